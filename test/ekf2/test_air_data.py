"""Airspeed, sideslip, drag and what the wind does to the barometer."""

from __future__ import annotations

import math

from ekf2.bench import GRAVITY
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params.ekf2 import AirDataParams
from ekf_fusion_ros.params.ekf2 import BaroParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import VisionParams

ODOMETRY = {'gnss': GnssParams(enabled=False), 'vision': VisionParams(use_velocity=True)}


def drifting(velocity, airspeed, **params):
    """A vehicle that looks north and drifts with a velocity in m/s, told by odometry."""
    bench = Bench(Ekf2Params(**ODOMETRY, **params))
    bench.odometry.velocity = np.array(velocity)
    bench.airspeed = airspeed
    bench.sending.add('vision')
    bench.run(10.0)
    assert 'ev_vel' in bench.flags
    bench.fly()
    return bench


def test_wind_is_velocity_less_airspeed_along_the_nose():
    bench = drifting((0.0, 1.5, 0.0), 2.4)
    assert 'wind' not in bench.flags
    bench.sending.add('airspeed')
    bench.run(3.0)
    assert {'wind', 'fuse_aspd'} <= bench.flags
    nose = matrix_from_quat(bench.x[0:4])[:, 0]
    np.testing.assert_allclose(bench.x[22:24], (np.array((0.0, 1.5, 0.0)) - 2.4 * nose)[0:2],
                               atol=0.02)


def test_wind_starts_as_uncertain_as_heading_and_sideslip_make_it():
    bench = drifting((10.0, 0.0, 0.0), 12.0)
    bench.sending.add('airspeed')
    while 'wind' not in bench.flags:
        bench.run(0.01)
    # across the nose 15 degrees of sideslip at 12 m/s, and 10 degrees of yaw on the 2 m/s of wind
    across = (12.0 * math.sin(math.radians(15.0))) ** 2 + (math.radians(10.0) * 2.0) ** 2
    assert bench.p[23] == pytest.approx(across + bench.p[5], rel=0.05)
    # along it the airspeed has been fused too: half of its own variance, less than the whole
    assert bench.p[22] < 1.4 ** 2


def test_wind_ends_ten_seconds_after_airspeed():
    bench = drifting((10.0, 0.0, 0.0), 12.0)
    bench.sending.add('airspeed')
    bench.run(3.0)
    bench.sending.discard('airspeed')
    bench.run(9.0)
    assert {'wind', 'fuse_aspd'} <= bench.flags
    bench.run(1.5)
    assert not {'wind', 'fuse_aspd'} & bench.flags
    assert not bench.p[22:24].any()


def test_airspeed_on_the_ground_is_not_used():
    bench = Bench(Ekf2Params(**ODOMETRY))
    bench.airspeed = 12.0
    bench.sending |= {'vision', 'airspeed'}
    bench.run(10.0)
    assert not {'wind', 'fuse_aspd'} & bench.flags


def test_an_airspeed_far_off_is_rejected():
    bench = drifting((10.0, 0.0, 0.0), 12.0)
    bench.sending.add('airspeed')
    bench.run(3.0)
    bench.airspeed = 40.0
    bench.run(1.0)
    assert bench.ekf.filter.rejections.airspeed
    assert bench.x[22] == pytest.approx(-2.0, abs=0.1)


@pytest.mark.parametrize(('name', 'velocity', 'coefficient'), [
    ('forward', (5.0, 0.0, 0.0), 0.3), ('backward', (-5.0, 0.0, 0.0), 0.3),
    ('right', (0.0, 5.0, 0.0), -0.3), ('left', (0.0, -5.0, 0.0), -0.3)])
def test_the_airflow_moves_the_barometer(name, velocity, coefficient):
    yaw = Bench()
    yaw.run(5.0)
    turn = yaw.attitude[2]
    c, s = math.cos(turn), math.sin(turn)
    along = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))) @ velocity
    heights = []
    for params in (BaroParams(), BaroParams(**{f'pressure_error_{name}': coefficient})):
        bench = drifting(along, 0.0, baro=params)
        bench.run(30.0)
        heights.append(-bench.x[9])
    # half k v^2 / g; the offset found at rest before does not know of it
    assert heights[1] - heights[0] == pytest.approx(0.5 * coefficient * 25.0 / GRAVITY, abs=0.02)


def test_the_wind_is_taken_off_before_the_airflow_moves_the_barometer():
    """5 m/s over the ground with 2 m/s of it as wind is 3 m/s of air."""
    heights = []
    for params in (BaroParams(), BaroParams(pressure_error_forward=0.3)):
        bench = drifting((5.0, 0.0, 0.0), 3.0, baro=params)
        bench.sending.add('airspeed')
        bench.run(5.0)
        assert 'wind' in bench.flags
        bench.run(60.0)
        heights.append(-bench.x[9])
    air = bench.x[4:6] - bench.x[22:24]
    assert np.hypot(*air) == pytest.approx(3.0, abs=0.05)
    nose = matrix_from_quat(bench.x[0:4])[0:2, 0]
    assert heights[1] - heights[0] == pytest.approx(
        0.5 * 0.3 * float(nose @ air) ** 2 / GRAVITY, abs=1e-3)


def test_the_correction_is_limited():
    heights = []
    for params in (BaroParams(), BaroParams(pressure_error_forward=0.3,
                                            pressure_error_max_airspeed=3.0)):
        bench = drifting((5.0, 0.0, 0.0), 0.0, baro=params)
        bench.run(30.0)
        heights.append(-bench.x[9])
    assert heights[1] - heights[0] == pytest.approx(0.5 * 0.3 * 9.0 / GRAVITY, abs=0.02)


def test_a_fixed_wing_without_sideslip_finds_the_wind_across():
    bench = Bench()
    bench.sending.add('fix')
    bench.run(15.0)
    bench.fly(on_wings=True)
    bench.travel(15.0, 30.0)
    assert {'wind', 'fuse_beta'} <= bench.flags and 'fuse_aspd' not in bench.flags
    # no wind across the nose; along it nothing is known
    nose = matrix_from_quat(bench.x[0:4])[0:2, 0]
    across = np.array((-nose[1], nose[0]))
    relative = bench.x[4:6] - bench.x[22:24]
    assert across @ relative == pytest.approx(0.0, abs=0.5)


def test_air_data_carry_on_where_the_fixes_end():
    bench = Bench()
    bench.airspeed = 15.0
    bench.sending.add('fix')
    bench.run(15.0)
    bench.fly(on_wings=True)
    bench.travel(15.0, 25.0)
    bench.sending.add('airspeed')
    bench.travel(15.0, 5.0)
    start, since = bench.x[7], bench.now_us
    bench.sending.discard('fix')
    bench.run(20.0)
    assert 'gps' not in bench.flags
    assert {'wind', 'fuse_aspd', 'fuse_beta'} <= bench.flags
    state = bench.ekf.nav_state()
    assert not state.dead_reckoning and state.local_position_valid
    assert bench.x[7] - start == pytest.approx(15.0 * 1e-6 * (bench.now_us - since), abs=5.0)


@pytest.mark.parametrize('wind', [(4.0, 0.0), (0.0, -3.0)])
def test_the_drag_of_a_hovering_multirotor_tells_the_wind(wind):
    """Level hover over one place: all that pushes sideways is the wind."""
    params = AirDataParams(use_drag=True, ballistic_coef_x=25.0, ballistic_coef_y=30.0,
                           momentum_drag_coef=0.12, drag_noise=0.5)
    bench = Bench(Ekf2Params(air_data=params))
    bench.sending.add('fix')
    bench.run(15.0)
    bench.fly()
    yaw = bench.attitude[2]
    c, s = math.cos(yaw), math.sin(yaw)
    air_x, air_y = np.array(((c, s), (-s, c))) @ wind
    pushed = [0.5 * 1.225 * v * abs(v) / b + 0.12 * v for v, b in ((air_x, 25.0), (air_y, 30.0))]
    # to stay where it is the vehicle leans into the wind
    roll = math.asin(-pushed[1] / GRAVITY)
    pitch = math.asin(pushed[0] / GRAVITY)
    bench.force = np.array((pushed[0], pushed[1], -math.sqrt(
        GRAVITY ** 2 - pushed[0] ** 2 - pushed[1] ** 2)))
    for _ in range(50):
        bench.rate = np.array((-roll, pitch, 0.0)) / 0.5 * np.array((-1.0, 1.0, 1.0))
        bench.run(0.01)
    bench.rate = np.zeros(3)
    bench.run(40.0)
    assert 'wind' in bench.flags
    np.testing.assert_allclose(bench.x[22:24], wind, atol=0.5)
