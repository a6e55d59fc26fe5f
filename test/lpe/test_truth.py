"""LPE against simulated truth, and against EKF2 on the same flights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.lpe.lpe import Lpe
from ekf_fusion_ros.params.lpe import FlowParams
from ekf_fusion_ros.params.lpe import GnssParams
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.trajectory import Hover
from ekf_fusion_ros.simulation.trajectory import Loiter

FLIGHT = Flight(duration=130.0, size=40.0, period=40.0, height=15.0, landing=15.0)
HORIZONTAL = slice(0, 2)


def scenario_of(trajectory, seed, **gnss):
    sensors = default_sensors(('fix', 'imu', 'magnetic_field', 'pressure'))
    sensors['fix'] = replace(sensors['fix'], stamp_delay=0.11, **gnss)
    return Scenario(trajectory=trajectory, sensors=sensors, seed=seed)


@pytest.mark.parametrize(('trajectory', 'seed'), [
    (FLIGHT, 0), (Hover(duration=100.0), 1),
    pytest.param(FLIGHT, 2, marks=pytest.mark.slow),
    pytest.param(FLIGHT, 3, marks=pytest.mark.slow),
    pytest.param(Loiter(duration=120.0), 4, marks=pytest.mark.slow)])
def test_with_true_attitude_it_is_nearly_as_good_as_ekf2(fly, trajectory, seed):
    scenario = scenario_of(trajectory, seed)
    lpe = fly(Lpe(), scenario, true_attitude=True).after(60.0)
    ekf = fly(Ekf2(), scenario, true_attitude=False).after(60.0)
    assert lpe.rms(HORIZONTAL) < 1.5 * ekf.rms(HORIZONTAL)
    assert lpe.rms() < 1.5 * ekf.rms()


@pytest.mark.parametrize('trajectory', [
    FLIGHT, pytest.param(Loiter(duration=90.0), marks=pytest.mark.slow)])
def test_a_land_detector_that_is_stuck_does_not_hold_it_on_the_ground(fly, trajectory):
    lpe = Lpe()
    take = lpe.push
    lpe.push = lambda sample: None if isinstance(sample, LandedSample) and not sample.landed \
        else take(sample)
    flown = fly(lpe, scenario_of(trajectory, 4), true_attitude=True).after(40.0)
    assert np.linalg.norm(flown.position[:, HORIZONTAL], axis=1).max() < 5.0
    assert lpe.filter.landed


def test_without_noise_the_error_vanishes(fly):
    scenario = scenario_of(FLIGHT, 0, pos_noise=0.0, pos_correlated=0.0, vel_noise=0.0)
    quiet = replace(scenario.sensors['imu'], gyro_noise=0.0, accel_noise=0.0, gyro_walk=0.0,
                    accel_walk=0.0)
    scenario = replace(scenario, sensors={**scenario.sensors, 'imu': quiet})
    flown = fly(Lpe(), scenario, true_attitude=True).after(40.0)
    assert flown.rms(HORIZONTAL) < 0.05
    assert np.abs(flown.velocity).max() < 0.1
    last = flown.states[-1]
    assert np.linalg.norm(last.accel_bias) < 0.01


@pytest.mark.slow
def test_its_own_attitude_filter_is_good_to_three_degrees(fly):
    flown = fly(Lpe(), scenario_of(FLIGHT, 5), true_attitude=False).after(60.0)
    assert np.sqrt(np.mean(flown.angle ** 2)) < 3.0
    assert flown.rms(HORIZONTAL) < 1.5


@pytest.mark.slow
def test_fixes_without_velocity_keep_its_attitude_filter_upright(fly):
    """In turns of 3 m/s^2 RMS, which without any velocity pass for 17 deg of tilt."""
    def position_only(sample):
        return sample._replace(velocity=NAN3) if isinstance(sample, GnssSample) else sample

    turns = replace(FLIGHT, size=20.0, period=20.0)
    flown = fly(Lpe(), scenario_of(turns, 6), true_attitude=False, change=position_only)
    flown = flown.after(60.0)
    assert np.sqrt(np.mean(flown.angle ** 2)) < 1.5
    assert flown.rms(HORIZONTAL) < 1.5


def test_flow_alone_keeps_its_attitude_filter_upright(fly):
    """Without a fix the declination is unknown, so that it flies 2.6 deg off true north."""
    sensors = default_sensors(('imu', 'magnetic_field', 'pressure', 'range', 'flow'))
    flight = Flight(duration=60.0, size=20.0, period=30.0, height=5.0, landing=15.0)
    scenario = Scenario(trajectory=flight, sensors=sensors, seed=1)
    lpe = Lpe(LpeParams(flow=FlowParams(enabled=True), gnss=GnssParams(enabled=False)))
    flown = fly(lpe, scenario, true_attitude=False, local=True).after(20.0)
    aloft = flown.time < 40.0
    assert np.sqrt(np.mean(flown.angle[aloft] ** 2)) < 3.5
    assert np.sqrt(np.mean(flown.velocity[aloft, HORIZONTAL] ** 2)) < 0.3
