"""The take-off navigation test: does the estimate agree with its measurements once it moves?

A wrong yaw shows itself only in motion. A fixed wing recovers by its course, a multirotor flies
away; so the estimate of a multirotor that fails is not to be flown by (PX4's commander).
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterable
from enum import Enum

from ekf_fusion_ros.estimator import AidStatus

SECOND = 1_000_000
SUFFICIENT_TIME_US = 30 * SECOND
SUFFICIENT_SPEED = 5.0
FAILURE_TIME_US = 1 * SECOND
TAKEOFF_TESTED = ('multirotor',)
"""Kinds of vehicle that the test is for."""

# Observations of horizontal position and of velocity that the test goes by.
TESTED_AIDS = frozenset((
    'gnss_velocity', 'gnss_vertical_velocity', 'gnss_position', 'gnss', 'vision_velocity',
    'vision_vertical_velocity', 'vision_position', 'vision'))
FLOW = 'optical_flow'


class Verdict(Enum):
    """What the test has found out since the vehicle was last in standby."""

    OPEN = 'open'
    PASSED = 'passed'
    FAILED = 'failed'


class TakeoffTest:
    """Passes after 30 s of flight or at 5 m/s; fails once innovations fail for more than 1 s.

    Both can come in one step; then it has failed. Unlike PX4's, the second of failure begins in
    the air: on the ground nothing is tested, so that one bad sample at take-off is no failure.
    """

    def __init__(self) -> None:
        """Start open."""
        self.verdict = Verdict.OPEN
        self._takeoff_us: int | None = None
        self._last_pass_us = 0

    def step(
        self, now_us: int, speed: float, innovations_pass: Callable[[], bool], *, standby: bool,
        landed: bool,
    ) -> bool:
        """Return whether the verdict has changed.

        speed: horizontal, m/s. `innovations_pass` is asked only where it counts. Standby is
        disarmed: there the verdict is forgotten.
        """
        before = self.verdict
        if standby or landed or self._takeoff_us is None:
            self._takeoff_us = self._last_pass_us = now_us
        if standby:
            self.verdict = Verdict.OPEN
        elif not landed and before is Verdict.OPEN:
            self._judge(now_us, speed, innovations_pass())
        return self.verdict is not before

    def forget_time(self) -> None:
        """Keep the verdict through a jump of the stamps; an open test begins again."""
        self._takeoff_us = None

    def _judge(self, now_us: int, speed: float, innovations_pass: bool) -> None:
        assert self._takeoff_us is not None
        sufficient_time = now_us - self._takeoff_us > SUFFICIENT_TIME_US
        sufficient_speed = speed > SUFFICIENT_SPEED
        if sufficient_time or sufficient_speed:
            self.verdict = Verdict.PASSED
        if innovations_pass:
            self._last_pass_us = now_us
        if now_us - self._last_pass_us > FAILURE_TIME_US:
            self.verdict = Verdict.FAILED


def innovations_pass(aids: Iterable[AidStatus]) -> bool:
    """Return whether the test ratios of position and velocity in use are all below 1.

    Optical flow counts where nothing else in use does. Without any there is nothing to fail.
    """
    active = [aid for aid in aids if aid.active]
    tested = [aid for aid in active if aid.name in TESTED_AIDS] or [
        aid for aid in active if aid.name == FLOW]
    return all(aid.test_ratio < 1.0 for aid in tested)
