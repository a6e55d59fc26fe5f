"""Services and request topics of the running node, and those whose types are not installed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from math import nan
from types import SimpleNamespace
from typing import TYPE_CHECKING
from typing import Any

import pytest

rclpy = pytest.importorskip('rclpy')

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.srv import GetParameters
from rcl_interfaces.srv import SetParameters
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from sensor_msgs.msg import NavSatFix
from std_srvs.srv import Empty
from std_srvs.srv import SetBool
from std_srvs.srv import Trigger
from test_fuser import fix
from test_fuser import odometry

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.node import places
from ekf_fusion_ros.node import services
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.node.inputs import TOPICS
from ekf_fusion_ros.node.optional import TYPES
from ekf_fusion_ros.node.optional import absence
from ekf_fusion_ros.node.qos import latched_qos
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

StartFuser = Callable[..., 'Fuser']


class Operator:
    """Drives the node along a line and asks things of it."""

    def __init__(self, fuser: Fuser, peer: Peer) -> None:
        self.fuser = fuser
        self.peer = peer
        self.step = 0
        peer.connect(fuser, {'odom': Odometry, 'fix': NavSatFix})

    def ask(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service and return its response."""
        client = self.peer.node.create_client(kind, name)
        self.peer.until(client.service_is_ready, self.fuser)
        answer = client.call_async(request)
        self.peer.until(answer.done, self.fuser)
        return answer.result()

    def drive(self, steps: int) -> None:
        """Send tenths of a second; each is counted by the node before the next."""
        for _ in range(steps):
            self.step += 1
            self.peer.publish('odom', odometry(0.1 * self.step))
            if self.step % 2 == 0:
                self.peer.publish('fix', fix(0.1 * self.step))
        self.peer.until(lambda: self.peer.count('odometry') >= self.step, self.fuser)

    def drive_until(self, condition: Callable[[], bool]) -> None:
        """Drive until something is so."""
        while not condition():
            assert self.step < 5000, self.peer.texts()
            self.drive(20)

    def request(self, kind: type, topic: str, message: Any) -> None:
        """Publish on a topic of requests once the node listens."""
        publisher = self.peer.node.create_publisher(kind, topic, 10)
        self.peer.until(lambda: publisher.get_subscription_count() > 0, self.fuser)
        publisher.publish(message)

    def values(self, *names: str) -> list[Any]:
        """Return the values of parameters."""
        answer = self.ask(
            GetParameters, '/fuser/get_parameters', GetParameters.Request(names=names))
        return [Parameter.from_parameter_msg(one).value for one in (
            SimpleNamespace(name=name, value=value)
            for name, value in zip(names, answer.values, strict=True))]

    def change(self, **values: Any) -> list[str]:
        """Set parameters one by one (__ is a dot); return the reasons of refusal."""
        request = SetParameters.Request(parameters=as_messages(values))
        answer = self.ask(SetParameters, '/fuser/set_parameters', request)
        assert all(one.successful is not bool(one.reason) for one in answer.results)
        return [one.reason for one in answer.results]

    def hears(self, words: str) -> None:
        """Wait until the node has said something."""
        self.peer.until(lambda: words in self.fuser.output, self.fuser)


@pytest.fixture
def operator(start_fuser: StartFuser, peer: Peer) -> Operator:
    return Operator(start_fuser(), peer)


@pytest.mark.slow
def test_an_aid_is_switched_off_and_on(operator: Operator) -> None:
    operator.drive(10)
    answer = operator.ask(SetBool, '/fuser/use_fix', SetBool.Request(data=False))
    assert (answer.success, answer.message) == (True, 'done')
    before = operator.peer.count('fix', 'accepted')
    operator.drive(10)
    operator.peer.until(
        lambda: operator.peer.count('fix', 'refused.switched_off') == 5, operator.fuser)
    assert operator.peer.count('fix', 'accepted') == before
    assert operator.peer.texts()['fix'].startswith('switched off, ')
    assert operator.values('node.use_fix') == [False]
    assert operator.ask(SetBool, '/fuser/use_fix', SetBool.Request(data=True)).success
    operator.drive(10)
    operator.peer.until(
        lambda: operator.peer.count('fix', 'accepted') > before, operator.fuser)
    answer = operator.ask(SetBool, '/fuser/use_odometry', SetBool.Request(data=False))
    assert not answer.success
    assert 'call ~/set_enabled' in answer.message


@pytest.mark.slow
def test_the_fusion_is_disabled_and_enabled(operator: Operator) -> None:
    operator.drive(10)
    assert operator.ask(SetBool, '/fuser/set_enabled', SetBool.Request(data=False)).success
    operator.drive(10)
    operator.peer.until(
        lambda: operator.peer.count('odometry', 'refused.disabled') == 10, operator.fuser)
    assert operator.peer.texts()['estimator'].startswith('disabled')
    operator.ask(Empty, '/enable', Empty.Request())
    operator.drive(10)
    operator.peer.until(
        lambda: operator.peer.count('odometry', 'accepted') > 10, operator.fuser)


@pytest.mark.slow
def test_a_node_may_start_disabled(start_fuser: StartFuser, peer: Peer) -> None:
    operator = Operator(start_fuser({'node.disabled_at_startup': True}), peer)
    operator.drive(5)
    operator.peer.until(
        lambda: operator.peer.count('odometry', 'refused.disabled') == 5, operator.fuser)


@pytest.mark.slow
def test_origin_pose_and_reset(operator: Operator) -> None:
    """The origin is moved by 0.001 deg, then the vehicle told 3 m north, then all begun anew."""
    peer = operator.peer
    operator.request(NavSatFix, '/fuser/set_origin', NavSatFix(latitude=99.0))
    operator.hears('/fuser/set_origin: not done: latitude 99.0')
    operator.request(PoseWithCovarianceStamped, '/set_pose', given_pose(0.0, 0.0))
    operator.hears('/set_pose: not done: no pose can be set yet')
    operator.drive_until(lambda: bool(peer.odometry))
    operator.request(
        NavSatFix, '/fuser/set_origin',
        NavSatFix(latitude=47.001, longitude=8.0, altitude=nan))
    operator.hears('origin of the map set on request: latitude 47.001')
    operator.drive(20)
    # A thousandth of a degree of latitude is 111.2 m at 47 N.
    operator.drive_until(lambda: abs(peer.odometry[-1].pose.pose.position.y + 111.2) < 2.0)
    east = peer.odometry[-1].pose.pose.position.x
    operator.request(PoseWithCovarianceStamped, '/set_pose', given_pose(east, -108.0))
    operator.hears('pose set on request')
    operator.drive_until(lambda: any(
        abs(one.pose.pose.position.y + 108.0) < 1.0 for one in peer.odometry))
    answer = operator.ask(Trigger, '/fuser/reset', Trigger.Request())
    assert (answer.success, answer.message) == (True, 'done')
    operator.hears('the estimator starts again on request, the origin of the map stays')
    operator.ask(Empty, '/reset', Empty.Request())
    assert operator.ask(Trigger, '/fuser/reset_origin', Trigger.Request()).success
    operator.hears('the estimator starts again on request, the origin of the map is set anew')
    del peer.odometry[:]
    operator.drive_until(lambda: bool(peer.odometry))
    assert 'Traceback' not in operator.fuser.output


@pytest.mark.slow
def test_a_pose_in_another_frame_is_refused_by_name(operator: Operator) -> None:
    pose = given_pose(0.0, 0.0)
    pose.header.frame_id = 'camera_odom'
    operator.request(PoseWithCovarianceStamped, '/set_pose', pose)
    operator.hears(
        "/set_pose: not done: the pose is in frame 'camera_odom': give it in 'map'")


@pytest.mark.slow
def test_home_is_set_by_hand_and_here(operator: Operator) -> None:
    homes: list[NavSatFix] = []
    operator.peer.node.create_subscription(NavSatFix, '/home', homes.append, latched_qos())
    answer = operator.ask(Trigger, '/fuser/set_home_here', Trigger.Request())
    assert not answer.success
    assert answer.message.startswith('home cannot be here: ')
    operator.request(NavSatFix, '/fuser/set_home', NavSatFix(latitude=99.0))
    operator.hears('/fuser/set_home: not done: latitude 99.0')
    operator.drive_until(lambda: bool(operator.peer.odometry) and bool(homes))
    operator.request(
        NavSatFix, '/fuser/set_home', NavSatFix(latitude=46.5, longitude=7.5, altitude=100.0))
    operator.drive_until(lambda: homes[-1].latitude == 46.5)
    assert (homes[-1].longitude, homes[-1].altitude) == (7.5, 100.0)
    operator.hears('home set by hand: 46.5')
    assert operator.ask(Trigger, '/fuser/set_home_here', Trigger.Request()).success
    operator.drive_until(lambda: homes[-1].latitude == pytest.approx(47.0, abs=1e-3))


@pytest.mark.slow
def test_every_input_has_its_switch(start_fuser: StartFuser, peer: Peer) -> None:
    """All roles but the one that carries the time of the filter."""
    aids = [role for role in TOPICS if role != 'imu']
    operator = Operator(start_fuser({f'node.use_{role}': True for role in TOPICS}), peer)
    for on, success in ((False, False), (True, True)):
        answer = operator.ask(SetBool, '/fuser/use_imu', SetBool.Request(data=on))
        assert answer.success is success
    for role in aids:
        answer = operator.ask(SetBool, f'/fuser/use_{role}', SetBool.Request(data=False))
        assert (answer.success, answer.message) == (True, 'done'), role
        operator.peer.until(
            lambda role=role: peer.texts()[role].startswith('switched off, '), operator.fuser)
        answer = operator.ask(SetBool, f'/fuser/use_{role}', SetBool.Request(data=True))
        assert answer.success, role
        operator.peer.until(
            lambda role=role: peer.texts()[role].startswith('nothing received on '),
            operator.fuser)


@pytest.mark.slow
def test_live_parameters_change_and_others_say_why_not(operator: Operator) -> None:
    operator.drive(5)
    assert operator.change(ekf2__gnss__pos_gate=4.0, messages__fix__default_eph=2.0) == ['', '']
    operator.hears('parameters changed on request: ekf2.gnss.pos_gate = 4.0 (was 5.0)')
    operator.hears('parameters changed on request: messages.fix.default_eph = 2.0 (was 1.0)')
    assert operator.values('ekf2.gnss.pos_gate', 'messages.fix.default_eph') == [4.0, 2.0]
    frame, delay, rate, same = operator.change(
        node__map_frame='world', ekf2__gnss__delay_ms=50.0, session__output_rate=10.0,
        node__odom_frame='odom')
    assert frame == (
        "node.map_frame = 'map' cannot become 'world' while the node runs: topics are open and "
        'listeners rely on their types and frames; set it in the parameter file and start the '
        'node again')
    assert 'fusion horizon' in delay
    assert 'session.output_rate = 50.0 cannot become 10.0' in rate
    assert same == ''
    assert operator.values('node.map_frame', 'ekf2.gnss.delay_ms') == ['map', 110.0]


@pytest.mark.slow
def test_a_list_of_parameters_changes_as_a_whole_or_not_at_all(operator: Operator) -> None:
    def change(**values: Any) -> Any:
        request = SetParametersAtomically.Request(parameters=as_messages(values))
        return operator.ask(
            SetParametersAtomically, '/fuser/set_parameters_atomically', request).result

    names = 'ekf2.gnss.vel_gate', 'ekf2.vision.vel_gate'
    before = operator.values(*names)
    refused = change(ekf2__gnss__vel_gate=3.5, ekf2__earth__projection='sphere')
    assert not refused.successful
    assert 'ekf2.earth.projection' in refused.reason
    assert operator.values(*names) == before
    assert change(ekf2__gnss__vel_gate=3.5, ekf2__vision__vel_gate=2.5).successful
    assert operator.values(*names) == [3.5, 2.5]
    operator.drive(5)
    operator.hears('ekf2.gnss.vel_gate = 3.5 (was 5.0), ekf2.vision.vel_gate = 2.5 (was 3.0)')


@pytest.mark.slow
def test_an_input_is_a_parameter_too(operator: Operator) -> None:
    operator.drive(10)
    fix_off, odometry_off, range_on, range_off = operator.change(
        node__use_fix=False, node__use_odometry=False, node__use_range=True,
        node__use_imu=False)
    assert (fix_off, range_off) == ('', '')
    assert 'carries the time of the filter' in odometry_off
    assert 'is not subscribed to' in range_on
    operator.drive(10)
    operator.peer.until(
        lambda: operator.peer.count('fix', 'refused.switched_off') == 5, operator.fuser)


def as_messages(values: dict[str, Any]) -> list[Any]:
    """Return parameters as messages; __ in a name is a dot."""
    return [Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
            for name, value in values.items()]


def given_pose(x: float, y: float) -> PoseWithCovarianceStamped:
    """Return a position in the map with 1 m of uncertainty."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id = 'map'
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.covariance[0] = message.pose.covariance[7] = 1.0
    return message


class StandInNode:
    """Keeps what is offered and said instead of sending it."""

    def __init__(self) -> None:
        self.offered: dict[str, Callable[..., Any]] = {}
        self.said: list[str] = []

    def create_service(self, _: Any, name: str, work: Callable[..., Any]) -> None:
        self.offered[name] = work

    def create_subscription(self, _: Any, name: str, work: Callable[..., Any], __: int) -> None:
        self.offered[f'topic {name}'] = work

    def resolve_service_name(self, name: str) -> str:
        return name

    resolve_topic_name = resolve_service_name

    def set_parameters(self, parameters: Any) -> Any:
        raise RuntimeError('as on an internal error')

    def get_logger(self) -> Any:
        return SimpleNamespace(
            info=self.said.append, warning=self.said.append, error=self.said.append)


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> tuple[StandInNode, FusionSession]:
    """Services as on an install that has every type; the map lies about 47 N, 8 E."""
    monkeypatch.setattr(services, 'found_types', lambda: dict.fromkeys(TYPES, object))
    roles = ('odometry', 'fix')
    session = FusionSession(Params(), roles)
    switches = Switches(roles, 'odometry', enabled=True)
    node = StandInNode()
    services.Services(
        node, Steering(session, switches, 'map'), Guard(node, Counter()), roles)
    return node, session


def point(lat: float, lon: float, alt: float) -> SimpleNamespace:
    return SimpleNamespace(latitude=lat, longitude=lon, altitude=alt)


def test_every_service_of_robot_localization_is_offered(full: Any) -> None:
    node, _ = full
    assert {'toggle', 'set_pose', 'datum', 'toLL', 'fromLL', 'toLLArray', 'fromLLArray',
            'reset', 'enable', 'topic set_pose', 'topic set_gp_origin'} <= {*node.offered}
    assert not any('switched off, because' in line for line in node.said)


def test_toggle_tells_whether_it_was_news(full: Any) -> None:
    node, _ = full
    for on, news in ((True, False), (False, True), (False, False), (True, True)):
        response = SimpleNamespace(status=None)
        node.offered['toggle'](SimpleNamespace(on=on), response)
        assert response.status is news


def test_datum_and_origin_topic_set_the_origin(full: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    node, session = full
    seen: list[GeoPoint] = []
    monkeypatch.setattr(session, 'set_origin', lambda origin: bool(seen.append(origin) or True))
    turn = SimpleNamespace(x=0.0, y=0.0, z=0.7, w=0.7)
    request = SimpleNamespace(
        geo_pose=SimpleNamespace(position=point(47.0, 8.0, 400.0), orientation=turn))
    response = SimpleNamespace(success=None, message=None)
    node.offered['datum'](request, response)
    assert (response.success, response.message) == (True, services.UNTURNED)
    assert f'datum: {services.UNTURNED}' in node.said
    turn.z, turn.w, response.message = 0.0, 1.0, ''
    node.offered['datum'](request, response)
    assert (response.success, response.message) == (True, 'done')
    node.offered['topic set_gp_origin'](SimpleNamespace(position=point(46.0, 7.0, 1.0)))
    assert seen == [GeoPoint(47.0, 8.0, 400.0)] * 2 + [GeoPoint(46.0, 7.0, 1.0)]


def test_points_go_to_the_earth_and_back(full: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    node, session = full
    there, back = SimpleNamespace(ll_point=point(0, 0, 0)), SimpleNamespace(
        map_point=SimpleNamespace(x=0.0, y=0.0, z=0.0))
    asked = SimpleNamespace(map_point=SimpleNamespace(x=100.0, y=200.0, z=3.0))
    node.offered['toLL'](asked, there)
    assert any(line.startswith('toLL: not done: there is no map yet') for line in node.said)
    monkeypatch.setattr(
        type(session), 'origin', property(lambda _: GeoPoint(47.0, 8.0, 400.0)))
    node.offered['toLL'](asked, there)
    assert there.ll_point.latitude == pytest.approx(47.0 + 200.0 / 111190.0, abs=1e-6)
    assert there.ll_point.altitude == 403.0
    node.offered['fromLL'](SimpleNamespace(ll_point=there.ll_point), back)
    place = back.map_point
    assert (place.x, place.y, place.z) == pytest.approx((100.0, 200.0, 3.0), abs=1e-3)
    node.offered['fromLL'](SimpleNamespace(ll_point=point(95.0, 0.0, 0.0)), back)
    assert 'fromLL: not done: latitude 95.0' in node.said[-1]


def test_lists_of_points_go_whole_or_not_at_all(
    full: Any, monkeypatch: pytest.MonkeyPatch,
) -> None:
    node, session = full
    monkeypatch.setattr(places, 'imported', lambda *_: lambda: point(0.0, 0.0, 0.0))
    monkeypatch.setattr(
        type(session), 'origin', property(lambda _: GeoPoint(47.0, 8.0, 400.0)))
    there, back = SimpleNamespace(ll_points=[]), SimpleNamespace(map_points=[])
    asked = [SimpleNamespace(x=10.0, y=20.0, z=3.0), SimpleNamespace(x=-5.0, y=0.0, z=0.0)]
    node.offered['toLLArray'](SimpleNamespace(map_points=asked), there)
    assert [one.altitude for one in there.ll_points] == [403.0, 400.0]
    node.offered['fromLLArray'](SimpleNamespace(ll_points=there.ll_points), back)
    for place, answer in zip(asked, back.map_points, strict=True):
        assert (answer.x, answer.y, answer.z) == pytest.approx(
            (place.x, place.y, place.z), abs=1e-3)
    back.map_points.clear()
    node.offered['fromLLArray'](
        SimpleNamespace(ll_points=[*there.ll_points, point(95.0, 0.0, 0.0)]), back)
    assert back.map_points == []
    assert 'fromLLArray: not done: latitude 95.0' in node.said[-1]


def test_nothing_leaves_a_callback(full: Any) -> None:
    node, _ = full
    response = SimpleNamespace(success=None, message=None)
    node.offered['~/use_fix'](SimpleNamespace(data=True), response)
    assert (response.success, response.message) == (False, services.INTERNAL_ERROR)
    node.offered['topic set_pose'](None)
    assert sum('internal error at' in line for line in node.said) == 2


def test_absent_types_are_named_with_what_serves_instead() -> None:
    line = absence({})
    assert 'geographic_msgs, robot_localization, tf2_msgs cannot be imported' in line
    for name in TYPES:
        assert name in line
    assert 'toggle (call ~/set_enabled (std_srvs/SetBool))' in line
    assert absence(dict.fromkeys(TYPES, object)) == ''
