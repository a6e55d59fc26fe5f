"""nav_msgs/Odometry messages to VisionSamples, many at a time."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import repeat
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros import frames
from ekf_fusion_ros.messages.decode_odometry import LINEAR
from ekf_fusion_ros.messages.decode_odometry import MAX_POSITION
from ekf_fusion_ros.messages.decode_odometry import MAX_VELOCITY
from ekf_fusion_ros.messages.decode_odometry import ORIENTATION
from ekf_fusion_ros.messages.decode_odometry import POSE_COVARIANCE
from ekf_fusion_ros.messages.decode_odometry import POSITION
from ekf_fusion_ros.messages.decode_odometry import TWIST
from ekf_fusion_ros.messages.decode_odometry import TWIST_COVARIANCE
from ekf_fusion_ros.messages.decode_odometry import parent_kind
from ekf_fusion_ros.messages.fields import CORRELATION_MAX
from ekf_fusion_ros.messages.fields import QUATERNION_NORM_ERROR
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.flat import where_good
from ekf_fusion_ros.messages.mounting import turned_to_body
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.messages.stamps import plain_stamps
from ekf_fusion_ros.params.messages import ZERO
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import OdometryMessageParams
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def decode_odometry_rows(
    rows: FlatRows, params: MessageParams,
) -> Sequence[VisionSample | None]:
    """Return Odometry messages as samples, None for each that `decode_odometry` has to judge.

    The numbers are the same. Only what a visual odometry usually sends is decoded here: pose and
    twist measured on all axes, in the child frame, by a sensor along the axes of the body.
    """
    odometry = params.odometry
    try:
        kind = parent_kind(rows.frame_id, odometry)
    except Refused:
        return [None] * len(rows.sec)
    if odometry.twist_frame != 'child' or odometry.mount_rpy != ZERO:
        return [None] * len(rows.sec)
    times, good = plain_stamps(rows.sec, rows.nanosec)
    good &= np.isfinite(rows.numbers).all(axis=1)
    # What is not good must not disturb the arithmetic of the others.
    numbers = np.where(good[:, None], rows.numbers, 0.0)
    positions, position_vars = _positions(numbers, kind, odometry, good)
    quaternions, angular_vars = _attitudes(numbers, kind, rows.child_frame_id, odometry, good)
    velocities, velocity_covs = _velocities(numbers, rows.child_frame_id, odometry, good)
    # Kernels are compiled for contiguous arrays.
    vectors = map(np.ascontiguousarray, (
        positions, quaternions, velocities, position_vars, velocity_covs))
    samples = map(VisionSample, times.tolist(), *vectors, angular_vars.tolist(),
                  repeat(VelocityFrame.BODY_FRD))
    return where_good(samples, good)


def _positions(
    numbers: Array, kind: str, params: OdometryMessageParams, good: Mask,
) -> tuple[Array, Array]:
    """Return positions (n, 3) and their variances in NED or FRD."""
    positions = numbers[:, POSITION]
    good &= (np.abs(positions) <= MAX_POSITION).all(axis=1)
    variances = _blocks(numbers[:, POSE_COVARIANCE], 0, params.position_noise, params, good) \
        .diagonal(axis1=1, axis2=2)
    if kind != 'enu':
        return positions, variances
    return positions[:, (1, 0, 2)] * (1.0, 1.0, -1.0), variances[:, (1, 0, 2)]


def _attitudes(
    numbers: Array, kind: str, child_frame_id: str, params: OdometryMessageParams, good: Mask,
) -> tuple[Array, Array]:
    """Return quaternions (n, 4) from body FRD to the local frame and variances (n,) of yaw."""
    xyzw = numbers[:, ORIENTATION]
    # For numpy has no hypot of four, whose last bit may differ from that of a square root.
    norms = np.array([math.hypot(*quaternion) for quaternion in xyzw.tolist()])
    good &= np.abs(norms - 1.0) <= QUATERNION_NORM_ERROR
    quaternions = xyzw[:, (3, 0, 1, 2)] / np.where(good, norms, 1.0)[:, None]
    child_is_flu = frames.frame_kind(child_frame_id) == 'enu'
    if kind == 'enu':
        swap = frames.swap_attitude if child_is_flu else frames.swap_attitude_parent
        quaternions = np.array([swap(quaternion) for quaternion in quaternions])
    elif child_is_flu:
        quaternions = np.array([frames.swap_attitude_child(q) for q in quaternions])
    covariances = _blocks(numbers[:, POSE_COVARIANCE], 3, params.yaw_noise, params, good)
    return quaternions, covariances[:, 2, 2]


def _velocities(
    numbers: Array, child_frame_id: str, params: OdometryMessageParams, good: Mask,
) -> tuple[Array, Array]:
    """Return velocities (n, 3) in the body FRD and their covariances (n, 3, 3)."""
    velocities, covariances = numbers[:, LINEAR], numbers[:, TWIST_COVARIANCE]
    good &= (np.abs(velocities) <= MAX_VELOCITY).all(axis=1)
    good &= numbers[:, TWIST].any(axis=1) | covariances.any(axis=1)
    signs = np.array(turned_to_body((1.0, 1.0, 1.0), ZERO, child_frame_id))
    blocks = _blocks(covariances, 0, params.velocity_noise, params, good)
    # Adding zero turns -0.0 into what a product of matrices gives.
    return velocities * signs + 0.0, blocks * np.outer(signs, signs) + 0.0


def _blocks(
    flat: Array, first: int, noise: float, params: OdometryMessageParams, good: Mask,
) -> Array:
    """Return fields.measured_block (n, 3, 3) of rows; `good` loses those with anything unusual.

    noise: standard deviation where the covariance is left at zero.
    """
    good &= (flat[:, ::7] >= 0.0).all(axis=1)
    block = flat.reshape(-1, 6, 6)[:, first:first + 3, first:first + 3]
    variances = block.diagonal(axis1=1, axis2=2)
    unknown = (variances == 0.0).all(axis=1)[:, None]
    known = (variances > 0.0) & (variances < params.unmeasured_variance)
    good &= (unknown | known).all(axis=1)
    variances = np.where(unknown, noise ** 2, np.where(known, variances, 0.0))
    mean = np.where(unknown[:, None], 0.0, 0.5 * block + 0.5 * block.transpose(0, 2, 1))
    axes = np.arange(3)
    mean[:, axes, axes] = variances
    limits = CORRELATION_MAX * np.sqrt(variances[:, :, None] * variances[:, None, :])
    good &= (np.abs(mean) <= limits).all(axis=(1, 2))
    return mean
