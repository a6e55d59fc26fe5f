"""Optical flow: freed of rotation, it tells horizontal velocity, or the height of the terrain."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.aid_sources.optical_flow_motion import FlowMotion
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.state import FILTER_PERIOD_US
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import SECOND
from ekf_fusion_ros.ekf2.terrain import Terrain
from ekf_fusion_ros.kernels.innovation import project
from ekf_fusion_ros.kernels.optical_flow import flow_jacobians
from ekf_fusion_ros.kernels.update import test_ratio
from ekf_fusion_ros.mathlib.rotation import cross
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.samples import FlowSample

Array = NDArray[np.float64]

TERRAIN_NEEDS_FLOW_US = 5 * SECOND
HAGL_COASTS_US = 10 * SECOND
DATA_TIMEOUT_US = 10 * SECOND
DT_SHORTEST, DT_LONGEST = 0.7, 1.3
"""Exposure over the time since the last sample, between which both belong together."""

DT_MIN, DT_MAX = 1e-3, 0.2
CLEARANCE_MIN = 0.1
NOISE_MIN = 0.05
POOR_GNSS, POOR_GNSS_WHILE_FUSING = 1.0, 0.7
"""Accuracy of the fixes over what is required, above which flow is needed beside them."""


class Compensated(NamedTuple):
    """Flow without the rotation of the body: scene angle (2,), gyro (3,), interval, quality."""

    scene: tuple[float, float]
    gyro: Array
    dt: float
    quality: int


class OpticalFlow:
    """Observes behind the horizon; starts, continues or stops flow as horizontal aiding."""

    def __init__(self, f: Filter, resets: Resets, terrain: Terrain, checks: GnssChecks,
                 capacity: int) -> None:
        """Act on a filter through its resets; capacity in filter periods."""
        self._f = f
        self._resets = resets
        self._terrain = terrain
        self._checks = checks
        self._motion = FlowMotion(f)
        self.buffer: SampleBuffer[FlowSample] = SampleBuffer(capacity)
        self._popped: tuple[int, FlowSample] | None = None
        self._popped_us = 0
        self._sample: Compensated | None = None
        self.for_terrain = False
        self._h = np.zeros((2, 24))
        self._hp = np.zeros((2, 24))

    def push(self, sample: FlowSample, min_interval_us: int) -> None:
        """Queue a sample unless it follows the last one too closely."""
        if not self.buffer.admits(sample.time_us, min_interval_us):
            return
        delay_us = round(self._f.params.flow.delay_ms * 1000) + FILTER_PERIOD_US // 2
        self.buffer.push(sample.time_us - delay_us, sample)

    def pop(self) -> None:
        """Take the sample at the horizon, and decide whether the terrain needs it."""
        if not self.buffer.last_arrival_us:
            return
        f = self._f
        self._popped = self.buffer.pop_first_older_than(f.t_horizon)
        if self._popped is None:
            return
        self._popped_us = self._popped[0]
        if f.flags.in_air and not self.for_terrain:
            range_is_silent = f.late(f.times.hagl, TERRAIN_NEEDS_FLOW_US)
            gnss_alone = f.flags.gps and not f.flags.opt_flow
            self.for_terrain = range_is_silent and gnss_alone

    def step(self) -> None:
        """Run once per filter period."""
        if not self.buffer.last_arrival_us and not self._f.params.flow.enabled:
            return
        self._motion.step()
        usable = self._popped is not None and self._compensate(self._popped[1])
        if usable:
            self._control()
        elif self._f.flags.opt_flow and self._f.t_horizon > self._popped_us + DATA_TIMEOUT_US:
            self.stop()

    # ---- observation ----

    def _compensate(self, sample: FlowSample) -> bool:
        """Take the rotation out of a sample; False drops it."""
        f = self._f
        params = f.params.flow
        good_quality = sample.quality >= params.min_quality
        within_rate = math.hypot(*sample.flow.tolist()) <= sample.dt * params.max_rate
        upright = float(f.rot[2, 2]) > f.params.range.min_cos_tilt
        shortest = max(DT_SHORTEST * self._motion.elapsed, DT_MIN)
        dt_fits = shortest <= sample.dt <= min(DT_LONGEST * self._motion.elapsed, DT_MAX)
        gyro = self._motion.rotation_during(sample)
        if gyro is not None and good_quality and within_rate and upright and dt_fits:
            scene = (float(sample.flow[0] - gyro[0]), float(sample.flow[1] - gyro[1]))
            self._sample = Compensated(scene, gyro, sample.dt, sample.quality)
            return True
        if gyro is not None and not f.flags.in_air:
            # what stands on the ground does not move over it, whatever the camera sees
            dt = sample.dt if dt_fits else shortest
            self._sample = Compensated((0.0, 0.0), gyro, dt, sample.quality)
            return True
        self.for_terrain = False
        return False

    def _rate(self, sample: Compensated) -> tuple[float, float]:
        bias = self._motion.gyro_bias
        return (sample.scene[0] / sample.dt + float(bias[0]),
                sample.scene[1] / sample.dt + float(bias[1]))

    def _noise(self, quality: int) -> float:
        """Return the variance in (rad/s)^2: between two sigmas, by quality."""
        params = self._f.params.flow
        best = max(params.noise, NOISE_MIN)
        worst = max(params.noise_at_min_quality, NOISE_MIN)
        span = 255.0 - params.min_quality
        weight = 1.0 if span <= 0.0 else (quality - params.min_quality) / span
        weight = min(max(weight, 0.0), 1.0)
        return (weight * best + (1.0 - weight) * worst) ** 2

    def _body_velocity(self, sample: Compensated, rot: Array) -> tuple[float, float]:
        """Return the velocity of the camera along body x and y, m/s; rot is R of the state."""
        f = self._f
        velocity = f.x[4:7]
        if f.flow_lever is not None:
            velocity = velocity + f.rot @ cross(sample.gyro / -sample.dt, f.flow_lever)
        body = velocity @ rot
        return float(body[0]), float(body[1])

    # ---- start, continue, stop ----

    def _control(self) -> None:
        f = self._f
        flags = f.flags
        inhibited = self._inhibited()
        if flags.opt_flow and (inhibited or not f.params.flow.enabled):
            self.stop()
            return
        may_start = f.params.flow.enabled and not inhibited and flags.yaw_align
        if not flags.opt_flow and may_start:
            self._start()
        if not flags.opt_flow:
            return
        if f.recent(f.times.hagl, HAGL_COASTS_US):
            self._fuse()
            f.last_known_position = f.x[7:9].copy()
        timeout_us = round(f.params.aiding.reset_timeout * SECOND)
        if f.late(f.times.flow, timeout_us) and not flags.aided_other_than(flags.opt_flow):
            self._reset_to_flow()

    def _inhibited(self) -> bool:
        """True where motion or unknown terrain spoil flow that nothing needs."""
        f = self._f
        flags = f.flags
        if not flags.tilt_align:
            return True
        if not flags.in_air:
            return not self._motion.suits_on_ground()
        limit = POOR_GNSS_WHILE_FUSING if flags.opt_flow else POOR_GNSS
        only_source = flags.opt_flow and not flags.aided_other_than(flags.opt_flow)
        poor_gnss = flags.gps and self._checks.error_norm > limit
        required = f.dead_reckoning or only_source or poor_gnss
        return not self._terrain.valid and not required

    def _start(self) -> None:
        f = self._f
        f.flags.opt_flow = True
        f.times.flow = f.t_now
        if not f.flags.aided_other_than(f.flags.opt_flow):
            self._reset_to_flow()

    def _reset_to_flow(self) -> None:
        self._resets.velocity_to_aiding(self._checks.healthy)
        self._resets.position_to_aiding()

    def stop(self) -> None:
        """Stop flow as horizontal aiding."""
        f = self._f
        f.flags.opt_flow = False
        f.observations.flow.clear(f.t_now)

    # ---- fusion ----

    def _fuse(self) -> None:
        """Gate both axes together and fuse them one by one, each linearised before the first."""
        f = self._f
        sample, gate = self._sample, f.params.flow.gate
        assert sample is not None
        rot = matrix_from_quat(f.x[0:4])
        rate = self._rate(sample)
        if not math.hypot(*rate) < f.params.flow.max_rate:
            return
        distance = self._camera_height() / float(rot[2, 2])
        along, across = self._body_velocity(sample, rot)
        innovation = (across / distance - rate[0], -along / distance - rate[1])
        noise = self._noise(sample.quality)
        flow_jacobians(f.x, distance, self._h)
        variance = (project(f.cov.p, self._h[0], self._hp[0]) + noise,
                    project(f.cov.p, self._h[1], self._hp[1]) + noise)
        if min(variance) < noise:
            f.covariance_lost = True
            return
        if self._passes(innovation, variance, gate):
            self._apply(innovation, variance)

    def _camera_height(self) -> float:
        f = self._f
        height = self._terrain.down - float(f.x[PD])
        if f.flow_lever is not None:
            height -= float(f.rot[2] @ f.flow_lever)
        return max(height, f.params.terrain.ground_clearance, CLEARANCE_MIN)

    def _passes(
        self, innovation: tuple[float, float], variance: tuple[float, float], gate: float,
    ) -> bool:
        f = self._f
        record, rejections = f.observations.flow, f.rejections
        ratios = [test_ratio(i, s, gate) for i, s in zip(innovation, variance, strict=True)]
        rejections.flow_x, rejections.flow_y = (ratio > 1.0 for ratio in ratios)
        rejections.flow_judged_after_hagl = True
        return record.note(f.t_now, innovation, variance, max(ratios), max(ratios) <= 1.0)

    def _apply(self, innovation: tuple[float, float], variance: tuple[float, float]) -> None:
        f = self._f
        early = self._hp[1] / variance[1]
        learned = 1.0 - f.cov.inhibited
        for axis in range(2):
            project(f.cov.p, self._h[axis], self._hp[axis])
            gain = self._hp[axis] / variance[axis]
            if axis == 1:
                # attitude and velocity gains belong to the covariance before the first axis
                gain[0:7] = early[0:7]
            gain[13:16] *= learned
            healthy = f.cov.fuse(f.x, gain, self._hp[axis], innovation[axis])
            if axis == 0:
                f.faults.flow_x = not healthy
            else:
                f.faults.flow_y = not healthy
            if healthy:
                f.times.flow = f.t_now

    def aid_terrain(self) -> None:
        """Fuse a sample that the range finder's silence has left to the terrain."""
        f = self._f
        if not f.flags.in_air or not f.params.terrain.use_flow or self._sample is None:
            return
        self.for_terrain = False
        sample = self._sample
        rot = matrix_from_quat(f.x[0:4])
        innovation, variance = self._terrain.fuse_flow(
            self._rate(sample), self._body_velocity(sample, rot), float(rot[2, 2]),
            self._noise(sample.quality), f.params.flow.gate)
        f.observations.flow.innovation = innovation
        f.observations.flow.variance = variance

    # ---- reset ----

    def velocity(self, cos_tilt: float) -> tuple[Array, Array]:
        """Return NE velocity (2,) in m/s and its variances (2,) from the newest flow.

        cos_tilt: cosine of the tilt of the range finder.
        """
        f = self._f
        sample = self._sample
        assert sample is not None
        clearance = f.params.terrain.ground_clearance
        distance = max(self._terrain.down - float(f.x[PD]), clearance) / cos_tilt
        variance = np.full(2, distance * distance * self._noise(sample.quality))
        if distance - clearance <= 0.3:
            return np.zeros(2), variance
        x, y = sample.scene
        body = np.array((-distance * y / sample.dt, distance * x / sample.dt, 0.0))
        return (f.rot @ body)[0:2], variance
