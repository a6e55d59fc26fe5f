"""A flight with two receivers through a session, its errors, and what the receivers became."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace
from functools import cache
from functools import lru_cache
import math

import numpy as np

from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight

FLIGHT = Flight(duration=100.0, size=40.0, period=40.0, height=15.0, landing=10.0)
INPUTS = ('imu', 'magnetic_field', 'pressure')
Change = Callable[[float, GnssSample], GnssSample | None]


@dataclass(frozen=True, eq=False)
class Flown:
    """Outputs of a flight: time (N,) s from the start, position NED (N, 3) and its error."""

    time: np.ndarray
    position: np.ndarray
    error: np.ndarray
    fixes: list[GnssSample]
    events: list[str]
    session: FusionSession

    def rms(self, after: float) -> float:
        """Return the horizontal RMS error in m after a time in s."""
        error = self.error[self.time > after, 0:2]
        return float(np.sqrt((error ** 2).sum(axis=1).mean()))

    def blend_rms(self, after: float, delay: float) -> float:
        """Return the horizontal RMS error in m of the fixes that the estimator got."""
        start = FLOWN_FROM + 1e6 * (after + delay)
        fixes = [fix for fix in self.fixes if fix.time_us > start]
        error = np.array([place(fix) for fix in fixes]) - truth(
            np.array([1e-6 * (fix.time_us - FLOWN_FROM) - delay for fix in fixes]))
        return float(np.sqrt((error[:, 0:2] ** 2).sum(axis=1).mean()))


FLOWN_FROM = Scenario(trajectory=FLIGHT, sensors={}).start_us


def place(fix: GnssSample) -> tuple[float, float, float]:
    east, north, up = LocalTangent(ORIGIN.lat, ORIGIN.lon, ORIGIN.alt).to_enu(
        fix.lat, fix.lon, fix.alt)
    return north, east, -up


def truth(seconds: np.ndarray) -> np.ndarray:
    return FLIGHT.motion(seconds).position


def receiver(**changes: object) -> Gnss:
    """Return a receiver whose stamps are as late as the parameters have it."""
    return replace(Gnss(origin=ORIGIN, stamp_delay=0.11, latency=0.01), **changes)


@lru_cache(maxsize=16)
def _common(seed: int) -> list:
    """Return the arrivals of all but the receivers, which cost most of the time."""
    return list(Scenario(
        trajectory=FLIGHT, sensors=default_sensors(INPUTS), seed=seed).arrivals())


def fly(
    receivers: Mapping[str, Gnss], seed: int = 0, changes: Mapping[str, Change] | None = None,
    overrides: Mapping[str, object] | None = None, until: float = math.inf,
) -> Flown:
    """Fly with receivers by role; `changes` alter or drop (None) fixes by their time in s.

    What is flown without changes is flown once, and to the end: many a test compares with it.
    """
    if changes or overrides:
        return _fly(receivers, seed, changes, overrides, until)
    return _fly_once(tuple(receivers.items()), seed)


@cache
def _fly_once(receivers: tuple[tuple[str, Gnss], ...], seed: int) -> Flown:
    return _fly(dict(receivers), seed, None, None, math.inf)


def _fly(
    receivers: Mapping[str, Gnss], seed: int, changes: Mapping[str, Change] | None,
    overrides: Mapping[str, object] | None, until: float,
) -> Flown:
    session = FusionSession(
        with_overrides(Params(), overrides or {}), (*INPUTS, *receivers))
    arrivals = _common(seed) + list(Scenario(
        trajectory=FLIGHT, sensors=receivers, seed=seed).arrivals())
    arrivals.sort(key=lambda arrival: (arrival.time_us, arrival.role == 'imu'))
    outputs = []
    for arrival in arrivals:
        sample = arrival.sample
        if 1e-6 * (arrival.time_us - FLOWN_FROM) > until:
            break
        if changes and arrival.role in changes:
            sample = changes[arrival.role](1e-6 * (sample.time_us - FLOWN_FROM), sample)
        if sample is not None:
            outputs += session.take(arrival.role, sample)
    session.finish()
    return _flown(session, outputs)


def _flown(session: FusionSession, outputs: Sequence) -> Flown:
    navs = [output.nav for output in outputs]
    time = np.array([1e-6 * (nav.time_us - FLOWN_FROM) for nav in navs])
    tangent = LocalTangent(ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    origin = navs[0].origin
    east, north, up = tangent.to_enu(origin.lat, origin.lon, origin.alt)
    position = np.array([nav.position for nav in navs]) + np.array((north, east, -up))
    fixes = [fix for output in outputs for fix in output.fixes]
    return Flown(time, position, position - truth(time), fixes,
                 [event.text for event in session.drain_events()], session)


def moved(one: Flown, other: Flown, after: float = 0.0) -> float:
    """Return the largest horizontal distance in m between the outputs of two flights."""
    times = np.intersect1d(one.time, other.time)
    times = times[times > after]
    pair = [flown.position[np.searchsorted(flown.time, times), 0:2] for flown in (one, other)]
    return float(np.linalg.norm(pair[0] - pair[1], axis=1).max())
