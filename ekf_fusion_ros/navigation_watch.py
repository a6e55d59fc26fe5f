"""Navigation health beside a session: what it is told, and how often it looks."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ekf_fusion_ros.estimator import Estimator
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.health.navigation_health import NavigationHealth
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.roles import ARMED
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import LandedSample

if TYPE_CHECKING:
    from ekf_fusion_ros.params.tree import Params

PERIOD_US = 100_000


class NavigationWatch:
    """Steps NavigationHealth at the filter updates that cross tenths of a second.

    Arming is taken to be unknown without a role for it, and disarmed until that role speaks.
    """

    def __init__(self, params: Params, roles: Collection[str] | None, *, local: bool) -> None:
        """local: no fix takes part, so that there is no home."""
        self._health = NavigationHealth(
            params.health, params.ekf2.aiding.vehicle, params.ekf2.earth.projection)
        self._expects_home = not local
        self._landed: bool | None = None
        self._armed: bool | None = False if roles and ARMED in roles else None
        self._fix: GnssSample | None = None
        self.due_us = 0

    def note(self, sample: GnssSample | LandedSample | ArmedSample) -> None:
        """Take a sample that health goes by."""
        if isinstance(sample, GnssSample):
            self._fix = sample
        elif isinstance(sample, LandedSample):
            self._landed = sample.landed
        else:
            self._armed = sample.armed

    def step(self, now_us: int, estimator: Estimator) -> Sequence[Event]:
        """Judge the estimate; call at inertial times from `due_us` on. Returns what happened."""
        self.due_us = (now_us // PERIOD_US + 1) * PERIOD_US
        self._health.step(
            now_us, estimator, landed=self._landed, armed=self._armed, fix=self._fix)
        return self._health.drain_events()

    def restart(self) -> None:
        """Begin again with the estimator."""
        self.due_us = 0
        self._fix = None
        self._health.restart()

    @property
    def status(self) -> NavigationStatus:
        """The latest judgement."""
        return self._health.status

    def health(self, estimator: Health) -> Health:
        """Return the judgement in one sentence, with what the estimator itself waits for."""
        return self._health.health(
            expects_home=self._expects_home, detail=estimator.text if estimator.level else '')

    def set_home(self, point: GeoPoint | None) -> tuple[bool, Sequence[Event]]:
        """Set home by hand; None: here. Returns whether that was possible, and what happened."""
        return self._health.set_home(point), self._health.drain_events()
