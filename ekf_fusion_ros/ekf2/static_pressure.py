"""Error that the airflow around the vehicle makes in the static pressure."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params.ekf2 import BaroParams


def has_pressure_error(params: BaroParams) -> bool:
    """True where any coefficient says that the airflow matters."""
    return any((
        params.pressure_error_forward, params.pressure_error_backward,
        params.pressure_error_right, params.pressure_error_left, params.pressure_error_vertical))


def pressure_error_height(f: Filter) -> float:
    """Return what is to be added to pressure altitude, m: sum of k v^2 / (2 g) over body axes.

    v is the velocity of the body origin against the air at now, by the output predictor and the
    wind states.
    """
    params = f.params.baro
    velocity = f.output.velocity_at_origin(np.asarray(f.params.imu.position))
    velocity[0] -= f.x[22]
    velocity[1] -= f.x[23]
    x, y, z = (velocity @ matrix_from_quat(f.output.now[0:4])).tolist()
    largest = params.pressure_error_max_airspeed ** 2
    error: float = (
        (params.pressure_error_forward if x >= 0.0 else params.pressure_error_backward)
        * min(x * x, largest)
        + (params.pressure_error_right if y >= 0.0 else params.pressure_error_left)
        * min(y * y, largest)
        + params.pressure_error_vertical * min(z * z, largest))
    return 0.5 * error / GRAVITY
