"""Odometry as inertial input: increments of angle and velocity between its messages."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.mathlib.rotation import quat_from_rotation_vector
from ekf_fusion_ros.mathlib.rotation import quat_inverse
from ekf_fusion_ros.mathlib.rotation import quat_multiply
from ekf_fusion_ros.mathlib.rotation import rotation_vector_from_quat
from ekf_fusion_ros.mathlib.rotation import with_yaw
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params.two_topic import OdometryImuParams
from ekf_fusion_ros.params.two_topic import TwoTopicParams
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]

GRAVITY = np.array((0.0, 0.0, 9.80665))
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))
SECOND = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class _Reading:
    """What one odometry message says: position and attitude in its frame, body velocity."""

    time_us: int
    position: Array
    attitude: Array
    velocity: Array
    reset_counter: int


class OdometryImu:
    """Turns odometry into inertial increments and into what is fused beside them.

    Between two messages the body turns at a constant rate and its velocity changes at a constant
    acceleration, so the strapdown of the increments meets attitude and velocity of each message.
    Only differences within one message interval are used: a jump of the odometry's frame leaves
    the increments continuous, and is counted in `jumps` by kind (position, attitude, velocity,
    declared); `jump` names the kind of the newest message. A stamp that does not advance is
    counted as stamp.
    """

    def __init__(self, params: TwoTopicParams) -> None:
        """Start without a message."""
        self._params: OdometryImuParams = params.odometry
        self.jumps: Counter[str] = Counter()
        self.jump = ''
        self._last: _Reading | None = None
        self._attitude = LEVEL
        self._turn = np.zeros(3)
        self._step_speed = math.nan
        self._sample: VisionSample | None = None

    def push(self, sample: VisionSample) -> list[ImuSample]:
        """Return the increments (0 to many) that end with this message, the last at its stamp."""
        last = self._last
        self.jump = ''
        sample = _with_direction(sample)
        attitude = sample.quaternion if math.isfinite(sample.quaternion[0]) else LEVEL
        if last is None:
            position = sample.position.copy()
            velocity = _body_velocity(sample, attitude)
            start = np.nan_to_num(velocity, nan=0.0)
            self._last = _Reading(sample.time_us, position, attitude, start, sample.reset_counter)
            self._attitude = attitude
            self._sample = self._fused(sample, start, attitude)
            return []
        dt = (sample.time_us - last.time_us) / SECOND
        if dt <= 0.0:
            self._count('stamp')
            return []
        declared = sample.reset_counter != last.reset_counter
        if declared:
            self._count('declared')
        velocity = self._velocity(sample, attitude, last, dt, declared)
        # A frame that has moved may have turned as well, by an angle the body could have.
        moved = declared or self.jump == 'position'
        turn = self._turn_between(last.attitude, attitude, dt, moved)
        increments = self._increments(last, velocity, turn, sample.time_us)
        share = dt / (dt + self._params.smoothing)
        self._turn = self._turn + share * (turn / dt - self._turn)
        self._attitude = quat_multiply(self._attitude, quat_from_rotation_vector(turn))
        self._attitude = self._attitude / np.linalg.norm(self._attitude)
        self._last = _Reading(
            sample.time_us, sample.position.copy(), attitude, velocity, sample.reset_counter)
        self._sample = self._fused(sample, velocity, attitude)
        return increments

    def fused(self) -> VisionSample | None:
        """Return the newest message as the estimator should fuse it, None before one came.

        Velocity in the body frame; a level attitude along the axes of the odometry frame where
        none was measured.
        """
        return self._sample

    def _count(self, kind: str) -> None:
        self.jumps[kind] += 1
        self.jump = kind

    def _turn_between(self, before: Array, after: Array, dt: float, moved: bool) -> Array:
        """Return the rotation vector of the body over the interval.

        Where the frame is not the one of the message before (moved, or a turn that no body does),
        down is where it was, but north is not: tilt is believed, and yaw goes on at its rate; all
        of the attitude where the tilt cannot be believed.
        """
        limit = max(self._params.max_rate * dt, 0.1)
        turn = _turn(before, after)
        if np.linalg.norm(turn) > limit:
            self._count('attitude')
            moved = True
        if not moved:
            return turn
        turn = _turn(before, self._with_expected_yaw(before, after, dt))
        return self._turn * dt if np.linalg.norm(turn) > limit else turn

    def _with_expected_yaw(self, before: Array, after: Array, dt: float) -> Array:
        expected = quat_multiply(before, quat_from_rotation_vector(self._turn * dt))
        yaw = yaw_of(matrix_from_quat(expected))
        return quat_from_matrix(with_yaw(matrix_from_quat(after), yaw))

    def _velocity(
        self, sample: VisionSample, attitude: Array, last: _Reading, dt: float, declared: bool,
    ) -> Array:
        """Return the body velocity (3,) at the message: as measured, else from positions."""
        measured = _body_velocity(sample, attitude)
        step = _step(last, sample)
        if math.isfinite(measured[0]):
            explained = 0.5 * float(np.linalg.norm(last.velocity + measured)) * dt
            if not declared:
                self._is_jump(step, explained, explained)
            return self._limited(measured, last.velocity, dt)
        if declared or math.isnan(step[0]):
            return last.velocity
        # The speed of the step before, not the smoothed one: fast motion is no endless jump.
        before, self._step_speed = self._step_speed, float(np.linalg.norm(step)) / dt
        slack = self._params.max_acceleration * dt * dt
        if self._is_jump(step, before * dt, slack):
            return last.velocity
        raw = matrix_from_quat(attitude).T @ (step / dt)
        blend = 1.0 if math.isnan(before) else dt / (dt + self._params.smoothing)
        return self._limited(last.velocity + blend * (raw - last.velocity), last.velocity, dt)

    def _is_jump(self, step: Array, explained: float, slack: float) -> bool:
        """Compare lengths only, so that the heading of the frame does not matter."""
        excess = float(np.linalg.norm(step)) - explained
        jumped = excess > max(self._params.jump_distance, slack)
        if jumped:
            self._count('position')
        return jumped

    def _limited(self, velocity: Array, before: Array, dt: float) -> Array:
        change = velocity - before
        size = float(np.linalg.norm(change))
        limit = self._params.max_acceleration * dt + self._params.jump_speed
        if size <= limit:
            return velocity
        self._count('velocity')
        return before + change * (limit / size)

    def _increments(
        self, last: _Reading, velocity: Array, turn: Array, end_us: int,
    ) -> list[ImuSample]:
        span_us = end_us - last.time_us
        count = max(1, math.ceil(span_us / (1000.0 * self._params.period_ms) - 1e-6))
        after = quat_multiply(self._attitude, quat_from_rotation_vector(turn))
        change = matrix_from_quat(after) @ velocity
        change -= matrix_from_quat(self._attitude) @ last.velocity
        acceleration = change * (SECOND / span_us)
        force = acceleration - GRAVITY
        samples, before_us = [], last.time_us
        for k in range(count):
            stamp = last.time_us + (k + 1) * span_us // count
            middle = (0.5 * (stamp + before_us) - last.time_us) / span_us
            attitude = quat_multiply(self._attitude, quat_from_rotation_vector(turn * middle))
            dt = (stamp - before_us) / SECOND
            samples.append(ImuSample(
                stamp, turn * ((stamp - before_us) / span_us),
                matrix_from_quat(attitude).T @ force * dt, dt, dt))
            before_us = stamp
        return samples

    def _fused(self, sample: VisionSample, velocity: Array, attitude: Array) -> VisionSample:
        floor = self._params.velocity_noise ** 2
        covariance = floor * np.eye(3)
        if sample.has_velocity:
            covariance = np.where(np.isfinite(sample.velocity_cov), sample.velocity_cov, 0.0)
            if sample.velocity_frame is VelocityFrame.LOCAL_FRD:
                rotation = matrix_from_quat(attitude)
                covariance = rotation.T @ covariance @ rotation
            covariance = covariance + np.diag(
                np.maximum(floor - covariance.diagonal(), 0.0))
        elif not sample.has_position:
            velocity = NAN3
        return sample._replace(
            quaternion=attitude, velocity=velocity, velocity_cov=covariance,
            velocity_frame=VelocityFrame.BODY_FRD)


def _turn(before: Array, after: Array) -> Array:
    """Return the shorter rotation vector (3,) from one attitude to another."""
    turn: Array = rotation_vector_from_quat(quat_multiply(quat_inverse(before), after))
    angle = float(np.linalg.norm(turn))
    return turn * (1.0 - 2.0 * math.pi / angle) if angle > math.pi else turn


def _with_direction(sample: VisionSample) -> VisionSample:
    """Return a sample without a velocity whose direction in the odometry frame is not known.

    Positions tell it there, where a body velocity without an attitude does not.
    """
    blind = sample.velocity_frame is VelocityFrame.BODY_FRD and not sample.has_attitude
    return sample._replace(velocity=NAN3) if blind and sample.has_position else sample


def _body_velocity(sample: VisionSample, attitude: Array) -> Array:
    """Return the measured velocity (3,) in the body frame, NaN where none was measured."""
    if not sample.has_velocity:
        return NAN3
    velocity = np.nan_to_num(sample.velocity, nan=0.0)
    if sample.velocity_frame is VelocityFrame.LOCAL_FRD:
        velocity = matrix_from_quat(attitude).T @ velocity
    return velocity


def _step(last: _Reading, sample: VisionSample) -> Array:
    """Return the displacement (3,) since the last message; a height that is not measured rests."""
    step = sample.position - last.position
    if math.isnan(step[2]):
        step[2] = 0.0
    return step
