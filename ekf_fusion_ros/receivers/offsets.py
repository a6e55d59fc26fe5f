"""Slowly filtered offsets between receivers, so that losing or gaining one makes no step."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_PRESENCE = 0.1
"""Share of its weight with which a receiver comes back: accuracies stay within those of fixes."""


class _Mean:
    """Mean deviation of one receiver: of all so far at first, then over the last seconds.

    presence: 0 to 1, from away for an averaging time to there for one.
    """

    def __init__(self, time_us: int, size: int) -> None:
        self.value = np.zeros(size)
        self.first_us = time_us
        self.last_us = time_us
        self.presence = 0.0
        self._count = 0

    def update(self, deviation: Array, time_us: int, time_constant_us: float) -> Array:
        """Take a deviation in and return by how much the mean has moved."""
        self._count += 1
        share = self.presence * (time_us - self.last_us) / time_constant_us
        self.last_us = time_us
        change: Array = min(1.0, max(share, 1.0 / self._count)) * (deviation - self.value)
        self.value = self.value + change
        return change


class Offsets:
    """The offset of each receiver from the level of the blend.

    Deviations from a common prediction are averaged for each receiver over `offset_time`. The
    level of the blend follows what the means have in common, which is the error of the
    prediction, at once; to the weighted mean of the receivers that are there it goes over
    slowly, within `handover_time`. So neither the weights nor who is there ever make it jump,
    and without a hand-over it is their weighted mean. A receiver counts for the level once it
    was averaged for an offset time; one that is absent is taken along with it. One that comes
    back contradicts the prediction by all that this has drifted without it: its weight, and how
    fast its mean forgets, grow with its presence.
    """

    def __init__(self, size: int, offset_time: float, handover_time: float) -> None:
        """Average vectors (size,); time constants in s."""
        self._offset_us = 1e6 * offset_time
        self._handover_us = 1e6 * handover_time
        self._size = size
        self._means: dict[str, _Mean] = {}
        self._level: Array = np.zeros(size)
        self._first_us: int | None = None
        self._last_us = 0

    def of(self, name: str) -> Array:
        """Return the offset (size,) of a receiver: its mean above the level of the blend."""
        mean = self._means.get(name)
        return np.zeros(self._size) if mean is None else mean.value - self._level

    def presence(self, name: str) -> float:
        """Return how long a receiver has been back against the others, LEAST_PRESENCE to 1."""
        longest = max((mean.presence for mean in self._means.values()), default=0.0)
        if longest == 0.0:
            return 1.0
        presence = self._means[name].presence if name in self._means else 0.0
        return max(LEAST_PRESENCE, presence / longest)

    def move(self, step: Array) -> None:
        """Take a reset of the prediction in, which moves all deviations (size,) alike."""
        for mean in self._means.values():
            mean.value = mean.value + step
        self._level = self._level + step

    def update(
        self, deviations: Mapping[str, Array], weights: Mapping[str, float], time_us: int,
    ) -> None:
        """Take in the deviations of one time; weights: of every receiver that is there."""
        self._note_presence(weights, time_us)
        changes = {name: self._average(name, deviation, time_us)
                   for name, deviation in deviations.items()}
        shares = self._shares(weights, time_us)
        move = sum((share * changes[name] for name, share in shares.items() if name in changes),
                   np.zeros(self._size))
        for name, mean in self._means.items():
            if name not in shares:
                mean.value = mean.value + move
        self._level = self._level + move
        self._hand_over(shares, time_us)

    def _note_presence(self, there: Collection[str], time_us: int) -> None:
        share = (time_us - self._last_us) / self._offset_us
        for name, mean in self._means.items():
            presence = mean.presence + (share if name in there else -share)
            mean.presence = min(1.0, max(0.0, presence))

    def _average(self, name: str, deviation: Array, time_us: int) -> Array:
        mean = self._means.get(name)
        if mean is None or time_us - mean.last_us > self._handover_us:
            mean = self._means[name] = _Mean(time_us, self._size)
        return mean.update(deviation, time_us, self._offset_us)

    def _shares(self, weights: Mapping[str, float], time_us: int) -> dict[str, float]:
        """Return the weights, of sum 1, of those that count for the level."""
        known = [name for name in weights if name in self._means and weights[name] > 0.0]
        settled = [name for name in known
                   if time_us - self._means[name].first_us >= self._offset_us]
        counting = settled or known
        total = sum(weights[name] for name in counting)
        return {name: weights[name] / total for name in counting}

    def _hand_over(self, shares: Mapping[str, float], time_us: int) -> None:
        if not shares:
            return
        target = sum((share * self._means[name].value for name, share in shares.items()),
                     np.zeros(self._size))
        if self._first_us is None:
            self._first_us, self._level = time_us, target
        elapsed = max(time_us - self._last_us, 0) if self._last_us else 0
        known_for = max(time_us - self._first_us, 1)
        self._last_us = time_us
        share = min(1.0, elapsed / min(self._handover_us, known_for))
        self._level = self._level + share * (target - self._level)
