"""Flights of LPE in the simulator, and samples one by one for its sensors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress

import numpy as np
import pytest

from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample

EVERY = 25


@dataclass(frozen=True)
class Flown:
    """Errors of a flight at 10 Hz: time (N,) s, NED position and velocity (N, 3), angle deg."""

    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray
    angle: np.ndarray
    states: tuple

    def after(self, start, end=np.inf):
        kept = (self.time >= start) & (self.time < end)
        return Flown(self.time[kept], self.position[kept], self.velocity[kept],
                     self.angle[kept], tuple(compress(self.states, kept)))

    def rms(self, axes=slice(0, 3)):
        return float(np.sqrt(np.mean(np.sum(self.position[:, axes] ** 2, axis=1))))


def orientations(scenario, arrivals):
    """Return the true attitude by the stamp of each inertial sample."""
    stamps = [a.time_us for a in arrivals if isinstance(a.sample, ImuSample)]
    motion = scenario.trajectory.motion(1e-6 * (np.array(stamps) - scenario.start_us))
    return dict(zip(stamps, motion.quaternion, strict=True))


def fly(estimator, scenario, *, true_attitude, change=lambda sample: sample, local=False):
    """Run an estimator over a scenario; `change` may spoil or drop (None) a sample."""
    arrivals = list(scenario.arrivals())
    truth = orientations(scenario, arrivals)
    takeoff_us = scenario.start_us + 1e6 * getattr(scenario.trajectory, 'takeoff', 0.0)
    estimator.push(LandedSample(scenario.start_us, landed=True))
    rows, count, landed = [], 0, True
    for arrival in arrivals:
        if landed and arrival.time_us > takeoff_us:
            landed = False
            estimator.push(LandedSample(arrival.time_us, landed=False))
        sample = arrival.sample
        if true_attitude and isinstance(sample, ImuSample):
            sample = sample._replace(orientation=truth[sample.time_us])
        sample = change(sample)
        if sample is not None:
            estimator.push(sample)
        if isinstance(sample, ImuSample):
            estimator.update()
            count += 1
            nav = estimator.nav_state() if count % EVERY == 0 else None
            if nav is not None and (local or nav.origin is not None):
                rows.append(nav)
    return errors(scenario, rows)


def errors(scenario, rows):
    time = np.array([nav.time_us - scenario.start_us for nav in rows]) * 1e-6
    truth = scenario.trajectory.motion(time)
    origins = np.array([origin_ned(scenario, nav.origin) for nav in rows])
    q = np.array([nav.quaternion for nav in rows])
    cosine = np.abs(np.sum(q * truth.quaternion, axis=1))
    return Flown(
        time, np.array([nav.position for nav in rows]) + origins - truth.position,
        np.array([nav.velocity for nav in rows]) - truth.velocity,
        np.degrees(2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))), tuple(rows))


def origin_ned(scenario, origin):
    if origin is None:
        return 0.0, 0.0, 0.0
    tangent = LocalTangent(scenario.origin.lat, scenario.origin.lon, scenario.origin.alt)
    east, north, up = tangent.to_enu(origin.lat, origin.lon, origin.alt)
    return north, east, -up


@pytest.fixture(scope='session', name='fly')
def the_flying():
    return fly
