"""Optical flow as the only or one more source of horizontal velocity."""

from __future__ import annotations

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import FlowParams
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import TerrainParams

ONLY_FLOW = GnssParams(enabled=False)


def bench_with_flow(gnss=ONLY_FLOW, terrain=None, **flow):
    bench = Bench(Ekf2Params(gnss=gnss, flow=FlowParams(enabled=True, **flow),
                             terrain=terrain or TerrainParams()))
    bench.sending |= {'range', 'flow'}
    return bench


def flow_of(north, east, height):
    """Rate of the scene for a level vehicle that looks north."""
    return np.array((east / height, -north / height))


def hovering(height=5.0, **flow):
    """Fly on flow alone at a height in m."""
    bench = bench_with_flow(**flow)
    bench.run(10.0)
    assert 'opt_flow' in bench.flags
    bench.fly()
    bench.distance = height
    bench.run(12.0)
    assert 'opt_flow' in bench.flags
    return bench


def fused_from_now_on(bench):
    """Let a second pass after what the horizon still hides and count the fusions in it."""
    bench.run(0.3)
    before = bench.ekf.filter.observations.flow.fused
    bench.run(1.0)
    return bench.ekf.filter.observations.flow.fused - before


def in_body(bench):
    """Velocity along the level nose and to the right of it, m/s."""
    c, s = np.cos(bench.attitude[2]), np.sin(bench.attitude[2])
    return np.array(((c, s), (-s, c))) @ bench.x[4:6]


def test_flow_starts_in_time_and_only_where_it_is_wanted():
    bench = bench_with_flow()
    bench.run(4.9)
    assert 'opt_flow' not in bench.flags
    bench.run(5.0)
    assert 'opt_flow' in bench.flags
    assert bench.ekf.nav_state().local_position_valid
    assert not bench.ekf.nav_state().global_position_valid
    unwanted = Bench(Ekf2Params(gnss=ONLY_FLOW))
    unwanted.sending |= {'range', 'flow'}
    unwanted.run(10.0)
    assert 'opt_flow' not in unwanted.flags


def test_flow_ends_ten_seconds_after_its_samples():
    bench = hovering()
    bench.sending.discard('flow')
    bench.run(9.0)
    assert 'opt_flow' in bench.flags
    bench.run(1.5)
    assert 'opt_flow' not in bench.flags
    assert not bench.ekf.nav_state().local_position_valid


def test_starting_in_the_air_resets_velocity_to_what_flow_sees():
    bench = bench_with_flow()
    bench.sending.discard('flow')
    bench.run(8.0)
    bench.fly()
    bench.distance = 5.0
    bench.run(12.0)
    assert 'opt_flow' not in bench.flags
    before = bench.resets.vel_ne
    bench.flow.rate = flow_of(1.5, -2.5, 5.0)
    bench.sending.add('flow')
    while 'opt_flow' not in bench.flags:
        bench.run(0.01)
    assert bench.resets.vel_ne == before + 1
    reset_to = bench.resets.d_vel_ne
    assert np.linalg.norm(reset_to) == pytest.approx(np.hypot(1.5, 2.5), abs=0.05)
    np.testing.assert_allclose(in_body(bench), (1.5, -2.5), atol=0.1)
    assert any('optical flow' in event.text for event in bench.ekf.drain_events())


def test_on_the_ground_bad_flow_means_no_motion():
    bench = bench_with_flow()
    bench.flow.rate = flow_of(2.0, 1.0, 0.1)
    bench.flow.quality = 0
    bench.run(8.0)
    assert 'opt_flow' in bench.flags
    np.testing.assert_allclose(bench.x[4:6], 0.0, atol=0.01)


def test_in_the_air_bad_flow_is_dropped():
    bench = hovering()
    bench.flow.quality = 0
    assert fused_from_now_on(bench) == 0


def test_flow_faster_than_the_sensor_can_follow_is_dropped():
    bench = hovering(max_rate=1.0)
    assert fused_from_now_on(bench) > 40
    bench.flow.rate = np.array((1.05, 0.0))
    assert fused_from_now_on(bench) == 0


def test_a_shaken_vehicle_on_the_ground_waits_for_five_seconds():
    bench = bench_with_flow()
    bench.run(8.0)
    assert 'opt_flow' in bench.flags
    at_rest = bench.force
    bench.force = 2.5 * at_rest
    bench.run(0.5)
    assert 'opt_flow' not in bench.flags
    bench.force = at_rest
    bench.run(4.5)
    assert 'opt_flow' not in bench.flags
    bench.run(1.5)
    assert 'opt_flow' in bench.flags


def test_velocity_converges_in_flight():
    bench = hovering()
    at_rest = bench.force
    for k in range(100):
        bench.force = at_rest + np.array((0.8, -0.4, 0.0))
        bench.flow.rate = flow_of(0.008 * (k + 1), -0.004 * (k + 1), 5.0)
        bench.run(0.01)
    bench.force = at_rest
    bench.run(4.0)
    np.testing.assert_allclose(in_body(bench), (0.8, -0.4), atol=0.05)


def test_noise_follows_quality():
    variances = []
    for quality in (255, 128, 1):
        bench = hovering(noise=0.1, noise_at_min_quality=0.9, min_quality=1)
        bench.flow.quality = quality
        bench.run(0.3)
        record = bench.ekf.filter.observations.flow
        variances.append(record.variance[0])
    # what P adds is small beside the noise
    for variance, sigma in zip(variances, (0.1, 0.5, 0.9), strict=True):
        assert variance == pytest.approx(sigma ** 2, rel=0.15)


@pytest.mark.parametrize('own_gyro', [False, True])
def test_a_turning_camera_off_the_axis_sees_no_velocity(own_gyro):
    """A pure yaw turn swings the camera round the IMU; both the scene and the gyro show it."""
    lever, rate = np.array((0.0, 0.3, 0.0)), -0.4
    height = 5.0
    bench = hovering(height=height, position=tuple(lever))
    swing = np.cross((0.0, 0.0, rate), lever)
    bench.flow.rate = np.array((swing[1] / height, -swing[0] / height))
    if own_gyro:
        bench.flow.gyro = np.array((0.0, 0.0, -rate))
    bench.rate = np.array((0.0, 0.0, rate))
    yaw = 0.0
    for _ in range(300):
        yaw += 0.01 * rate
        c, s = np.cos(yaw), np.sin(yaw)
        bench.field = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ (0.2, 0.0, 0.4)
        bench.run(0.01)
    # the camera moves at 0.12 m/s; half of that would show in either axis
    assert 'opt_flow' in bench.flags
    np.testing.assert_allclose(bench.x[4:6], 0.0, atol=0.01)


@pytest.mark.parametrize(('eph', 'used'), [(0.5, False), (3.0, False), (4.0, True)])
def test_over_unknown_ground_flow_is_used_where_the_fixes_are_poor(eph, used):
    """Poor is an accuracy of more than 0.7 times what is required, here 5 m."""
    bench = bench_with_flow(gnss=GnssParams(), terrain=TerrainParams(use_flow=False))
    bench.sending.add('fix')
    bench.run(20.0)
    assert {'gps', 'opt_flow'} <= bench.flags
    bench.fly()
    bench.sending.discard('range')
    bench.fix.eph = eph
    bench.run(7.0)
    assert 'gps' in bench.flags
    assert ('opt_flow' in bench.flags) is used
