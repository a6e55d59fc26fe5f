"""GNSS position and velocity: checked at arrival, started after health, reset, stopped."""

from __future__ import annotations

from collections.abc import Callable
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.aid_sources.gnss_yaw import GnssYaw
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import GnssFix
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_position
from ekf_fusion_ros.ekf2.fusion import fuse_horizontal_velocity
from ekf_fusion_ros.ekf2.fusion import fuse_vertical_velocity
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.ekf2.yaw_recovery import YawRecovery
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

VERTICAL_NOISE_RATIO = 1.5
USABLE_ACCURACY = 1000.0
"""Accuracy in m below which a fix tells the field and the rate of the earth."""

DATA_TIMEOUT_US = 10 * SECOND
DATA_TIMEOUT_AIDED_US = 1 * SECOND
USUAL_INTERVAL_US = 200_000
SILENT_INTERVALS = 2.5
"""Usual intervals without a fix, or DATA_TIMEOUT_AIDED_US if that is longer, that are silence: a
receiver of 1 Hz is as regular as one of 5 Hz."""

INTERMITTENT_US = 1 * SECOND
NIS_SHARE = 0.4
"""Share of one fix in the mean of the normalised innovations: about four fixes count."""

NIS_PLAUSIBLE = 2.0
"""Mean over four fixes of three components that chance exceeds one time in fifty."""

NIS_DECAY = 0.97
"""Factor per fix by which raised accelerometer variance falls back."""


class Gnss:
    """Observes fixes behind the horizon; starts, continues, resets or stops their fusion."""

    def __init__(self, f: Filter, resets: Resets, checks: GnssChecks, recovery: YawRecovery,
                 capacity: int, align_to_course: Callable[[], bool]) -> None:
        """Act on a filter through its resets and the yaw recovery.

        align_to_course checks the yaw of a fixed wing after a time-out; True when done.
        """
        self._f = f
        self._resets = resets
        self._checks = checks
        self._recovery = recovery
        self._align_to_course = align_to_course
        self._yaw = GnssYaw(f, resets)
        self.buffer: SampleBuffer[GnssFix] = SampleBuffer(capacity)
        self.popped = False
        self._newest_before_pop_us = 0
        self.vision_yaw_forbidden = False
        self._previous_fix_us = 0
        self._interval_us = USUAL_INTERVAL_US
        self._velocity_nis = 1.0
        self._has_aided = False

    @property
    def wanted(self) -> bool:
        """True where the parameters ask for fixes at all."""
        params = self._f.params
        return params.gnss.enabled or params.height.reference == 'gnss'

    def push(self, sample: GnssSample, min_interval_us: int, initialised: bool) -> bool:
        """Check a fix at arrival and queue it; True when it set the origin."""
        f = self._f
        if not self.wanted or sample.fix_type < 3:
            self.buffer.passed_over['unwanted' if not self.wanted else 'no_3d_fix'] += 1
            return False
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return False
        self._checks.run(sample)
        places_origin = initialised and not f.earth.has_origin and self._checks.healthy
        origin_set = places_origin and math.isfinite(sample.alt)
        if origin_set:
            self._set_origin(sample)
        elif not f.earth.has_origin and sample.eph < USABLE_ACCURACY:
            known_before = f.earth.field is not None
            f.earth.look_around(sample.lat, sample.lon, sample.time_us)
            f.yaw_reset_requested |= not known_before and f.params.mag.type != 'none'
        delay_us = round(f.params.gnss.delay_ms * 1000) + FILTER_PERIOD_US // 2
        fix = GnssFix(sample.time_us - delay_us, np.zeros(2), sample.alt, sample.velocity,
                      sample.eph, sample.epv, sample.sacc, sample.has_velocity, sample.lat,
                      sample.lon, sample.yaw, sample.yaw_offset, self._levers(sample.antenna))
        self.buffer.push(fix.time_us, self._placed(fix))
        return origin_set

    def _levers(self, antenna: Antenna | None) -> Antenna | None:
        """Return the lever arms of an antenna that the sample places itself."""
        if antenna is None:
            return None
        return Antenna(*(place - self._f.params.imu.position for place in antenna))

    def _placed(self, fix: GnssFix) -> GnssFix:
        """Return a fix with its position in the local frame, which is zero without an origin."""
        projection = self._f.earth.projection
        if projection is None:
            return fix
        return fix._replace(position=np.array(projection.project(fix.lat, fix.lon)))

    def _set_origin(self, sample: GnssSample) -> None:
        """Tie the local frame to the earth so that a position already in use stays valid."""
        f = self._f
        altitude = sample.alt
        if f.flags.aided_horizontally():
            f.earth.set_origin_from(sample.lat, sample.lon, altitude, f.position)
        else:
            f.earth.set_origin(sample.lat, sample.lon, altitude + float(f.x[9]))
        if f.params.gnss.place_early_fixes:
            self.buffer.replace(self._placed)
        known_before = f.earth.field is not None
        f.earth.look_around(sample.lat, sample.lon, sample.time_us)
        if f.params.mag.type == 'none':
            self._recovery.request()
        elif not known_before:
            f.yaw_reset_requested = True
        f.events.add(f.t_now, EventKind.ORIGIN_SET,
                     f'{f.earth.origin_lat:.7f}, {f.earth.origin_lon:.7f}')

    def move_origin(self, origin: GeoPoint) -> bool:
        """Move the origin; position and waiting fixes keep their place on the earth."""
        f = self._f
        if not origin.on_earth:
            return False
        before = f.earth.projection
        altitude_before = f.earth.alt_ref
        place = None if before is None else before.reproject(float(f.x[7]), float(f.x[8]))
        f.earth.set_origin(origin.lat, origin.lon, origin.alt)
        f.earth.look_around(origin.lat, origin.lon, f.t_now)
        self.buffer.replace(self._placed)
        if f.fix is not None:
            f.fix = self._placed(f.fix)
        if place is None or f.earth.projection is None:
            return True
        self._resets.move_horizontally(np.array(f.earth.projection.project(*place)) - f.x[7:9])
        self._resets.move_vertically(origin.alt - altitude_before)
        return True

    @property
    def height_intermittent(self) -> bool:
        """True unless heights keep coming, by the buffer as the period found it."""
        fixes = self.buffer
        newest_us = self._newest_before_pop_us if self.popped else fixes.newest_time_us
        return (newest_us + INTERMITTENT_US <= self._f.t_now
                or fixes.newest is None or not math.isfinite(fixes.newest.altitude))

    def pop(self) -> None:
        """Take the fix at the horizon."""
        self._newest_before_pop_us = self.buffer.newest_time_us
        popped = self.buffer.pop_first_older_than(self._f.t_horizon)
        self.popped = popped is not None
        if popped is not None:
            if self._f.fix is not None:
                self._previous_fix_us = self._f.fix.time_us
                # An outage is no usual interval, a slower rate is one after a few fixes.
                self._interval_us = min(
                    popped[1].time_us - self._previous_fix_us, 2 * self._interval_us)
            self._f.fix = popped[1]

    def step(self) -> None:
        """Run once per filter period."""
        f = self._f
        if not self.popped:
            self._watch_silence()
            return
        assert f.fix is not None
        self._yaw.step(f.fix, self._checks.passing, self._checks.failing,
                       self.height_intermittent)
        if not f.flags.gps:
            self._recovery.align_without_gnss()
        self._start_or_stop()
        if f.flags.gps:
            self._recover_or_reset()
            self._remove_lever_arm()
            self._fuse()

    def _usual_silence_us(self) -> float:
        """Return the time without a fix that is nothing unusual for this receiver."""
        return SILENT_INTERVALS * self._interval_us if self._f.params.gnss.adapt_silence else 0.0

    def _watch_silence(self) -> None:
        f = self._f
        if not f.flags.gps or f.fix is None:
            return
        silence = f.t_horizon - f.fix.time_us
        if silence > DATA_TIMEOUT_US:
            self.stop(EventKind.GPS_DATA_STOPPED)
        elif silence > DATA_TIMEOUT_AIDED_US and silence > self._usual_silence_us() \
                and f.flags.aided_other_than(f.flags.gps):
            self.stop(EventKind.GPS_DATA_STOPPED_ALTERNATE)

    def _start_or_stop(self) -> None:
        f = self._f
        flags = f.flags
        ready = flags.tilt_align and f.earth.has_origin and self._checks.passing
        if f.params.gnss.enabled and not flags.gps and ready:
            if self._yaw_refers_to_north():
                self._start()
        elif flags.gps and (not f.params.gnss.enabled or not flags.yaw_align):
            self.stop(None)
        if flags.gps and self._checks.failing and flags.aided_other_than(flags.gps):
            self.stop(EventKind.GPS_QUALITY_POOR)
            if flags.ev_pos and not f.params.vision.rotate:
                self._resets.position_to_aiding()

    def _yaw_refers_to_north(self) -> bool:
        """True where yaw can be used with GNSS; otherwise ask for one that can."""
        f = self._f
        flags = f.flags
        has_compass = f.params.mag.type != 'none'
        if flags.yaw_align and not flags.ev_yaw and not (has_compass and f.yaw_reset_requested):
            return True
        self.vision_yaw_forbidden = True
        f.north_wanted_us = f.t_now
        if flags.ev_yaw:
            # yaw of the odometry frame: its heading against north is not known
            flags.ev_yaw = False
            if not has_compass:
                flags.yaw_align = False
                self._recovery.request()
        f.yaw_reset_requested |= has_compass
        return False

    def _start(self) -> None:
        f = self._f
        assert f.fix is not None
        f.events.add(f.t_now, EventKind.GPS_STARTED)
        if not self._continues(PN, f.fix.position, self._position_sigma(f.fix.hacc),
                               f.params.gnss.pos_gate):
            self._resets.position_to_fix()
        if not f.flags.opt_flow and f.fix.has_velocity:
            sigma = max(f.fix.sacc, f.params.gnss.vel_noise)
            if not self._continues(VN, f.fix.velocity, sigma, f.params.gnss.vel_gate):
                self._resets.velocity_to_fix()
        elif not f.flags.aided_horizontally():
            self._resets.velocity_to_unknown()
        f.flags.gps = self._has_aided = True
        if not self._flies_on_wings():
            # otherwise what follows a time-out is wanted too: a check of yaw by the course
            f.times.hor_pos = f.times.hor_vel = f.t_now

    def _flies_on_wings(self) -> bool:
        return self._f.flags.fixed_wing and self._f.flags.in_air

    def _continues(self, first: int, measured: Array, sigma: float, gate: float) -> bool:
        """True where the two states kept by dead reckoning since the last fix pass the gate."""
        f = self._f
        if f.params.gnss.reset_at_start or not self._has_aided:
            return False
        ratios = [
            test_ratio(float(f.x[first + k] - measured[k]),
                       f.cov.p[first + k, first + k] + sigma ** 2, gate) for k in range(2)]
        return max(ratios) <= 1.0

    def stop(self, reason: EventKind | None) -> None:
        """Stop fusing position, velocity and height."""
        f = self._f
        if reason is not None:
            f.events.add(f.t_now, reason)
        f.flags.gps = False
        f.flags.gps_hgt = False
        f.flags.gps_yaw = False
        self.vision_yaw_forbidden = False
        seen = f.observations
        for record in (seen.gps_hor_vel, seen.gps_ver_vel, seen.gps_hor_pos, seen.gps_height):
            record.clear(f.t_now)

    def _aiding_timed_out(self) -> bool:
        f = self._f
        times = f.times
        limit = round(f.params.aiding.reset_timeout * SECOND)
        newest = max(times.hor_pos, times.hor_vel, times.flow)
        return f.late(newest, limit) or f.late(times.hor_pos, 2 * limit)

    def _recover_or_reset(self) -> None:
        """Yaw from the EKF-GSF bank after a bad take-off, else position, velocity from the fix."""
        f = self._f
        timed_out = self._aiding_timed_out()
        if self._recovery.step(timed_out, self._previous_fix_us, self._checks.healthy):
            return
        if timed_out:
            f.events.add(f.t_now, EventKind.GPS_FUSION_TIMEOUT)
            if self._flies_on_wings():
                f.flags.mag_aligned_in_flight = self._align_to_course()
            self._resets.velocity_to_aiding(self._checks.healthy)
            self._resets.position_to_aiding()
            f.times.hor_pos = f.times.hor_vel = f.t_now

    def _remove_lever_arm(self) -> None:
        """Move the fix from the antenna to the IMU."""
        f = self._f
        assert f.fix is not None
        sacc = max(f.fix.sacc, f.params.gnss.vel_noise)
        lever, levers = f.gnss_lever, f.fix.antenna
        if levers is None and lever is None:
            f.fix = f.fix._replace(sacc=sacc)
            return
        if levers is None:
            assert lever is not None
            levers = Antenna(lever, lever, lever)
        arm, height_arm = f.rot @ levers.position, f.rot @ levers.height
        f.fix = f.fix._replace(
            position=f.fix.position - arm[0:2], altitude=f.fix.altitude + float(height_arm[2]),
            velocity=f.fix.velocity - f.rot @ cross(f.rate, levers.velocity), sacc=sacc)

    def _fuse(self) -> None:
        f = self._f
        fix, params = f.fix, f.params.gnss
        assert fix is not None
        velocity_innovation = (f.x[4:7] - fix.velocity).tolist()
        position_innovation = (f.x[7:9] - fix.position).tolist()
        if fix.has_velocity:
            noise = fix.sacc ** 2
            f.last_velocity = fix.velocity[0:2].tolist()
            f.last_velocity_variance = (noise, noise)
            fuse_horizontal_velocity(f, f.observations.gps_hor_vel, velocity_innovation[0:2],
                                     (noise, noise), params.vel_gate)
            fuse_vertical_velocity(f, f.observations.gps_ver_vel, velocity_innovation[2],
                                   noise * VERTICAL_NOISE_RATIO ** 2, params.vel_gate)
            self._adapt_accel_noise()
        stated = self._position_sigma(fix.hacc) ** 2
        noise = stated * self._repetition(fix.time_us)
        fuse_horizontal_position(f, f.observations.gps_hor_pos, position_innovation,
                                 (noise, noise), self._position_gate(stated, noise))

    def _position_gate(self, stated: float, noise: float) -> float:
        """Return the gate in sigmas of a fix that is fused with more noise than it states, in m^2.

        Correlated errors tell less than white ones but are no larger: an innovation has the
        variance that state and fix have by themselves.
        """
        f = self._f
        gate = f.params.gnss.pos_gate
        if noise == stated:
            return gate
        variance = 0.5 * (f.cov.p.item(7, 7) + f.cov.p.item(8, 8))
        return gate * math.sqrt((variance + stated) / (variance + noise))

    def _repetition(self, time_us: int) -> float:
        """Return how many fixes tell as much as one whose errors are independent.

        White noise of variance s^2 n at interval T has at low frequency the power of a first-order
        Markov process of variance s^2 and time constant tau where n = 2 tau / T.
        """
        f = self._f
        tau = f.params.gnss.correlation_time
        if not f.recent(f.observations.ev_hor_vel.last_fused_us, SECOND):
            # inertial data alone drift faster than the errors of fixes change
            return 1.0
        interval = max(time_us - self._previous_fix_us, 1) / SECOND
        return max(1.0, 2.0 * tau / interval)

    def _adapt_accel_noise(self) -> None:
        """Let the accelerometer noise follow the innovations of the velocity.

        Innovation-based adaptive estimation (R. K. Mehra, "Approaches to adaptive filtering",
        1972): in a consistent filter the normalised innovation squared is 1 in the mean. Much more
        of it over the last fixes tells that the inertial data are worse than stated (vibration,
        lag, stamps): the noise rises at once and falls back slowly.
        """
        f = self._f
        if not f.params.imu.adapt_accel_noise:
            return
        seen = f.observations
        squares = [
            i * i / v for record in (seen.gps_hor_vel, seen.gps_ver_vel)
            for i, v in zip(record.innovation, record.variance, strict=True)]
        self._velocity_nis += NIS_SHARE * (sum(squares) / len(squares) - self._velocity_nis)
        implausible = self._velocity_nis > NIS_PLAUSIBLE
        f.cov.scale_accel_noise(self._velocity_nis if implausible else NIS_DECAY)

    def _position_sigma(self, hacc: float) -> float:
        """Bound the claimed accuracy; a sole source may not be distrusted without limit."""
        f = self._f
        lower = max(f.params.gnss.pos_noise, 0.01)
        sigma = max(hacc, lower)
        if f.flags.aided_other_than(f.flags.gps):
            return sigma
        return min(sigma, max(f.params.aiding.pos_noaid_noise, lower))

