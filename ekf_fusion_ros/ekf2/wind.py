"""When the wind states are in use, and where they start."""

from __future__ import annotations

import math

import numpy as np

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.state import WIND
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.mathlib.rotation import yaw_of

TIMEOUT_US = 10 * SECOND
AIRSPEED_RECENT_US = SECOND // 2
INITIAL_VARIANCE = 1.0
"""Variance in (m/s)^2 of each component of a wind taken to be zero."""

INITIAL_SIDESLIP = math.radians(15.0)
INITIAL_YAW_VARIANCE = math.radians(10.0) ** 2


class Wind:
    """Starts the wind states for the first source that needs them, and ends them without any."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f

    def step(self) -> None:
        """End what has timed out; once per filter period, before air data are fused."""
        f = self._f
        flags = f.flags
        if not flags.wind and not flags.fuse_aspd:
            return
        airspeed_ended = f.late(f.times.airspeed, TIMEOUT_US)
        sideslip_ended = f.late(f.times.sideslip, TIMEOUT_US)
        unobserved = airspeed_ended and sideslip_ended and not f.params.air_data.use_drag
        if f.holding_position or unobserved:
            self._activate(False)
        if airspeed_ended:
            flags.fuse_aspd = False

    def start(self) -> bool:
        """Bring the wind states into use; False where they already are."""
        if self._f.flags.wind:
            return False
        self._activate(True)
        self.reset()
        return True

    def _activate(self, active: bool) -> None:
        f = self._f
        f.flags.wind = f.cov.wind_active = active

    def reset(self) -> None:
        """Take the wind from the airspeed of this step at zero sideslip, else to be calm."""
        f = self._f
        sample = f.airspeed
        fresh = f.airspeed_popped and f.t_horizon - f.airspeed_us < AIRSPEED_RECENT_US
        if sample is None or not fresh:
            f.x[WIND] = 0.0
            f.cov.set_variances(22, np.full(2, INITIAL_VARIANCE))
            return
        yaw = yaw_of(f.rot)
        speed = sample.true_airspeed
        f.x[22] = f.x[4] - speed * math.cos(yaw)
        f.x[23] = f.x[5] - speed * math.sin(yaw)
        f.cov.set_block(22, self._covariance(speed, airspeed_variance(f, sample.eas2tas)))

    def _covariance(self, speed: float, noise: float) -> np.ndarray:
        """Return (2, 2): airspeed error along, sideslip across, yaw error, ground velocity."""
        f = self._f
        yaw = yaw_321(matrix_from_quat(f.x[0:4]))
        c, s = math.cos(yaw), math.sin(yaw)
        along = c * f.x[22] + s * f.x[23]
        across = c * f.x[23] - s * f.x[22]
        by_airspeed = np.array((c, s))
        by_sideslip = np.array((-s, c))
        by_yaw = np.array((-along * s - across * c, along * c - across * s))
        slip_variance = (speed * math.sin(INITIAL_SIDESLIP)) ** 2
        block: np.ndarray = (
            noise * np.outer(by_airspeed, by_airspeed)
            + slip_variance * np.outer(by_sideslip, by_sideslip)
            + INITIAL_YAW_VARIANCE * np.outer(by_yaw, by_yaw))
        block[0, 0] += f.cov.p[4, 4]
        block[1, 1] += f.cov.p[5, 5]
        return block


def airspeed_variance(f: Filter, eas2tas: float) -> float:
    """Return the variance of true airspeed in (m/s)^2."""
    noise = min(max(f.params.air_data.airspeed_noise, 0.5), 5.0)
    return (noise * min(max(eas2tas, 0.9), 10.0)) ** 2


def recover_covariance(f: Filter, wind: Wind) -> None:
    """Start P anew after an innovation variance below the noise: of wind alone where it can."""
    if f.wind_dead_reckoning:
        f.x[WIND] = 0.0
        f.covariance_lost = True
    else:
        wind.reset()
