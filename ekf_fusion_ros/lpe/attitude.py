"""Attitude, an input of LPE: of the Imu, of the odometry, or of our own filter."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.geo.magnetic_field import make_field
from ekf_fusion_ros.lpe.attitude_filter import AttitudeFilter
from ekf_fusion_ros.lpe.gravity import ForceHistory
from ekf_fusion_ros.lpe.gravity import Gravity
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params.lpe import AttitudeParams
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

SOURCE_AGE_US = SECOND
"""Time after which a source that is silent makes way for the next."""

FIX_WINDOW_US = 0
FLOW_WINDOW_US = SECOND // 2
ESTIMATE_WINDOW_US = SECOND // 10
"""Windows over which velocities are averaged before they tell gravity."""

UNKNOWN_YAW_VARIANCE = math.pi ** 2 / 3.0


class Attitude:
    """Attitude at the newest inertial sample; between samples of its source the gyro turns it.

    Where the odometry tells it, its heading against north is that of `HeadingSample`, or what the
    filter had when the odometry began.
    """

    def __init__(self, params: AttitudeParams) -> None:
        """Know nothing yet."""
        self.params = params
        self.source = ''
        self.rate = np.zeros(3)
        self.yaw_jump = 0.0
        self.jumps = 0
        self.yaw_variance = UNKNOWN_YAW_VARIANCE
        self._filter = AttitudeFilter()
        self._orientation_us: int | None = None
        self._odometry: VisionSample | None = None
        self._odometry_us: int | None = None
        self._resets = 0
        self._heading: tuple[float, float] | None = (0.0, 0.0) if params.odometry_yaw else None
        self._declination = math.radians(params.declination_deg)
        self._place_known = False
        self._force = ForceHistory()
        self._by_fixes = Gravity(self._force, FIX_WINDOW_US)
        self._by_flow = Gravity(self._force, FLOW_WINDOW_US)
        self._by_estimate = Gravity(self._force, ESTIMATE_WINDOW_US)

    @property
    def ready(self) -> bool:
        """True once there is an attitude."""
        return self._filter.ready and self.source != ''

    @property
    def yaw_aligned(self) -> bool:
        """True once yaw is one against north, or that of the odometry where that is the map's."""
        return self._filter.yaw_known

    @property
    def quaternion(self) -> Array:
        """Body to NED, (4,)."""
        return self._filter.quaternion

    @property
    def rot(self) -> Array:
        """Body to NED, (3, 3)."""
        return self._filter.rot

    @property
    def gyro_bias(self) -> Array:
        """The bias that is taken off the gyro, (3,) rad/s."""
        return self._filter.gyro_bias

    def step(self, imu: ImuSample) -> None:
        """Carry the attitude to the end of an inertial increment."""
        attitude = self._filter
        if attitude.ready:
            attitude.turn(imu.delta_angle, imu.delta_angle_dt)
        self.rate = imu.delta_angle / imu.delta_angle_dt - attitude.gyro_bias
        if imu.orientation is not None and self.params.source in ('auto', 'imu'):
            self._orientation_us = imu.time_us
            self.source = 'imu'
            attitude.take(imu.orientation)
            self._align(self.params.yaw_sigma ** 2)
        elif self._fresh(self._orientation_us, imu.time_us):
            return
        elif self._usable_odometry(imu.time_us):
            self._take_odometry(imu.time_us)
        elif not self._fresh(self._odometry_us, imu.time_us):
            self._filter_step(imu)

    def push_odometry(self, sample: VisionSample) -> bool:
        """Note an odometry sample; it acts once inertial time has reached it. False if never."""
        wanted = sample.has_attitude and self.params.source in ('auto', 'odometry')
        if wanted:
            self._odometry = sample
        return wanted and self.source != 'imu'

    def push_heading(self, sample: HeadingSample) -> None:
        """Take the heading of the odometry frame against north."""
        self._heading = (sample.yaw, sample.variance)

    def push_field(self, sample: MagSample) -> bool:
        """Take a magnetic field; False where it is not used."""
        if self.source != 'filter':
            return False
        field = self.rot @ sample.field
        magnetic = math.atan2(-field[1], field[0])
        self._take_heading(sample.time_us, self._declination + magnetic, relative=True)
        return True

    def push_fix(self, fix: GnssSample, delay_us: int) -> None:
        """Take from a fix the yaw of two antennas, the velocity, and the declination."""
        if self.source == 'filter' and math.isfinite(fix.yaw):
            self._take_heading(fix.time_us, fix.yaw, relative=False)
        if fix.has_velocity and np.isfinite(fix.velocity).all():
            self._note_velocity(self._by_fixes, fix.time_us - delay_us, fix.velocity)
        if self.params.declination_from_table and not self._place_known:
            self._place_known = True
            self._declination = make_field('ecl_table', 0.0).lookup(fix.lat, fix.lon).declination

    def push_flow(self, time_us: int, velocity: Array) -> None:
        """Take a velocity (3,) m/s NED that optical flow has measured."""
        self._note_velocity(self._by_flow, time_us, velocity)

    def push_estimate(self, time_us: int, velocity: Array) -> None:
        """Take a valid velocity (3,) m/s NED of the estimate."""
        self._note_velocity(self._by_estimate, time_us, velocity)

    def _note_velocity(self, gravity: Gravity, time_us: int, velocity: Array) -> None:
        """Let a velocity tell gravity, which only the own filter needs and gathers force for."""
        if self.source == 'filter':
            gravity.note(time_us, velocity)

    def take_yaw(self, yaw: float, variance: float) -> None:
        """Turn to a yaw in rad that somebody knows."""
        before = yaw_of(self.rot)
        self._filter.take_yaw(yaw)
        if self._heading is not None:
            self._heading = (self._heading[0] + yaw - before, variance)
        self.yaw_variance = variance
        self._note_jump(yaw - before)

    def covariance(self) -> Array:
        """Return that of small rotations about the earth axes, (3, 3) rad^2."""
        tilt = self.params.tilt_sigma ** 2
        return np.diag((tilt, tilt, self.yaw_variance))

    @staticmethod
    def _fresh(last_us: int | None, now_us: int) -> bool:
        return last_us is not None and now_us - last_us < SOURCE_AGE_US

    def _align(self, variance: float) -> None:
        self._filter.yaw_known = True
        self.yaw_variance = variance

    def _note_jump(self, angle: float) -> None:
        self.yaw_jump += wrap_pi(angle)
        self.jumps += 1

    def _usable_odometry(self, now_us: int) -> bool:
        """True where an odometry sample is due that tells more than the filter knows."""
        sample = self._odometry
        if sample is None or sample.time_us > now_us:
            return False
        knows_heading = self._heading is not None
        return knows_heading or self.source == 'odometry' or not self.yaw_aligned

    def _take_odometry(self, now_us: int) -> None:
        sample, self._odometry = self._odometry, None
        assert sample is not None
        attitude = self._filter
        before = yaw_of(attitude.rot)
        # The body has turned since the sample.
        turn = self.rate * (1e-6 * (now_us - sample.time_us))
        measured = quat_multiply(sample.quaternion, quat_from_rotation_vector(turn))
        jumped = self.source == 'odometry' and sample.reset_counter != self._resets
        if self._heading is None or jumped:
            variance = UNKNOWN_YAW_VARIANCE if self._heading is None else self._heading[1]
            heading = before - yaw_of(matrix_from_quat(measured))
        else:
            heading, variance = self._heading
            attitude.yaw_known = True
        if jumped and self._heading is not None:
            self._heading = (heading, variance)
        to_north = quat_from_rotation_vector(np.array((0.0, 0.0, heading)))
        attitude.take(quat_normalise(quat_multiply(to_north, measured)))
        turned = wrap_pi(yaw_of(attitude.rot) - before)
        if self.source and abs(turned) > 0.2:
            self._note_jump(turned)
        self._resets, self._odometry_us, self.source = \
            sample.reset_counter, now_us, 'odometry'
        self.yaw_variance = variance + self.params.yaw_sigma ** 2

    def _filter_step(self, imu: ImuSample) -> None:
        if self.params.source not in ('auto', 'filter'):
            return
        force = imu.delta_velocity / imu.delta_velocity_dt
        if not self._filter.ready:
            self._filter.level(force)
        else:
            self._force.carry(imu.time_us, self.rot @ imu.delta_velocity)
            self._filter.steady(imu.time_us, self._gravity(imu.time_us, force), self.rate,
                                imu.delta_angle_dt, self.params)
        self.source = 'filter' if self._filter.ready else ''

    def _gravity(self, now_us: int, force: Array) -> Array:
        """Return gravity (3,) m/s^2 in the body; without velocities as if nothing accelerated."""
        for told in (self._by_fixes, self._by_flow, self._by_estimate):
            gravity = told.at(now_us)
            if gravity is not None:
                return self.rot.T @ gravity
        return -force

    def _take_heading(self, time_us: int, heading: float, *, relative: bool) -> None:
        """Take a yaw in rad, or (relative) how far ours is from it."""
        error = wrap_pi(heading if relative else heading - yaw_of(self.rot))
        if self.yaw_aligned:
            self._filter.note_heading(time_us, error)
        else:
            self._filter.take_yaw(yaw_of(self.rot) + error)
        self._align(self.params.yaw_sigma ** 2)

