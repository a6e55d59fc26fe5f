"""The EKF against simulated truth: errors vanish without noise, and are as large as stated."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import BaroParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import ImuParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.params.ekf2 import YawEstimatorParams
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.magnetometer import Magnetometer
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import field_at
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.vision import Vision

FLIGHT = Flight(duration=130.0, size=40.0, period=40.0, height=15.0, landing=15.0)
TAKEOFF = FLIGHT.takeoff
EVERY = 25


@dataclass(frozen=True)
class Flown:
    """Errors of a flight at 10 Hz: time (N,) s, NED position and velocity, yaw rad.

    horizon (N, 6): errors of position and velocity where the filter works, before the output
    predictor; horizon_cov (N, 6, 6) what the filter says of them. stated (N, 9): variances that
    the output states of position, rotation and velocity.
    """

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    yaw: np.ndarray
    horizon: np.ndarray
    horizon_cov: np.ndarray
    stated: np.ndarray
    innovations: dict[str, np.ndarray]

    def after(self, start: float, end: float = np.inf) -> Flown:
        kept = (self.time >= start) & (self.time < end)
        columns = ('time', 'position', 'velocity', 'yaw', 'horizon', 'horizon_cov', 'stated')
        return replace(self, **{name: getattr(self, name)[kept] for name in columns})

    def horizontal(self) -> np.ndarray:
        return np.hypot(self.position[:, 0], self.position[:, 1])


def perfect_sensors(gnss_arm=(0.0, 0.0, 0.0), imu_arm=(0.0, 0.0, 0.0)):
    return {
        'imu': Imu(gyro_noise=0.0, accel_noise=0.0, gyro_walk=0.0, accel_walk=0.0,
                   lever_arm=imu_arm),
        'fix': Gnss(origin=ORIGIN, pos_noise=0.0, pos_correlated=0.0, vel_noise=0.0,
                    stamp_delay=0.11, lever_arm=gnss_arm),
        'magnetic_field': Magnetometer(earth_field=field_at(ORIGIN), field_noise=0.0),
        'pressure': Barometer(altitude_noise=0.0, drift=0.0),
    }


def fly(sensors, params=None, seed=0, trajectory=FLIGHT):
    """Run the filter over a simulated flight and return its errors."""
    scenario = Scenario(trajectory=trajectory, sensors=sensors, seed=seed)
    ekf = Ekf2(params or Ekf2Params())
    ekf.push(LandedSample(scenario.start_us, landed=True))
    states, innovations, count, landed = [], {}, 0, True
    for arrival in scenario.arrivals():
        if landed and arrival.time_us > scenario.start_us + TAKEOFF * 1e6:
            landed = False
            ekf.push(LandedSample(arrival.time_us, landed=False))
        ekf.push(arrival.sample)
        if isinstance(arrival.sample, ImuSample):
            ekf.update()
            count += 1
            if count % EVERY == 0:
                note_innovations(ekf, innovations)
                state = ekf.nav_state()
                if state is not None and state.origin is not None:
                    states.append((state, *at_horizon(ekf)))
    return errors(scenario, states, innovations)


def note_innovations(ekf, innovations):
    for status in ekf.aid_statuses():
        rows = innovations.setdefault(status.name, [])
        if status.fused and (not rows or rows[-1][0] != status.time_us):
            rows.append((status.time_us, status.innovation, status.innovation_variance))


PLACE_AND_SPEED = [7, 8, 9, 4, 5, 6]


def at_horizon(ekf):
    """Return time, position and velocity (6,) and their covariance from inside the filter."""
    f = ekf.filter
    cov = f.cov.p[np.ix_(PLACE_AND_SPEED, PLACE_AND_SPEED)]
    return f.imu.time_us, f.x[PLACE_AND_SPEED].copy(), cov


def errors(scenario, rows, innovations):
    states, horizon_us, horizon, horizon_cov = zip(*rows, strict=True)
    time = np.array([state.time_us - scenario.start_us for state in states]) * 1e-6
    truth = scenario.trajectory.motion(time)
    then = scenario.trajectory.motion((np.array(horizon_us) - scenario.start_us) * 1e-6)
    origin = np.array([origin_ned(scenario, state.origin) for state in states])
    q = np.array([state.quaternion for state in states])
    yaw = np.arctan2(2 * (q[:, 0] * q[:, 3] + q[:, 1] * q[:, 2]),
                     1 - 2 * (q[:, 2] ** 2 + q[:, 3] ** 2))
    return Flown(
        time, np.array([state.position for state in states]) + origin - truth.position,
        np.array([state.velocity for state in states]) - truth.velocity,
        np.remainder(yaw - truth.yaw + np.pi, 2 * np.pi) - np.pi,
        np.array(horizon) + np.hstack([origin - then.position, -then.velocity]),
        np.array(horizon_cov),
        np.array([np.hstack((s.pose_cov.diagonal(), s.velocity_cov.diagonal())) for s in states]),
        {name: rows for name, rows in innovations.items() if rows})


def origin_ned(scenario, origin):
    tangent = LocalTangent(scenario.origin.lat, scenario.origin.lon, scenario.origin.alt)
    east, north, up = tangent.to_enu(origin.lat, origin.lon, origin.alt)
    return north, east, -up


def told(**gnss):
    return Ekf2Params(gnss=GnssParams(**gnss))


def test_without_noise_the_error_vanishes():
    flown = fly(perfect_sensors()).after(70.0)
    assert flown.horizontal().max() < 0.1
    assert np.abs(flown.position[:, 2]).max() < 0.05
    assert np.abs(flown.velocity).max() < 0.05
    assert np.degrees(np.abs(flown.yaw)).max() < 0.2


@pytest.mark.slow
def test_the_acceleration_told_is_that_of_the_vehicle():
    scenario = Scenario(trajectory=FLIGHT, sensors=perfect_sensors(), seed=0)
    ekf = Ekf2(Ekf2Params())
    times, told_by_filter = [], []
    for arrival in scenario.arrivals():
        ekf.push(arrival.sample)
        if isinstance(arrival.sample, ImuSample) and ekf.update():
            nav, time = ekf.nav_state(), 1e-6 * (arrival.time_us - scenario.start_us)
            if nav is not None and time > 70.0:
                # the sample holds the mean over the interval that it ends
                times.append(time - 0.5 * arrival.sample.delta_velocity_dt)
                told_by_filter.append(nav.acceleration)
    truth = scenario.trajectory.motion(np.array(times)).acceleration
    errors = np.array(told_by_filter) - truth
    assert np.abs(errors).max() < 0.1


@pytest.mark.slow
def test_antenna_place_matters_and_is_taken_off():
    arm = (0.8, -0.5, 0.0)
    aware = fly(perfect_sensors(gnss_arm=arm), told(position=arm)).after(70.0)
    unaware = fly(perfect_sensors(gnss_arm=arm)).after(70.0)
    assert aware.horizontal().max() < 0.1
    assert unaware.horizontal().mean() > 0.8 * np.hypot(0.8, 0.5)


@pytest.mark.slow
def test_imu_place_is_taken_off():
    arm = (0.3, 0.2, 0.0)
    aware = fly(perfect_sensors(imu_arm=arm), Ekf2Params(imu=ImuParams(position=arm))).after(70.0)
    unaware = fly(perfect_sensors(imu_arm=arm)).after(70.0)
    assert aware.horizontal().max() < 0.1
    # The IMU swings around the body origin as fast as the vehicle turns.
    assert np.abs(aware.velocity[:, :2]).max() < 0.05
    assert np.abs(unaware.velocity[:, :2]).max() > 0.08


@pytest.mark.slow
def test_delay_matters_and_is_taken_off():
    """Fixes 110 ms old taken for 10 ms old drag the track behind the vehicle."""
    right = fly(perfect_sensors(), told(delay_ms=110.0)).after(70.0)
    wrong = fly(perfect_sensors(), told(delay_ms=10.0)).after(70.0)
    speed = np.linalg.norm(FLIGHT.motion(right.time).velocity[:, :2], axis=1).mean()
    assert right.horizontal().max() < 0.1
    assert wrong.horizontal().mean() > 0.7 * 0.1 * speed


@pytest.mark.slow
def test_biases_are_found():
    sensors = perfect_sensors()
    sensors['imu'] = replace(
        sensors['imu'], gyro_bias=(0.01, -0.02, 0.015), accel_bias=(0.0, 0.0, 0.15))
    flown = fly(sensors).after(90.0)
    assert flown.horizontal().max() < 0.15
    assert np.degrees(np.abs(flown.yaw)).max() < 1.0


@pytest.mark.slow
def test_yaw_is_left_to_gnss_in_flight_without_a_compass():
    """A pseudo measurement of yaw would claim what nothing has measured."""
    def yaw_error(hold_yaw):
        sensors = perfect_sensors()
        del sensors['magnetic_field']
        sensors['imu'] = Imu(gyro_bias=(0.005, -0.005, 0.01))
        sensors['fix'] = replace(sensors['fix'], pos_noise=0.5, vel_noise=0.2)
        # An early alignment by the bank leaves the error that the one holds and the other loses.
        params = Ekf2Params(mag=MagParams(type='none'), aiding=AidingParams(hold_yaw=hold_yaw),
                            yaw_estimator=YawEstimatorParams(accuracy='vertical'))
        return np.degrees(np.sqrt(np.mean(fly(sensors, params, seed=4).after(60.0).yaw ** 2)))

    free = yaw_error('unaided')
    assert free < 1.0
    assert free < 0.6 * yaw_error('always')


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(3))
def test_where_nothing_aids_in_flight_the_output_says_how_far_it_may_be_off(seed):
    sensors = perfect_sensors()
    sensors['imu'] = Imu(accel_bias=(0.05, -0.05, 0.0))
    sensors['fix'] = replace(sensors['fix'], pos_noise=0.8, vel_noise=0.2,
                             outages=((60.0, 95.0),))
    flown = fly(sensors, seed=seed)
    held = flown.after(72.0, 95.0)
    errors = np.abs(np.hstack((held.position[:, 0:2], held.velocity[:, 0:2])))
    sigmas = np.sqrt(held.stated[:, [0, 1, 6, 7]])
    assert held.horizontal().max() > 30.0
    assert (errors < 3.0 * sigmas).all()
    for kind in (slice(0, 2), slice(2, 4)):
        rms = np.sqrt((errors[:, kind] ** 2).mean())
        assert np.sqrt((sigmas[:, kind] ** 2).mean()) < 10.0 * rms
    assert np.sqrt(flown.after(105.0).stated[:, [0, 1, 6, 7]]).max() < 1.0


def test_odometry_velocity_bridges_an_outage():
    def flown(with_odometry):
        sensors = perfect_sensors()
        sensors['imu'] = Imu(accel_bias=(0.05, -0.05, 0.0))
        sensors['fix'] = replace(sensors['fix'], pos_noise=0.5, vel_noise=0.2,
                                 outages=((80.0, 105.0),))
        if with_odometry:
            sensors['odometry'] = Vision(heading=1.0, scale=0.01)
        vision = VisionParams(use_velocity=with_odometry, rotate=True, delay_ms=0.0)
        return fly(sensors, Ekf2Params(vision=vision), seed=2).after(80.0, 105.0)

    bridged, alone = flown(True), flown(False)
    # One per cent of the scale and a degree of yaw over 25 s at 6 m/s, plus where it began.
    assert bridged.horizontal().max() < 2.5
    assert bridged.horizontal().max() < 0.4 * alone.horizontal().max()


@pytest.fixture(scope='module')
def consistent():
    """Flights whose noise is what the filter is told, white and unbiased."""
    sensors = perfect_sensors()
    sensors['imu'] = replace(sensors['imu'], gyro_noise=1.5e-3, accel_noise=2e-2)
    sensors['fix'] = replace(sensors['fix'], pos_noise=0.8, vel_noise=0.3)
    sensors['magnetic_field'] = replace(sensors['magnetic_field'], field_noise=0.05)
    sensors['pressure'] = replace(sensors['pressure'], altitude_noise=2.0)
    # Density times sqrt(rate of the filter), 100 Hz, is the noise of one increment over its time.
    params = Ekf2Params(
        imu=ImuParams(gyro_noise=1.5e-2, accel_noise=0.2, gyro_bias_process_noise=1e-4,
                      accel_bias_process_noise=1e-3),
        gnss=GnssParams(pos_noise=0.1, vel_noise=0.1), mag=MagParams(noise=0.05),
        baro=BaroParams(noise=2.0))
    return [fly(sensors, params, seed=seed) for seed in range(8)]


def bounds(degrees_of_freedom, probability=0.999):
    stats = pytest.importorskip('scipy.stats')
    tail = 0.5 * (1.0 - probability)
    return stats.chi2.ppf([tail, 1.0 - tail], degrees_of_freedom) / degrees_of_freedom


@pytest.mark.slow
@pytest.mark.parametrize('axes', [(0, 1), (3, 4)], ids=['position', 'velocity'])
def test_errors_are_as_large_as_stated(consistent, axes):
    """NEES, Bar-Shalom, Estimation with Applications to Tracking, 5.4; one sample in 5 s."""
    values = []
    for flown in consistent:
        late = flown.after(60.0)
        e = late.horizon[::50][:, axes]
        c = late.horizon_cov[::50][:, axes][:, :, axes]
        values += list(np.einsum('ni,nij,nj->n', e, np.linalg.inv(c), e))
    low, high = bounds(2 * len(values))
    assert low < np.mean(values) / 2.0 < high


def nis(consistent, name):
    """Return normalised squared innovations (N, components) after 40 s of flight."""
    ratios = []
    for flown in consistent:
        rows = flown.innovations[name]
        begin = rows[0][0] + 40_000_000
        ratios += [np.square(i) / np.array(v) for t, i, v in rows if t > begin]
    return np.array(ratios)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['gnss_position', 'baro_height', 'magnetic_field'])
def test_innovations_are_as_large_as_stated(consistent, name):
    ratios = nis(consistent, name)
    low, high = bounds(ratios.size)
    assert low < np.mean(ratios) < high


@pytest.mark.slow
@pytest.mark.parametrize('name', ['gnss_velocity', 'gnss_vertical_velocity'])
def test_velocity_innovations_are_not_larger_than_stated(consistent, name):
    # The filter adds noise for what it does not model, so that they may well be smaller.
    ratios = nis(consistent, name)
    _, high = bounds(ratios.size)
    assert 0.7 < np.mean(ratios) < high
