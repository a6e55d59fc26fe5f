"""What an operator asks of the running fusion, done or refused in one sentence."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.map_origin import map_of_point
from ekf_fusion_ros.map_origin import point_of_map
from ekf_fusion_ros.messages.decode_pose import decode_pose
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.session import FusionSession

NO_STATE = 'no pose can be set yet: wait until the filter has started'
NO_MAP = 'there is no map yet: wait until a good fix has set its origin'
LOCAL = 'no fix takes part, so that the frame has no place on the earth: set node.use_fix to true'
GIVE_POINT = 'give deg within -90 .. 90 and -180 .. 180, and m'


class Steering:
    """Acts on a session and its switches, and announces what was done as an event.

    Requests return '' when done, else in one sentence why not and what to do.
    """

    def __init__(self, session: FusionSession, switches: Switches, frame: str) -> None:
        """Steer a session whose outputs are in the frame of this name."""
        self._session = session
        self._switches = switches
        self._frame = frame

    @property
    def enabled(self) -> bool:
        """True while messages reach the filter."""
        return self._switches.enabled

    def reset(self, *, keep_origin: bool = True) -> str:
        """Start the estimator again."""
        self._session.reset(keep_origin=keep_origin)
        return ''

    def enable(self, on: bool) -> str:
        """Let messages reach the filter, or keep all of them back."""
        if on != self._switches.enabled:
            self._switches.enabled = on
            self._session.announce(f'the fusion is {"enabled" if on else "disabled"} on request')
        return ''

    def switch(self, role: str, on: bool) -> str:
        """Let the messages of one role reach the filter, or keep them back."""
        before = self._switches.is_on(role)
        refusal = self._switches.switch(role, on)
        if not refusal and self._switches.is_on(role) != before:
            self._session.announce(f'{role} is switched {"on" if on else "off"} on request')
        return refusal

    def obstacle(self, role: str, on: bool) -> str:
        """Return why `switch` would refuse, '' where it would not."""
        return self._switches.obstacle(role, on)

    def set_origin(self, point: GeoPoint) -> str:
        """Move the origin of the map; the place of the vehicle on the earth stays.

        An altitude of NaN, which geographic_msgs calls unspecified, leaves that of the origin.
        """
        place = words_of(point)
        if not point.completed(0.0).on_earth:
            return f'{place} is not a point of the earth: {GIVE_POINT}'
        if self._session.local:
            return LOCAL
        if not self._session.set_origin(point):
            return f'the estimator does not take {place} as origin'
        self._session.announce(f'origin of the map set on request: {place}')
        return ''

    def set_home(self, point: GeoPoint | None) -> str:
        """Set home by hand, to stay; None: to where the vehicle is, by the rules from then on."""
        if self._session.set_home(point):
            return ''
        if point is None:
            status = self._session.navigation
            words = '; '.join(one.sentence(status.time_us) for one in status.missing)
            return f'home cannot be here: {words or "there is no estimate yet"}'
        return f'{words_of(point)} is not a point of the earth: {GIVE_POINT}'

    def set_pose(self, message: Any) -> str:
        """Jump to the pose of a PoseWithCovarianceStamped."""
        try:
            pose = decode_pose(message, self._frame)
        except Refused as refusal:
            return refusal.detail
        if self._session.set_pose(pose):
            return ''
        has_state = self._session.estimator.nav_state() is not None
        return NO_MAP if has_state else NO_STATE

    def point_of_map(self, x: float, y: float, z: float) -> GeoPoint:
        """Return the point of the earth at x, y, z in m of the map; ValueError says why not."""
        return point_of_map(x, y, z, self._origin(), self._projection)

    def map_of_point(self, point: GeoPoint) -> tuple[float, float, float]:
        """Return x, y, z in m of the map of a point of the earth; ValueError says why not."""
        return map_of_point(point, self._origin(), self._projection)

    def switches(self) -> Mapping[str, bool]:
        """Return by role whether its messages reach the filter."""
        return {role: self._switches.is_on(role) for role in sorted(self._session.roles or ())}

    @property
    def _projection(self) -> str:
        return self._session.params.ekf2.earth.projection

    def _origin(self) -> GeoPoint:
        if self._session.local:
            raise ValueError(LOCAL)
        origin = self._session.origin
        if origin is None:
            raise ValueError(NO_MAP)
        return origin


def words_of(point: GeoPoint) -> str:
    """Return a point in words."""
    altitude = 'unspecified' if math.isnan(point.alt) else point.alt
    return f'latitude {point.lat}, longitude {point.lon}, altitude {altitude}'
