"""Changes to the parameter tree by name."""

from __future__ import annotations

import dataclasses
import math

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.params.spec import leaves


def test_overrides_replace_only_what_they_name() -> None:
    before = Params()
    after = with_overrides(before, {'ekf2.gnss.pos_noise': 1.5, 'ekf2.mag.type': 'none'})

    changed = {
        name
        for (name, old, _), (_, new, _) in zip(leaves(before), leaves(after), strict=True)
        if old != new
    }
    assert changed == {'ekf2.gnss.pos_noise', 'ekf2.mag.type'}
    assert after.ekf2.gnss.pos_noise == 1.5
    assert after.ekf2.mag.type == 'none'
    assert before == Params()


@pytest.mark.parametrize(
    ('name', 'given', 'expected'),
    [
        ('ekf2.gnss.pos_noise', 2, 2.0),
        ('ekf2.gnss.pos_noise', '1e-1', 0.1),
        ('ekf2.gnss.checks.req_nsats', '7', 7),
        ('ekf2.gnss.checks.req_nsats', 7.0, 7),
        ('ekf2.gnss.enabled', 'false', False),
        ('ekf2.gnss.enabled', 'on', True),
        ('ekf2.imu.position', [1, 2, 3], (1.0, 2.0, 3.0)),
        ('ekf2.imu.position', '0.1, -2, 3e-1', (0.1, -2.0, 0.3)),
        ('ekf2.imu.position', '[0, 0, 1]', (0.0, 0.0, 1.0)),
    ],
)
def test_values_take_the_type_of_the_parameter(name: str, given: object, expected: object) -> None:
    values = {leaf: value for leaf, value, _ in leaves(with_overrides(Params(), {name: given}))}

    assert values[name] == expected
    assert type(values[name]) is type(expected)


@pytest.mark.parametrize(
    ('name', 'given', 'words'),
    [
        ('ekf2.gnss.pos_noise', 'abc', 'a number'),
        ('ekf2.gnss.pos_noise', True, 'a number'),
        ('ekf2.gnss.pos_noise', math.nan, 'finite'),
        ('ekf2.gnss.pos_noise', 1000.0, 'at most 100 m'),
        ('ekf2.gnss.pos_noise', -1.0, 'at least 0.01 m'),
        ('ekf2.gnss.enabled', 1, 'true or false'),
        ('ekf2.gnss.checks.req_nsats', 6.5, 'an integer'),
        ('ekf2.imu.position', [1.0, 2.0], 'a list of 3'),
        ('ekf2.imu.position', 1.0, 'a list of 3'),
        ('ekf2.imu.position', [1.0, 2.0, math.inf], 'finite'),
        ('ekf2.mag.type', 'compass', 'auto, heading'),
        ('ekf2.mag.type', 3, 'text'),
    ],
)
def test_refused_value_is_named_with_what_was_expected(
    name: str, given: object, words: str
) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        with_overrides(Params(), {name: given})
    assert name in str(caught.value)
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize(
    ('name', 'near'),
    [
        ('ekf2.gnss.pos_noize', 'ekf2.gnss.pos_noise'),
        ('req_hacc', 'ekf2.gnss.checks.req_hacc'),
        ('gnss.pos_noise', 'ekf2.gnss.pos_noise'),
        ('ekf2.gnss', 'is a group'),
    ],
)
def test_unknown_name_is_answered_with_the_nearest(name: str, near: str) -> None:
    with pytest.raises(ValueError, match=near) as caught:
        with_overrides(Params(), {name: 1.0})
    assert name in str(caught.value)


def test_an_estimator_that_is_not_there_is_refused_with_those_that_are() -> None:
    assert with_overrides(Params(), {'estimator': 'lpe'}).estimator == 'lpe'
    with pytest.raises(ValueError, match='ekf2, lpe'):
        with_overrides(Params(), {'estimator': 'inav'})


@pytest.mark.parametrize(('name', 'ours'), [
    ('EKF2_GPS_DELAY', 'ekf2.gnss.delay_ms'), ('EKF2_GPS_POS_Y', 'ekf2.gnss.position'),
    ('EKF2_HGT_REF', 'ekf2.height.reference'), ('EKF2_RNG_AID', 'ekf2.range.aid'),
    ('EKF2_TERR_MASK', 'ekf2.terrain.use_range, ekf2.terrain.use_flow')])
def test_a_name_of_px4_is_answered_with_ours(name: str, ours: str) -> None:
    with pytest.raises(ValueError, match=f'{name}: that is the name of PX4') as error:
        with_overrides(Params(), {name: 1})
    assert str(error.value).endswith(f'here it is {ours}')


def test_every_parameter_has_words_and_a_default_inside_its_range() -> None:
    for name, value, spec in leaves(Params()):
        assert spec.description.endswith('.'), name
        spec.check(name, value)
        kinds = {type(element) for element in (value if isinstance(value, tuple) else (value,))}
        assert kinds and kinds <= {bool, int, float, str}, name
        assert spec.min is None or spec.max is None or spec.min < spec.max, name


def test_the_tree_cannot_be_changed_in_place() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        Params().ekf2.gnss.pos_noise = 1.0  # type: ignore[misc]
