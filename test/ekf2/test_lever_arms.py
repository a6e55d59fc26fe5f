"""Antenna and odometry sensor away from the IMU, on a vehicle that looks east or turns."""

from __future__ import annotations

import math

from ekf2.bench import EARTH_FIELD
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import VelocityFrame

EAST = 0.5 * math.pi
NO_FIXES = GnssParams(enabled=False)


def test_the_place_of_the_antenna_is_taken_off():
    """The origin is where the antenna was; 1 m ahead is east, 0.5 m to the right is south."""
    bench = Bench(Ekf2Params(
        gnss=GnssParams(position=(1.0, 0.5, -0.2)), mag=MagParams(declination_from_table=False),
        height=HeightParams(reference='gnss')), yaw=EAST)
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(25.0)
    assert {'gps', 'gps_hgt'} <= bench.flags
    np.testing.assert_allclose(bench.x[7:9], (0.5, -1.0), atol=0.05)


def test_a_fix_may_place_its_antenna_itself():
    """Position, height and velocity of a fix of several receivers each have a place."""
    bench = Bench(Ekf2Params(
        gnss=GnssParams(position=(9.0, 9.0, 9.0)), imu=ImuParams(position=(0.1, 0.0, 0.0)),
        mag=MagParams(declination_from_table=False), height=HeightParams(reference='gnss')),
        yaw=EAST)
    bench.fix.antenna = Antenna(
        np.array((1.1, 0.5, -7.0)), np.array((5.0, 5.0, -0.2)), np.zeros(3))
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(25.0)
    assert {'gps', 'gps_hgt'} <= bench.flags
    np.testing.assert_allclose(bench.x[7:9], (0.5, -1.0), atol=0.05)
    # The origin is at the height of the fix, from where the IMU is 0.2 m down.
    assert bench.x[9] == pytest.approx(0.2, abs=0.05)


def test_the_place_of_the_odometry_sensor_is_taken_off():
    bench = Bench(Ekf2Params(
        gnss=NO_FIXES, imu=ImuParams(position=(0.1, 0.0, 0.0)),
        vision=VisionParams(use_position=True, position=(0.6, 0.2, 0.0))), yaw=EAST)
    bench.run(4.5)
    bench.sending.add('vision')
    bench.run(8.0)
    np.testing.assert_allclose(bench.x[7:9], (0.2, -0.5), atol=0.01)
    # The body origin is 0.1 m behind the IMU, which is west of it.
    np.testing.assert_allclose(bench.ekf.nav_state().position[0:2], (0.2, -0.6), atol=0.01)


def turning(bench, rate, seconds):
    """Turn about the vertical with the field turning along."""
    bench.rate = np.array((0.0, 0.0, rate))
    start = bench.turned
    steps = round(seconds / 0.01)
    for k in range(steps):
        bench.turned = start + rate * 0.01 * (k + 1)
        c, s = math.cos(bench.turned), math.sin(bench.turned)
        bench.field = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ EARTH_FIELD
        bench.run(0.01)


@pytest.mark.parametrize('arm', [(0.5, 0.0, 0.0), (0.0, -0.8, 0.3)])
def test_the_swing_of_the_odometry_sensor_is_taken_off(arm):
    bench = Bench(Ekf2Params(
        gnss=NO_FIXES, mag=MagParams(type='heading'),
        vision=VisionParams(use_velocity=True, position=arm)))
    bench.run(4.5)
    turning(bench, 1.0, 1.0)
    bench.odometry.velocity = np.cross((0.0, 0.0, 1.0), arm)
    bench.odometry.frame = VelocityFrame.BODY_FRD
    bench.odometry.velocity_cov = np.eye(3) * 0.01
    bench.sending.add('vision')
    turning(bench, 1.0, 2.0)
    assert 'ev_vel' in bench.flags
    np.testing.assert_allclose(bench.x[4:7], 0.0, atol=0.03)


def test_the_swing_of_the_antenna_is_taken_off():
    bench = Bench(Ekf2Params(
        gnss=GnssParams(position=(0.8, 0.0, 0.0)),
        mag=MagParams(type='heading', declination_from_table=False)))
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(13.0)
    assert 'gps' in bench.flags
    place = np.array((bench.fix.lat, bench.fix.lon))
    for k in range(60):
        # The receiver is 110 ms late: the antenna has moved on by as much.
        angle = max(0.1 * (k + 1) - 0.11, 0.0)
        swing = 0.8 * np.array((-math.sin(angle), math.cos(angle), 0.0))
        moved = 0.8 * np.array((math.cos(angle) - 1.0, math.sin(angle)))
        bench.fix.velocity = swing
        bench.fix.lat = place[0] + moved[0] / 111_180.0
        bench.fix.lon = place[1] + moved[1] / 75_550.0
        turning(bench, 1.0, 0.1)
    assert np.linalg.norm(bench.x[4:6]) < 0.15
    np.testing.assert_allclose(bench.x[7:9], (-0.8, 0.0), atol=0.1)
