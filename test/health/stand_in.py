"""An estimator that says what a test wants it to say."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field
import math

import numpy as np

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.health.navigation_health import NavigationHealth
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.samples import GnssSample

START_US = 1_000_000_000
ORIGIN = GeoPoint(47.0, 8.0, 400.0)


@dataclass
class StandIn:
    """An estimate (NED) whose accuracies are eph, epv, evh, and the vehicle around it.

    A step of the test lasts `step_us`; sentences that health tells gather in `told`.
    """

    params: HealthParams = field(default_factory=HealthParams)
    vehicle: str = 'multirotor'
    step_us: int = 100_000
    started: bool = True
    eph: float = 1.0
    epv: float = 2.0
    evh: float = 0.3
    north: float = 0.0
    east: float = 0.0
    down: float = 0.0
    speed: float = 0.0
    yaw: float = 0.5
    yaw_jump: float = 0.0
    origin: GeoPoint | None = ORIGIN
    global_valid: bool = True
    local_valid: bool = True
    dead_reckoning: bool = False
    ratio: float = 0.1
    innovation: float = 0.5
    in_air: bool = False
    landed: bool | None = None
    armed: bool | None = False
    fix: GnssSample | None = None

    def __post_init__(self) -> None:
        """Nothing has been judged yet."""
        self.now_us = START_US
        self.health = NavigationHealth(self.params, self.vehicle, 'wgs84')
        self.told: list[str] = []

    @property
    def status(self):
        """The latest judgement."""
        return self.health.status

    @property
    def home(self):
        """Home as it is now."""
        return self.health.status.home

    def hear(self, eph: float, epv: float = 2.0) -> None:
        """Let a fix come now."""
        self.fix = GnssSample(self.now_us, 47.0, 8.0, 400.0, eph, epv)

    def run(self, seconds: float, *, fixes_of: float | None = None) -> None:
        """Let time pass in steps; with fixes of an accuracy in m."""
        for _ in range(round(seconds * 1e6 / self.step_us)):
            self.now_us += self.step_us
            if fixes_of is not None:
                self.hear(fixes_of)
            self.health.step(
                self.now_us, self, landed=self.landed, armed=self.armed, fix=self.fix)
            self.told += [event.text for event in self.health.drain_events()]

    def once(self) -> None:
        """Take one step."""
        self.run(1e-6 * self.step_us)

    def nav_state(self) -> NavState | None:
        """Return the state that the attributes describe."""
        if not self.started:
            return None
        eph, epv, evh = 0.5 * self.eph ** 2, self.epv ** 2, 0.5 * self.evh ** 2
        return NavState(
            self.now_us,
            np.array((math.cos(0.5 * self.yaw), 0.0, 0.0, math.sin(0.5 * self.yaw))),
            np.array((self.speed, 0.0, 0.0)), np.array((self.north, self.east, self.down)),
            np.zeros(3), np.diag((eph, eph, epv, 0.0, 0.0, 0.0)), np.diag((evh, evh, 0.0)),
            np.zeros(3), np.zeros(3), self.origin, yaw_aligned=True,
            dead_reckoning=self.dead_reckoning, local_position_valid=self.local_valid,
            global_position_valid=self.global_valid, in_air=self.in_air, yaw_jump=self.yaw_jump)

    def passed_over(self):
        return {}

    def aid_statuses(self):
        """Return position and velocity of fixes with the ratio and the innovation."""
        return [
            AidStatus(name, True, self.now_us, (self.innovation, 0.0), (1.0, 1.0), self.ratio,
                      self.ratio > 1.0, 0, 0, 0, 0, 0, 0)
            for name in ('gnss_position', 'gnss_velocity')]
