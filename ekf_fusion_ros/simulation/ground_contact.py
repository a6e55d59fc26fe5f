"""Land detector, and the switch that arms the vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class GroundContact(Sensor):
    """Tells that the vehicle is on the ground: lower than `height` m over it and at rest.

    The height is that of the body origin, which stands `clearance` m above the ground at rest; at
    rest is slower than `speed` m/s. `fixed_wing` and `fuse_beta` are passed on.
    """

    rate: float = 5.0
    height: float = 0.1
    clearance: float = 0.0
    speed: float = 0.2
    fixed_wing: bool = False
    fuse_beta: bool = False

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[LandedSample]:
        instants = self.instants_us(trajectory)
        motion = trajectory.motion(instants * 1e-6)
        north, east, down = motion.position.T
        height = trajectory.terrain.down(north, east) - down - self.clearance
        still = np.linalg.norm(motion.velocity, axis=1) < self.speed
        landed = (height < self.height) & still
        stamps = self.stamps(instants, start_us)
        return [LandedSample(stamps[k], bool(landed[k]), self.fixed_wing, self.fuse_beta)
                for k in np.flatnonzero(self.present(instants))]


@dataclass(frozen=True, kw_only=True)
class Arming(Sensor):
    """Tells that the vehicle is armed from `armed_at` to `disarmed_at` s after the start."""

    rate: float = 2.0
    armed_at: float = 0.0
    disarmed_at: float = math.inf

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[ArmedSample]:
        instants = self.instants_us(trajectory)
        stamps = self.stamps(instants, start_us)
        armed = (instants >= 1e6 * self.armed_at) & (instants < 1e6 * self.disarmed_at)
        return [ArmedSample(stamps[k], bool(armed[k]))
                for k in np.flatnonzero(self.present(instants))]
