"""Motion of the vehicle beside optical flow: its rotation over the exposure, and its violence."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.kernels.optical_flow import accumulate_motion
from ekf_fusion_ros.kernels.prediction import GRAVITY
from ekf_fusion_ros.samples import FlowSample

Array = NDArray[np.float64]

ACCUMULATION_MAX = 1.0
INTERVALS_DIFFER = 0.1
"""Intervals in s of sensor and autopilot gyro that may be compared, and summed at all."""

BIAS_SHARE = 0.01
BIAS_STEP = 0.1
FORCE_MIN, FORCE_MAX = 0.5 * GRAVITY, 1.5 * GRAVITY
TILT_COS = math.cos(math.radians(30.0))
GOOD_MEMORY_US = SECOND // 10
BAD_MEMORY_US = 5 * SECOND


class FlowMotion:
    """Sums the autopilot's gyro since the last flow sample and watches motion on the ground."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self.gyro_bias: Array = np.zeros(3)
        self._turn = np.zeros(4)
        self._motion = np.zeros(4)
        # The sensor gives minus the rotation, so that the sum of both is what is wrong with it.
        self._against = 1.0 if f.params.flow.opposed_gyro else -1.0
        self._share = FILTER_PERIOD / f.params.imu.accel_bias_learn_time
        self._bad_us = 0
        self._good_us = 0

    def step(self) -> None:
        """Run once per filter period."""
        f = self._f
        accumulate_motion(f.imu.increments, f.x, self._share, self._turn, self._motion)
        if f.flags.in_air:
            self._bad_us, self._good_us = 0, f.t_horizon
        elif self._violent():
            self._bad_us = f.t_horizon
        else:
            self._good_us = f.t_horizon

    @property
    def elapsed(self) -> float:
        """Time in s since the last flow sample."""
        return float(self._turn[3])

    def _violent(self) -> bool:
        x, y, z, rate_peak = self._motion.tolist()
        force = math.hypot(x, y, z)
        too_fast = rate_peak > self._f.params.flow.max_rate
        tilted = float(self._f.rot[2, 2]) < TILT_COS
        return not FORCE_MIN <= force <= FORCE_MAX or too_fast or tilted

    def suits_on_ground(self) -> bool:
        """True where the vehicle has stood still enough for flow of zero to be believed."""
        now = self._f.t_horizon
        return now <= self._good_us + GOOD_MEMORY_US and now >= self._bad_us + BAD_MEMORY_US

    def rotation_during(self, sample: FlowSample) -> Array | None:
        """Return minus the body rotation (3,) in rad over the exposure, None where unknown.

        It starts the sum anew. Where the sensor has a gyro of its own, that is returned, and
        `gyro_bias` (3,) in rad/s follows what it differs from the autopilot's.
        """
        turn, elapsed = self._turn[0:3], self.elapsed
        self._turn = np.zeros(4)
        if elapsed > ACCUMULATION_MAX:
            return None
        if not np.isfinite(sample.gyro).all():
            self.gyro_bias = np.zeros(3)
            return -turn
        comparable = min(elapsed, sample.dt) > 0.0 and abs(elapsed - sample.dt) < INTERVALS_DIFFER
        if not comparable:
            return None
        difference = sample.gyro / sample.dt + self._against * turn / elapsed
        step = np.minimum(np.maximum(difference, -BIAS_STEP), BIAS_STEP)
        self.gyro_bias = (1.0 - BIAS_SHARE) * self.gyro_bias + BIAS_SHARE * step
        return sample.gyro
