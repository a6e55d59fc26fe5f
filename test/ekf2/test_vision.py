"""External vision: flags, resets, frames, covariances, loss."""

from __future__ import annotations

import math

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.resets import velocity_tells_attitude
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import VelocityFrame

QUARTER = 0.5 * math.pi
NO_FIXES = GnssParams(enabled=False)
USED = {'position': {'ev_pos'}, 'velocity': {'ev_vel'}, 'yaw': {'ev_yaw'}}


def vision_only(height='baro', **vision):
    return Ekf2Params(gnss=NO_FIXES, vision=VisionParams(**vision),
                      height=HeightParams(reference=height))


def aligned(params, **attitude):
    """A vehicle whose tilt and yaw are aligned, odometry still off."""
    bench = Bench(params, **attitude)
    bench.run(4.5)
    assert {'tilt_align', 'yaw_align'} <= bench.flags
    return bench


def yaw_quaternion(yaw):
    return quat_from_matrix(matrix_from_euler_321(0.0, 0.0, yaw))


@pytest.mark.parametrize('kind', USED)
def test_each_part_is_used_where_asked_for_and_stops_with_the_data(kind):
    bench = aligned(vision_only(**{f'use_{kind}': True}))
    before = bench.flags
    bench.sending.add('vision')
    bench.run(1.0)
    expected = before | USED[kind]
    if kind == 'yaw':
        expected -= {'mag_hdg'}
    assert bench.flags == expected
    bench.sending.discard('vision')
    bench.run(6.5)
    assert USED[kind] <= bench.flags
    bench.run(1.0)
    assert bench.flags == before


@pytest.mark.parametrize('kind', ['position', 'velocity'])
def test_local_but_no_global_position(kind):
    bench = aligned(vision_only(**{f'use_{kind}': True}))
    assert not bench.ekf.nav_state().local_position_valid
    bench.sending.add('vision')
    bench.run(1.0)
    state = bench.ekf.nav_state()
    assert state.local_position_valid
    assert not state.global_position_valid
    assert not state.dead_reckoning


def test_yaw_turns_once_to_the_odometry_and_once_back_to_the_compass():
    bench = aligned(vision_only(use_yaw=True))
    resets = bench.resets.quat
    bench.odometry.quaternion = yaw_quaternion(0.5)
    bench.sending.add('vision')
    bench.run(1.0)
    assert bench.resets.quat == resets + 1
    assert bench.attitude[2] == pytest.approx(0.5, abs=1e-3)
    bench.sending.discard('vision')
    bench.run(7.5)
    assert bench.resets.quat == resets + 2
    assert 'mag_hdg' in bench.flags
    assert bench.attitude[2] == pytest.approx(0.0, abs=0.02)


def first_sample(bench, counter):
    """Run until a reset has happened; odometry is 175 ms old."""
    before = getattr(bench.resets, counter)
    bench.sending.add('vision')
    for _ in range(60):
        bench.run(0.01)
        if getattr(bench.resets, counter) != before:
            break
    assert getattr(bench.resets, counter) == before + 1


def test_the_first_velocity_is_taken_by_a_reset():
    bench = aligned(vision_only(use_velocity=True))
    bench.odometry.velocity = np.array((0.3, -1.0, 0.4))
    first_sample(bench, 'vel_ne')
    np.testing.assert_allclose(bench.x[4:7], (0.3, -1.0, 0.4), atol=0.01)
    np.testing.assert_allclose(bench.ekf.nav_state().velocity, (0.3, -1.0, 0.4), atol=0.01)


def test_the_first_position_is_taken_by_a_reset():
    bench = aligned(vision_only(use_position=True))
    bench.odometry.position = np.array((8.3, -1.0, 0.0))
    first_sample(bench, 'pos_ne')
    np.testing.assert_allclose(bench.x[7:9], (8.3, -1.0), atol=1e-5)


@pytest.mark.parametrize('turn', [QUARTER, -2.0])
def test_a_rotated_frame_is_turned_into_that_of_the_filter(turn):
    """The vehicle looks north; in the frame of the odometry its yaw is `turn`."""
    bench = aligned(vision_only(use_position=True, use_velocity=True, rotate=True))
    bench.odometry.quaternion = yaw_quaternion(turn)
    to_filter = matrix_from_euler_321(0.0, 0.0, -turn)
    bench.odometry.velocity = np.array((0.3, -1.0, 0.4))
    bench.odometry.position = np.array((5.0, 7.0, 0.0))
    velocity_resets = bench.resets.vel_ne
    first_sample(bench, 'pos_ne')
    assert bench.resets.vel_ne == velocity_resets + 1
    np.testing.assert_allclose(bench.ekf.filter.rot_ev, to_filter, atol=1e-3)
    np.testing.assert_allclose(bench.x[4:7], to_filter @ bench.odometry.velocity, atol=1e-2)
    np.testing.assert_allclose(bench.x[7:9], (to_filter @ bench.odometry.position)[0:2],
                               atol=1e-2)


def test_a_source_that_is_less_sure_leaves_more_variance():
    bench = aligned(vision_only(use_velocity=True))
    bench.odometry.velocity_cov = np.diag((2.0, 0.01, 0.01))
    bench.sending.add('vision')
    bench.run(3.0)
    assert bench.p[4] > 3.0 * bench.p[5]


@pytest.mark.parametrize(('frame', 'uncertain', 'left'), [
    (VelocityFrame.BODY_FRD, 5, 2.0), (VelocityFrame.LOCAL_FRD, 4, 1.0)])
def test_covariance_turns_with_the_body_but_not_with_the_local_frame(frame, uncertain, left):
    """The vehicle looks east; the first axis of the odometry's velocity is poor."""
    bench = aligned(vision_only(use_velocity=True), yaw=QUARTER)
    bench.odometry.velocity_cov = np.diag((2.0, 0.01, 0.01))
    bench.odometry.frame = frame
    first_sample(bench, 'vel_ne')
    certain = 9 - uncertain
    # A fusion of the same sample follows the reset. After one that a local velocity has made known
    # it halves both, 2.0 and 0.01 m^2/s^2; one to a body velocity leaves them to the fusion.
    assert bench.p[uncertain] / bench.p[certain] == pytest.approx(200.0, rel=0.15)
    assert bench.p[uncertain] == pytest.approx(left, rel=0.1)


def test_covariance_of_a_local_velocity_turns_with_a_rotated_frame():
    """The vehicle looks north; the frame of the odometry has its first axis west."""
    bench = aligned(vision_only(use_velocity=True, rotate=True))
    bench.odometry.quaternion = yaw_quaternion(QUARTER)
    bench.odometry.velocity_cov = np.diag((2.0, 0.01, 0.01))
    first_sample(bench, 'vel_ne')
    np.testing.assert_allclose(bench.ekf.filter.rot_ev, matrix_from_euler_321(0.0, 0.0, -QUARTER),
                               atol=1e-2)
    assert bench.p[5] / bench.p[4] == pytest.approx(200.0, rel=0.15)


def test_position_velocity_and_yaw_together():
    bench = aligned(vision_only(use_position=True, use_velocity=True, use_yaw=True))
    before = bench.flags
    bench.odometry.quaternion = yaw_quaternion(-0.4)
    bench.odometry.position = np.array((4.0, -2.0, 0.0))
    bench.sending.add('vision')
    bench.run(1.0)
    assert bench.flags == before - {'mag_hdg'} | {'ev_pos', 'ev_vel', 'ev_yaw'}
    np.testing.assert_allclose(bench.x[4:9], (0.0, 0.0, 0.0, 4.0, -2.0), atol=0.02)
    assert bench.attitude[2] == pytest.approx(-0.4, abs=0.01)


def test_a_body_velocity_goes_where_the_vehicle_looks():
    bench = aligned(vision_only(use_velocity=True), yaw=QUARTER)
    bench.odometry.velocity = np.array((2.0, 0.5, 0.0))
    bench.odometry.frame = VelocityFrame.BODY_FRD
    first_sample(bench, 'vel_ne')
    np.testing.assert_allclose(bench.x[4:7], (-0.5, 2.0, 0.0), atol=0.05)


@pytest.mark.parametrize('rotate', [False, True])
def test_a_moved_position_is_followed_in_the_frame_of_the_odometry(rotate):
    """With its yaw in use the frame of the odometry is the earth frame: nothing to rotate."""
    bench = aligned(vision_only(use_position=True, use_yaw=True, rotate=rotate), yaw=0.6)
    bench.odometry.position_var = np.full(3, 0.01)
    bench.sending.add('vision')
    bench.run(4.0)
    np.testing.assert_allclose(bench.x[7:9], 0.0, atol=1e-2)
    bench.odometry.position = np.array((0.3, 0.0, 0.0))
    bench.run(12.0)
    np.testing.assert_allclose(bench.x[7:9], (0.3, 0.0), atol=3e-2)
    assert bench.attitude[2] == pytest.approx(0.6, abs=0.02)


def test_height_of_the_odometry_and_back_to_the_barometer():
    bench = aligned(vision_only(height='vision', use_position=True))
    assert 'ev_hgt' not in bench.flags
    bench.odometry.position = np.array((0.0, 0.0, -1.5))
    bench.sending.add('vision')
    bench.run(1.0)
    assert 'ev_hgt' in bench.flags
    assert 'baro_hgt' not in bench.flags
    assert bench.x[9] == pytest.approx(-1.5, abs=0.05)
    bench.sending.discard('vision')
    bench.run(6.0)
    assert 'baro_hgt' in bench.flags
    assert 'ev_hgt' not in bench.flags


def test_odometry_without_an_attitude_is_used_by_its_body_velocity():
    bench = aligned(vision_only(use_velocity=True, use_yaw=True, rotate=True), yaw=1.0)
    bench.odometry.quaternion = np.full(4, np.nan)
    bench.odometry.velocity = np.array((1.0, 0.0, 0.0))
    bench.odometry.frame = VelocityFrame.BODY_FRD
    bench.sending.add('vision')
    bench.run(1.0)
    assert 'ev_vel' in bench.flags
    assert 'ev_yaw' not in bench.flags
    assert np.isfinite(bench.x).all()
    assert math.atan2(bench.x[5], bench.x[4]) == pytest.approx(1.0, abs=0.05)


def test_odometry_without_a_velocity_is_used_by_its_position():
    bench = aligned(vision_only(use_position=True, use_velocity=True))
    bench.odometry.velocity = np.full(3, np.nan)
    bench.odometry.position = np.array((1.0, 2.0, np.nan))
    bench.sending.add('vision')
    bench.run(1.0)
    assert 'ev_pos' in bench.flags
    assert 'ev_vel' not in bench.flags
    np.testing.assert_allclose(bench.x[7:9], (1.0, 2.0), atol=0.05)


@pytest.mark.parametrize(('changed', 'told'), [
    ({}, True), ({'frame': VelocityFrame.LOCAL_FRD}, True),
    ({'velocity_tells_attitude': False}, False),
    ({'frame': VelocityFrame.LOCAL_FRD, 'rotate': False}, False), ({'rotate': False}, True),
    ({'frame': VelocityFrame.LOCAL_FRD, 'use_yaw': True}, False), ({'use_yaw': True}, True),
    # Absolute positions of a rotated frame turn with the attitude too.
    ({'use_position': True}, False), ({'use_position': True, 'rotate': False}, True),
    ({'use_position': True, 'fixes': True}, True)])
def test_velocity_tells_attitude_where_its_frame_turns_with_the_body(changed, told):
    vision = {'use_velocity': True, 'rotate': True, **changed}
    frame = vision.pop('frame', VelocityFrame.BODY_FRD)
    gnss = GnssParams(enabled=vision.pop('fixes', False))
    bench = aligned(Ekf2Params(gnss=gnss, vision=VisionParams(**vision)))
    bench.odometry.frame = frame
    bench.sending.add('vision')
    bench.run(1.0)
    f = bench.ekf.filter
    assert velocity_tells_attitude(f, f.vision) is told
