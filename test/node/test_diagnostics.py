"""/diagnostics through diagnostic_updater, for which a stand-in serves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import sys
from types import SimpleNamespace
from typing import TYPE_CHECKING
from typing import Any

import pytest

pytest.importorskip('rclpy')

from builtin_interfaces.msg import Time

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.node.diagnostics import PlainDiagnostics
from ekf_fusion_ros.node.diagnostics import UpdaterDiagnostics
from ekf_fusion_ros.node.diagnostics import make_diagnostics

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

STAND_INS = Path(__file__).parent / 'stand_ins'


class Node:
    """A node in a namespace that keeps what is published."""

    def __init__(self) -> None:
        self.sent: list[list[Any]] = []
        self.cancelled = 0

    def get_namespace(self) -> str:
        return '/robot1'

    def get_name(self) -> str:
        return 'fuser'

    def get_fully_qualified_name(self) -> str:
        return '/robot1/fuser'

    def get_clock(self) -> Any:
        return SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))

    def has_parameter(self, _: str) -> bool:
        return False

    def declare_parameter(self, _: str, value: float) -> Any:
        return SimpleNamespace(value=value)

    def create_timer(self, *_: Any) -> Any:
        return SimpleNamespace(cancel=self._cancel)

    def _cancel(self) -> None:
        self.cancelled += 1

    def create_publisher(self, *_: Any) -> Any:
        return SimpleNamespace(publish=lambda message: self.sent.append(message.status))


@pytest.fixture
def node() -> Node:
    return Node()


@pytest.fixture
def diagnostics(node: Node, monkeypatch: pytest.MonkeyPatch) -> UpdaterDiagnostics:
    """What the node uses where the package is installed."""
    monkeypatch.syspath_prepend(str(STAND_INS))
    made = make_diagnostics(node)  # type: ignore[arg-type]
    assert isinstance(made, UpdaterDiagnostics)
    return made


def test_each_report_is_a_task_and_says_what_is_new(
    diagnostics: UpdaterDiagnostics, node: Node,
) -> None:
    diagnostics.publish([Report('estimator', HealthLevel.WARN, 'aligning tilt', {'queue': '3'}),
                         Report('fix', HealthLevel.OK, '5.0 Hz')])
    diagnostics.publish([Report('estimator', HealthLevel.OK, 'ok'),
                         Report('fix', HealthLevel.ERROR, 'silent')])
    assert [[(one.name, one.level, one.message) for one in sent] for sent in node.sent] == [
        [('fuser: estimator', b'\x01', 'aligning tilt'), ('fuser: fix', b'\x00', '5.0 Hz')],
        [('fuser: estimator', b'\x00', 'ok'), ('fuser: fix', b'\x02', 'silent')]]
    assert [(one.key, one.value) for one in node.sent[0][0].values] == [('queue', '3')]


def test_a_subject_that_is_no_longer_reported_is_no_longer_published(
    diagnostics: UpdaterDiagnostics, node: Node,
) -> None:
    diagnostics.publish([Report('estimator', HealthLevel.OK, 'ok'),
                         Report('receiver fix_2', HealthLevel.OK, 'weight 0.4')])
    diagnostics.publish([Report('estimator', HealthLevel.OK, 'ok')])
    assert [one.name for one in node.sent[1]] == ['fuser: estimator']


def test_the_node_says_when_not_a_timer_on_ros_time(
    diagnostics: UpdaterDiagnostics, node: Node,
) -> None:
    assert node.cancelled == 1 and node.sent == []
    diagnostics.publish([Report('estimator', HealthLevel.OK, 'ok')])
    assert node.sent[0][0].hardware_id == 'robot1'


def test_without_the_package_the_message_is_built_by_hand(
    node: Node, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, 'diagnostic_updater', None)
    made = make_diagnostics(node)  # type: ignore[arg-type]
    assert isinstance(made, PlainDiagnostics)
    made.publish([Report('estimator', HealthLevel.OK, 'ok')])
    assert node.sent[0][0].name == 'robot1/fuser: estimator'


@pytest.mark.slow
def test_the_node_reports_through_the_package_whatever_its_period(
    start_fuser: Callable[..., Fuser], peer: Peer, monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The period of the package is a parameter that the user may set as for any other node."""
    monkeypatch.setenv('PYTHONPATH', str(STAND_INS))
    fuser = start_fuser({'diagnostic_updater.period': 50.0})
    sentence = 'waiting for odometry: /odom has 0 messages, no publisher'
    peer.until(lambda: peer.texts().get('estimator') == sentence, fuser)
    assert peer.reports['estimator'].name == 'fuser: estimator'
    seen = peer.report_count
    peer.until(lambda: peer.report_count >= seen + 5, fuser)
