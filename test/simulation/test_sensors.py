"""Sensors: exact without noise, of the stated statistics with it."""

from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.magnetometer import Magnetometer
from ekf_fusion_ros.simulation.noise import gauss_markov
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Arrival
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.scenario import field_at
from ekf_fusion_ros.simulation.trajectory import GRAVITY
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.trajectory import Hover
from ekf_fusion_ros.simulation.vision import Vision

START = 1_000_000_000
RNG = np.random.default_rng
EIGHT = FigureOfEight(duration=60.0, climb=4.0)
PERFECT_IMU = Imu(gyro_noise=0.0, accel_noise=0.0, gyro_walk=0.0, accel_walk=0.0)
PERFECT_VISION = Vision(pos_noise=0.0, vel_noise=0.0, tilt_noise=0.0)


def test_strapdown_of_a_perfect_imu_returns_to_truth():
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    arm = (0.1, 0.2, -0.3)
    samples = replace(PERFECT_IMU, lever_arm=arm).measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([0.0, 60.0])).at_point(np.array(arm))
    attitude = rotation.from_matrix(truth.rotation[0])
    velocity, position = truth.velocity[0], truth.position[0]
    for s in samples:
        halfway = attitude * rotation.from_rotvec(0.5 * s.delta_angle)
        fall = np.array([0.0, 0.0, GRAVITY * s.delta_velocity_dt])
        gain = halfway.apply(s.delta_velocity) + fall
        position = position + (velocity + 0.5 * gain) * s.delta_velocity_dt
        velocity = velocity + gain
        attitude = attitude * rotation.from_rotvec(s.delta_angle)
    assert samples[-1].time_us == START + 60_000_000
    np.testing.assert_allclose(attitude.as_matrix(), truth.rotation[1], atol=1e-9)
    np.testing.assert_allclose(velocity, truth.velocity[1], atol=1e-5)
    np.testing.assert_allclose(position, truth.position[1], atol=1e-3)


def test_imu_noise_has_the_stated_density():
    imu = replace(PERFECT_IMU, gyro_noise=1e-3, accel_noise=2e-2, gyro_bias=(0.01, 0.0, -0.02))
    samples = imu.measure(Hover(duration=80.0), START, RNG(1))
    rate = np.array([s.delta_angle / s.delta_angle_dt for s in samples])
    force = np.array([s.delta_velocity / s.delta_velocity_dt for s in samples])
    np.testing.assert_allclose(rate.mean(axis=0), (0.01, 0.0, -0.02), atol=5e-4)
    np.testing.assert_allclose(rate.std(axis=0), 1e-3 * np.sqrt(250.0), rtol=0.05)
    np.testing.assert_allclose(force.std(axis=0), 2e-2 * np.sqrt(250.0), rtol=0.05)
    np.testing.assert_allclose(force.mean(axis=0), (0.0, 0.0, -GRAVITY), atol=1e-2)


def test_perfect_gnss_lies_on_the_antenna():
    pymap3d = pytest.importorskip('pymap3d')
    arm = np.array([0.4, 0.0, -0.2])
    gnss = Gnss(origin=ORIGIN, pos_noise=0.0, pos_correlated=0.0, vel_noise=0.0,
                lever_arm=tuple(arm), stamp_delay=0.1)
    samples = gnss.measure(EIGHT, START, RNG(0))
    t = np.array([s.time_us - START for s in samples]) * 1e-6 - 0.1
    truth = EIGHT.motion(t).at_point(arm)
    north, east, down = pymap3d.geodetic2ned(
        np.array([s.lat for s in samples]), np.array([s.lon for s in samples]),
        np.array([s.alt for s in samples]), ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    np.testing.assert_allclose(np.stack([north, east, down], axis=1), truth.position, atol=1e-6)
    np.testing.assert_allclose([s.velocity for s in samples], truth.velocity, atol=1e-12)


def test_gauss_markov_has_sigma_and_correlation():
    process = gauss_markov(RNG(2), 0.5, 3.0, np.full(60000, 0.2), 1)[:, 0]
    assert process.std() == pytest.approx(0.5, rel=0.08)
    lag = 15
    correlation = np.corrcoef(process[:-lag], process[lag:])[0, 1]
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.06)


def test_perfect_vision_is_truth_in_a_turned_frame():
    vision = replace(PERFECT_VISION, heading=0.8)
    samples = vision.measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([s.time_us - START for s in samples]) * 1e-6)
    c, s = np.cos(0.8), np.sin(0.8)
    to_earth = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    moved = np.array([v.position for v in samples]) @ to_earth.T
    np.testing.assert_allclose(moved, truth.position - truth.position[0], atol=1e-9)
    body = np.array([v.velocity for v in samples])
    np.testing.assert_allclose(truth.to_earth(body), truth.velocity, atol=1e-12)
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    seen = rotation.from_quat([np.roll(v.quaternion, -1) for v in samples]).as_matrix()
    np.testing.assert_allclose(to_earth @ seen, truth.rotation, atol=1e-9)


def test_vision_scale_stretches_distance_and_speed():
    samples = replace(PERFECT_VISION, scale=0.02).measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([s.time_us - START for s in samples]) * 1e-6)
    way = np.linalg.norm(np.diff([s.position for s in samples], axis=0), axis=1).sum()
    true_way = np.linalg.norm(np.diff(truth.position, axis=0), axis=1).sum()
    assert way / true_way == pytest.approx(1.02, abs=1e-9)
    speed = np.array([np.linalg.norm(s.velocity) for s in samples])
    np.testing.assert_allclose(speed, 1.02 * np.linalg.norm(truth.velocity, axis=1), atol=1e-12)


def test_vision_yaw_drift_walks_as_stated():
    walk = np.radians(1.0) / np.sqrt(60.0)
    hover = Hover(duration=60.0)
    ends = []
    for seed in range(200):
        vision = replace(PERFECT_VISION, rate=2.0, yaw_walk=walk)
        q = vision.measure(hover, START, RNG(seed))[-1].quaternion
        ends.append(2.0 * np.arctan2(q[3], q[0]))
    # A sample of 200 gives the deviation to 5 % (1 sigma).
    assert np.degrees(np.std(ends)) == pytest.approx(1.0, abs=0.16)


def test_vision_claims_what_it_errs():
    """Errors over a flight stay within three of the stated sigmas, and are not far below."""
    ratios = []
    for seed in range(20):
        vision = Vision(scale=0.01, yaw_walk=np.radians(1.0) / np.sqrt(60.0))
        samples = vision.measure(EIGHT, START, RNG(seed))[600::300]
        truth = EIGHT.motion(np.array([s.time_us - START for s in samples]) * 1e-6)
        error = np.array([s.position for s in samples]) - truth.position + EIGHT.motion(
            np.zeros(1)).position
        sigma = np.sqrt([s.position_var for s in samples])
        ratios.append(np.mean((error / sigma)[:, :2] ** 2))
    assert 0.1 < np.mean(ratios) < 9.0


def test_magnetometer_sees_the_earth_field_from_the_body():
    mag = Magnetometer(earth_field=field_at(ORIGIN), field_noise=0.0, body_field=(0.01, 0.0, 0.0))
    samples = mag.measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([s.time_us - START for s in samples]) * 1e-6)
    fields = np.array([s.field for s in samples]) - (0.01, 0.0, 0.0)
    np.testing.assert_allclose(truth.to_earth(fields), np.tile(field_at(ORIGIN), (len(fields), 1)),
                               atol=1e-12)


def test_motors_disturb_the_magnetometer_in_the_air_only():
    flight = Flight(duration=60.0)
    quiet, disturbed = (
        Magnetometer(earth_field=field_at(ORIGIN), field_noise=0.0, motor_field=motors)
        .measure(flight, START, RNG(0)) for motors in ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)))
    added = np.array([a.field - b.field for a, b in zip(disturbed, quiet, strict=True)])
    assert not added[:50].any()
    # a gentle flight: about one g
    np.testing.assert_allclose(added[1500:1600], np.tile((0.1, 0.0, 0.0), (100, 1)), atol=0.02)


def test_barometer_follows_height():
    baro = Barometer(reference=488.0, altitude_noise=0.0, drift=0.0, bias=1.5)
    samples = baro.measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([s.time_us - START for s in samples]) * 1e-6)
    np.testing.assert_allclose([s.altitude for s in samples], 489.5 - truth.position[:, 2])


def test_outages_leave_gaps_and_nothing_else():
    whole = Gnss(origin=ORIGIN).measure(EIGHT, START, RNG(3))
    gap = Gnss(origin=ORIGIN, outages=((20.0, 30.0),)).measure(EIGHT, START, RNG(3))
    kept = [s for s in whole if not 20.0 <= (s.time_us - START) * 1e-6 < 30.0]
    assert [(s.time_us, s.lat, s.lon) for s in gap] == [(s.time_us, s.lat, s.lon) for s in kept]
    assert len(whole) - len(gap) == 50


def test_late_messages_arrive_late_in_order():
    sensors = default_sensors(['imu', 'fix'])
    sensors['fix'] = replace(sensors['fix'], latency=0.25, stamp_delay=0.1)
    arrivals = list(Scenario(trajectory=Hover(duration=5.0), sensors=sensors).arrivals())
    times = [a.time_us for a in arrivals]
    assert times == sorted(times)
    late = {a.time_us - a.sample.time_us for a in arrivals if a.role == 'fix'}
    assert late == {250_000}
    assert isinstance(arrivals[0], Arrival)


def test_one_sensor_more_leaves_the_others_as_they_are():
    hover = Hover(duration=5.0)

    def fixes(*roles):
        scenario = Scenario(trajectory=hover, sensors=default_sensors(roles), seed=7)
        return [(a.sample.lat, a.sample.lon) for a in scenario.arrivals() if a.role == 'fix']

    assert fixes('fix') == fixes('odometry', 'fix', 'imu')


def test_unknown_role_is_refused():
    with pytest.raises(ValueError, match='sonar'):
        Scenario(trajectory=Hover(duration=1.0), sensors={'sonar': PERFECT_IMU})
