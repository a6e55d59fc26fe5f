"""Services and topics by which an operator steers the node.

Names and types are those of robot_localization where its types can be imported; what stands under
`~/` is ours, of std_srvs, and answers with a sentence.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Collection
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import NavSatFix
from std_srvs.srv import Empty
from std_srvs.srv import SetBool
from std_srvs.srv import Trigger

from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.node.guard import INTERNAL_ERROR
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.node.optional import absence
from ekf_fusion_ros.node.optional import found_types
from ekf_fusion_ros.node.places import Places
from ekf_fusion_ros.node.places import geo_point

REQUEST_DEPTH = 10
LEVEL_ERROR = 1e-3
"""Length of the vector part of an orientation that is as good as none."""

UNTURNED = ('the origin is set, but the orientation is not used: x of this map points east, '
            'whatever the datum says')
Work = Callable[[Any, Any], str]


class Services:
    """Offers every service and listens to every request topic; nothing that is asked can raise."""

    def __init__(
        self, node: Node, steering: Steering, guard: Guard, roles: Collection[str],
    ) -> None:
        self._node = node
        self._steering = steering
        self._places = Places(steering)
        self._guard = guard
        self._offer_own(roles)
        self._offer_standard()
        found = found_types()
        for name, kind in found.items():
            self._offer_found(name, kind)
        missing = absence(found)
        if missing:
            node.get_logger().info(missing)

    def _offer_own(self, roles: Collection[str]) -> None:
        steering = self._steering
        self._serve(Trigger, '~/reset', lambda _, __: steering.reset())
        self._serve(Trigger, '~/reset_origin', lambda _, __: steering.reset(keep_origin=False))
        self._serve(SetBool, '~/set_enabled', lambda request, _: steering.enable(request.data))
        for role in roles:
            self._serve(SetBool, f'~/use_{role}',
                        lambda request, _, role=role: self._switch(role, request.data))
        self._listen(NavSatFix, '~/set_origin', lambda message: steering.set_origin(
            geo_point(message)))
        self._listen(NavSatFix, '~/set_home', lambda message: steering.set_home(
            geo_point(message)))
        self._serve(Trigger, '~/set_home_here', lambda _, __: steering.set_home(None))

    def _offer_standard(self) -> None:
        """Offer what robot_localization offers with standard types."""
        steering = self._steering
        self._serve(Empty, 'reset', lambda _, __: steering.reset())
        self._serve(Empty, 'enable', lambda _, __: steering.enable(True))
        self._listen(PoseWithCovarianceStamped, 'set_pose', steering.set_pose)

    def _offer_found(self, name: str, kind: Any) -> None:
        if name == 'set_gp_origin':
            self._listen(kind, name, lambda message: self._steering.set_origin(
                geo_point(message.position)))
            return
        works: dict[str, Work] = {
            'toggle': self._toggle, 'datum': self._set_datum,
            'set_pose': lambda request, _: self._steering.set_pose(request.pose),
            'toLL': self._places.to_ll, 'toLLArray': self._places.to_ll_array,
            'fromLL': self._places.from_ll, 'fromLLArray': self._places.from_ll_array}
        if name in works:
            self._serve(kind, name, works[name])

    def _switch(self, role: str, on: bool) -> str:
        """Switch an input through its parameter, so that both tell the same."""
        result, = self._node.set_parameters([Parameter(f'node.use_{role}', value=bool(on))])
        return '' if result.successful else str(result.reason)

    def _toggle(self, request: Any, response: Any) -> str:
        """Switch the fusion; as in robot_localization the status tells whether that was news."""
        response.status = bool(request.on) != self._steering.enabled
        return self._steering.enable(bool(request.on))

    def _set_datum(self, request: Any, response: Any) -> str:
        refusal = self._steering.set_origin(geo_point(request.geo_pose.position))
        turn = request.geo_pose.orientation
        if not refusal and max(abs(turn.x), abs(turn.y), abs(turn.z)) > LEVEL_ERROR:
            self._node.get_logger().warning(f'datum: {UNTURNED}')
            if hasattr(response, 'message'):
                response.message = UNTURNED
        return refusal

    def _serve(self, kind: Any, name: str, work: Work) -> None:
        """Offer a service whose work returns '' or why it was not done."""
        full = self._node.resolve_service_name(name)

        def call(request: Any, response: Any) -> Any:
            try:
                refusal = work(request, response)
            except Exception as error:  # nothing may leave a callback
                self._guard.tell(f'the service {full}', error)
                refusal = INTERNAL_ERROR
            self._answer(full, response, refusal)
            return response

        self._node.create_service(kind, name, call)

    def _listen(self, kind: Any, name: str, work: Callable[[Any], str]) -> None:
        """Take requests from a topic; its work returns '' or why it was not done."""
        full = self._node.resolve_topic_name(name)

        def arrive(message: Any) -> None:
            try:
                refusal = work(message)
            except Exception as error:  # nothing may leave a callback
                self._guard.tell(f'a message on {full}', error)
                return
            if refusal:
                self._warn(full, refusal)

        self._node.create_subscription(kind, name, arrive, REQUEST_DEPTH)

    def _answer(self, name: str, response: Any, refusal: str) -> None:
        """Fill in what the response has room for; the log hears of every refusal."""
        if hasattr(response, 'success'):
            response.success = not refusal
        if hasattr(response, 'message'):
            response.message = refusal or response.message or 'done'
        if refusal:
            self._warn(name, refusal)

    def _warn(self, name: str, refusal: str) -> None:
        self._node.get_logger().warning(f'{name}: not done: {refusal}')
