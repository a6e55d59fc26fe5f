"""A beacon on the ground that tells the velocity of the vehicle, as for a precision landing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.simulation import noise
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class AuxiliaryVelocity(Sensor):
    """Velocity against a target at rest with white errors of `vel_noise` m/s per axis.

    Nothing is measured further than `reach` m above the ground the flight starts from.
    """

    rate: float = 20.0
    vel_noise: float = 0.1
    reach: float = 100.0

    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[AuxVelocitySample]:
        instants = self.instants_us(trajectory)
        motion = trajectory.motion(instants * 1e-6).at_point(np.array(self.lever_arm))
        velocity = motion.velocity + noise.white(rng, self.vel_noise, motion.velocity.shape)
        variance = np.full(3, max(self.vel_noise, 0.01) ** 2)
        seen = self.present(instants) & (-motion.position[:, 2] <= self.reach)
        stamps = self.stamps(instants, start_us)
        return [AuxVelocitySample(stamps[k], velocity[k], variance)
                for k in np.flatnonzero(seen)]
