"""What a user may push: any array of numbers; what cannot be a measurement is named."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.session import FusionSession

DT = 0.01
REST = (0.0, 0.0, -9.80665 * DT)
NAN = math.nan


def stand(ekf, build=np.array, seconds=3.0, begin_us=1_000_000):
    """Let a filter stand still, facing north; return the time after."""
    for k in range(round(seconds / DT)):
        time_us = begin_us + round(1e6 * DT * k)
        ekf.push(ImuSample(time_us, build((0.0, 0.0, 0.0)), build(REST), DT, DT))
        ekf.push(MagSample(time_us, build((0.2, 0.0, 0.4))))
        ekf.push(BaroSample(time_us, 100.0))
        ekf.update()
    return begin_us + round(1e6 * seconds)


@pytest.mark.parametrize('build', [
    list, tuple, lambda v: np.array(v, np.float32), lambda v: np.repeat(v, 2)[::2],
    lambda v: np.array(v, '>f8')])
def test_numbers_may_come_in_any_array(build):
    ekf = Ekf2()
    stand(ekf, build)
    state = ekf.nav_state()
    np.testing.assert_allclose(state.position, 0.0, atol=1e-3)
    # cos and sin of half a yaw of zero: the field points north
    np.testing.assert_allclose(state.quaternion, (1.0, 0.0, 0.0, 0.0), atol=1e-3)


@pytest.mark.parametrize(('sample', 'words'), [
    (lambda t: ImuSample(t, np.zeros(2), np.array(REST), DT, DT), 'ImuSample.delta_angle has'),
    (lambda t: ImuSample(t, np.zeros((3, 1)), np.array(REST), DT, DT), r'shape \(3, 1\)'),
    (lambda t: ImuSample(t, np.zeros(3), np.full(3, NAN), DT, DT), 'delta_velocity is'),
    (lambda t: ImuSample(t, np.array((math.inf, 0, 0)), np.zeros(3), DT, DT), 'delta_angle is'),
    (lambda t: ImuSample(t, np.zeros(3), np.array(REST), NAN, DT), 'delta_angle_dt is nan'),
    (lambda t: MagSample(t, np.array((0.2, NAN, 0.4))), 'MagSample.field is'),
    (lambda t: MagSample(t, 'north'), 'MagSample.field is'),
    (lambda t: BaroSample(t, NAN), 'BaroSample.altitude is nan'),
    (lambda t: GnssSample(t, NAN, 8.0, 400.0, 1.0, 1.5), 'GnssSample.lat is nan'),
    (lambda t: GnssSample(t, 47.0, 8.0, NAN, NAN, NAN), 'GnssSample.eph is nan: must'),
    (lambda t: GnssSample(t, 47.0, 8.0, 400.0, 1.0, math.inf), 'epv is inf beside a measured alt'),
    (lambda t: GnssSample(t, 47.0, 8.0, 400.0, 1.0, 1.5, np.zeros(3)), 'GnssSample.sacc is nan'),
    (lambda t: GnssSample(t, 47.0, 8.0, 400.0, 1.0, 1.5, yaw=1.0, yaw_offset=NAN),
     'GnssSample.yaw_offset is nan beside a measured yaw'),
    (lambda t: VisionSample(t, np.zeros(3), NAN4, position_var=np.array((0.1, NAN, 0.1))),
     'VisionSample.position_var is .* beside a measured position'),
    (lambda t: VisionSample(t, NAN3, NAN4, np.zeros(3), velocity_cov=np.diag((0.1, math.inf, 1))),
     'VisionSample.velocity_cov is'),
    (lambda t: VisionSample(t, NAN3, np.array((1.0, 0, 0, 0)), angular_var=NAN),
     'VisionSample.angular_var is nan beside a measured quaternion'),
    (lambda t: VisionSample(t, NAN3, np.array((1.0, 0, 0, NAN))), 'quaternion is .* in part'),
    (lambda t: GnssSample(t, 47.0, 8.0, 400.0, 1.0, 1.5, np.array((0, 0, NAN)), 0.2),
     'GnssSample.velocity is .* measured in part'),
    (lambda t: VisionSample(t, np.zeros(3), np.zeros(3)), 'VisionSample.quaternion has'),
    (lambda t: FlowSample(t, np.zeros(3), np.zeros(3), 255, 0.1), 'FlowSample.flow has'),
])
def test_what_is_no_measurement_is_named_and_changes_nothing(sample, words):
    ekf, untouched = Ekf2(), Ekf2()
    now_us = stand(ekf)
    stand(untouched)
    with pytest.raises(ValueError, match=words):
        ekf.push(sample(now_us))
        ekf.update()
    stand(ekf, seconds=1.0, begin_us=now_us)
    stand(untouched, seconds=1.0, begin_us=now_us)
    np.testing.assert_array_equal(ekf.states(), untouched.states())


@pytest.mark.parametrize('sample', [
    lambda t: GnssSample(t, 47.0, 8.0, NAN, 1.0, NAN, yaw_offset=NAN),
    lambda t: GnssSample(t, 47.0, 8.0, 400.0, 1.0, 1.5, yaw=1.0, yaw_accuracy=NAN),
    lambda t: VisionSample(t, np.array((0.0, 0.0, NAN)), NAN4, NAN3, np.array((0.1, 0.1, NAN)),
                           np.full((3, 3), NAN), NAN),
])
def test_an_accuracy_of_what_was_not_measured_may_be_unknown(sample):
    ekf = Ekf2()
    now_us = stand(ekf)
    ekf.push(sample(now_us))
    stand(ekf, seconds=1.0, begin_us=now_us)
    assert np.isfinite(ekf.filter.x).all()
    assert np.isfinite(ekf.filter.cov.p).all()


def test_what_is_no_sample_is_told_from_samples():
    with pytest.raises(TypeError, match='str: expected one of ImuSample, '):
        Ekf2().push('north')


def test_parameters_of_everything_are_told_from_those_of_the_filter():
    with pytest.raises(TypeError, match='expected Ekf2Params; of Params they are'):
        Ekf2(Params())


def test_armed_is_nothing_to_the_filter_of_a_session_without_roles():
    session = FusionSession(Params())
    session.push(ImuSample(1_000_000, np.zeros(3), np.array(REST), DT, DT))
    session.push(ArmedSample(1_000_000, armed=True))
    assert session.statistics()['armed'].accepted == 1
