"""Changes of parameters while the filter runs: taken or refused as a whole."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params.live import changed
from ekf_fusion_ros.params.live import differences
from ekf_fusion_ros.params.live import live_names
from ekf_fusion_ros.params.live import why_fixed


def test_live_parameters_change_together() -> None:
    before = Params()
    after = changed(before, {'ekf2.gnss.pos_gate': 4.0, 'ekf2.mag.noise': '0.1'})
    assert differences(before, after) == [
        ('ekf2.gnss.pos_gate', 5.0, 4.0), ('ekf2.mag.noise', 0.05, 0.1)]


def test_a_fixed_parameter_may_be_given_its_value() -> None:
    assert changed(Params(), {'node.map_frame': 'map', 'ekf2.baro.gate': 5.0}) == Params()


@pytest.mark.parametrize(('name', 'value', 'words'), [
    ('ekf2.mag.delay_ms', 5.0, 'fusion horizon'),
    ('session.horizon_ms', 300.0, 'fusion horizon'),
    ('ekf2.gnss.position', (1.0, 0.0, 0.0), 'mounting'),
    ('messages.imu.mount_rpy', (1.0, 0.0, 0.0), 'mounting'),
    ('node.odom_frame', 'other', 'types and frames'),
    ('node.fix_velocity_type', 'twist', 'types and frames'),
    ('session.origin', (47.0, 8.0, 0.0), '~/set_origin'),
    ('ekf2.output.vel_tau', 1.0, 'built into'),
    ('ekf2.gnss.pos_gate', 0.5, 'must be at least 1'),
    ('ekf2.gnss.no_such', 0.5, 'unknown parameter'),
])
def test_what_cannot_change_is_said(name: str, value: object, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        changed(Params(), {'ekf2.gnss.vel_gate': 4.0, name: value})
    assert name in str(caught.value)


def test_every_fixed_parameter_has_a_reason() -> None:
    live = live_names(Params())
    assert {'ekf2.gnss.pos_noise', 'messages.odometry.yaw_noise', 'node.use_fix'} <= live
    fixed = [name for name, _, _ in differences_of_all() if name not in live]
    assert fixed and all(why_fixed(name) for name in fixed)


def differences_of_all() -> list[tuple[str, object, object]]:
    from ekf_fusion_ros.params.spec import leaves
    return [(name, value, value) for name, value, _ in leaves(Params())]
