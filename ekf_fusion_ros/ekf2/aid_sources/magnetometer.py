"""Magnetometer: heading on the ground and in steady flight, all three axes when observable."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.aid_sources.magnetic_course import CourseAlignment
from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import declination
from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import fuse_declination
from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import fuse_three_axes
from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import start_field_from
from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import synthetic_z
from ekf_fusion_ros.ekf2.averaging import SampleAverage
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.heading import PSEUDO_YAW_NOISE
from ekf_fusion_ros.ekf2.heading import HeadingFusion
from ekf_fusion_ros.ekf2.heading import mag_yaw
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.terrain import Terrain
from ekf_fusion_ros.ekf2.yaw_recovery import YawRecovery
from ekf_fusion_ros.kernels.compile import machine_code
from ekf_fusion_ros.kernels.magnetic import low_pass
from ekf_fusion_ros.samples import MagSample

Array = NDArray[np.float64]

ANOMALY_HEIGHT = 1.5
"""Height in m above ground below which steel in the ground may bend the field."""

OBSERVABLE_MEMORY_US = 2 * SECOND
FIELD_SETTLING_US = 5 * SECOND
INHIBITED_TOO_LONG_US = 5 * SECOND
STRENGTH_ON_EARTH = 0.45
STRENGTH_RANGE = 0.40
"""Middle and half width in Gauss of what is found on the earth."""

DECLINATION_SIGMA = 0.5
DECLINATION_SIGMA_AT_START = 0.02
"""Sigma in rad of the declination, and of the first one after the field is started."""

LPF_SHARE = 0.1


class Magnetometer:
    """Observes, selects heading or 3-axis fusion, realigns yaw above the ground, fuses."""

    def __init__(self, f: Filter, resets: Resets, heading: HeadingFusion, terrain: Terrain,
                 recovery: YawRecovery, capacity: int) -> None:
        """Act on a filter through its resets and heading fusion."""
        self._f = f
        self._resets = resets
        self._heading = heading
        self._terrain = terrain
        self._course = CourseAlignment(f, resets, recovery.contradicted)
        self.average = SampleAverage(np.zeros(3))
        self.buffer: SampleBuffer[Array] = SampleBuffer(capacity)
        self.lpf = np.zeros(3)
        self._low_pass = machine_code(low_pass)
        self.count = 0
        self.popped = False
        self._delay_us = round(f.params.mag.delay_ms * 1000)
        self.field = np.zeros(3)
        self.aligned_us = 0
        self.inhibit_reset_request = False
        self._declination_done = False
        self._yaw_observable = False
        self._bias_observable = False
        self._yaw_started_us = 0
        self._suitable_us = 0
        self._not_inhibited_us = 0
        self._inhibited = False
        self._other_yaw_before = False

    @property
    def usable(self) -> bool:
        """True where the parameters allow the magnetometer to set the heading at start."""
        return self._f.params.mag.type in ('auto', 'heading', 'three_axis', 'vtol')

    @property
    def _only_learns_field(self) -> bool:
        """True where motors of forward flight may disturb it: only field states are corrected."""
        return self._f.params.mag.type == 'vtol' and self._f.flags.fuse_aspd

    def push(self, sample: MagSample, min_interval_us: int) -> None:
        """Average a raw sample in, and queue the mean when the interval has passed."""
        mean = self.average.add(sample.time_us, sample.field, min_interval_us, self._delay_us)
        if mean is not None:
            self.buffer.push(*mean)

    def pop(self) -> None:
        """Take the sample at the horizon into `field` and its low-pass."""
        popped = self.buffer.pop_first_older_than(self._f.t_horizon)
        self.popped = popped is not None
        if popped is None:
            return
        measured = popped[1]
        if self.count:
            self._low_pass(self.lpf, measured, LPF_SHARE)
        else:
            self.lpf = measured.copy()
        self.count += 1
        self.field = measured
        if self._f.params.mag.synthesize_z:
            self._replace_z(measured)

    def _replace_z(self, measured: Array) -> None:
        z = synthetic_z(self._f, measured)
        self._f.flags.synthetic_mag_z = z is not None
        if z is not None:
            self.field = np.array((measured[0], measured[1], z))

    def step(self, checks: GnssChecks) -> None:
        """Run once per filter period."""
        f = self._f
        flags = f.flags
        if f.params.mag.check_strength or f.params.mag.check_inclination:
            flags.mag_disturbed = self._field_implausible()
        if not flags.in_air:
            flags.mag_aligned_in_flight = False
            self._course.land()
        no_other_yaw = not flags.ev_yaw and not flags.gps_yaw
        if f.params.mag.type == 'none' or flags.mag_fault or not flags.tilt_align:
            self.stop()
            if no_other_yaw and self._yaw_needs_holding():
                self._heading.hold(None, PSEUDO_YAW_NOISE)
            return
        other_yaw_ended = no_other_yaw and self._other_yaw_before
        self._other_yaw_before = not no_other_yaw
        if other_yaw_ended or not flags.yaw_align or self.inhibit_reset_request:
            f.yaw_reset_requested = True
        if not no_other_yaw or not self.popped:
            return
        self._select()
        self._realign_yaw_if_requested()
        if flags.in_air and self._course.must_reset:
            self._course.must_reset = False
            self._resets.velocity_to_aiding(checks.healthy)
            self._resets.position_to_aiding()
        if flags.yaw_align:
            self._fuse()

    def _yaw_needs_holding(self) -> bool:
        """True where only a pseudo measurement keeps yaw bounded, or the parameters ask for it."""
        flags, when = self._f.flags, self._f.params.aiding.hold_yaw
        motion_tells_yaw = flags.gps and flags.in_air
        unaided = when == 'unaided' and not motion_tells_yaw
        return when == 'always' or unaided or not flags.yaw_align

    def _field_implausible(self) -> bool:
        """Compare the newest field with the model, or with what is found on earth without one."""
        mag = self._f.params.mag
        return ((mag.check_strength and self._strength_implausible())
                or (mag.check_inclination and self._inclination_implausible()))

    def _strength_implausible(self) -> bool:
        strength = float(np.linalg.norm(self.field))
        field = self._f.earth.field
        if self._f.earth.has_origin and field is not None:
            return abs(strength - field.strength) > self._f.params.mag.strength_tolerance
        return abs(strength - STRENGTH_ON_EARTH) > STRENGTH_RANGE

    def _inclination_implausible(self) -> bool:
        field = self._f.earth.field
        if field is None or not self.count:
            return False
        north, east, down = (self._f.rot @ self.field).tolist()
        inclination = math.atan2(down, math.hypot(north, east))
        tolerance = math.radians(self._f.params.mag.inclination_tolerance)
        return abs(inclination - field.inclination) > tolerance

    def stop(self) -> None:
        """Stop heading and 3-axis fusion."""
        self._use_three_axes(False)
        self._f.flags.mag_hdg = False
        self._declination_done = False

    def _use_three_axes(self, use: bool) -> None:
        if use:
            self._f.flags.mag_hdg = False
        if self._f.flags.mag_3d != use:
            self._f.flags.mag_3d = use
            self._f.cov.activate_mag(use)

    def _select(self) -> None:
        kind = self._f.params.mag.type
        three_axes = kind == 'three_axis'
        if kind in ('auto', 'vtol'):
            # a heading would correct the attitude
            three_axes = self._field_is_observable() or self._only_learns_field
        self._use_three_axes(three_axes)
        self._f.flags.mag_hdg = not three_axes

    def _field_is_observable(self) -> bool:
        """Judge yaw and body-field observability; call once per sample."""
        f = self._f
        gate = f.params.mag.acceleration_gate
        needed = gate if self._yaw_observable else 2.0 * gate
        acceleration = math.hypot(f.accel_lpf.item(0), f.accel_lpf.item(1))
        self._yaw_observable = acceleration > needed and (f.flags.gps or f.flags.ev_pos)
        turned, turn_rate = f.output.yaw.tolist()
        rate_gate = f.params.mag.yaw_rate_gate
        if not self._bias_observable:
            self._bias_observable = abs(turn_rate) > rate_gate
        else:
            elapsed = 1e-6 * (f.t_horizon - self._yaw_started_us)
            self._bias_observable = abs(turned) > 0.5 * rate_gate * elapsed
        f.output.yaw[0] = 0.0
        self._yaw_started_us = f.t_horizon
        if self._yaw_observable or self._bias_observable:
            self._suitable_us = f.t_horizon
        recently_observable = f.t_horizon - self._suitable_us < OBSERVABLE_MEMORY_US
        return f.flags.mag_aligned_in_flight and recently_observable

    def _realign_yaw_if_requested(self) -> None:
        f = self._f
        if f.flags.in_air and not f.flags.mag_aligned_in_flight:
            clear_of_ground = self._terrain.ground_down() - f.x[9] > ANOMALY_HEIGHT
            f.yaw_reset_requested |= bool(clear_of_ground)
        if not f.yaw_reset_requested or self._inhibited or not self._align():
            return
        f.yaw_reset_requested = False
        f.flags.yaw_align = True
        if f.flags.in_air:
            f.flags.mag_aligned_in_flight = True
        if self.inhibit_reset_request:
            self.inhibit_reset_request = False
            bias_variance = (f.params.imu.switch_on_gyro_bias * FILTER_PERIOD) ** 2
            f.cov.set_variances(12, np.array((bias_variance,)))

    def _align(self) -> bool:
        if self._f.flags.in_air and self._f.flags.fixed_wing:
            return self.align_to_course()
        return not self._f.flags.mag_disturbed and self.reset_heading()

    def align_to_course(self) -> bool:
        """Check yaw of a fixed wing by the course of the fixes, or take it from the field."""
        fix = self._course.usable_fix()
        if fix is None:
            return self.reset_heading()
        if not self._course.align(fix, self.field):
            return False
        self._declination_done = False
        self.aligned_us = self._f.t_horizon
        return True

    def reset_heading(self, *, initial: bool = False) -> bool:
        """Set yaw and earth field from the filtered field; True when done or not needed."""
        f = self._f
        if self.aligned_us == f.t_horizon and not initial:
            return True
        if f.params.mag.type == 'indoor' and not self._fixes_wait_for_north():
            return True
        if f.params.mag.type == 'none':
            return False
        yaw = mag_yaw(f, self.lpf, declination(f))
        variance = 0.0 if initial else max(f.params.mag.heading_noise, 1e-2) ** 2
        self._resets.yaw(yaw, variance, shift_output=not initial)
        start_field_from(f, self.lpf)
        f.cov.reset_field(f.params.mag.noise ** 2)
        self._declination_done = False
        self.aligned_us = f.t_horizon
        return True

    def _fuse(self) -> None:
        f = self._f
        flags = f.flags
        flags.mag_dec = (flags.mag_3d and (not flags.gps or f.params.mag.declination_always)
                         and not self._only_learns_field)
        self._inhibited = self._is_indoors() or flags.mag_disturbed
        if not self._inhibited:
            self._not_inhibited_us = f.t_horizon
        if f.t_horizon - self._not_inhibited_us > INHIBITED_TOO_LONG_US:
            self.inhibit_reset_request = True
        if flags.mag_3d:
            self._fuse_three_axes()
        elif flags.mag_hdg:
            self._fuse_heading()

    def _is_indoors(self) -> bool:
        """Take a vehicle of that type to be indoors where nothing needs or tells north."""
        flags = self._f.flags
        aided = flags.gps or flags.ev_pos or flags.ev_vel
        unaided = self._f.params.mag.type == 'indoor' and not aided
        return unaided and not self._fixes_wait_for_north()

    def _fixes_wait_for_north(self) -> bool:
        """Return whether nothing but yaw keeps good fixes from aiding, and they alone would.

        The reference inhibits the field until they aid, which then never happens.
        """
        f = self._f
        aided = f.flags.gps or f.flags.ev_pos or f.flags.ev_vel
        return f.recent(f.north_wanted_us, SECOND) and not aided

    def _fuse_three_axes(self) -> None:
        f = self._f
        settled = f.t_horizon - self.aligned_us > FIELD_SETTLING_US
        all_states = settled and not self._only_learns_field
        if not self._declination_done:
            # the field direction is taken from the model first, so that yaw does not move
            fuse_declination(f, DECLINATION_SIGMA_AT_START)
            self._declination_done = True
            fuse_three_axes(f, self.field, all_states)
            return
        fuse_three_axes(f, self.field, all_states)
        if f.flags.mag_dec:
            fuse_declination(f, DECLINATION_SIGMA)

    def _fuse_heading(self) -> None:
        f = self._f
        noise = f.params.mag.heading_noise ** 2
        if not self._inhibited:
            self._heading.fuse_magnetic(self.field, declination(f), noise)
            return
        self._heading.predicted_yaw()
        self._heading.hold(mag_yaw(f, self.field - f.x[19:22], declination(f)), noise)
