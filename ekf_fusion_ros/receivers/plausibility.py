"""Receivers against each other and the prediction: one that deviates is excluded."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Mapping
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.receivers.prediction import Prediction
from ekf_fusion_ros.receivers.reading import KINDS
from ekf_fusion_ros.receivers.reading import PARTS
from ekf_fusion_ros.receivers.reading import UNITS
from ekf_fusion_ros.receivers.reading import Reading

Array = NDArray[np.float64]
MAJORITY = 3


class Plausibility:
    """Excludes a kind of measurement of a receiver that the majority contradicts.

    The receivers and, as long as it is accurate, the prediction have one vote each. With three
    votes or more the median decides, which one of them cannot pull; with two, the receiver that
    claims to be better. An excluded receiver is admitted again once it has agreed for some time.
    """

    def __init__(self, params: ReceiversParams) -> None:
        self._params = params
        self._smallest = (
            params.min_deviation, params.min_deviation, params.min_velocity_deviation)
        self._reasons: dict[tuple[str, int], str] = {}
        self._agreeing: dict[tuple[str, int], int] = {}

    def reason(self, name: str, kind: int) -> str:
        """Say why a kind of measurement of a receiver is excluded, '' where it is not."""
        return self._reasons.get((name, kind), '')

    def judge(
        self, readings: Mapping[str, Reading], new: Collection[str], prediction: Prediction,
        time_us: int,
    ) -> list[str]:
        """Judge the `new` readings by all newest ones; say who was excluded or admitted.

        One from before is not judged again: the prediction may have been reset since.
        """
        news: list[str] = []
        for kind in range(len(KINDS)):
            known = {name: reading for name, reading in readings.items() if reading.has(kind)}
            if len(known) < 2:
                continue
            reference, variance = self._reference(known, kind, prediction)
            for name in (name for name in new if name in known):
                difference = known[name].deviation[PARTS[kind]] - reference
                deviation = float(np.linalg.norm(difference))
                sigma = math.sqrt(known[name].sigma[kind] ** 2 + variance)
                limit = max(self._params.gate * sigma, self._smallest[kind])
                news += self._note(name, kind, deviation, limit, time_us)
        return news

    def _reference(
        self, known: Mapping[str, Reading], kind: int, prediction: Prediction,
    ) -> tuple[Array, float]:
        """Return what the majority says and its variance, taken for that of a mean."""
        votes = [reading.deviation[PARTS[kind]] for reading in known.values()]
        sigmas = [reading.sigma[kind] for reading in known.values()]
        if prediction.trusted and prediction.sigma[kind] <= self._smallest[kind]:
            votes.append(np.zeros_like(votes[0]))
            sigmas.append(prediction.sigma[kind])
        if len(votes) >= MAJORITY:
            median: Array = np.median(votes, axis=0)
            return median, sum(sigma ** 2 for sigma in sigmas) / len(sigmas) ** 2
        best = min(known, key=lambda name: (
            bool(self.reason(name, kind)), known[name].sigma[kind]))
        return known[best].deviation[PARTS[kind]], known[best].sigma[kind] ** 2

    def _note(
        self, name: str, kind: int, deviation: float, limit: float, time_us: int) -> list[str]:
        key, before = (name, kind), self.reason(name, kind)
        if deviation > limit:
            self._agreeing.pop(key, None)
            self._reasons[key] = (
                f'{deviation:.1f} {UNITS[kind]} from the majority, limit {limit:.1f}')
            return [] if before else [f'{name}: {KINDS[kind]} excluded, {self._reasons[key]}']
        if not before:
            return []
        since = self._agreeing.setdefault(key, time_us)
        if time_us - since < 1e6 * self._params.readmission_time:
            return []
        del self._reasons[key], self._agreeing[key]
        return [f'{name}: {KINDS[kind]} agrees again, admitted']
