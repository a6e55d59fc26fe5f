"""The home position: when it is set, and what is missing until it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import replace
import math
from typing import NamedTuple

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_321
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.samples import GnssSample

SECOND = 1_000_000
FIX_RECENT_US = 3 * SECOND
"""Age of a fix above which there is none: receivers of 1 Hz count too."""

MOVED = 2.0
"""Distance from home, in accuracies, by which a landed vehicle has been moved."""


@dataclass(frozen=True, slots=True)
class Home:
    """Where the vehicle belongs: deg and m in the datum of the fixes, and the same locally.

    x, y, z m NED about the origin, NaN before there is one; yaw rad from north, clockwise, of the
    vehicle when home was set. manual: set by hand, so that nothing else moves it.
    """

    time_us: int
    lat: float
    lon: float
    alt: float
    x: float
    y: float
    z: float
    yaw: float
    manual: bool = False


class Accuracy(NamedTuple):
    """1-sigma accuracy of horizontal and vertical position in m, horizontal velocity in m/s."""

    eph: float
    epv: float
    evh: float


class Situation(NamedTuple):
    """What a decision about home rests on; armed is None where nobody tells."""

    nav: NavState
    accuracy: Accuracy
    global_valid: bool
    local_valid: bool
    landed: bool
    took_off: bool
    armed: bool | None
    just_armed: bool
    fix: GnssSample | None


class Shortfall(NamedTuple):
    """Something that home waits for, and since when."""

    kind: str
    text: str
    since_us: int

    def sentence(self, now_us: int) -> str:
        """Say what is missing and for how long."""
        return f'{self.text}, for {max(now_us - self.since_us, 0) / SECOND:.0f} s'


class HomePosition:
    """Sets home as PX4's commander does, from a position that is valid and accurate enough.

    While disarmed: once there is none yet, and again where a landed vehicle has been moved. Again
    on arming, and on take-off. Without an `armed` input: once. Never while set by hand.
    """

    def __init__(self, params: HealthParams, projection: str) -> None:
        """`projection` is the name of the one that the estimator uses."""
        self._params = params
        self._projection = projection
        self.home: Home | None = None
        self.missing: tuple[Shortfall, ...] = ()
        self._origin: GeoPoint | None = None
        self._yaw_jump: float | None = None

    def step(self, s: Situation) -> bool:
        """Return whether home has been set, or set again."""
        self._note_missing(s)
        self._follow(s.nav)
        if not self._due(s) or self.missing:
            return False
        self._set(s.nav)
        return True

    def _due(self, s: Situation) -> bool:
        if self.home is not None and self.home.manual:
            return False
        if s.just_armed or (s.took_off and s.armed):
            return True
        if self.home is None:
            return not s.armed
        return s.armed is False and s.landed and self._is_moved(s)

    def _is_moved(self, s: Situation) -> bool:
        home = self.home
        assert home is not None
        north, east, down = s.nav.position.tolist()
        aside = math.hypot(north - home.x, east - home.y) > MOVED * s.accuracy.eph
        return aside or abs(down - home.z) > MOVED * s.accuracy.epv

    def _set(self, nav: NavState) -> None:
        origin = nav.origin
        assert origin is not None
        north, east, down = nav.position.tolist()
        projection = make_projection(self._projection, origin.lat, origin.lon, origin.alt)
        lat, lon = projection.reproject(north, east)
        self.home = Home(nav.time_us, lat, lon, origin.alt - down, north, east, down, _yaw(nav))

    def set_by_hand(self, time_us: int, point: GeoPoint, nav: NavState | None) -> bool:
        """Take a point (deg, m) as home until told otherwise; False where it is unusable."""
        on_earth = abs(point.lat) <= 90.0 and abs(point.lon) <= 180.0
        if not on_earth or not math.isfinite(point.alt):
            return False
        yaw = math.nan if nav is None else _yaw(nav)
        self.home = self._placed(
            Home(time_us, point.lat, point.lon, point.alt, *3 * (math.nan,), yaw, manual=True),
            None if nav is None else nav.origin)
        return True

    def set_here(self, s: Situation) -> bool:
        """Take the present place as home, no longer by hand; False where something is missing."""
        self._note_missing(s)
        if self.missing:
            return False
        self._set(s.nav)
        return True

    def forget_time(self) -> None:
        """Keep home through a restart of the estimator, whose jumps begin at zero again."""
        self.missing = ()
        self._yaw_jump = None

    def _follow(self, nav: NavState) -> None:
        """Turn home with the jumps of yaw, and move it with the origin."""
        jump = 0.0 if self._yaw_jump is None else nav.yaw_jump - self._yaw_jump
        self._yaw_jump = nav.yaw_jump
        if self.home is not None and jump:
            self.home = replace(self.home, yaw=wrap_pi(self.home.yaw + jump))
        if nav.origin != self._origin:
            self._origin = nav.origin
            self.home = self._placed(self.home, nav.origin)

    def _placed(self, home: Home | None, origin: GeoPoint | None) -> Home | None:
        """Return home with its local position about an origin."""
        if home is None or origin is None:
            return home
        projection = make_projection(self._projection, origin.lat, origin.lon, origin.alt)
        north, east = projection.project(home.lat, home.lon)
        return replace(home, x=north, y=east, z=origin.alt - home.alt)

    def _note_missing(self, s: Situation) -> None:
        """Renew the list of what is missing; what was missing before keeps its time."""
        since = {shortfall.kind: shortfall.since_us for shortfall in self.missing}
        now_us = s.nav.time_us
        self.missing = tuple(
            Shortfall(kind, text, since.get(kind, now_us)) for kind, text in self._lacks(s))

    def _lacks(self, s: Situation) -> Iterator[tuple[str, str]]:
        """Yield kind and words of each condition that does not hold."""
        p, accuracy = self._params, s.accuracy
        if not s.global_valid:
            yield self._why_no_global(s)
        if not s.local_valid:
            yield 'local', 'no valid local position'
        if s.global_valid and not accuracy.eph <= p.home_eph:
            yield 'eph', f'position accuracy {accuracy.eph:.1f} m, limit {p.home_eph:.1f} m'
        if s.global_valid and not accuracy.epv <= p.home_epv:
            yield 'epv', f'height accuracy {accuracy.epv:.1f} m, limit {p.home_epv:.1f} m'

    def _why_no_global(self, s: Situation) -> tuple[str, str]:
        p, fix = self._params, s.fix
        if fix is None or s.nav.time_us - fix.time_us > FIX_RECENT_US:
            return 'fix', 'no GPS fix'
        if fix.eph > p.home_eph:
            return 'gps', f'GPS accuracy {fix.eph:.1f} m, limit {p.home_eph:.1f} m'
        if fix.epv > p.home_epv:
            return 'gps', f'GPS height accuracy {fix.epv:.1f} m, limit {p.home_epv:.1f} m'
        return 'global', 'no valid global position'


def _yaw(nav: NavState) -> float:
    return yaw_321(matrix_from_quat(nav.quaternion))
