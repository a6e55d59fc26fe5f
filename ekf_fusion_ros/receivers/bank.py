"""Two or more receivers become one: fixes of an epoch, blended by their accuracy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import replace
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import OVERTAKEN
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.receivers.offsets import Offsets
from ekf_fusion_ros.receivers.plausibility import Plausibility
from ekf_fusion_ros.receivers.prediction import Prediction
from ekf_fusion_ros.receivers.reading import KINDS
from ekf_fusion_ros.receivers.reading import PARTS
from ekf_fusion_ros.receivers.reading import Reading
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import Antenna
from ekf_fusion_ros.samples import GnssSample

Array = NDArray[np.float64]

POSITION, HEIGHT, VELOCITY = range(len(KINDS))
KINDS_WITH_OFFSET = (POSITION, HEIGHT)
UNKNOWN_HEIGHT_EPV = 1e3
LEFT_OUT = 'left_out_of_blend'
EPOCH_INTERVAL_US = 40_000
"""Fixes closer together than this belong to one epoch: the filter takes none so close."""


@dataclass(frozen=True, slots=True, eq=False)
class Receiver:
    """Antenna (3,) m in the body FRD, and delay of the receiver in us."""

    antenna: Array
    delay_us: int


@dataclass(frozen=True, slots=True)
class ReceiverStatus:
    """What becomes of one receiver.

    weights: share of position, height and velocity in the blend; offset: N, E, D in m above the
    blend, which is taken off; obstacles: in words why a kind is not used, by kind.
    """

    name: str
    live: bool
    weights: tuple[float, ...]
    offset: tuple[float, ...]
    obstacles: Mapping[str, str]


class ReceiverBank:
    """Blends the fixes of several receivers on a common time base.

    Each fix counts once: those of an epoch, at most one of each receiver, are carried to the
    newest of their times by the prediction and averaged with weights 1/sigma^2, position, height
    and velocity each by their own. What a receiver deviates from the others on average is taken
    off before (Offsets), what contradicts the majority is left out (Plausibility). A receiver
    that fails a check is used nevertheless while no other is better: the filter has gates of its
    own.
    """

    def __init__(
        self, receivers: Mapping[str, Receiver], params: ReceiversParams, projection: str,
        wait_limit_us: int, state: Callable[[], NavState | None],
    ) -> None:
        """Blend these receivers, the first of which lends its delay to the blend.

        No epoch waits for longer than wait_limit_us; `state` returns the present estimate.
        """
        self._receivers = receivers
        self._params = params
        self._projection = projection
        self._wait_us = min(round(1e3 * params.wait_ms), wait_limit_us)
        self._timeout_us = round(1e6 * params.timeout)
        self._state = state
        self._delay_us = next(iter(receivers.values())).delay_us
        self._epoch: dict[str, GnssSample] = {}
        self._newest_us: dict[str, int] = {}
        self._present: set[str] = set()
        self._readings: dict[str, Reading] = {}
        self._last_us = 0
        self._prediction: Prediction | None = None
        self._plausibility = Plausibility(params)
        self._offsets = {kind: Offsets(PARTS[kind].stop - PARTS[kind].start, params.offset_time,
                                       params.handover_time) for kind in KINDS_WITH_OFFSET}
        self._events: list[Event] = []
        self.passed_over: dict[str, Counter[str]] = {name: Counter() for name in receivers}
        """Fixes that went into no blended position, by receiver and reason."""

    @property
    def waiting(self) -> bool:
        """True while an epoch is open or a receiver may yet be lost."""
        return bool(self._epoch or self._newest_us)

    def push(self, name: str, fix: GnssSample) -> list[GnssSample]:
        """Take a fix of a receiver; return the blended ones that it completes."""
        own_delay_us = self._receivers[name].delay_us
        if own_delay_us != self._delay_us:
            fix = fix._replace(time_us=fix.time_us - own_delay_us + self._delay_us)
        self._note_arrival(name, fix.time_us)
        blended: list[GnssSample] = []
        if name in self._epoch and not self._is_late(name):
            blended = self._close()
        self._give_up(name)
        self._epoch[name] = fix
        complete = not any(name not in self._epoch or self._is_late(name)
                           for name in self._newest_us)
        return blended + (self._close() if complete else [])

    def _give_up(self, name: str) -> None:
        """Drop a late fix that was still alone when the next one came."""
        if self._epoch.pop(name, None) is not None:
            self.passed_over[name][OVERTAKEN] += 1

    def _note_arrival(self, name: str, time_us: int) -> None:
        if not self._present:
            self._newest_us = dict.fromkeys(self._receivers, time_us)
        if name not in self._present:
            self._present.add(name)
            self._events.append(Event(time_us, f'{name}: the receiver is there'))
        self._newest_us[name] = max(time_us, self._newest_us.get(name, 0))

    def _is_late(self, name: str) -> bool:
        """True for a fix of the epoch that should have been in the one before."""
        return self._epoch[name].time_us - self._last_us < EPOCH_INTERVAL_US

    def advance(self, now_us: int) -> list[GnssSample]:
        """Return what is due at inertial time now_us; notice who has fallen silent."""
        for name, newest_us in list(self._newest_us.items()):
            if now_us - newest_us > self._timeout_us:
                del self._newest_us[name]
                self._readings.pop(name, None)
                self._give_up(name)
                self._present.discard(name)
                self._events.append(Event(
                    now_us, f'{name}: the receiver is silent, no fix for '
                    f'{self._params.timeout:g} s'))
        oldest_us = min((fix.time_us for fix in self._epoch.values()), default=now_us)
        return self._close() if now_us - oldest_us > self._wait_us else []

    def flush(self) -> list[GnssSample]:
        """Give up waiting."""
        blended = self._close()
        for name in list(self._epoch):
            self._give_up(name)
        return blended

    def drain_events(self) -> list[Event]:
        """Return and forget who came, went, was excluded and admitted."""
        events, self._events = self._events, []
        return events

    def statuses(self) -> list[ReceiverStatus]:
        """Return what becomes of each receiver now."""
        return [self._status(name) for name in self._receivers]

    def _status(self, name: str) -> ReceiverStatus:
        weights = [self._shares(kind).get(name, 0.0) for kind in range(len(KINDS))]
        offset = [float(x) for kind in KINDS_WITH_OFFSET for x in self._offsets[kind].of(name)]
        live = name in self._readings
        obstacles = {KINDS[kind]: self._obstacle(name, kind) for kind in range(len(KINDS))
                     if live and self._obstacle(name, kind)}
        return ReceiverStatus(name, live, tuple(weights), tuple(offset), obstacles)

    def _close(self) -> list[GnssSample]:
        """Blend the fixes of the epoch; late ones that are alone join the next."""
        if all(self._is_late(name) for name in self._epoch):
            return []
        time_us = self._last_us = max(fix.time_us for fix in self._epoch.values())
        epoch, self._epoch = self._epoch, {}
        prediction = Prediction(
            self._state(), next(iter(epoch.values())), self._delay_us, self._projection)
        self._follow_reset(prediction)
        for name, fix in epoch.items():
            self._readings[name] = Reading.of(fix, prediction.deviation(
                fix, fix.time_us - self._delay_us, self._receivers[name].antenna))
        news = self._plausibility.judge(self._readings, list(epoch), prediction, time_us)
        self._events += [Event(time_us, text) for text in news]
        if prediction.trusted:
            self._follow_offsets(epoch, time_us)
        blended = self._blend(list(epoch), prediction, time_us)
        return [] if blended is None else [blended]

    def _follow_reset(self, prediction: Prediction) -> None:
        """Compare what was measured before a reset of the estimate with the new estimate."""
        before, self._prediction = self._prediction, prediction
        step = np.zeros(6) if before is None else np.append(
            -prediction.jump_since(before), np.zeros(3))
        if step.any():
            self._readings = {
                name: replace(reading, deviation=reading.deviation + step)
                for name, reading in self._readings.items()}
            for kind, offsets in self._offsets.items():
                offsets.move(step[PARTS[kind]])

    def _follow_offsets(self, names: Mapping[str, GnssSample], time_us: int) -> None:
        for kind, offsets in self._offsets.items():
            shares = self._shares(kind)
            offsets.update(
                {name: self._readings[name].deviation[PARTS[kind]] for name in names
                 if name in shares}, shares, time_us)

    def _blend(
        self, names: list[str], prediction: Prediction, time_us: int) -> GnssSample | None:
        """Return the mean of the readings, None where the position of none is usable."""
        shares = [self._shares(kind, names) for kind in range(len(KINDS))]
        for name in names:
            self.passed_over[name][LEFT_OUT] += name not in shares[POSITION]
        if not shares[POSITION]:
            return None
        arms = Antenna(*(sum((share * self._receivers[name].antenna
                              for name, share in of_kind.items()), np.zeros(3))
                         for of_kind in shares))
        place = prediction.place(
            self._mean_deviation(shares), time_us - self._delay_us, arms)
        eph, epv, sacc = (min((self._sigma(name, kind) for name in of_kind),
                              default=math.nan) for kind, of_kind in enumerate(shares))
        best = max(shares[POSITION], key=lambda name: shares[POSITION][name])
        fixes = [self._readings[name].fix for name in shares[POSITION]]
        with_yaw = next((fix for fix in fixes if math.isfinite(fix.yaw)), fixes[0])
        return self._readings[best].fix._replace(
            time_us=time_us, lat=place.lat, lon=place.lon,
            alt=place.alt, eph=eph, epv=epv if shares[HEIGHT] else UNKNOWN_HEIGHT_EPV,
            velocity=place.velocity if shares[VELOCITY] else NAN3, sacc=sacc,
            fix_type=max(fix.fix_type for fix in fixes),
            nsats=max((fix.nsats for fix in fixes if fix.nsats is not None), default=None),
            pdop=min((fix.pdop for fix in fixes if fix.pdop is not None), default=None),
            yaw=with_yaw.yaw, yaw_offset=with_yaw.yaw_offset,
            yaw_accuracy=with_yaw.yaw_accuracy, antenna=arms)

    def _mean_deviation(self, shares: list[dict[str, float]]) -> Array:
        mean = np.zeros(6)
        for kind, of_kind in enumerate(shares):
            for name, share in of_kind.items():
                deviation = self._readings[name].deviation[PARTS[kind]]
                if kind in self._offsets:
                    deviation = deviation - self._offsets[kind].of(name)
                mean[PARTS[kind]] += share * deviation
        return mean

    def _shares(self, kind: int, among: list[str] | None = None) -> dict[str, float]:
        """Return the weights of the usable receivers for a kind, of sum 1; zero ones left out."""
        usable = [name for name, reading in self._readings.items() if reading.has(kind)]
        fine = [name for name in usable if not self._obstacle(name, kind)]
        chosen = [name for name in fine or usable if among is None or name in among]
        inverse = {name: self._sigma(name, kind) ** -2 for name in chosen}
        total = sum(inverse.values())
        return {name: weight / total for name, weight in inverse.items()}

    def _sigma(self, name: str, kind: int) -> float:
        """Return the accuracy to weigh a receiver by: that it claims, less for one just back."""
        sigma = self._readings[name].sigma[kind]
        if kind not in self._offsets:
            return sigma
        return sigma / math.sqrt(self._offsets[kind].presence(name))

    def _obstacle(self, name: str, kind: int) -> str:
        return (self._plausibility.reason(name, kind)
                or self._readings[name].shortcoming(kind, self._params))
