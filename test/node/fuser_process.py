"""The node in a process of its own, and a peer that talks to it over DDS."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Mapping
from pathlib import Path
import signal
import subprocess
import sys
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import NavSatFix

DEADLINE_S = 120.0
RELIABLE = QoSProfile(depth=10000)
REPOSITORY = Path(__file__).resolve().parents[2]


class Fuser:
    """`fuser` as a process; its output goes to a file."""

    def __init__(
        self, log: Path, parameters: Mapping[str, Any], remappings: Mapping[str, str],
    ) -> None:
        self._log = log
        command = [sys.executable, '-m', 'ekf_fusion_ros.node.fusion_node', '--ros-args']
        for name, value in parameters.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            command += ['-p', f'{name}:={text}']
        for name, topic in remappings.items():
            command += ['-r', f'{name}:={topic}']
        with log.open('wb') as stream:
            self.process = subprocess.Popen(
                command, stdout=stream, stderr=subprocess.STDOUT, cwd=REPOSITORY)

    @property
    def output(self) -> str:
        """What the node printed so far."""
        return self._log.read_text(errors='replace')

    def wait(self) -> int:
        """Return the exit status."""
        return self.process.wait(DEADLINE_S)

    def interrupt(self, kind: signal.Signals = signal.SIGINT) -> None:
        """Send a signal."""
        self.process.send_signal(kind)

    def close(self) -> None:
        """End the process however it stands."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class Peer:
    """Publishes to the node and keeps what it says."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = Node('peer', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._publishers: dict[str, Any] = {}
        self.odometry: list[Odometry] = []
        self.gps: list[Odometry] = []
        self.fixes: list[NavSatFix] = []
        self.reports: dict[str, Any] = {}
        self.report_count = 0
        for kind, topic, keep in (
            (Odometry, 'odometry/filtered', self.odometry.append),
            (Odometry, 'odometry/gps', self.gps.append),
            (NavSatFix, 'gps/filtered', self.fixes.append),
            (DiagnosticArray, '/diagnostics', self._note),
        ):
            self.node.create_subscription(kind, topic, keep, RELIABLE)

    def _note(self, message: DiagnosticArray) -> None:
        self.report_count += 1
        for status in message.status:
            self.reports[status.name.split(': ')[1]] = status

    def connect(self, fuser: Fuser, topics: Mapping[str, type]) -> None:
        """Advertise topics and wait until the node listens to each and is listened to."""
        for topic, kind in topics.items():
            self._publishers[topic] = self.node.create_publisher(kind, topic, RELIABLE)
        self.until(
            lambda: bool(self.reports) and all(
                publisher.get_subscription_count() for publisher in self._publishers.values()),
            fuser)
        # The node may learn of the publishers a little later; until then it drops best-effort
        # messages.
        seen = self.report_count
        self.until(lambda: self.report_count >= seen + 5, fuser)

    def publish(self, topic: str, message: Any) -> None:
        """Publish one message."""
        self._publishers[topic].publish(message)

    def until(self, condition: Callable[[], bool], fuser: Fuser) -> None:
        """Serve callbacks until a condition holds; fail at a deadline or when the node ends."""
        deadline = time.monotonic() + DEADLINE_S
        while not condition():
            assert fuser.process.poll() is None, f'the node ended:\n{fuser.output}'
            assert time.monotonic() < deadline, (
                f'waited in vain; diagnostics {self.texts()}, output:\n{fuser.output}')
            self._executor.spin_once(timeout_sec=0.05)

    def texts(self) -> dict[str, str]:
        """Return the sentence of every diagnostic status."""
        return {name: status.message for name, status in self.reports.items()}

    def count(self, role: str, key: str = 'received') -> int:
        """Return a number of the newest report on a role, 0 before it is there."""
        status = self.reports.get(role)
        values = {} if status is None else {item.key: item.value for item in status.values}
        return int(values.get(key, 0))

    def close(self) -> None:
        """Leave the network."""
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self._context)
