"""Fusion of the three magnetometer axes and of the declination."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.earth import MIN_FIELD
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import EARTH_FIELD

Array = NDArray[np.float64]

VARIANCE_TOO_SMALL = 1
"""What the kernels return where an innovation variance is below the noise."""


def table_declination(f: Filter) -> float:
    """Return the declination in rad from the field model where known, else the parameter."""
    if f.params.mag.declination_from_table and f.earth.field is not None:
        return f.earth.field.declination
    return math.radians(f.params.mag.declination_deg)


def declination(f: Filter) -> float:
    """Return the declination in rad the filter works with."""
    if f.flags.mag_aligned_in_flight:
        return math.atan2(f.x[17], f.x[16])
    return table_declination(f)


def fuse_three_axes(f: Filter, measured: Array, all_states: bool) -> bool:
    """Gate the three axes together and fuse them one by one; False where nothing was fused."""
    params = f.params.mag
    fit, innovations, variances, (x, y, z), outcome = f.cov.correct_by_field(
        f.x, measured, 2 if f.flags.synthetic_mag_z else 3, max(params.noise, 1e-3) ** 2,
        params.gate, all_states, table_declination(f), f.earth.shortest_field)
    faults, rejections = f.faults, f.rejections
    first, second, third = outcome
    faults.mag_x, faults.mag_y, faults.mag_z = first != 0, second != 0, third != 0
    if VARIANCE_TOO_SMALL in outcome:
        _restart_field_covariance(f)
    if not fit:
        return False
    f.observations.yaw.test_ratio = 0.0
    rejections.mag_x, rejections.mag_y, rejections.mag_z = x > 1.0, y > 1.0, z > 1.0
    rejections.mag_judged_after_height = True
    ratio = max(x, y, z)
    return f.observations.mag.note(f.t_now, innovations, variances, ratio, ratio <= 1.0)


def _restart_field_covariance(f: Filter) -> None:
    tilt = f.params.imu.initial_tilt_err ** 2
    f.cov.set_attitude(f.x[0:4], np.full(3, tilt))
    f.cov.reset_field(f.params.mag.noise ** 2)


def fuse_declination(f: Filter, sigma: float) -> None:
    """Fuse atan2(east, north) of the earth field with a sigma in rad."""
    if abs(f.x.item(16)) < MIN_FIELD * 1e-3:
        return
    innovation, variance, outcome = f.cov.fuse_declination(
        f.x, declination(f), sigma * sigma, table_declination(f), f.earth.shortest_field)
    f.faults.declination = outcome != 0
    if outcome == VARIANCE_TOO_SMALL:
        return
    f.observations.declination.note(f.t_now, (innovation,), (variance,), 0.0, True)


def synthetic_z(f: Filter, measured: Array) -> float | None:
    """Return the z axis that field model and attitude imply, Gauss; None where unknown."""
    field = f.earth.field
    if field is None or not f.params.mag.declination_from_table:
        return None
    horizontal = field.strength * math.cos(field.inclination)
    earth = np.array((horizontal * math.cos(field.declination),
                      horizontal * math.sin(field.declination),
                      field.strength * math.sin(field.inclination)))
    rest = field.strength ** 2 - measured[0] ** 2 - measured[1] ** 2
    return math.copysign(math.sqrt(max(rest, 0.0)), float(earth @ f.rot[:, 2]))


def start_field_from(f: Filter, measured: Array) -> None:
    """Set the earth field to a measurement (3,) in body axes at the cached attitude."""
    f.x[EARTH_FIELD] = f.rot @ measured
