"""/diagnostics through diagnostic_updater, of which a stand-in keeps the documented interface."""

from __future__ import annotations

from collections.abc import Callable
import sys
from types import ModuleType
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.msg import KeyValue

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.node.diagnostics import PlainDiagnostics
from ekf_fusion_ros.node.diagnostics import UpdaterDiagnostics
from ekf_fusion_ros.node.diagnostics import make_diagnostics


class Status(DiagnosticStatus):
    """A status with the two methods that tasks call."""

    def summary(self, level: bytes, text: str) -> None:
        self.level, self.message = level, text

    def add(self, key: str, value: str) -> None:
        self.values.append(KeyValue(key=key, value=value))


class Updater:
    """Runs its tasks when forced to, and keeps what they say."""

    def __init__(self, node: Any) -> None:
        self.cancelled = 0
        self.timer = SimpleNamespace(cancel=self._cancel)
        self.tasks: dict[str, Callable[[Any], Any]] = {}
        self.hardware = ''
        self.sent: list[list[Status]] = []

    def _cancel(self) -> None:
        self.cancelled += 1

    def setHardwareID(self, name: str) -> None:  # noqa: N802
        self.hardware = name

    def add(self, name: str, task: Callable[[Any], Any]) -> None:
        assert name not in self.tasks
        self.tasks[name] = task

    def removeByName(self, name: str) -> bool:  # noqa: N802
        return self.tasks.pop(name, None) is not None

    def force_update(self) -> None:
        self.sent.append([task(Status(name=name)) for name, task in self.tasks.items()])


@pytest.fixture
def updater(monkeypatch: pytest.MonkeyPatch) -> Updater:
    """What the node uses where the package is installed, with the node in a namespace."""
    module = ModuleType('diagnostic_updater')
    module.Updater = Updater  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'diagnostic_updater', module)
    node = SimpleNamespace(get_namespace=lambda: '/robot1')
    diagnostics = make_diagnostics(node)  # type: ignore[arg-type]
    assert isinstance(diagnostics, UpdaterDiagnostics)
    one: Updater = diagnostics._updater
    one.publish = diagnostics.publish  # type: ignore[attr-defined]
    return one


def test_each_report_is_a_task_and_says_what_is_new(updater: Any) -> None:
    updater.publish([Report('estimator', HealthLevel.WARN, 'aligning tilt', {'queue': '3'}),
                     Report('fix', HealthLevel.OK, '5.0 Hz')])
    updater.publish([Report('estimator', HealthLevel.OK, 'ok'),
                     Report('fix', HealthLevel.ERROR, 'silent')])
    assert [[(one.name, one.level, one.message) for one in sent] for sent in updater.sent] == [
        [('estimator', b'\x01', 'aligning tilt'), ('fix', b'\x00', '5.0 Hz')],
        [('estimator', b'\x00', 'ok'), ('fix', b'\x02', 'silent')]]
    assert [(one.key, one.value) for one in updater.sent[0][0].values] == [('queue', '3')]


def test_a_subject_that_is_no_longer_reported_is_no_longer_published(updater: Any) -> None:
    updater.publish([Report('estimator', HealthLevel.OK, 'ok'),
                     Report('receiver fix_2', HealthLevel.OK, 'weight 0.4')])
    updater.publish([Report('estimator', HealthLevel.OK, 'ok')])
    assert [one.name for one in updater.sent[1]] == ['estimator']


def test_the_node_says_when_not_a_timer_on_ros_time(updater: Any) -> None:
    assert updater.cancelled == 1 and updater.sent == []
    assert updater.hardware == 'robot1'


def test_without_the_package_the_message_is_built_by_hand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, 'diagnostic_updater', None)
    node = SimpleNamespace(get_fully_qualified_name=lambda: '/robot1/fuser',
                           create_publisher=lambda *_: None)
    assert isinstance(make_diagnostics(node), PlainDiagnostics)  # type: ignore[arg-type]
