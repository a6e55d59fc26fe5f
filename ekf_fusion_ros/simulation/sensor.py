"""What all simulated sensors share: rate, stamps, delays and outages."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.simulation.trajectory import Trajectory

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)
Window = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Sensor(ABC):
    """A sensor that measures a trajectory at a constant rate.

    rate Hz; the first measurement is `phase` s after the start. The message stamp is
    `stamp_delay` s later than the measurement; the message arrives `latency` s after its stamp.
    lever_arm (3,) m is the place of the sensor in the body, FRD. Nothing is measured inside
    `outages`, windows [start, end) in s from the start.
    """

    rate: float
    phase: float = 0.0
    stamp_delay: float = 0.0
    latency: float = 0.0
    lever_arm: Vector = ZERO
    outages: tuple[Window, ...] = ()

    @abstractmethod
    def measure(
        self, trajectory: Trajectory, start_us: int, rng: np.random.Generator,
    ) -> Sequence[Sample]:
        """Return the samples in order; the trajectory starts at start_us."""

    def instants_us(self, trajectory: Trajectory) -> NDArray[np.int64]:
        """Return the times of measurement (N,), us from the start, outages included."""
        count = int((trajectory.duration - self.phase) * self.rate + 1e-6) + 1
        times = self.phase + np.arange(count) / self.rate
        return np.rint(times * 1e6).astype(np.int64)

    def present(self, instants_us: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which instants (N,) lie outside the outages."""
        seconds = instants_us * 1e-6
        kept = np.ones(len(seconds), dtype=bool)
        for begin, end in self.outages:
            kept &= (seconds < begin) | (seconds >= end)
        return kept

    def stamps(self, instants_us: NDArray[np.int64], start_us: int) -> list[int]:
        """Return the message stamps of measurements."""
        return [int(t) + start_us + round(self.stamp_delay * 1e6) for t in instants_us]


def intervals(instants_us: NDArray[np.int64]) -> Array:
    """Return the time in s before each instant (N,); none before the first."""
    return np.diff(instants_us, prepend=instants_us[:1]) * 1e-6
