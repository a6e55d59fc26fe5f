"""Navigation health: what the estimate is good for, by the rules of PX4's commander.

It looks at an estimator and never changes it.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import Estimator
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.health.home import Accuracy
from ekf_fusion_ros.health.home import HomePosition
from ekf_fusion_ros.health.home import Shortfall
from ekf_fusion_ros.health.home import Situation
from ekf_fusion_ros.health.status import FLAGS
from ekf_fusion_ros.health.status import UNITS
from ekf_fusion_ros.health.status import UNKNOWN
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.health.status import navigation_report
from ekf_fusion_ros.health.status import place
from ekf_fusion_ros.health.takeoff_test import TAKEOFF_TESTED
from ekf_fusion_ros.health.takeoff_test import TakeoffTest
from ekf_fusion_ros.health.takeoff_test import Verdict
from ekf_fusion_ros.health.takeoff_test import innovations_pass
from ekf_fusion_ros.health.validity import ValidityFlag
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.samples import GnssSample

SECOND = 1_000_000


class NavigationHealth:
    """Steps the three validity flags, the take-off test and home on the stamps of the estimate."""

    def __init__(self, params: HealthParams, vehicle: str, projection: str) -> None:
        """`vehicle` is one of ekf2.aiding.vehicle, `projection` the one of the estimator."""
        self._params = params
        self._tested = params.takeoff_test and vehicle in TAKEOFF_TESTED
        self._flags = {name: ValidityFlag(_limit(params, name), params) for name in FLAGS}
        self._test = TakeoffTest()
        self._home = HomePosition(params, projection)
        self._timeout_us = round(params.timeout * SECOND)
        self._events: list[Event] = []
        self.status = NavigationStatus()
        self._situation: Situation | None = None
        self._last_us: int | None = None
        self._waiting_us: int | None = None
        self._global_us: int | None = None
        self._was_landed = True
        self._was_armed: bool | None = None

    def step(
        self, now_us: int, estimator: Estimator, *, landed: bool | None = None,
        armed: bool | None = None, fix: GnssSample | None = None,
    ) -> NavigationStatus:
        """Judge the estimate at inertial time now_us.

        landed: what is told, None where the estimator infers it. armed: what is told, None where
        nobody tells. fix: the newest one, to say why there is no position.
        """
        nav = estimator.nav_state()
        if nav is None:
            for flag in self._flags.values():
                flag.step(now_us, math.nan, available=False, landed=True)
            self._last_us = now_us
            if self._waiting_us is None:
                self._waiting_us = now_us
            return self._report(now_us, None)
        on_ground = (not nav.in_air) if landed is None else landed
        aids = estimator.aid_statuses
        accuracy = accuracy_of(nav, aids() if nav.dead_reckoning else ())
        took_off = self._was_landed and not on_ground
        # Motion alone is no take-off: a robot drives off again and again.
        told_so = armed is True or (armed is None and landed is not None)
        if took_off and told_so:
            for flag in self._flags.values():
                flag.take_off()
        self._step_test(now_us, nav, estimator, on_ground, armed)
        self._step_flags(now_us, nav, accuracy, on_ground)
        self._situation = Situation(
            nav, accuracy, nav.origin is not None and self._flags['global position'].valid,
            self._flags['local position'].valid, on_ground, took_off, armed,
            bool(armed) and not self._was_armed, fix)
        self._step_home(now_us, self._situation)
        self._was_landed, self._was_armed, self._last_us = on_ground, armed, now_us
        return self._report(now_us, self._situation)

    def _step_test(
        self, now_us: int, nav: NavState, estimator: Estimator, landed: bool, armed: bool | None,
    ) -> None:
        if not self._tested:
            return
        # Without an `armed` input the ground is where a test is forgotten.
        standby = landed if armed is None else not armed
        changed = self._test.step(
            now_us, math.hypot(float(nav.velocity[0]), float(nav.velocity[1])),
            lambda: innovations_pass(estimator.aid_statuses()), standby=standby, landed=landed)
        if changed and self._test.verdict is Verdict.PASSED:
            self._tell(now_us, 'take-off navigation test passed')
        elif changed and self._test.verdict is Verdict.FAILED:
            self._tell(now_us, 'navigation failed after take-off: innovations failed for 1 s; '
                       'position and velocity are not valid until the vehicle is disarmed')

    def _step_flags(
        self, now_us: int, nav: NavState, accuracy: Accuracy, landed: bool,
    ) -> None:
        fresh = self._last_us is None or now_us - self._last_us <= self._timeout_us
        on_earth = nav.origin is not None and nav.gnss_started and nav.yaw_aligned
        if nav.global_position_valid and on_earth:
            self._global_us = now_us
        global_known = self._global_us is not None \
            and now_us - self._global_us <= self._timeout_us
        local_known = nav.local_position_valid
        for (name, flag), value, known in zip(
                self._flags.items(), (accuracy.eph, accuracy.eph, accuracy.evh),
                (global_known, local_known, local_known), strict=True):
            limit = flag.limit
            if self._test.verdict is Verdict.FAILED:
                changed = flag.withdraw(now_us)
            else:
                changed = flag.step(now_us, value, available=known and fresh, landed=landed)
            if changed:
                self._tell(now_us, self._transition(name, flag, limit, known and fresh))

    def _transition(self, name: str, flag: ValidityFlag, limit: float, known: bool) -> str:
        if flag.valid:
            return f'{name} valid'
        if self._test.verdict is Verdict.FAILED:
            return f'{name} no longer valid: the take-off navigation test has failed'
        if not known:
            return f'{name} no longer valid: the estimator does not know it'
        unit = UNITS[name]
        return (f'{name} no longer valid: accuracy {flag.accuracy:.1f} {unit}, limit '
                f'{limit:.1f} {unit}')

    def _step_home(self, now_us: int, situation: Situation) -> None:
        again = self._home.home is not None
        if self._home.step(situation) and self._home.home is not None:
            self._tell(now_us, f'home set{" again" if again else ""}: {place(self._home.home)}')
        if situation.just_armed and not self._is_ready():
            self._tell(now_us, 'armed though health.arm_without_gps is off: '
                       + (NavigationStatus(now_us, missing=self._home.missing).home_text
                          if self._home.home is None else 'global position not valid'))

    def _is_ready(self) -> bool:
        if self._params.arm_without_gps:
            return True
        return self._flags['global position'].valid and self._home.home is not None

    def _report(self, now_us: int, situation: Situation | None) -> NavigationStatus:
        global_position, local_position, velocity = (
            self._flags[name].valid for name in FLAGS)
        missing = self._home.missing
        if situation is None:
            missing = (Shortfall(
                'estimate', 'the estimator has not started', self._waiting_us or now_us),)
        self.status = NavigationStatus(
            now_us, global_position, local_position, velocity, self._test.verdict,
            self._home.home, missing, self._is_ready(),
            UNKNOWN if situation is None else situation.accuracy)
        return self.status

    def set_home(self, point: GeoPoint | None) -> bool:
        """Set home by hand (deg, m); None takes the present place and follows the rules again.

        False where the point is unusable, or the present place not known well enough.
        """
        situation = self._situation
        if point is not None:
            done = self._home.set_by_hand(
                self.status.time_us, point, None if situation is None else situation.nav)
        else:
            done = situation is not None and self._home.set_here(situation)
        if done and self._home.home is not None:
            self._report(self.status.time_us, situation)
            self._tell(self.status.time_us, self.status.home_text)
        return done

    def health(self, *, expects_home: bool, detail: str = '') -> Health:
        """Say in one sentence what navigation lacks; `detail` is what the estimator waits for."""
        return navigation_report(
            self.status, self._flags, expects_home=expects_home, detail=detail)

    def restart(self) -> None:
        """Forget the estimate, as the estimator does; home stays where it is."""
        for name in FLAGS:
            self._flags[name] = ValidityFlag(_limit(self._params, name), self._params)
        self._home.forget_time()
        self._test.forget_time()
        self._waiting_us = None
        self._situation = self._last_us = self._global_us = None

    def drain_events(self) -> Sequence[Event]:
        """Return and forget the events since the last call."""
        events, self._events = self._events, []
        return events

    def _tell(self, time_us: int, text: str) -> None:
        self._events.append(Event(time_us, text))


def accuracy_of(nav: NavState, aids: Sequence[AidStatus] = ()) -> Accuracy:
    """Return the accuracy of a state, in dead reckoning no better than the last innovations.

    Rejected measurements tell more of an error than a covariance that has never seen them (PX4's
    ECL, get_ekf_lpos_accuracy). `aids` need not be given otherwise.
    """
    position, velocity = nav.pose_cov.diagonal().tolist(), nav.velocity_cov.diagonal().tolist()
    eph = math.sqrt(max(position[0] + position[1], 0.0))
    evh = math.sqrt(max(velocity[0] + velocity[1], 0.0))
    for aid in aids:
        if aid.active and aid.name in ('gnss_position', 'vision_position'):
            eph = max(eph, math.hypot(*aid.innovation))
        elif aid.active and aid.name in ('gnss_velocity', 'vision_velocity'):
            evh = max(evh, math.hypot(*aid.innovation))
    return Accuracy(eph, math.sqrt(max(position[2], 0.0)), evh)


def _limit(params: HealthParams, name: str) -> float:
    return params.velocity_evh if name == 'local velocity' else params.position_eph

