"""Whether the sensors that the filter lives on come often enough, by their accepted stamps."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.roles import FIX
from ekf_fusion_ros.roles import IMU
from ekf_fusion_ros.roles import MAGNETIC_FIELD
from ekf_fusion_ros.roles import ODOMETRY
from ekf_fusion_ros.roles import PRESSURE
from ekf_fusion_ros.roles import RANGE

IMU_MINIMUM = 100
AIDING_MINIMUM = 5
"""Hz, as PX4 asks for; magnetometer and height."""

ROLE_OF_HEIGHT = {'baro': PRESSURE, 'gnss': FIX, 'range': RANGE, 'vision': ODOMETRY}

SECOND_US = 1_000_000
WINDOW_US = 5 * SECOND_US
SLOW_PERCENT = 95
RECOVERED_PERCENT = 99
"""Shares of the least rate: a sensor of just that rate may lose a message or have a slow clock."""


def minimum_rates(params: Ekf2Params, roles: frozenset[str]) -> dict[str, int]:
    """Return the least rate in Hz of each role in use that has one."""
    wanted = {MAGNETIC_FIELD: AIDING_MINIMUM, IMU: IMU_MINIMUM}
    height = ROLE_OF_HEIGHT[params.height.reference]
    # Two topics: odometry carries the height from fix to fix, however rare they are.
    if height != FIX or IMU in roles:
        wanted[height] = AIDING_MINIMUM
    return {role: rate for role, rate in wanted.items() if role in roles}


class SensorRates:
    """Measures each role over some seconds; says once that it is slow, until it has recovered."""

    def __init__(self, minima: Mapping[str, int]) -> None:
        """Watch these roles, given with their least rate in Hz; due_us: the next judgement."""
        self._watches = {role: _RateWatch(role, minimum) for role, minimum in minima.items()}
        self.due_us = 0

    @property
    def roles(self) -> Collection[str]:
        """Roles that are watched."""
        return self._watches.keys()

    def step(self, now_us: int, heard: Mapping[str, tuple[int, int]]) -> list[str]:
        """Return a sentence for each role that has become too slow by inertial time now_us.

        To be called when inertial time has reached `due_us`. heard: how many messages of each role
        have been accepted up to now, and the stamp of the newest, us.
        """
        self.due_us = now_us + SECOND_US
        return [watch.sentence() for role, watch in self._watches.items()
                if watch.judge(now_us, *heard[role])]

    def slow(self) -> list[str]:
        """Return a sentence for each role that is too slow."""
        return [watch.sentence() for watch in self._watches.values() if watch.slow]

    def values(self) -> dict[str, str]:
        """Return the rates in Hz that have been measured, for diagnostics."""
        return {f'rate.{role}': f'{watch.rate:.1f}' for role, watch in self._watches.items()
                if watch.rate is not None}


class _RateWatch:
    """Rate of one role from the last stamp of a window to that of the next."""

    def __init__(self, role: str, minimum: int) -> None:
        self._role = role
        self._minimum = minimum
        self._start_us: int | None = None
        self._heard_before = 0
        self.rate: float | None = None
        self.slow = False

    def judge(self, now_us: int, heard: int, newest_us: int) -> bool:
        """Close the window where it is full; True when the role has become too slow."""
        if self._start_us is None:
            self._start_us, self._heard_before = now_us, heard
        if now_us - self._start_us < WINDOW_US:
            return False
        count = heard - self._heard_before
        elapsed_us = max((newest_us if count else now_us) - self._start_us, 1)
        self.rate = count * SECOND_US / elapsed_us
        was_slow = self.slow
        percent = RECOVERED_PERCENT if was_slow else SLOW_PERCENT
        self.slow = 100 * count * SECOND_US < percent * self._minimum * elapsed_us
        if count:
            self._start_us, self._heard_before = newest_us, heard
        return self.slow and not was_slow

    def sentence(self) -> str:
        return (f'{self._role} comes at {self.rate or 0.0:.1f} Hz, less than the '
                f'{self._minimum} Hz that the filter needs')
