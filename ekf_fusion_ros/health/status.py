"""What navigation health says: a record for programs, a sentence for people."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping
import math
from typing import NamedTuple

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.health.home import Accuracy
from ekf_fusion_ros.health.home import Home
from ekf_fusion_ros.health.home import Shortfall
from ekf_fusion_ros.health.takeoff_test import Verdict
from ekf_fusion_ros.health.validity import ValidityFlag

SECOND = 1_000_000
UNKNOWN = Accuracy(math.nan, math.nan, math.nan)
UNITS = {'global position': 'm', 'local position': 'm', 'local velocity': 'm/s'}
FLAGS = tuple(UNITS)


class NavigationStatus(NamedTuple):
    """Health at `time_us`, before the first step all invalid.

    missing: what home waits for, empty where it could be set. ready: the vehicle may be armed, by
    what the parameters ask of navigation.
    """

    time_us: int = 0
    global_position_valid: bool = False
    local_position_valid: bool = False
    local_velocity_valid: bool = False
    takeoff_test: Verdict = Verdict.OPEN
    home: Home | None = None
    missing: tuple[Shortfall, ...] = ()
    ready: bool = False
    accuracy: Accuracy = UNKNOWN

    @property
    def home_text(self) -> str:
        """Say where home is, or why there is none and for how long."""
        if self.home is None:
            waits = '; '.join(shortfall.sentence(self.time_us) for shortfall in self.missing)
            nothing = 'the vehicle is armed' if self.time_us else 'there is no estimate yet'
            return f'home not set: {waits or nothing}'
        hand = ' by hand' if self.home.manual else ''
        return f'home set{hand}: {place(self.home)}'


def navigation_report(
    status: NavigationStatus, flags: Mapping[str, ValidityFlag], *, expects_home: bool,
    detail: str = '',
) -> Health:
    """Return level, one sentence and the numbers behind it.

    Without `expects_home` neither home nor a global position is missed.
    """
    sentences = list(_complaints(status, flags, expects_home, detail))
    level = HealthLevel.WARN if sentences else HealthLevel.OK
    if status.takeoff_test is Verdict.FAILED:
        level = HealthLevel.ERROR
    good = status.home_text if expects_home else 'local position and velocity valid'
    return Health(level, '; '.join(sentences) or good, _values(status, flags))


def _complaints(
    status: NavigationStatus, flags: Mapping[str, ValidityFlag], expects_home: bool, detail: str,
) -> Iterator[str]:
    if status.takeoff_test is Verdict.FAILED:
        yield 'navigation failed after take-off: disarm, and check compass and heading'
        return
    if expects_home and status.home is None:
        yield status.home_text + (f' ({detail})' if detail else '')
        return
    for name, flag in flags.items():
        if not flag.valid and (expects_home or name != 'global position'):
            yield f'{name} not valid: {_reason(name, flag)}, for ' \
                f'{(status.time_us - flag.invalid_since_us) / SECOND:.0f} s'


def _reason(name: str, flag: ValidityFlag) -> str:
    if flag.passing:
        return f'must be good for {flag.remaining():.0f} s more'
    if math.isnan(flag.accuracy) or flag.accuracy < flag.limit:
        return 'the estimator does not know it'
    return f'accuracy {flag.accuracy:.1f} {UNITS[name]}, limit {flag.limit:.1f} {UNITS[name]}'


def _values(status: NavigationStatus, flags: Mapping[str, ValidityFlag]) -> dict[str, str]:
    values = {f'{name} valid'.replace(' ', '_'): str(flag.valid).lower()
              for name, flag in flags.items()}
    values |= {
        'ready': str(status.ready).lower(), 'takeoff_test': status.takeoff_test.value,
        'eph': f'{status.accuracy.eph:.2f}', 'epv': f'{status.accuracy.epv:.2f}',
        'evh': f'{status.accuracy.evh:.2f}'}
    home = status.home
    if home is not None:
        values |= {
            'home.lat': f'{home.lat:.7f}', 'home.lon': f'{home.lon:.7f}',
            'home.alt': f'{home.alt:.2f}', 'home.manual': str(home.manual).lower()}
    return values


def place(home: Home) -> str:
    """Return latitude, longitude and altitude in words."""
    return f'{home.lat:.7f}, {home.lon:.7f}, {home.alt:.2f} m'
