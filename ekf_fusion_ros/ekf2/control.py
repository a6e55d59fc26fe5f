"""One filter period at the horizon: which samples have come, and every aid source in turn."""

from __future__ import annotations

import math

from ekf_fusion_ros.ekf2.aid_sources.airspeed import Airspeed
from ekf_fusion_ros.ekf2.aid_sources.auxiliary_velocity import AuxiliaryVelocity
from ekf_fusion_ros.ekf2.aid_sources.barometer import Barometer
from ekf_fusion_ros.ekf2.aid_sources.drag import Drag
from ekf_fusion_ros.ekf2.aid_sources.fake_position import FakePosition
from ekf_fusion_ros.ekf2.aid_sources.gnss import Gnss
from ekf_fusion_ros.ekf2.aid_sources.magnetometer import Magnetometer
from ekf_fusion_ros.ekf2.aid_sources.optical_flow import OpticalFlow
from ekf_fusion_ros.ekf2.aid_sources.range_finder import RangeFinder
from ekf_fusion_ros.ekf2.aid_sources.sideslip import Sideslip
from ekf_fusion_ros.ekf2.aid_sources.vision import Vision
from ekf_fusion_ros.ekf2.alignment import initialise_covariance
from ekf_fusion_ros.ekf2.covariance import rotation_vector_variances
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.given_pose import take_pose
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.heading import HeadingFusion
from ekf_fusion_ros.ekf2.height import Height
from ekf_fusion_ros.ekf2.height_health import HeightHealth
from ekf_fusion_ros.ekf2.height_source import HeightSource
from ekf_fusion_ros.ekf2.range_height import RangeHeight
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.terrain import Terrain
from ekf_fusion_ros.ekf2.validity import Validity
from ekf_fusion_ros.ekf2.wind import Wind
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.ekf2.yaw_recovery import YawRecovery
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose

TILT_ALIGNED_VARIANCE = math.radians(3.0) ** 2
AIRSPEED_RECENT_US = SECOND
BANK_ACCURACY = 1.2
"""Least accuracy in m/s that the yaw bank is told of a velocity: told less, it decides too early
and is off by several of its sigmas (docs/px4_differences.md)."""


class Control:
    """Owns the aid sources and steps them in their order."""

    def __init__(self, f: Filter, observation_length: int, imu_length: int) -> None:
        """Build the sources on a filter; lengths of the buffers of samples and of periods."""
        self._f = f
        self.resets = Resets(f)
        self.heading = HeadingFusion(f)
        self.terrain = Terrain(f)
        self.bank = YawEstimator()
        self.checks = GnssChecks(f)
        recovery = YawRecovery(f, self.resets, self.bank)
        self.mag = Magnetometer(f, self.resets, self.heading, self.terrain, recovery,
                                observation_length)
        self.baro = Barometer(f, observation_length)
        self.gnss = Gnss(f, self.resets, self.checks, recovery, observation_length,
                         self.mag.align_to_course)
        self.vision = Vision(f, self.resets, self.heading, observation_length)
        self.range = RangeFinder(f, observation_length)
        self.flow = OpticalFlow(f, self.resets, self.terrain, self.checks, imu_length)
        self.resets.flow_velocity = lambda: self.flow.velocity(self.range.cos_tilt)
        self.wind = Wind(f)
        self.airspeed = Airspeed(f, self.wind, observation_length)
        self.sideslip = Sideslip(f, self.wind)
        self.drag = Drag(f, self.wind, observation_length, imu_length)
        self.aux_velocity = AuxiliaryVelocity(f, observation_length)
        ranging = RangeHeight(f, self.range, self.terrain)
        self.height_source = HeightSource(
            f, self.resets, self.baro, self.gnss, self.vision, ranging)
        self._height_health = HeightHealth(
            f, self.height_source, self.baro, self.gnss, self.vision, ranging)
        self._height = Height(
            f, self.height_source, self.baro, self.gnss, self.checks, self.vision, ranging)
        self.fake_position = FakePosition(f, self.resets)
        self.validity = Validity(f)
        self._sampled = (self.gnss, self.mag, self.baro, self.vision)
        self._active_before: tuple[bool, ...] = ()

    def step(self) -> None:
        """Run every source once, then terrain."""
        f = self._f
        flags = f.flags
        f.gps_hgt_before, f.rng_hgt_before = flags.gps_hgt, flags.rng_hgt
        if not flags.tilt_align:
            self._check_tilt()
        yaw_was_aligned = flags.yaw_align
        self._take_samples()
        self._height_health.step()
        self.mag.step(self.checks)
        self.flow.step()
        self.gnss.step()
        if flags.wind or flags.fuse_aspd or flags.fuse_beta or f.airspeed_popped \
                or self.drag.enabled:
            self._step_air_data()
        self._height.step()
        self.vision.step(self.checks, self.gnss.vision_yaw_forbidden)
        self.aux_velocity.step()
        self.fake_position.step(self.checks)
        self.validity.step()
        if self.heading.covariance_lost or f.covariance_lost:
            self.heading.covariance_lost = f.covariance_lost = False
            initialise_covariance(f)
        if flags.yaw_align and not yaw_was_aligned:
            f.events.add(f.t_now, EventKind.YAW_ALIGNED)
        self.terrain.step(self.range, self.flow)
        self._note_activity()

    def _take_samples(self) -> None:
        """Take what the horizon has passed, after judging whether sensors still deliver."""
        self.baro.check_arrival()
        horizon_us = self._f.t_horizon
        for source in self._sampled:
            if source.buffer.next_us <= horizon_us:
                source.pop()
            else:
                source.popped = False
        self.range.pop()
        self.flow.pop()
        self.airspeed.pop()

    def _step_air_data(self) -> None:
        self.wind.step()
        self.airspeed.step()
        self.sideslip.step()
        self.drag.step(self.mag.inhibit_reset_request)

    def move_origin(self, origin: GeoPoint) -> bool:
        """Move the origin of the local frame; False where the point is unusable.

        Barometer and ground move with the frame, so that they do not pull the height back.
        """
        before, earth = float(self._f.x[PD]), self._f.earth
        had_origin, altitude_before = earth.has_origin, earth.alt_ref
        if not self.gnss.move_origin(origin):
            return False
        if not had_origin:
            self.height_source.refer_to(earth.alt_ref - altitude_before)
        self._shift_heights(float(self._f.x[PD]) - before)
        return True

    def set_pose(self, pose: GivenPose) -> None:
        """Jump to a pose; relative heights follow, an absolute one may contradict it."""
        before = float(self._f.x[PD])
        take_pose(self._f, self.resets, pose)
        if min(pose.position_var[0:2]) > 0.0:
            self.fake_position.note_position()
        self._shift_heights(float(self._f.x[PD]) - before)

    def _shift_heights(self, shift: float) -> None:
        """Let what refers to the vehicle's height follow a shift in m, positive down."""
        self.baro.offset += shift
        self._height.move(shift)
        self.terrain.move(shift)

    def _check_tilt(self) -> None:
        f = self._f
        variances = rotation_vector_variances(f.x[0:4], f.cov.p)
        if variances[0] + variances[1] < TILT_ALIGNED_VARIANCE:
            f.flags.tilt_align = True
            f.events.add(f.t_now, EventKind.TILT_ALIGNED)

    def bank_airspeed(self) -> float:
        """Return the last airspeed in m/s, what a fixed wing usually has where that is old."""
        f = self._f
        if f.flags.fixed_wing and f.late(f.airspeed_us, AIRSPEED_RECENT_US):
            return f.params.yaw_estimator.default_airspeed
        return 0.0 if f.airspeed is None else f.airspeed.true_airspeed

    def correct_bank(self) -> None:
        """Let the yaw bank use its velocity, and offer it that of a new fix for the next step."""
        f = self._f
        self.bank.correct(f.imu.increments, f.flags.in_air, f.x, f.dt_avg)
        fix = f.fix
        if not self.gnss.popped or fix is None or not fix.has_velocity:
            return
        if f.params.yaw_estimator.accuracy == 'speed':
            self.bank.set_velocity(fix.velocity, max(fix.sacc, BANK_ACCURACY))
        elif fix.vacc > 0.0:
            self.bank.set_velocity(fix.velocity, fix.vacc)

    def _note_activity(self) -> None:
        """Count starts and stops of each observation."""
        f = self._f
        flags, seen = f.flags, f.observations
        active = (flags.gps, flags.gps_hgt, flags.ev_pos, flags.ev_vel, flags.ev_hgt,
                  flags.baro_hgt, flags.mag_3d, flags.mag_dec,
                  flags.mag_hdg or flags.ev_yaw or flags.gps_yaw, f.holding_position,
                  flags.rng_hgt, flags.opt_flow, flags.fuse_aspd, flags.wind)
        if active == self._active_before:
            return
        self._active_before = active
        (gps, gps_hgt, ev_pos, ev_vel, ev_hgt, baro, mag_3d, mag_dec, yaw, holding, ranging,
         flow, airspeed, wind) = active
        for record in (seen.gps_hor_pos, seen.gps_hor_vel, seen.gps_ver_vel):
            record.note_active(gps)
        seen.gps_height.note_active(gps_hgt)
        seen.ev_hor_pos.note_active(ev_pos)
        seen.ev_hor_vel.note_active(ev_vel)
        seen.ev_ver_vel.note_active(ev_vel)
        seen.ev_height.note_active(ev_hgt)
        seen.baro_height.note_active(baro)
        seen.mag.note_active(mag_3d)
        seen.declination.note_active(mag_dec)
        seen.yaw.note_active(yaw)
        seen.fake_pos.note_active(holding)
        seen.range_height.note_active(ranging)
        seen.flow.note_active(flow)
        seen.airspeed.note_active(airspeed)
        seen.sideslip.note_active(wind and flags.fuse_beta)
        seen.drag.note_active(wind and self.drag.enabled)
