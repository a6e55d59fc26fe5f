"""FusionSession: messages in, fused states out; the one path of node, replay and library."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Collection
from collections.abc import Iterable
from collections.abc import Mapping
from collections.abc import Sequence
import math
from typing import TYPE_CHECKING
from typing import Any

from ekf_fusion_ros.airspeed_conditions import check_airspeed
from ekf_fusion_ros.completion import Completion
from ekf_fusion_ros.estimator import YAW_KNOWN_VARIANCE
from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import Estimator
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.fix_intake import FixIntake
from ekf_fusion_ros.fused_output import FusedOutput
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.holding import Holding
from ekf_fusion_ros.input_checks import InputChecks
from ekf_fusion_ros.inputs import ROLE_OF_SAMPLE
from ekf_fusion_ros.inputs import InertialInput
from ekf_fusion_ros.inputs import adopt_params
from ekf_fusion_ros.inputs import decoder_of
from ekf_fusion_ros.inputs import make_estimator
from ekf_fusion_ros.inputs import make_motion_heading
from ekf_fusion_ros.inputs import make_odometry_drift
from ekf_fusion_ros.inputs import rows_decoder_of
from ekf_fusion_ros.inputs import uses_fixes
from ekf_fusion_ros.map_origin import fixed_origin
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.navigation_watch import NavigationWatch
from ekf_fusion_ros.odometry_heading import OdometryHeading
from ekf_fusion_ros.receivers.bank import ReceiverStatus
from ekf_fusion_ros.roles import AIRSPEED
from ekf_fusion_ros.roles import ARMED
from ekf_fusion_ros.roles import AUX_VELOCITY
from ekf_fusion_ros.roles import FIX
from ekf_fusion_ros.roles import FIX_VELOCITY
from ekf_fusion_ros.roles import FIXES
from ekf_fusion_ros.roles import FLOW
from ekf_fusion_ros.roles import GPS_HEADING
from ekf_fusion_ros.roles import IMU
from ekf_fusion_ros.roles import LANDED
from ekf_fusion_ros.roles import MAGNETIC_FIELD
from ekf_fusion_ros.roles import ODOMETRY
from ekf_fusion_ros.roles import PARTS_OF_FIX
from ekf_fusion_ros.roles import WITHOUT_STAMP
from ekf_fusion_ros.roles import age_limit_us
from ekf_fusion_ros.roles import configure
from ekf_fusion_ros.sample_check import check_sample
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.sensor_rates import SensorRates
from ekf_fusion_ros.sensor_rates import minimum_rates
from ekf_fusion_ros.stamp_order import AidingOrder
from ekf_fusion_ros.stamp_order import InertialOrder
from ekf_fusion_ros.stamp_order import Step
from ekf_fusion_ros.stamp_order import check_advance
from ekf_fusion_ros.statistics import RoleStatistics
from ekf_fusion_ros.statistics import counted_together
from ekf_fusion_ros.statistics import note_milestones

if TYPE_CHECKING:
    from ekf_fusion_ros.params.tree import Params

SECOND_US = 1_000_000
NO_HEIGHT_EPV = 1e3
YAW_WITHOUT_ODOMETRY = frozenset((FIX_VELOCITY, GPS_HEADING, MAGNETIC_FIELD))
"""Roles that tell the yaw of the body by themselves."""
TELL_MOTION = frozenset((ODOMETRY, FIX, FLOW, AUX_VELOCITY, AIRSPEED))
NO_MOTION = ('no topic in use tells horizontal motion, so that the place of the start is held: '
             'add one of odometry, fix, flow')
NO_ALTITUDE = ('the fixes have no altitude: that of the origin is taken to be 0, and the vehicle '
               'to stay there as far as no other topic tells')


class FusionSession:
    """Drives one estimator from messages (`handle`) or samples (`push`).

    `roles` names the inputs in use; aiding is configured from them (roles.configure). With
    `roles=None` samples go straight into the estimator with the parameters as they are.
    `on_update` is called with the estimator after every filter update. Raises ValueError for
    roles that cannot be fused.
    """

    def __init__(
        self,
        params: Params,
        roles: Collection[str] | None = None,
        *,
        estimator: Estimator | None = None,
        on_update: Callable[[Estimator], None] | None = None,
    ) -> None:
        self.params = params if roles is None else configure(params, roles)
        self.roles = None if roles is None else frozenset(roles)
        self._estimator = make_estimator(self.params) if estimator is None else estimator
        self._on_update = on_update
        self._statistics = {role: RoleStatistics() for role in sorted(roles or ())}
        self._events: list[Event] = []
        self._make_decoders()
        self._inertial_role = IMU if roles is None or IMU in roles else ODOMETRY
        self._local = self._is_local()
        self._rate_mhz = round(1000 * self.params.session.output_rate)
        self._last_altitude: float | None = None
        self._altitude_assumed = False
        self.restarts = 0
        self.first_restart_us: int | None = None
        self._resets_before: Counter[str] = Counter()
        self._passed_over_before: dict[str, Counter[str]] = {}
        self._aids_before: list[AidStatus] = []
        self._home = fixed_origin(self.params.session)
        self._landed: LandedSample | None = None
        self.milestones: dict[str, int] = {}
        self._navigation = NavigationWatch(self.params, self.roles, local=self._local)
        self._forget()

    def _make_decoders(self) -> None:
        self._decoders = {role: decoder_of(role, self.params) for role in self._statistics}

    def adopt(self, params: Params) -> None:
        """Go on with other parameters, of which live ones and untried mountings may differ.

        As at the start the roles choose the aiding, and a value other than the default wins.
        """
        self.params = params if self.roles is None else configure(params, self.roles)
        self._make_decoders()
        adopt_params(self._estimator, self.params)

    def _is_local(self) -> bool:
        if self.roles is None:
            return not uses_fixes(self.params)
        return FIX not in self.roles

    def _forget(self) -> None:
        """Begin a track: at the start, after a reset, after a jump of the stamps."""
        session = self.params.session
        roles = self.roles or frozenset()
        self._now_us: int | None = None
        self._tick: int | None = None
        self._fixes: list[GnssSample] = []
        self._velocity_seen = False
        self._inertial_order = InertialOrder(
            round(SECOND_US * session.stamp_gap_max), round(SECOND_US * session.gap_notice))
        lead_us = round(SECOND_US * session.stamp_lead_max)
        self._aiding_order = {
            role: AidingOrder(lead_us, age_limit_us(self.params, role)) for role in roles}
        self._rates = SensorRates(minimum_rates(self.params.ekf2, frozenset(roles)))
        self._heading = OdometryHeading()
        self._checks = InputChecks(
            imu=IMU in roles, twist_frame=self.params.messages.odometry.twist_frame)
        self._holding = Holding(round(1000 * session.hold_ms))
        self._completion = Completion(self.params.messages)
        self._intake = FixIntake(
            self._statistics, roles, self.params, self._estimator.nav_state)
        self._inertial = InertialInput(self.params, self._inertial_role) if roles else None
        self._drift = make_odometry_drift(self.params)
        self._motion = make_motion_heading(self.params, roles, self._drift)

    def handle(self, role: str, message: Any) -> list[FusedOutput]:
        """Take one ROS message (of rosbags or rclpy) and return the outputs that are due.

        Never raises for a bad message: it is counted by reason. Raises KeyError for a role that
        the session was not made for.
        """
        return self.take(role, self.decode(role, message))

    def decode(self, role: str, message: Any) -> Any:
        """Return what a message says, for `take`: a stamped sample, or why it is refused.

        It neither changes the session nor hangs on its state, so messages may be decoded ahead.
        """
        try:
            return self._decoders[role](message)
        except Refused as refusal:
            return refusal

    def rows_decoder(self, role: str) -> Callable[[FlatRows], Sequence[Any]] | None:
        """Return what decodes many messages of a role as `decode` would, None without one.

        It gives None for each message that `decode` has to look at.
        """
        return rows_decoder_of(role, self.params)

    def take(self, role: str, decoded: Any) -> list[FusedOutput]:
        """Take what `decode` returned, or a Refused of the caller; return the outputs due."""
        statistics = self._statistics[role]
        statistics.received += 1
        if isinstance(decoded, Refused):
            self._count_refusal(role, decoded.reason, decoded.detail)
            return []
        try:
            self._judge(role, decoded)
        except Refused as refusal:
            self._count_refusal(role, refusal.reason, refusal.detail)
            return []
        return self._accept(role, decoded)

    def push(self, sample: Sample) -> list[FusedOutput]:
        """Take one sample and return the outputs that are due.

        With roles the sample passes the order checks of its role; without roles it goes straight
        into the estimator.
        """
        role = ROLE_OF_SAMPLE[type(sample)]
        statistics = self._statistics.setdefault(role, RoleStatistics())
        statistics.received += 1
        try:
            check_sample(sample)
            if self.roles is not None:
                self._judge_role(role)
                self._judge(role, sample)
            elif isinstance(sample, ImuSample):
                check_advance(sample.time_us, self._now_us)
        except Refused as refusal:
            self._count_refusal(role, refusal.reason, refusal.detail)
            return []
        if self.roles is not None:
            return self._accept(role, sample)
        statistics.accepted += 1
        return self._push_directly(sample)

    def refuse(self, role: str, reason: str, detail: str = '') -> None:
        """Count a message that the caller keeps from the session, by reason."""
        self._statistics[role].received += 1
        self._count_refusal(role, reason, detail)

    def finish(self) -> None:
        """Take in what is still held or waits for a partner; after this the counts are exact."""
        for role, sample in self._holding.flush():
            self._aid(role, sample)
        self._push_fixes(self._intake.flush())

    def _push_directly(self, sample: Sample) -> list[FusedOutput]:
        if isinstance(sample, ImuSample):
            output = self._advance(sample)
            return [] if output is None else [output]
        if isinstance(sample, VisionSample):
            self._heading.push(sample)
        if isinstance(sample, GnssSample):
            sample = self._with_height(sample)
            self._fixes.append(sample)
        if isinstance(sample, (GnssSample, LandedSample, ArmedSample)):
            self._navigation.note(sample)
        if not isinstance(sample, ArmedSample):
            self._estimator.push(sample)
        return []

    def _judge_role(self, role: str) -> None:
        if self.roles is None or role not in self.roles:
            raise Refused('role_not_in_use', f'the session was made without role {role}')

    def _judge(self, role: str, reading: Any) -> None:
        """Raise Refused for a reading that comes out of order or is worth nothing."""
        if role == self._inertial_role:
            before_us = self._inertial_order.last
            step = self._inertial_order.judge(reading.time_us)
            if before_us is not None and step is not Step.FORWARD:
                self._follow_step(role, step, reading.time_us, before_us)
            return
        if role not in WITHOUT_STAMP:
            self._aiding_order[role].judge(reading.time_us, self._inertial_order.last)
        if role == AIRSPEED:
            check_airspeed(reading, self.params.ekf2.aiding)

    def _follow_step(self, role: str, step: Step, time_us: int, before_us: int) -> None:
        gap = (time_us - before_us) / SECOND_US
        if step is Step.PAUSE:
            self._tell(time_us, f'no {role} message for {gap:.3f} s')
            return
        self._tell(time_us, f'the stamps of {role} jumped by {gap:+.3f} s: the estimator '
                   'starts again')
        self._restart()
        self._inertial_order.judge(time_us)

    def _accept(self, role: str, sample: Any) -> list[FusedOutput]:
        if role == self._inertial_role:
            return self._accept_inertial(role, sample)
        if role not in PARTS_OF_FIX:
            self._statistics[role].accepted += 1
        if role == LANDED:
            self._landed = sample
            self._navigation.note(sample)
            self._tell_landed()
            return []
        if role == ARMED:
            self._navigation.note(sample)
            return []
        if role in FIXES:
            sample = self._with_height(sample)
        holding = self._holding
        holding.push(role, sample)
        if (self._now_us or 0) >= holding.due_us:
            for due in holding.release(self._now_us):
                self._aid(*due)
        return []

    def _accept_inertial(self, role: str, reading: Any) -> list[FusedOutput]:
        time_us = reading.time_us
        self._statistics[role].accepted += 1
        if time_us >= self._rates.due_us:
            heard = {watched: self._heard(watched) for watched in self._rates.roles}
            for slow in self._rates.step(time_us, heard):
                self._tell(time_us, slow)
        return self._run(role, reading)

    def _heard(self, role: str) -> tuple[int, int]:
        """Return how many messages of a role were not refused, and the newest stamp."""
        statistics = self._statistics[role]
        order = self._inertial_order if role == self._inertial_role else self._aiding_order[role]
        return statistics.received - statistics.refused_total, order.last or 0

    def _with_height(self, fix: GnssSample) -> GnssSample:
        if math.isfinite(fix.alt):
            self._last_altitude = fix.alt
            return fix
        # A fix without height still places the vehicle; its height must carry little weight.
        self._altitude_assumed |= self._last_altitude is None
        return fix._replace(alt=self._last_altitude or 0.0, epv=NO_HEIGHT_EPV)

    def _aid(self, role: str, sample: Any) -> None:
        """Hand an aiding sample to the estimator and to what looks for yaw in motion."""
        if role in PARTS_OF_FIX:
            self._push_fixes(self._intake.push(role, sample))
        elif role in FIXES:
            self._completion.note_fix(sample)
            self._push_fixes(self._intake.push_fix(role, sample))
        elif role == ODOMETRY:
            self._push_odometry(sample)
        else:
            if role == MAGNETIC_FIELD:
                self._tell_each(sample.time_us, self._checks.note_field(sample))
            self._estimator.push(self._completion.sample(sample))

    def _tell_landed(self) -> None:
        """Tell of ground contact, which acts at once, or as soon as there is inertial time."""
        if self._landed is not None and self._now_us is not None:
            self._estimator.push(self._landed._replace(time_us=self._now_us))

    def _push_odometry(self, sample: VisionSample) -> None:
        self._heading.push(sample)
        jump = '' if self._inertial is None else self._inertial.jump()
        if jump:
            self._tell(sample.time_us, jump)
        self._tell_each(
            sample.time_us, self._checks.note_odometry(sample, jumped=bool(jump)))
        if self._motion is not None:
            self._motion.push_odometry(sample, jumped=bool(jump))
        self._estimator.push(sample if self._inertial is None else self._inertial.fused(sample))

    def _push_fixes(self, fixes: Sequence[GnssSample]) -> None:
        self._note(self._intake.drain_events())
        for fix in fixes:
            self._push_fix(fix)

    def _push_fix(self, fix: GnssSample) -> None:
        self._fixes.append(fix)
        self._velocity_seen |= fix.has_velocity
        self._navigation.note(fix)
        self._estimator.push(fix)
        if self._motion is None:
            return
        heading = self._motion.push_fix(fix, self._held_heading)
        if heading is not None:
            self._estimator.push(heading)
        drift = None if self._drift is None else self._drift.news(fix.time_us)
        if drift is not None:
            self._estimator.push(drift)

    def _held_heading(self) -> tuple[float, float] | None:
        alignment = self.alignment()
        return None if alignment is None else (-alignment[0], alignment[1])

    def _run(self, role: str, reading: Any) -> list[FusedOutput]:
        """Step through the increments that end with a message of the inertial role."""
        assert self._inertial is not None
        outputs: list[FusedOutput] = []
        increments = self._inertial.push(reading)
        if self._checks.watches_imu:
            self._tell_each(reading.time_us, self._checks.note_imu(increments))
        if role == ODOMETRY:
            self._push_odometry(reading)
        holding, intake = self._holding, self._intake
        for imu in increments:
            if imu.time_us >= holding.due_us:
                for due in holding.release(imu.time_us):
                    self._aid(*due)
            if intake.waiting:
                self._push_fixes(intake.advance(imu.time_us))
            output = self._advance(imu)
            if output is not None:
                outputs.append(output)
        return outputs

    def _advance(self, imu: ImuSample) -> FusedOutput | None:
        """Step the estimator by one increment and return the output that is due, if any."""
        time_us, estimator = imu.time_us, self._estimator
        first, self._now_us = self._now_us is None, time_us
        estimator.push(imu)
        if first:
            self._tell_landed()
        if not estimator.update():
            return None
        if self._on_update is not None:
            self._on_update(estimator)
        if time_us >= self._navigation.due_us:
            self._note(self._navigation.step(time_us, estimator))
        # Rows stand at filter updates, so those of any rate are a subset of all updates.
        tick = time_us * self._rate_mhz // 1_000_000_000
        if self._rate_mhz and tick == self._tick:
            return None
        self._tick = tick
        nav = estimator.nav_state()
        if nav is None:
            return None
        note_milestones(self.milestones, nav)
        if not self._local:
            nav = self._at_home(nav)
            if nav is None or not (nav.yaw_aligned and nav.gnss_started):
                return None
        fixes, self._fixes = tuple(self._fixes), []
        return FusedOutput(nav, self._local, fixes)

    def _at_home(self, nav: NavState) -> NavState | None:
        """Return the state about the first origin, which restarts keep; None without one."""
        if nav.origin is None:
            return None
        if self._home is None:
            self._home = nav.origin
        self._home = self._home.completed(nav.origin.alt)
        if nav.origin != self._home and self._estimator.set_origin(self._home):
            return self._estimator.nav_state()
        return nav

    def _restart(self) -> None:
        self.restarts += 1
        # The stamp before it: the one after may be of another clock.
        if self.first_restart_us is None:
            self.first_restart_us = self._now_us
        self.finish()
        self._collect()
        self._resets_before.update(self._estimator.reset_counts())
        self._passed_over_before = self._passed_over()
        self._aids_before = self.aid_statuses()
        self._estimator.reset()
        self._navigation.restart()
        self._forget()

    @property
    def estimator(self) -> Estimator:
        """The estimator that is driven."""
        return self._estimator

    @property
    def local(self) -> bool:
        """True where outputs are in the odometry's own frame because no fix takes part."""
        return self._local

    @property
    def origin(self) -> GeoPoint | None:
        """Origin of the map frame, None before it is set."""
        nav = self._estimator.nav_state()
        return None if nav is None else nav.origin

    def set_origin(self, origin: GeoPoint) -> bool:
        """Move the origin of the map frame; False where the point is unusable.

        The place of the vehicle on the earth stays. Before a fix has placed the vehicle on the
        earth the origin waits for it. An altitude of NaN is left open: the origin keeps the one
        that it has, or would have got.
        """
        if not origin.completed(0.0).on_earth:
            return False
        present = self._home or self.origin
        if present is not None:
            origin = origin.completed(present.alt)
        waits = not self._local and self.origin is None
        moved = waits or self._estimator.set_origin(origin)
        if moved:
            self._home = origin
        return moved

    def set_pose(self, pose: GivenPose) -> bool:
        """Jump to a pose of the map frame; False before there is a state and a map."""
        nav = self._estimator.nav_state()
        if nav is None or not (self._local or self._at_home(nav)):
            return False
        if not self._estimator.set_pose(pose):
            return False
        if self._motion is not None and 0.0 < pose.yaw_var < YAW_KNOWN_VARIANCE:
            self._motion.given(math.sqrt(pose.yaw_var))
        return True

    @property
    def navigation(self) -> NavigationStatus:
        """What the estimate is good for, and home; judged ten times a second of stamps."""
        return self._navigation.status

    def navigation_health(self) -> Health:
        """Say in one sentence what navigation lacks, home above all."""
        return self._navigation.health(self._estimator.health())

    def set_home(self, point: GeoPoint | None) -> bool:
        """Set home by hand, to stay; None: to where the vehicle is, by the rules from then on.

        False where the point is unusable, or the present place not known well enough.
        """
        done, events = self._navigation.set_home(point)
        self._note(events)
        return done

    def reset(self, *, keep_origin: bool = True) -> None:
        """Start again with the same parameters; counts and events go on.

        Without keep_origin the map gets a new origin: the fixed one where there is one, else that
        of the next good fix.
        """
        if not keep_origin:
            self._home = fixed_origin(self.params.session)
        self.announce('the estimator starts again on request, the origin of the map '
                      + ('stays' if keep_origin else 'is set anew'))
        self._restart()

    def announce(self, text: str) -> None:
        """Tell of something that was done to the session, as an event of now."""
        self._tell(self._now_us or 0, text)

    def alignment(self) -> tuple[float, float] | None:
        """Return heading of the odometry frame against ENU and its sigma in rad.

        None without odometry or fix, and before the yaw is aligned.
        """
        if self._local or not self._heading.known:
            return None
        nav = self._estimator.nav_state()
        if nav is None or not nav.yaw_aligned:
            return None
        return self._heading.estimate(nav)

    def statistics(self) -> Mapping[str, RoleStatistics]:
        """Return the counts by role; exact at any time but for `pending` ones."""
        for role, counts in self._passed_over().items():
            self._statistics[role].passed_over = counts
        return self._statistics

    def _passed_over(self) -> dict[str, Counter[str]]:
        """Return what the estimator had no use for, by role, over all restarts."""
        counts = {role: Counter(before) for role, before in self._passed_over_before.items()}
        for kind, now in self._estimator.passed_over().items():
            role = ROLE_OF_SAMPLE[kind]
            if now and role in self._statistics:
                counts[role] = counts.get(role, Counter()) + Counter(now)
        for role, passed_over in self._intake.passed_over().items():
            counts[role] = counts.get(role, Counter()) + passed_over
        return counts

    def aid_statuses(self) -> list[AidStatus]:
        """Return the record of each kind of observation, its counts over all restarts."""
        return counted_together(self._aids_before, self._estimator.aid_statuses())

    def resets(self) -> dict[str, int]:
        """Return how often each part of the state has jumped, and the session restarted."""
        now = Counter(self._estimator.reset_counts())
        names = [*now, *self._resets_before]
        counts = {name: now[name] + self._resets_before[name] for name in names}
        return {**counts, 'restarts': self.restarts}

    def drain_events(self) -> list[Event]:
        """Return and forget the events since the last call, in order of time."""
        self._collect()
        events, self._events = self._events, []
        return events

    def health(self) -> Health:
        """Say in one sentence what the session is doing or waiting for."""
        health = self._estimator.health()
        text, warnings = self._waiting_for() or health.text, self.warnings()
        fine = text == health.text and not warnings
        return Health(health.level if fine else max(health.level, HealthLevel.WARN),
                      '; '.join([text, *warnings]), {**health.values, **self._rates.values()})

    def warnings(self) -> list[str]:
        """Return what is wrong with the inputs, in sentences."""
        lack = self._heading.lack if self._inertial_role == ODOMETRY else ''
        blind = NO_MOTION if self._local and self.roles is not None \
            and not self.roles & TELL_MOTION else ''
        flat = NO_ALTITUDE if self._altitude_assumed and self._last_altitude is None else ''
        refused = [f'{role}: {counts.complaint}' for role, counts in self._statistics.items()
                   if counts.complaint]
        return [*refused, *self._rates.slow(), *self._checks.sentences(),
                *filter(None, (lack, blind, flat))]

    def receivers(self) -> Sequence[ReceiverStatus]:
        """Return what becomes of each of several receivers, nothing where there is one."""
        return self._intake.statuses()

    @property
    def inertial_role(self) -> str:
        """Role whose messages drive time."""
        return self._inertial_role

    @property
    def waiting_role(self) -> str:
        """First role of which nothing was accepted and without which nothing starts, or ''."""
        if self.roles is None:
            return ''
        if not self._statistics[self._inertial_role].accepted:
            return self._inertial_role
        fixes = [role for role in FIXES if role in self.roles and not self._local]
        arrived = any(self._statistics[role].accepted for role in fixes)
        return '' if arrived or not fixes else FIX

    def _waiting_for(self) -> str:
        role = self.waiting_role
        if role:
            return f'waiting for {role}: {self._statistics[role].summary()}'
        nav = self._estimator.nav_state()
        if nav is None or nav.yaw_aligned:
            return ''
        missing = self._missing_for_yaw()
        if missing or self._motion is None:
            return missing
        return str(self._motion.status().text)

    def _missing_for_yaw(self) -> str:
        """Say what to add where no topic in use ties the yaw of an IMU to anything."""
        roles = self.roles or frozenset()
        if IMU not in roles or self._local or self._velocity_seen or roles & YAW_WITHOUT_ODOMETRY:
            return ''
        add = f'add a topic of {", ".join(sorted(YAW_WITHOUT_ODOMETRY))}'
        if ODOMETRY not in roles:
            return f'the yaw cannot be aligned: the fixes have no velocity; {add} or odometry'
        if not self._heading.known or self._heading.has_attitude:
            return ''
        return ('the yaw cannot be aligned: the odometry has no orientation; '
                f'{add}, or leave the imu out')

    def _collect(self) -> None:
        self._events += self._estimator.drain_events()

    def _tell(self, time_us: int, text: str) -> None:
        self._note((Event(time_us, text),))

    def _tell_each(self, time_us: int, texts: Iterable[str]) -> None:
        for text in texts:
            self._tell(time_us, text)

    def _note(self, events: Sequence[Event]) -> None:
        if events:
            self._collect()
            self._events += events

    def _count_refusal(self, role: str, reason: str, detail: str) -> None:
        first = self._statistics[role].refuse(reason, detail)
        if first and detail:
            self._tell(self._now_us or 0, f'{role}: refused, {reason}: {detail}')
