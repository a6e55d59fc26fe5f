"""Jumps of the state: each is applied to the output history, counted and its size kept."""

from __future__ import annotations

from collections.abc import Callable
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import GYRO_BIAS
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import VD
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.kernels.vision import Three
from ekf_fusion_ros.kernels.vision import turn_velocity
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import quat_normalise
from ekf_fusion_ros.mathlib.rotation import with_yaw
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

YAW_VARIANCE_MAX = 0.01
UNKNOWN_VELOCITY_VARIANCE = 25.0
UNKNOWN_CLIMB_VARIANCE = 10.0

DIFFUSE = 100.0
LEVEL = np.eye(3)


class ResetCounters:
    """How often each part of the state has jumped, and by how much the last time."""

    def __init__(self) -> None:
        """Start with no resets."""
        self.quat = 0
        self.yaw_sum = 0.0
        self.vel_ne = 0
        self.vel_d = 0
        self.pos_ne = 0
        self.pos_d = 0
        self.d_quat: Array = np.array((1.0, 0.0, 0.0, 0.0))
        self.d_vel_ne: Array = np.zeros(2)
        self.d_vel_d = 0.0
        self.d_pos_ne: Array = np.zeros(2)
        self.d_pos_d = 0.0

    def total(self) -> int:
        """Return the number of all resets."""
        return self.quat + self.vel_ne + self.vel_d + self.pos_ne + self.pos_d


class Resets:
    """Moves the filter to a measurement where fusing it would take too long or is impossible."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.counters = ResetCounters()
        self.flow_velocity: Callable[[], tuple[Array, Array]] | None = None

    def yaw(
        self, yaw: float, variance: float, *, shift_output: bool = True,
        variance_max: float = YAW_VARIANCE_MAX,
    ) -> None:
        """Turn to a yaw in rad, keeping the tilt.

        The variance in rad^2, at most variance_max, is added about the vertical.
        """
        f = self._f
        before = f.x[0:4].copy()
        f.rot = with_yaw(f.rot, yaw)
        after = quat_from_matrix(f.rot)
        f.x[0:4] = after
        f.cov.decorrelate_attitude()
        if variance > 0.0:
            f.cov.add_yaw_variance(after, min(variance, variance_max))
        delta = quat_normalise(quat_multiply(after, quat_inverse(before)))
        if shift_output:
            f.output.rotate(delta)
        self.counters.d_quat = delta
        self.counters.yaw_sum += 2.0 * math.atan2(float(delta[3]), float(delta[0]))
        self.counters.quat += 1

    def false_yaw(self, yaw: float, variance: float) -> None:
        """Turn to a yaw in rad, variance in rad^2, from one that has proved to be false.

        A false yaw has taught a false gyro bias, which gets its switch-on variance, and a false
        wind, which starts anew with the next air data.
        """
        f = self._f
        if not f.params.gnss.thorough_yaw_recovery:
            self.yaw(yaw, variance)
            return
        self.yaw(yaw, variance, variance_max=math.inf)
        bias_variance = (f.params.imu.switch_on_gyro_bias * f.dt_avg) ** 2
        f.cov.set_variances(GYRO_BIAS.start, np.full(3, bias_variance))
        f.flags.wind = f.cov.wind_active = False

    def horizontal_velocity(self, velocity: Array, variance: Array) -> None:
        """Set NE velocity (2,) m/s and its variances (2,)."""
        f = self._f
        self.counters.d_vel_ne = velocity[0:2] - f.x[VN:VN + 2]
        self.counters.vel_ne += 1
        f.x[VN:VN + 2] = velocity[0:2]
        f.cov.set_variances(VN, variance[0:2])
        f.output.shift(VN, self.counters.d_vel_ne)

    def vertical_velocity(self, velocity: float, variance: float) -> None:
        """Set down velocity m/s and its variance."""
        f = self._f
        self.counters.d_vel_d = velocity - float(f.x[VD])
        self.counters.vel_d += 1
        f.x[VD] = velocity
        f.cov.set_variances(VD, np.array((variance,)))
        f.output.shift(VD, np.array((self.counters.d_vel_d,)))

    def horizontal_position(self, position: Array, variance: Array) -> None:
        """Set NE position (2,) m and its variances (2,)."""
        f = self._f
        self.counters.d_pos_ne = position[0:2] - f.x[PN:PN + 2]
        self.counters.pos_ne += 1
        f.x[PN:PN + 2] = position[0:2]
        f.cov.set_variances(PN, variance[0:2])
        f.output.shift(PN, self.counters.d_pos_ne)

    def vertical_position(self, down: float, variance: float | None) -> None:
        """Set down position m and its variance; None keeps the variance."""
        f = self._f
        self.counters.d_pos_d = down - float(f.x[PD])
        self.counters.pos_d += 1
        f.x[PD] = down
        if variance is not None:
            f.cov.set_variances(PD, np.array((variance,)))
        f.output.shift(PD, np.array((self.counters.d_pos_d,)))

    def move_horizontally(self, shift: Array) -> None:
        """Shift the NE position by (2,) m: the frame has moved, not the vehicle."""
        f = self._f
        f.x[PN:PN + 2] += shift
        f.last_known_position = f.last_known_position + shift
        f.output.shift(PN, shift)
        self.counters.d_pos_ne = shift
        self.counters.pos_ne += 1

    def move_vertically(self, shift: float) -> None:
        """Shift the down position in m: the frame has moved, not the vehicle."""
        f = self._f
        f.x[PD] += shift
        f.output.shift(PD, np.array((shift,)))
        self.counters.d_pos_d = shift
        self.counters.pos_d += 1

    def velocity_to_aiding(self, gnss_healthy: bool) -> None:
        """Take the velocity of the best active source, zero where there is none.

        gnss_healthy: no receiver check has failed for the health time.
        """
        f = self._f
        if f.flags.gps and gnss_healthy and f.fix is not None and f.fix.has_velocity:
            self.velocity_to_fix()
        elif f.flags.opt_flow and self.flow_velocity is not None:
            f.events.add(f.t_now, EventKind.VEL_RESET_FLOW)
            self.horizontal_velocity(*self.flow_velocity())
        elif f.flags.ev_vel and f.vision is not None and f.vision.has_velocity:
            f.events.add(f.t_now, EventKind.VEL_RESET_VISION)
            turned, spread = vision_velocity_in_filter_frame(f, f.vision)
            velocity, variance = np.array(turned), np.array(spread)
            if velocity_tells_attitude(f, f.vision):
                # Its direction hangs on the attitude; the fusion that follows makes that known.
                variance = variance + DIFFUSE * (1.0 + float(velocity @ velocity))
            self.horizontal_velocity(velocity, variance)
            self.vertical_velocity(float(velocity[2]), float(variance[2]))
        else:
            f.events.add(f.t_now, EventKind.VEL_RESET_ZERO)
            self.horizontal_velocity(np.zeros(2), np.full(2, UNKNOWN_VELOCITY_VARIANCE))

    def velocity_to_unknown(self) -> None:
        """Forget what the assumption of rest has taught of the horizontal velocity."""
        self._f.cov.set_variances(VN, np.full(2, UNKNOWN_VELOCITY_VARIANCE))

    def velocity_to_fix(self) -> None:
        """Take the velocity of the delayed fix, all three axes."""
        f = self._f
        assert f.fix is not None
        f.events.add(f.t_now, EventKind.VEL_RESET_GPS)
        variance = f.fix.sacc ** 2
        self.horizontal_velocity(f.fix.velocity, np.full(2, variance))
        self.vertical_velocity(float(f.fix.velocity[2]), variance)

    def position_to_aiding(self) -> None:
        """Take the position of the best active source, the last known where there is none."""
        f = self._f
        if f.flags.gps and f.fix is not None:
            self.position_to_fix()
        elif f.flags.ev_pos and f.vision is not None and f.vision.has_position:
            f.events.add(f.t_now, EventKind.POS_RESET_VISION)
            position = np.nan_to_num(f.vision.position)
            if f.params.vision.rotate:
                position = f.rot_ev @ position
            self.horizontal_position(position, f.vision.position_var)
        elif f.flags.opt_flow and f.params.aiding.doubt_held_position:
            # Flow tells no place: that of before stays.
            return
        elif f.flags.opt_flow:
            f.events.add(f.t_now, EventKind.POS_RESET_LAST_KNOWN)
            target = f.last_known_position if f.flags.in_air else np.zeros(2)
            self.horizontal_position(target, np.zeros(2))
        else:
            f.events.add(f.t_now, EventKind.POS_RESET_LAST_KNOWN)
            variance = np.full(2, f.params.aiding.pos_noaid_noise ** 2)
            self.horizontal_position(f.last_known_position, variance)

    def position_to_fix(self) -> None:
        """Take the position of the delayed fix."""
        f = self._f
        assert f.fix is not None
        f.events.add(f.t_now, EventKind.POS_RESET_GPS)
        self.horizontal_position(f.fix.position, np.full(2, f.fix.hacc ** 2))


def velocity_tells_attitude(f: Filter, sample: VisionSample) -> bool:
    """Return whether a velocity is to be observed in the body, with which its frame turns.

    Not beside absolute positions of a rotated frame: they turn with the attitude as well, so that
    a yaw which the velocity ties to them would follow its own corrections.
    """
    rotated = f.params.vision.rotate and not f.flags.ev_yaw
    positions_turn = rotated and f.flags.ev_pos and not f.params.gnss.enabled
    if not f.params.vision.velocity_tells_attitude or positions_turn:
        return False
    if sample.velocity_frame is VelocityFrame.BODY_FRD:
        return True
    return rotated and sample.has_attitude


def vision_velocity_in_filter_frame(f: Filter, sample: VisionSample) -> tuple[Three, Three]:
    """Return velocity in m/s NED at the IMU, and its variances, of a vision sample.

    Removes the lever arm of the sensor with the delayed rate.
    """
    if sample.velocity_frame is VelocityFrame.BODY_FRD:
        turn = f.rot
    else:
        turn = f.rot_ev if f.params.vision.rotate else LEVEL
    velocity, variance = turn_velocity(turn, sample.velocity, sample.velocity_cov)
    if f.vision_lever is not None:
        swing = f.rot @ cross(f.rate, f.vision_lever)
        velocity = tuple((velocity - swing).tolist())
    return velocity, variance
