"""What every sensor does: measure, initialise, correct, time out."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from collections import Counter
from typing import Any
from typing import ClassVar

from ekf_fusion_ros.lpe.correction import Measurement
from ekf_fusion_ros.lpe.correction import innovation_of
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.observation import Observation

TOO_LATE = 'too_late'
NOT_GOOD_ENOUGH = 'not_good_enough_to_start'


class Sensor(ABC):
    """A sensor begins timed out; more than `required` good samples initialise it.

    From then on each good sample corrects, until none has come for `timeout_us`. A sample whose
    normalised innovation is above its threshold times `tolerance` marks the sensor as faulty, the
    next below clears that; `drops_faulty` says whether such a sample is kept from the state.
    """

    name: ClassVar[str]
    size: ClassVar[int] = 1
    required: ClassVar[int]
    timeout_us: ClassVar[int]
    tolerance: ClassVar[float] = 1.0
    drops_faulty: ClassVar[bool] = True

    def __init__(self, f: Filter) -> None:
        """Work on a filter."""
        self._f = f
        self.observation = Observation(self.name, self.size)
        self.passed_over: Counter[str] = Counter()
        self.timed_out = True
        self.faulty = False
        self.updated = False
        self._waiting: list[Any] = []
        self._good = 0
        self._last_us = 0

    @abstractmethod
    def measure(self, sample: Any) -> Any | None:
        """Return what a sample tells, None where it is unusable (and count why)."""

    @abstractmethod
    def model(self, measured: Any) -> Measurement | None:
        """Return the linear measurement that an initialised sensor makes of it."""

    def enabled(self) -> bool:
        """Return whether the fusion mask has the sensor."""
        return True

    def gather(self, measured: Any) -> bool:
        """Take a good sample of the initialisation; False where it has to begin again."""
        return True

    def begin(self) -> None:
        """Conclude the initialisation."""
        self.forget()
        self.timed_out = self.faulty = False
        self.observation.note_active(True)
        self._f.tell(f'{self.name} initialised')

    def forget(self) -> None:
        """Forget the samples of the initialisation."""
        self._good = 0

    def push(self, sample: Any) -> None:
        """Queue a sample for the next step."""
        if self.enabled():
            self._waiting.append(sample)
        else:
            self.passed_over['not_enabled'] += 1

    def check_timeout(self) -> None:
        """Begin again where nothing good has come for too long."""
        if not self.timed_out and self._f.now_us - self._last_us > self.timeout_us:
            self.timed_out = True
            self.forget()
            self.observation.note_active(False)
            self._f.tell(f'{self.name} timed out')

    def step(self) -> None:
        """Take what has come since the last step."""
        waiting, self._waiting = self._waiting, []
        self.updated = False
        for sample in waiting:
            measured = self.measure(sample)
            if measured is None:
                continue
            self.updated = True
            self._last_us = self._f.now_us
            if self.timed_out:
                self._initialise(measured)
            else:
                self._correct(measured)

    def _initialise(self, measured: Any) -> None:
        if not self.gather(measured):
            self.passed_over[NOT_GOOD_ENOUGH] += 1
            self.forget()
            return
        self._good += 1
        if self._good > self.required:
            self.begin()

    def _correct(self, measured: Any) -> None:
        f = self._f
        m = self.model(measured)
        if m is None:
            return
        innovation = innovation_of(f.x, f.P, m)
        ratio = innovation.ratio / self.tolerance
        self._note_fault(ratio > 1.0)
        used = not (self.faulty and self.drops_faulty)
        self.observation.note(f.now_us, [-r for r in innovation.residual.tolist()],
                              innovation.S.diagonal().tolist(), ratio, used)
        if used:
            f.correct(m.C, innovation)

    def _note_fault(self, faulty: bool) -> None:
        if faulty != self.faulty:
            self.faulty = faulty
            self._f.tell(f'{self.name} ' + (
                'contradicts the estimate' if faulty else 'agrees with the estimate again'))
