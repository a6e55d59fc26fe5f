"""The one sentence that says what the node is doing or waiting for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.statistics import RoleStatistics

INERTIAL_SILENCE_S = 1.0
NAMES = {'odometry': 'odometry', 'fix': 'a fix', 'imu': 'IMU data'}
USABLE_NAMES = {'odometry': 'usable odometry', 'fix': 'a usable fix', 'imu': 'usable IMU data'}
DISABLED = 'disabled: call ~/set_enabled with data: true, or enable'
PREPARING = 'preparing the compiled kernels, which takes a minute the first time'


@dataclass(frozen=True, slots=True)
class InputSeen:
    """What is known of one input: topic, counts, silence in s, its publishers in words."""

    role: str
    topic: str
    counts: RoleStatistics
    age: float | None
    publishers: Callable[[], str]


def situation(
    health: Health, waiting: InputSeen | None, inertial: InputSeen, *, enabled: bool = True,
) -> Health:
    """Return the health of a session, or the nearer reason why nothing can come of it.

    `waiting`: the input without which nothing can start; `inertial`: the one that drives time.
    """
    if not enabled:
        return Health(HealthLevel.WARN, DISABLED, health.values)
    if waiting is not None:
        return Health(HealthLevel.WARN, waiting_sentence(waiting), health.values)
    if inertial.age is not None and inertial.age > INERTIAL_SILENCE_S:
        text = (f'no {NAMES[inertial.role]} for {inertial.age:.0f} s: {inertial.topic} has '
                f'{inertial.publishers()}')
        return Health(HealthLevel.ERROR, text, health.values)
    return health


def waiting_sentence(seen: InputSeen) -> str:
    """Say what is waited for, and why it has not come."""
    counts = seen.counts
    if counts.received == 0:
        return (f'waiting for {NAMES[seen.role]}: {seen.topic} has 0 messages, '
                f'{seen.publishers()}')
    text = f'waiting for {USABLE_NAMES[seen.role]}: {seen.topic} has {counts.received} messages'
    if not counts.refused:
        return f'{text}, none judged yet'
    reasons = ', '.join(f'{count} {reason}' for reason, count in sorted(counts.refused.items()))
    return f'{text}, refused: {reasons}; the last: {counts.last_refusal}'
