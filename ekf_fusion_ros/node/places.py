"""Places of the map as points of the earth and back, by the services of robot_localization."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Point

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.node.optional import imported


class Places:
    """Fills in responses; each request returns '' or in one sentence why it was not done."""

    def __init__(self, steering: Steering) -> None:
        self._steering = steering

    def to_ll(self, request: Any, response: Any) -> str:
        """Serve ToLL."""
        return self._locate(request.map_point, response.ll_point)

    def from_ll(self, request: Any, response: Any) -> str:
        """Serve FromLL."""
        return self._place(request.ll_point, response.map_point)

    def to_ll_array(self, request: Any, response: Any) -> str:
        """Serve ToLLArray."""
        kind = imported('geographic_msgs.msg', 'GeoPoint')
        return fill_list(self._locate, request.map_points, response.ll_points, kind)

    def from_ll_array(self, request: Any, response: Any) -> str:
        """Serve FromLLArray."""
        return fill_list(self._place, request.ll_points, response.map_points, Point)

    def _locate(self, place: Any, answer: Any) -> str:
        try:
            point = self._steering.point_of_map(place.x, place.y, place.z)
        except ValueError as error:
            return str(error)
        answer.latitude, answer.longitude, answer.altitude = point.lat, point.lon, point.alt
        return ''

    def _place(self, point: Any, answer: Any) -> str:
        try:
            answer.x, answer.y, answer.z = self._steering.map_of_point(geo_point(point))
        except ValueError as error:
            return str(error)
        return ''


def fill_list(
    work: Callable[[Any, Any], str], asked: Sequence[Any], answers: list[Any], kind: Any,
) -> str:
    """Append an answer of a kind for each thing asked, none at all where one is refused."""
    made = [kind() for _ in asked]
    for one, answer in zip(asked, made, strict=True):
        refusal = work(one, answer)
        if refusal:
            return refusal
    answers.extend(made)
    return ''


def geo_point(message: Any) -> GeoPoint:
    """Return a geographic_msgs/GeoPoint or a sensor_msgs/NavSatFix as a point."""
    return GeoPoint(message.latitude, message.longitude, message.altitude)
