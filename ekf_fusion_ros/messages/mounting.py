"""Static mounting of sensors: ROS gives it in FLU (REP-103), the estimator takes it in FRD."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.frames import FRD_FLU
from ekf_fusion_ros.frames import frame_kind
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.messages import ZERO
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import Vector

Array = NDArray[np.float64]


@lru_cache(maxsize=32)
def sensor_to_body(rpy: Vector, frame_id: str) -> Array:
    """Return the rotation (3, 3) from sensor axes to body FRD.

    The sensor's axes are FRD when its frame name ends in _frd or _ned, FLU otherwise; `rpy` turns
    its FLU axes into those of the body, about fixed axes in rad.
    """
    turned = FRD_FLU @ matrix_from_euler_321(*rpy)
    rotation = turned if frame_kind(frame_id) == 'enu' else turned @ FRD_FLU
    rotation.flags.writeable = False
    return rotation


def turned_to_body(vector: Any, rpy: Vector, frame_id: str) -> tuple[Any, Any, Any]:
    """Return a vector of sensor axes in body FRD; its elements are floats or arrays (n,).

    For a single vector numpy would take three times as long.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = _rows(rpy, frame_id)
    x, y, z = vector
    return (xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z)


@lru_cache(maxsize=32)
def _rows(rpy: Vector, frame_id: str) -> list[list[float]]:
    rows: list[list[float]] = sensor_to_body(rpy, frame_id).tolist()
    return rows


@lru_cache(maxsize=32)
def body_to_sensor_quaternion(rpy: Vector) -> Array:
    """Return the rotation (4,) from body FRD to the sensor's FRD axes."""
    quaternion = quat_from_matrix(FRD_FLU @ matrix_from_euler_321(*rpy).T @ FRD_FLU)
    quaternion.flags.writeable = False
    return quaternion


def with_mounting(ekf2: Ekf2Params, messages: MessageParams) -> Ekf2Params:
    """Return the estimator's parameters with the lever arms of the messages' mounting (FRD).

    A lever arm that the messages leave at zero keeps the estimator's value. Raises ValueError
    where both are given and differ.
    """
    arms = {
        'imu': messages.imu.mount_xyz,
        'gnss': messages.fix.mount_xyz,
        'vision': messages.odometry.mount_xyz,
        'range': messages.range.mount_xyz,
        'flow': messages.flow.mount_xyz,
    }
    changes: dict[str, Any] = {}
    for group, (x, y, z) in arms.items():
        position = (x, -y, -z)
        current = getattr(ekf2, group, None)
        if position == ZERO or current is None or position == current.position:
            continue
        if current.position != ZERO:
            raise ValueError(
                f'ekf2.{group}.position {current.position} (FRD) and the mount_xyz of its message '
                f'{(x, y, z)} (FLU) differ: give one of them')
        changes[group] = replace(current, position=position)
    return replace(ekf2, **changes)
