"""Flow and range alone against simulated truth: exact without noise, and consistent with it."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.params.ekf2 import BaroParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import FlowParams
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import RangeParams
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.ground_contact import GroundContact
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.magnetometer import Magnetometer
from ekf_fusion_ros.simulation.optical_flow import OpticalFlow
from ekf_fusion_ros.simulation.range_finder import RangeFinder
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import field_at
from ekf_fusion_ros.simulation.trajectory import Flight

FLIGHT = Flight(duration=130.0, size=40.0, period=60.0, height=10.0, landing=15.0)
SETTLED, BRAKING = 40.0, 112.0
EVERY = 25
BEST = 255
FIELD = field_at(ORIGIN)
DECLINATION = math.degrees(math.atan2(FIELD[1], FIELD[0]))
"""Without fixes the filter must be told."""

NOISY = {
    # Density times sqrt(rate of the filter), 100 Hz, is the noise of one increment over its time.
    'imu': Imu(gyro_noise=1.5e-3, accel_noise=2e-2, gyro_walk=0.0, accel_walk=0.0),
    'magnetic_field': Magnetometer(earth_field=FIELD, field_noise=0.05),
    'pressure': Barometer(reference=ORIGIN.alt, altitude_noise=2.0, drift=0.0),
    'range': RangeFinder(distance_noise=0.1),
    'flow': OpticalFlow(flow_noise=0.15, gyro_noise=0.0, quality=BEST),
    'landed': GroundContact(),
}
NOISES = {'gyro_noise', 'accel_noise', 'field_noise', 'altitude_noise', 'distance_noise',
          'flow_noise'}
PARAMS = Ekf2Params(
    imu=ImuParams(gyro_noise=1.5e-2, accel_noise=0.2, gyro_bias_process_noise=1e-4,
                  accel_bias_process_noise=1e-3),
    gnss=GnssParams(enabled=False), mag=MagParams(noise=0.05, declination_deg=DECLINATION),
    baro=BaroParams(noise=2.0), range=RangeParams(noise=0.1),
    flow=FlowParams(enabled=True, noise=0.15))


@dataclass(frozen=True)
class Flown:
    """Errors at 10 Hz: NE position m, velocity m/s (N, 2), their covariances, true velocity."""

    position: np.ndarray
    velocity: np.ndarray
    position_cov: np.ndarray
    velocity_cov: np.ndarray
    true_velocity: np.ndarray

    def speed_error(self):
        """Share by which the speed is estimated too high."""
        return np.sum(self.velocity * self.true_velocity) / np.sum(self.true_velocity ** 2)


def fly(sensors, params=PARAMS, seed=0):
    scenario = Scenario(trajectory=FLIGHT, sensors=sensors, seed=seed)
    ekf, rows, count = Ekf2(params), [], 0
    for arrival in scenario.arrivals():
        ekf.push(arrival.sample)
        if not isinstance(arrival.sample, ImuSample):
            continue
        ekf.update()
        count += 1
        f = ekf.filter
        time = 1e-6 * (f.imu.time_us - scenario.start_us)
        if count % EVERY == 0 and SETTLED < time < BRAKING:
            rows.append((time, f.x[7:9].copy(), f.x[4:6].copy(), f.cov.p[7:9, 7:9].copy(),
                         f.cov.p[4:6, 4:6].copy()))
    time, position, velocity, position_cov, velocity_cov = map(
        np.array, zip(*rows, strict=True))
    truth = scenario.trajectory.motion(time)
    true_velocity = truth.velocity[:, 0:2]
    return Flown(position - truth.position[:, 0:2], velocity - true_velocity, position_cov,
                 velocity_cov, true_velocity)


def silent(sensor):
    return replace(sensor, **{name: 0.0 for name in NOISES if hasattr(sensor, name)})


@pytest.mark.parametrize('own_gyro', [
    {'has_gyro': False}, {}, {'gyro_bias': (0.03, -0.02, 0.01)}],
    ids=['no_gyro', 'gyro', 'biased_gyro'])
def test_without_noise_the_error_vanishes(own_gyro):
    sensors = {name: silent(sensor) for name, sensor in NOISY.items()}
    sensors['flow'] = replace(sensors['flow'], **own_gyro)
    flown = fly(sensors)
    assert abs(flown.speed_error()) < 0.002
    assert np.abs(flown.velocity).max() < 0.03
    # A fifth of a per cent of 320 m, were it all in one direction.
    assert np.linalg.norm(flown.position, axis=1).max() < 0.6


@pytest.mark.slow
def test_a_gyro_compared_with_the_wrong_sign_takes_rotation_for_bias():
    """PX4's way; the vehicle turns about 0.2 rad/s, and tilts, at 10 m."""
    sensors = {name: silent(sensor) for name, sensor in NOISY.items()}
    flow = replace(PARAMS.flow, opposed_gyro=False)
    assert fly(sensors, replace(PARAMS, flow=flow)).speed_error() > 0.03


@pytest.fixture(scope='module')
def flights():
    return [fly(NOISY, seed=seed) for seed in range(8)]


def nees(errors, covariances):
    """Return the normalised squared errors (N,), two degrees of freedom each."""
    return np.einsum('ni,nij,nj->n', errors, np.linalg.inv(covariances), errors)


def bounds(degrees_of_freedom, probability=0.999):
    stats = pytest.importorskip('scipy.stats')
    tail = 0.5 * (1.0 - probability)
    return stats.chi2.ppf([tail, 1.0 - tail], degrees_of_freedom) / degrees_of_freedom


@pytest.mark.slow
def test_velocity_errors_are_as_large_as_stated(flights):
    """Bar-Shalom, Estimation with Applications to Tracking, 5.4; one sample in 5 s."""
    values = np.concatenate(
        [nees(flown.velocity[::50], flown.velocity_cov[::50]) for flown in flights])
    low, high = bounds(2 * len(values))
    assert low < values.mean() / 2.0 < high


@pytest.mark.slow
def test_position_errors_are_as_large_as_stated(flights):
    """They add up all the way, so that each flight is one sample: its end."""
    values = np.concatenate(
        [nees(flown.position[-1:], flown.position_cov[-1:]) for flown in flights])
    low, high = bounds(2 * len(values))
    assert low < values.mean() / 2.0 < high


@pytest.mark.slow
def test_speed_has_no_bias(flights):
    errors = [flown.speed_error() for flown in flights]
    # Three standard errors of the mean of eight flights.
    assert abs(np.mean(errors)) < 3.0 * np.std(errors, ddof=1) / math.sqrt(len(errors))
