"""A pose that an operator gives: reached at once, with its variance, where it is given."""

from __future__ import annotations

from dataclasses import replace
import math

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import MagParams


@pytest.fixture
def bench():
    return leaning()


def leaning(imu_position=(0.0, 0.0, 0.0)):
    """A vehicle that leans, without compass, receiver or odometry; it holds its position."""
    params = replace(Ekf2Params(), mag=MagParams(type='none'), gnss=GnssParams(enabled=False),
                     imu=ImuParams(position=imu_position))
    bench = Bench(params, roll=0.2, pitch=-0.1)
    bench.sending.discard('mag')
    bench.run(5.0)
    return bench


def pose(position=(0.0, 0.0, 0.0), position_var=(0.0, 0.0, 0.0), yaw=0.0, yaw_var=0.0):
    return GivenPose(np.array(position), np.array(position_var), yaw, yaw_var)


def yaw_of_state(state):
    return yaw_of(matrix_from_quat(state.quaternion))


def test_nothing_can_be_set_before_the_start():
    assert not Ekf2().set_pose(pose(yaw_var=1.0))


def test_the_pose_is_reached_at_once_and_stays(bench):
    given = pose((40.0, -7.0, -3.0), (0.25, 0.25, 0.04), 2.0, 0.01)
    assert bench.ekf.set_pose(given)
    state = bench.ekf.nav_state()
    np.testing.assert_allclose(state.position, given.position, atol=1e-9)
    assert yaw_of_state(state) == pytest.approx(2.0, abs=1e-6)
    assert state.yaw_aligned
    # No correlation is left: the variances are those that were given.
    np.testing.assert_allclose(np.diag(state.pose_cov)[[0, 1, 2, 5]], (0.25, 0.25, 0.04, 0.01))
    bench.run(5.0)
    state = bench.ekf.nav_state()
    np.testing.assert_allclose(state.position, given.position, atol=0.2)
    assert yaw_of_state(state) == pytest.approx(2.0, abs=0.02)
    assert 'pose set on request' in [event.text for event in bench.ekf.drain_events()]
    assert bench.ekf.reset_counts()['attitude'] >= 1


def test_the_pose_is_that_of_the_body_and_not_of_the_imu():
    bench = leaning((0.3, 0.0, -0.1))
    bench.ekf.set_pose(pose((40.0, -7.0, -3.0), (0.25, 0.25, 0.04), 2.0, 0.01))
    bench.run(0.02)
    np.testing.assert_allclose(bench.ekf.nav_state().position, (40.0, -7.0, -3.0), atol=0.005)


def test_tilt_and_its_uncertainty_stay(bench):
    before = bench.ekf.nav_state()
    bench.ekf.set_pose(pose(yaw=-2.5, yaw_var=0.04))
    after = bench.ekf.nav_state()
    down = np.array((0.0, 0.0, 1.0))
    np.testing.assert_allclose(
        matrix_from_quat(after.quaternion).T @ down, matrix_from_quat(before.quaternion).T @ down,
        atol=1e-9)
    tilt = [np.trace(state.pose_cov[3:5, 3:5]) for state in (before, after)]
    assert tilt[1] == pytest.approx(tilt[0], rel=1e-6)


def test_what_is_not_given_stays(bench):
    before = bench.ekf.nav_state()
    bench.ekf.set_pose(pose((9.0, 9.0, 9.0), yaw=1.0))
    after = bench.ekf.nav_state()
    np.testing.assert_array_equal(after.position, before.position)
    np.testing.assert_array_equal(after.quaternion, before.quaternion)
    bench.ekf.set_pose(pose((9.0, 9.0, 9.0), (0.0, 0.0, 0.5)))
    after = bench.ekf.nav_state()
    np.testing.assert_allclose(after.position[0:2], before.position[0:2], atol=1e-9)
    assert after.position[2] == pytest.approx(9.0)


def test_a_vague_yaw_aligns_nothing(bench):
    bench.ekf.set_pose(pose(yaw=1.0, yaw_var=math.radians(40.0) ** 2))
    assert not bench.ekf.nav_state().yaw_aligned


def test_the_velocity_turns_with_the_yaw(bench):
    filter_ = bench.ekf.filter
    yaw = yaw_of_state(bench.ekf.nav_state())
    filter_.x[4:7] = (3.0, 1.0, 0.5)
    bench.ekf.set_pose(pose(yaw=yaw + math.pi / 2, yaw_var=0.01))
    np.testing.assert_allclose(filter_.x[4:7], (-1.0, 3.0, 0.5), atol=1e-6)


def test_a_receiver_corrects_a_pose_that_is_wrong():
    bench = Bench()
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(12.0)
    before = bench.ekf.nav_state().position
    bench.ekf.set_pose(pose(before + np.array((2.0, 0.0, 0.0)), (9.0, 9.0, 0.0)))
    assert bench.ekf.nav_state().position[0] == pytest.approx(before[0] + 2.0)
    bench.run(5.0)
    np.testing.assert_allclose(bench.ekf.nav_state().position[0:2], before[0:2], atol=0.2)
