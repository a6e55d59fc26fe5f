"""Mask 449: fixes, yaw of two antennas and odometry velocity, each lost and found in flight."""

from __future__ import annotations

from dataclasses import astuple
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.ekf2.flags import FLAG_NAMES
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.dual_antenna import DualAntennaGnss
from ekf_fusion_ros.simulation.ground_contact import GroundContact
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.vision import Vision

FLIGHT = Flight(duration=115.0, size=40.0, period=40.0, height=15.0, landing=15.0)
NO_YAW, NO_VISION, NO_FIX = (32.0, 45.0), (55.0, 67.0), (77.0, 92.0)
"""When each source is silent, s; it has ten seconds and more to settle before the next."""

EVERY = 25
SIGMAS = 4.0
"""Exceeded by chance one time in sixteen thousand; a flight is some hundred independent draws."""

HEADING = 1.0
"""Of the odometry frame, rad: far from that of the filter."""

SENSORS = {
    'imu': Imu(gyro_bias=(0.002, -0.001, 0.001), accel_bias=(0.03, -0.02, 0.05)),
    'fix': DualAntennaGnss(origin=ORIGIN, pos_noise=0.8, pos_correlated=0.0, vel_noise=0.2,
                           antenna_offset=0.5, outages=(NO_FIX,), heading_outages=(NO_YAW,)),
    'odometry': Vision(heading=HEADING, outages=(NO_VISION,)),
    'pressure': Barometer(reference=ORIGIN.alt, drift=0.0),
    'landed': GroundContact(),
}
PARAMS = Ekf2Params(
    gnss=GnssParams(yaw=True, delay_ms=0.0), mag=MagParams(type='none'),
    vision=VisionParams(use_velocity=True, rotate=True, delay_ms=0.0))


@dataclass(frozen=True)
class Flown:
    """A flight at 10 Hz: modes, resets, errors NED in m, m/s and rad, and 1-sigma as stated."""

    time: np.ndarray
    flags: list[set[str]]
    resets: list[dict[str, int]]
    dead_reckoning: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    tilt: np.ndarray
    yaw: np.ndarray
    odometry_heading: np.ndarray
    position_sigma: np.ndarray
    velocity_sigma: np.ndarray

    def at(self, time):
        """Return the flags, the reset counts and the index at a time in s."""
        k = int(np.searchsorted(self.time, time))
        return self.flags[k], self.resets[k], k

    def during(self, start, end):
        return (self.time >= start) & (self.time < end)


def fly(params=PARAMS, end=FLIGHT.duration, seen=lambda sample: sample):
    """Run the filter on samples as they are seen, from the moment that it knows its origin."""
    scenario = Scenario(trajectory=FLIGHT, sensors=SENSORS, seed=449)
    ekf, rows, count = Ekf2(params), [], 0
    for arrival in scenario.arrivals():
        ekf.push(seen(arrival.sample))
        if not isinstance(arrival.sample, ImuSample):
            continue
        ekf.update()
        count += 1
        time = 1e-6 * (arrival.time_us - scenario.start_us)
        if time > end:
            break
        state = ekf.nav_state() if count % EVERY == 0 else None
        if state is not None and state.origin is not None:
            rows.append((time, state, flags_of(ekf), ekf.reset_counts(),
                         yaw_321(ekf.filter.rot_ev)))
    return compared(scenario, *zip(*rows, strict=True))


def flags_of(ekf):
    return {name for name in FLAG_NAMES if getattr(ekf.filter.flags, name)}


def compared(scenario, time, states, flags, resets, odometry_heading):
    truth = scenario.trajectory.motion(np.array(time))
    rot = np.array([matrix_from_quat(state.quaternion) for state in states])
    down = np.einsum('ni,ni->n', rot[:, 2], truth.rotation[:, 2])
    yaw = np.arctan2(rot[:, 1, 0], rot[:, 0, 0]) - truth.yaw
    tangent = LocalTangent(ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    east, north, _ = tangent.to_enu(*astuple(states[-1].origin))
    # Height counts from the start: that is where the barometer was set to zero.
    start = np.array((north, east, 0.0))
    return Flown(
        np.array(time), flags, resets, np.array([state.dead_reckoning for state in states]),
        np.array([state.position for state in states]) + start - truth.position,
        np.array([state.velocity for state in states]) - truth.velocity,
        np.arccos(np.clip(down, -1.0, 1.0)), np.remainder(yaw + np.pi, 2 * np.pi) - np.pi,
        np.array(odometry_heading),
        np.sqrt([np.diag(state.pose_cov)[0:3] for state in states]),
        np.sqrt([np.diag(state.velocity_cov) for state in states]))


@pytest.fixture(scope='module')
def flown():
    return fly()


MODES = {'gps', 'gps_yaw', 'ev_vel'}
SETTLED = 15.0
"""Five seconds after the start of the fixes, s."""


@pytest.mark.parametrize(('time', 'modes'), [
    (20.0, MODES),
    # Fixes go on without their yaw: it is given up after 7 s, back with the second that has it.
    (38.5, MODES), (39.5, MODES - {'gps_yaw'}), (44.5, MODES - {'gps_yaw'}), (46.0, MODES),
    # Odometry is given up after 7 s too.
    (61.5, MODES), (62.5, MODES - {'ev_vel'}), (66.5, MODES - {'ev_vel'}), (68.0, MODES),
    # Fixes are given up after 1 s, as odometry carries on, and take their yaw with them.
    (77.5, MODES), (78.5, {'ev_vel'}), (91.5, {'ev_vel'}), (93.0, MODES),
    (114.0, MODES)])
def test_each_source_is_given_up_in_time_and_comes_back(flown, time, modes):
    flags, _, _ = flown.at(time)
    assert flags - {'in_air', 'vehicle_at_rest'} == modes | {'tilt_align', 'yaw_align', 'baro_hgt'}


@pytest.mark.parametrize(('before', 'after', 'jumps'), [
    (15.0, 45.0, {}),
    (45.0, 47.0, {'attitude': 1}),
    (47.0, 67.0, {}),
    (67.0, 68.0, {'velocity_ne': 1, 'velocity_d': 1}),
    (68.0, 92.0, {}),
    (92.0, 94.0, {'attitude': 1, 'velocity_ne': 1, 'velocity_d': 1, 'position_ne': 1}),
    (94.0, 114.0, {})])
def test_only_a_source_that_comes_back_resets_what_it_measures(flown, before, after, jumps):
    (_, old, _), (_, new, _) = flown.at(before), flown.at(after)
    assert {name: new[name] - old[name] for name in new if new[name] != old[name]} == jumps


def test_position_and_velocity_are_as_good_as_stated_in_every_phase(flown):
    late = flown.during(SETTLED, np.inf)
    for error, sigma in ((flown.position, flown.position_sigma),
                         (flown.velocity, flown.velocity_sigma)):
        assert (np.abs(error[late]) < SIGMAS * sigma[late]).all()


@pytest.mark.parametrize('silence', [NO_YAW, NO_VISION, NO_FIX])
def test_what_is_left_holds_attitude_velocity_and_position(flown, silence):
    silent = flown.during(*silence)
    # Of the accelerometers' 0.05 m/s^2 bias a third of a degree of tilt could remain.
    assert np.degrees(flown.tilt[silent]).max() < 0.5
    assert np.degrees(np.abs(flown.yaw[silent])).max() < 1.5
    assert np.abs(flown.velocity[silent]).max() < 0.4
    assert np.hypot(*flown.position[silent, 0:2].T).max() < 1.5
    assert not flown.dead_reckoning[silent].any()


def test_odometry_velocity_carries_the_position_without_fixes(flown):
    (_, _, first), (_, _, last) = (flown.at(time) for time in NO_FIX)
    drift = flown.position[last, 0:2] - flown.position[first, 0:2]
    way = np.linalg.norm(FLIGHT.motion(flown.time[first:last]).velocity, axis=1).sum() * 0.1
    # A degree of yaw across the way; the white noise of the velocity leaves 0.05 m.
    assert 50.0 < way < 150.0
    assert np.linalg.norm(drift) < np.radians(1.0) * way + 0.2


def test_heading_of_the_odometry_frame_is_known_throughout(flown):
    late = flown.during(SETTLED, np.inf)
    # Yaw jumps to one heading of the antennas, 1.1 degrees of noise; odometry adds 0.2.
    error = np.abs(flown.odometry_heading[late] - HEADING)
    assert np.degrees(error).max() < 3.0 * 1.2
    assert np.degrees(np.median(error)) < 1.2


def test_everything_is_finite(flown):
    for value in vars(flown).values():
        if isinstance(value, np.ndarray):
            assert np.isfinite(value).all()


def test_velocity_turned_by_the_attitude_first_makes_yaw_run_away():
    """PX4's way: the measurement turns with each correction of yaw, which so confirms itself."""
    turned_first = replace(PARAMS.vision, velocity_tells_attitude=False)
    flown = fly(replace(PARAMS, vision=turned_first), end=33.0)
    assert np.degrees(np.abs(flown.yaw[-1])) > 5.0


def in_odometry_frame(sample):
    if not isinstance(sample, VisionSample):
        return sample
    turn = matrix_from_quat(sample.quaternion)
    return sample._replace(
        velocity=turn @ sample.velocity, velocity_frame=VelocityFrame.LOCAL_FRD,
        velocity_cov=turn @ sample.velocity_cov @ turn.T)


def test_velocity_of_the_rotated_odometry_frame_is_that_of_the_body(flown):
    """Its frame hangs on the attitude just as the body does."""
    turned = fly(end=33.0, seen=in_odometry_frame)
    same = slice(len(turned.time))
    np.testing.assert_allclose(turned.yaw, flown.yaw[same], atol=1e-9)
    np.testing.assert_allclose(turned.velocity, flown.velocity[same], atol=1e-9)
