"""What became of the messages of one input: counts, rate, age, delay, verdicts of the filter."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import math

from ekf_fusion_ros.airspeed_conditions import BELOW_THRESHOLD
from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.statistics import RoleStatistics

# Roles that need not speak while nothing changes.
TOLD_ON_CHANGE = ('landed', 'armed')
# Why messages are refused while all is well: a vehicle that is slow or parked.
EXPECTED_REASONS = (BELOW_THRESHOLD,)

AIDS = {
    'odometry': ('vision_position', 'vision_height', 'vision_velocity',
                 'vision_vertical_velocity', 'vision', 'mocap'),
    'fix': ('gnss_position', 'gnss_height', 'gnss'),
    'fix_velocity': ('gnss_velocity', 'gnss_vertical_velocity'),
    'magnetic_field': ('magnetic_field', 'declination'),
    'pressure': ('baro_height', 'baro'),
    'range': ('range_height', 'height_above_ground', 'lidar', 'sonar'),
    'flow': ('optical_flow',),
    'airspeed': ('airspeed',),
    'aux_velocity': ('auxiliary_velocity', 'landing_target'),
}
"""Kinds of observation that come of a role, in EKF2 and in LPE."""

RATE_WINDOW_S = 5.0
SILENCE_S = 1.5
USUAL_INTERVALS = 3.0
CLOCK_TOLERANCE_S = 1.0


class SourceWatch:
    """Turns counts and arrivals of one role into a report, level by what is new since the last.

    `arrived` is the time of the newest arrival and `note_stamp` takes its stamp, both in s.
    """

    def __init__(self, role: str, topic: str) -> None:
        self.role = role
        self.topic = topic
        self.arrived: float | None = None
        self.switched_on = True
        self._refused = 0
        self._counted: deque[tuple[float, int]] = deque()

    def age(self, now: float) -> float | None:
        """Return the time in s since the newest arrival, None before the first."""
        return None if self.arrived is None else now - self.arrived

    def report(
        self, counts: RoleStatistics, now: float, aids: Sequence[AidStatus] = (),
        delay: float | None = None,
    ) -> Report:
        """Report at time `now` in s.

        `delay`: from stamp to arrival of the newest message in s, by the clock of the node.
        """
        rate = self._rate(counts.received, now)
        refused = sum(
            count for why, count in counts.refused.items() if why not in EXPECTED_REASONS)
        new_refused = refused - self._refused
        self._refused = refused
        mine = [aid for aid in aids if aid.name in AIDS.get(self.role, ())]
        silent = self._silent(rate, now)
        rejected = [aid.name for aid in mine if aid.active and aid.innovation_rejected]
        bad_clock = delay is not None and abs(delay) > CLOCK_TOLERANCE_S
        troubled = silent or new_refused or rejected or bad_clock or not self.switched_on
        level = HealthLevel.WARN if troubled else HealthLevel.OK
        words = [self._sentence(counts), self._silence(silent, now)]
        words += [f'{name} rejected by the filter' for name in rejected]
        words.append(clock_words(delay) if bad_clock and delay is not None else '')
        text = ', '.join(word for word in words if word)
        values = {**self._values(counts, rate, now, delay), **verdicts(mine)}
        return Report(self.role, level, text, values)

    def _rate(self, received: int, now: float) -> float:
        """Return the rate in Hz of arrival over the last seconds."""
        while self._counted and now - self._counted[0][0] > RATE_WINDOW_S:
            self._counted.popleft()
        self._counted.append((now, received))
        elapsed = now - self._counted[0][0]
        return (received - self._counted[0][1]) / elapsed if elapsed > 0.0 else 0.0

    def _silent(self, rate: float, now: float) -> bool:
        age = self.age(now)
        if age is None:
            return True
        usual = USUAL_INTERVALS / rate if rate > 0.0 else 0.0
        return age > max(SILENCE_S, usual) and self.role not in TOLD_ON_CHANGE

    def _silence(self, silent: bool, now: float) -> str:
        age = self.age(now)
        return f'none for {age:.1f} s' if silent and age is not None else ''

    def _values(
        self, counts: RoleStatistics, rate: float, now: float, delay: float | None,
    ) -> dict[str, str]:
        age = self.age(now)
        reasons = sorted(counts.refused.items())
        values = {
            'topic': self.topic, 'received': str(counts.received),
            'accepted': str(counts.accepted), 'pending': str(counts.pending),
            'refused': str(counts.refused_total), 'rate': f'{rate:.1f}',
            'age': '' if age is None else f'{age:.3f}',
            'delay': '' if delay is None else f'{delay:.3f}',
            'last_refusal': counts.last_refusal}
        values.update({f'refused.{reason}': str(count) for reason, count in reasons})
        values.update({f'detail.{reason}': counts.details[reason] for reason, _ in reasons})
        passed_over = sorted(counts.passed_over.items())
        values.update({f'passed_over.{reason}': str(count) for reason, count in passed_over})
        return values

    def _sentence(self, counts: RoleStatistics) -> str:
        off = '' if self.switched_on else 'switched off, '
        if not counts.received:
            return f'{off}nothing received on {self.topic} yet'
        words = [f'{off}{counts.received} received on {self.topic}']
        words += [f'{count} refused: {reason}' for reason, count in sorted(counts.refused.items())]
        return ', '.join(words)


def verdicts(aids: Sequence[AidStatus]) -> dict[str, str]:
    """Return what the filter made of the observations of one role.

    `test_ratio` is the largest innovation against its limit: above 1 it is rejected.
    """
    if not aids:
        return {}
    rejected = [aid for aid in aids if aid.innovation_rejected]
    return {
        'test_ratio': f'{max(math.sqrt(aid.test_ratio) for aid in aids):.3f}',
        'fused': str(sum(aid.fused for aid in aids)),
        'rejected': str(sum(aid.rejected for aid in aids)),
        'in_use': ' '.join(aid.name for aid in aids if aid.active) or 'none',
        'last_rejection': '; '.join(_rejection(aid) for aid in rejected),
    }


def _rejection(aid: AidStatus) -> str:
    size = math.hypot(*aid.innovation)
    return f'{aid.name}: innovation {size:.3g}, {math.sqrt(aid.test_ratio):.2f} times its limit'


def clock_words(delay: float) -> str:
    """Say how far the stamps are from the clock of the node, and what that may mean."""
    if delay < 0.0:
        return f'stamps are {-delay:.1f} s ahead of the clock of this node: are clocks in step?'
    return (f'stamps are {delay:.1f} s behind the clock of this node: a recording needs '
            'use_sim_time, else are clocks in step?')
