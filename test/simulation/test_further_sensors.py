"""Range, flow, airspeed, heading, ground contact: exact without noise, as stated with it."""

from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.simulation.airspeed import Airspeed
from ekf_fusion_ros.simulation.auxiliary_velocity import AuxiliaryVelocity
from ekf_fusion_ros.simulation.dual_antenna import DualAntennaGnss
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.ground_contact import GroundContact
from ekf_fusion_ros.simulation.optical_flow import OpticalFlow
from ekf_fusion_ros.simulation.range_finder import RangeFinder
from ekf_fusion_ros.simulation.scenario import FURTHER_ROLES
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import ROLES
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.surroundings import Terrain
from ekf_fusion_ros.simulation.surroundings import Wind
from ekf_fusion_ros.simulation.trajectory import Circle
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.trajectory import Hover
from ekf_fusion_ros.simulation.trajectory import Loiter

START = 1_000_000_000
RNG = np.random.default_rng
EIGHT = FigureOfEight(duration=60.0, climb=4.0, period=30.0)
HOVER = Hover(duration=200.0, place=(0.0, 0.0, -5.0))
LIDAR = RangeFinder(distance_noise=0.0)
CAMERA = OpticalFlow(flow_noise=0.0, gyro_noise=0.0)
PITOT = Airspeed(speed_noise=0.0)
ANTENNAS = DualAntennaGnss(origin=ORIGIN, heading_noise=0.0)


def times(samples, delay=0.0):
    return np.array([s.time_us - START for s in samples]) * 1e-6 - delay


def distances(samples):
    return np.array([s.distance for s in samples])


# Range finder.

def test_perfect_range_meets_a_slope_where_geometry_says():
    """Ray and plane n . x = d, solved by hand, for a tilted vehicle and a lever arm."""
    slope, height, arm = (0.1, -0.05), 1.5, np.array([0.3, -0.2, 0.1])
    eight = replace(EIGHT, terrain=Terrain(height=height, slope=slope))
    lidar = replace(LIDAR, lever_arm=tuple(arm), stamp_delay=0.02, max_distance=100.0)
    samples = lidar.measure(eight, START, RNG(0))
    truth = eight.motion(times(samples, 0.02)).at_point(arm)
    normal = np.array([slope[0], slope[1], 1.0])
    axis = truth.rotation[:, :, 2]
    expected = (-height - truth.position @ normal) / (axis @ normal)
    np.testing.assert_allclose(distances(samples), expected, atol=1e-9)
    # The eight is flown with enough bank for the slant to matter.
    assert axis[:, 2].min() < 0.99


def test_hills_are_met_on_their_surface():
    terrain = Terrain(hill=2.0, wavelength=60.0)
    eight = replace(EIGHT, terrain=terrain)
    samples = LIDAR.measure(eight, START, RNG(0))
    truth = eight.motion(times(samples))
    hit = truth.position + distances(samples)[:, None] * truth.rotation[:, :, 2]
    np.testing.assert_allclose(
        hit[:, 2], -2.0 * np.sin(2.0 * np.pi * hit[:, 0] / 60.0), atol=1e-9)


def test_a_sensor_that_looks_ahead_sees_further():
    lidar = replace(LIDAR, pitch=math.radians(30.0))
    samples = lidar.measure(HOVER, START, RNG(0))
    np.testing.assert_allclose(distances(samples), 5.0 / math.cos(math.radians(30.0)))


def test_range_noise_bias_and_drift():
    noisy = replace(LIDAR, distance_noise=0.05, relative_noise=0.01, bias=0.2)
    errors = distances(noisy.measure(HOVER, START, RNG(1))) - 5.0
    assert errors.mean() == pytest.approx(0.2, abs=0.01)
    assert errors.std() == pytest.approx(0.05 + 0.01 * 5.0, rel=0.05)
    short = replace(HOVER, duration=25.0)
    drifted = replace(LIDAR, drift=0.1, rate=2.0)
    ends = [distances(drifted.measure(short, START, RNG(k)))[-1] - 5.0 for k in range(300)]
    assert np.std(ends) == pytest.approx(0.1 * math.sqrt(25.0), rel=0.15)


def test_range_without_a_distance_stands_at_the_limit():
    lost = replace(LIDAR, dropout=0.2).measure(HOVER, START, RNG(2))
    none = [s for s in lost if s.quality == 0]
    assert len(none) / len(lost) == pytest.approx(0.2, abs=0.02)
    assert {s.distance for s in none} == {20.0}
    far = LIDAR.measure(replace(HOVER, place=(0.0, 0.0, -25.0)), START, RNG(0))
    assert {(s.distance, s.quality) for s in far} == {(20.0, 0)}
    near = LIDAR.measure(replace(HOVER, place=(0.0, 0.0, -0.1)), START, RNG(0))
    assert {(s.distance, s.quality) for s in near} == {(0.2, 0)}


def test_range_is_lost_beyond_its_tilt():
    steep = Circle(duration=30.0, radius=10.0, speed=9.0, height=10.0)
    samples = replace(LIDAR, max_tilt=math.radians(30.0)).measure(steep, START, RNG(0))
    tilt = np.arccos(steep.motion(times(samples)).rotation[:, 2, 2])
    lost = np.array([s.quality == 0 for s in samples])
    np.testing.assert_array_equal(lost, tilt > math.radians(30.0))
    assert 0 < lost.sum() < len(lost)


def test_stuck_range_repeats_the_last_reading():
    noisy = replace(LIDAR, distance_noise=0.05)
    free = distances(noisy.measure(HOVER, START, RNG(3)))
    samples = replace(noisy, stuck=((10.0, 12.0),)).measure(HOVER, START, RNG(3))
    t = times(samples)
    inside = (t >= 10.0) & (t < 12.0)
    stuck = distances(samples)
    assert set(stuck[inside]) == {free[np.argmax(inside) - 1]}
    np.testing.assert_array_equal(stuck[~inside], free[~inside])


# Optical flow.

def test_level_flow_is_speed_over_height():
    """On a straight level leg fx = v_right / h and fy = -v_forward / h: no rotation."""
    class Leg(Hover):
        def position(self, t):
            return [3.0 * t, 0.0 * t + 2.0, 0.0 * t - 8.0]

    leg = Leg(duration=10.0, heading=0.5)
    for sample in CAMERA.measure(leg, START, RNG(0)):
        forward, right = 3.0 * math.cos(0.5), -3.0 * math.sin(0.5)
        assert sample.flow == pytest.approx(
            np.array([right, -forward]) / 8.0 * sample.dt, abs=1e-12)
        assert sample.gyro == pytest.approx(0.0, abs=1e-12)
        assert sample.quality == 200


def test_flow_less_gyro_is_translation_over_range():
    """Compensated as the filter does it, the flow is the body velocity over the slant range."""
    arm = np.array([0.2, 0.1, 0.05])
    camera = replace(CAMERA, lever_arm=tuple(arm), rate=200.0, stamp_delay=0.005)
    samples = camera.measure(EIGHT, START, RNG(0))
    dt = np.array([s.dt for s in samples])
    truth = EIGHT.motion(times(samples, 0.005) - 0.5 * dt).at_point(arm)
    velocity = truth.to_body(truth.velocity)
    distance = -truth.position[:, 2] / truth.rotation[:, 2, 2]
    expected = np.stack([velocity[:, 1], -velocity[:, 0]], axis=1) / distance[:, None]
    compensated = np.array([s.flow - s.gyro[:2] for s in samples]) / dt[:, None]
    np.testing.assert_allclose(compensated, expected, atol=1e-4)


def test_gyro_of_the_flow_sensor_is_minus_the_rotation():
    samples = CAMERA.measure(EIGHT, START, RNG(0))
    rotation = np.array([-s.gyro for s in samples])
    middle = EIGHT.motion(times(samples) - 0.5 * samples[0].dt)
    np.testing.assert_allclose(rotation / samples[0].dt, middle.rate, atol=2e-3)
    without = replace(CAMERA, has_gyro=False).measure(EIGHT, START, RNG(0))
    assert all(np.isnan(s.gyro).all() for s in without)


def test_flow_noise_and_bias():
    camera = OpticalFlow(flow_noise=0.1, bias=(0.02, -0.03), gyro_noise=0.01,
                         gyro_bias=(0.001, 0.002, 0.003))
    samples = camera.measure(HOVER, START, RNG(1))
    rate = np.array([s.flow / s.dt for s in samples])
    gyro = np.array([s.gyro / s.dt for s in samples])
    np.testing.assert_allclose(rate.mean(axis=0), (0.02, -0.03), atol=0.006)
    np.testing.assert_allclose(rate.std(axis=0), 0.1, rtol=0.05)
    np.testing.assert_allclose(gyro.mean(axis=0), (0.001, 0.002, 0.003), atol=6e-4)
    np.testing.assert_allclose(gyro.std(axis=0), 0.01, rtol=0.05)


def test_flow_has_no_quality_near_far_or_fast():
    def qualities(trajectory, **changes):
        return {s.quality for s in replace(CAMERA, **changes).measure(trajectory, START, RNG(0))}

    assert qualities(HOVER) == {200}
    assert qualities(HOVER, min_distance=6.0) == {0}
    assert qualities(HOVER, max_distance=4.0) == {0}
    assert qualities(EIGHT, max_rate=0.3) == {0, 200}


# Airspeed.

def test_perfect_airspeed_is_the_speed_through_the_air():
    wind = Wind(mean=(4.0, -3.0, 0.0), gust=1.0, gust_period=15.0)
    eight = replace(EIGHT, wind=wind)
    samples = replace(PITOT, reference=488.0).measure(eight, START, RNG(0))
    t = times(samples)
    truth = eight.motion(t)
    strength = 5.0 + np.sin(2.0 * np.pi * t / 15.0)
    air = truth.velocity - strength[:, None] * np.array([0.8, -0.6, 0.0])
    np.testing.assert_allclose(
        [s.true_airspeed for s in samples], np.linalg.norm(air, axis=1), atol=1e-9)
    # ISO 2533 at 500 m: 1.16727 kg/m^3.
    assert np.mean([s.eas2tas for s in samples]) == pytest.approx(
        math.sqrt(1.2250 / 1.16727), abs=2e-4)


def test_airspeed_errors_and_floor():
    windy = replace(HOVER, wind=Wind(mean=(12.0, 0.0, 0.0)))
    pitot = Airspeed(scale=0.05, bias=0.4, speed_noise=0.6)
    speed = np.array([s.true_airspeed / s.eas2tas for s in pitot.measure(windy, START, RNG(1))])
    factor = pitot.measure(windy, START, RNG(1))[0].eas2tas
    assert speed.mean() == pytest.approx(1.05 * 12.0 / factor + 0.4, abs=0.05)
    assert speed.std() == pytest.approx(0.6, rel=0.05)
    calm = [s.true_airspeed for s in Airspeed().measure(HOVER, START, RNG(1))]
    assert min(calm) == 0.0
    # Half of a normal distribution.
    assert np.mean(calm) == pytest.approx(0.5 / math.sqrt(2.0 * math.pi), rel=0.1)


def test_airspeed_drifts():
    windy = replace(HOVER, duration=16.0, wind=Wind(mean=(20.0, 0.0, 0.0)))
    pitot = replace(PITOT, drift=0.1, rate=2.0)
    ends = [s.true_airspeed / s.eas2tas for s in (
        pitot.measure(windy, START, RNG(k))[-1] for k in range(300))]
    assert np.std(ends) == pytest.approx(0.1 * 4.0, rel=0.15)


def test_an_aeroplane_flies_at_its_airspeed_and_never_sideways():
    wind = np.array([5.0, -2.0, 0.0])
    loiter = Loiter(duration=120.0, wind=Wind(mean=tuple(wind)))
    motion = loiter.motion(np.arange(45.0, 120.0, 0.5))
    air = motion.velocity - wind
    np.testing.assert_allclose(np.linalg.norm(air, axis=1), 18.0, atol=1e-9)
    assert np.abs(motion.to_body(air)[:, 1]).max() < 1e-9
    rest = loiter.motion(np.arange(0.0, 5.0, 0.5))
    assert np.abs(rest.velocity).max() == 0.0 and np.abs(rest.position).max() == 0.0


# Two antennas.

@pytest.mark.parametrize('offset', [0.0, math.pi / 2, -2.5])
def test_perfect_heading_is_the_yaw(offset):
    """Level the offset drops out; banked the axis points a little elsewhere, as ECL predicts."""
    level = Hover(duration=5.0, heading=2.0)
    antennas = replace(ANTENNAS, antenna_offset=offset)
    assert [s.yaw for s in antennas.measure(level, START, RNG(0))] == pytest.approx(26 * [2.0])
    samples = antennas.measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(times(samples))
    axis = truth.to_earth(np.array([math.cos(offset), math.sin(offset), 0.0]))
    seen = np.array([s.yaw + s.yaw_offset for s in samples])
    np.testing.assert_allclose(np.cos(seen), axis[:, 0] / np.hypot(axis[:, 0], axis[:, 1]))
    np.testing.assert_allclose(np.sin(seen), axis[:, 1] / np.hypot(axis[:, 0], axis[:, 1]))


def test_heading_errors():
    noisy = replace(ANTENNAS, heading_noise=0.02, heading_bias=0.1)
    samples = noisy.measure(replace(HOVER, heading=0.3), START, RNG(1))
    errors = np.array([s.yaw for s in samples]) - 0.3
    assert errors.mean() == pytest.approx(0.1, abs=0.003)
    assert errors.std() == pytest.approx(0.02, rel=0.1)
    assert {s.yaw_accuracy for s in samples} == {0.02}
    short = replace(HOVER, duration=25.0)
    ends = [replace(ANTENNAS, heading_drift=0.01).measure(short, START, RNG(k))[-1].yaw
            for k in range(300)]
    assert np.std(ends) == pytest.approx(0.01 * 5.0, rel=0.15)


def test_second_antenna_leaves_the_fix_as_it_is():
    one = Gnss(origin=ORIGIN, outages=((30.0, 40.0),)).measure(HOVER, START, RNG(5))
    dual = DualAntennaGnss(origin=ORIGIN, outages=((30.0, 40.0),),
                           heading_outages=((10.0, 20.0),)).measure(HOVER, START, RNG(5))
    assert [(s.time_us, s.lat, s.alt, s.velocity[0]) for s in one] == [
        (s.time_us, s.lat, s.alt, s.velocity[0]) for s in dual]
    known = np.isfinite([s.yaw for s in dual])
    t = times(dual)
    np.testing.assert_array_equal(known, (t < 10.0) | (t >= 20.0))
    np.testing.assert_array_equal(np.isfinite([s.yaw_accuracy for s in dual]), known)


# Ground contact.

def test_ground_contact_is_told_by_height_and_speed():
    flight = Flight(duration=120.0)
    samples = GroundContact(fixed_wing=True).measure(flight, START, RNG(0))
    truth = flight.motion(times(samples))
    t = truth.time
    landed = np.array([s.landed for s in samples])
    assert landed[t < 12.0].all() and not landed[(t > 14.0) & (t < 105.0)].any()
    assert landed[-1]
    np.testing.assert_array_equal(
        landed, (-truth.position[:, 2] < 0.1) & (np.linalg.norm(truth.velocity, axis=1) < 0.2))
    assert all(isinstance(s, LandedSample) and s.fixed_wing for s in samples)


def test_ground_contact_counts_from_the_terrain():
    hill = replace(HOVER, terrain=Terrain(height=4.7))
    assert not any(s.landed for s in GroundContact().measure(hill, START, RNG(0)))
    assert all(s.landed for s in GroundContact(clearance=0.3).measure(hill, START, RNG(0)))


# Auxiliary velocity.

def test_a_beacon_tells_the_velocity_within_its_reach():
    exact = AuxiliaryVelocity(vel_noise=0.0, reach=12.0).measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([(s.time_us - START) * 1e-6 for s in exact]))
    np.testing.assert_allclose([s.velocity for s in exact], truth.velocity, atol=1e-9)
    assert (-truth.position[:, 2] <= 12.0).all()
    everywhere = AuxiliaryVelocity(vel_noise=0.2).measure(EIGHT, START, RNG(0))
    truth = EIGHT.motion(np.array([(s.time_us - START) * 1e-6 for s in everywhere]))
    error = np.array([s.velocity for s in everywhere]) - truth.velocity
    assert 0 < len(exact) < len(everywhere)
    assert error.std(axis=0) == pytest.approx(3 * [0.2], rel=0.1)
    assert everywhere[0].variance == pytest.approx(3 * [0.04])


# All together.

@pytest.mark.parametrize('sensor', [LIDAR, CAMERA, PITOT, GroundContact(), AuxiliaryVelocity()])
def test_outages_and_delays(sensor):
    gap = replace(sensor, outages=((20.0, 30.0),), stamp_delay=0.05)
    whole = [s.time_us - START for s in sensor.measure(EIGHT, START, RNG(3))]
    kept = [t for t in whole if not 20_000_000 <= t < 30_000_000]
    late = [s.time_us - START - 50_000 for s in gap.measure(EIGHT, START, RNG(3))]
    assert late == kept
    assert len(kept) < len(whole)


def test_further_roles_leave_the_others_as_they_are():
    def fixes(*roles):
        scenario = Scenario(
            trajectory=replace(HOVER, duration=5.0), sensors=default_sensors(roles), seed=7)
        return [(a.sample.lat, a.sample.lon) for a in scenario.arrivals() if a.role == 'fix']

    assert fixes('fix') == fixes(*ROLES, *FURTHER_ROLES, 'gps_heading')
