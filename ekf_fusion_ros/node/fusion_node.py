"""The node `fuser`: odometry, fixes and their company in, fused odometry out."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from collections.abc import Sequence
from dataclasses import replace
import signal
import sys
import time
import traceback
from types import FrameType
from typing import Any

from geometry_msgs.msg import PoseStamped
from geometry_msgs.msg import PoseWithCovarianceStamped
from geometry_msgs.msg import TwistStamped
from geometry_msgs.msg import TwistWithCovarianceStamped
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
import rclpy
from rclpy.clock import Clock
from rclpy.clock import ClockType
from rclpy.executors import Executor
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import FluidPressure
from sensor_msgs.msg import Imu
from sensor_msgs.msg import MagneticField
from sensor_msgs.msg import NavSatFix
from sensor_msgs.msg import Range
from std_msgs.msg import Bool

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.node.diagnostics import DiagnosticsPublisher
from ekf_fusion_ros.node.diagnostics import EstimatorWatch
from ekf_fusion_ros.node.diagnostics import TopicWatch
from ekf_fusion_ros.node.intake import Intake
from ekf_fusion_ros.node.navigation import NavigationPublisher
from ekf_fusion_ros.node.parameters import declare_parameters
from ekf_fusion_ros.node.publishers import Publishers
from ekf_fusion_ros.node.qos import input_qos
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.warm_up import warm_up

TOPICS = {
    'odometry': ('odom', Odometry),
    'fix': ('fix', NavSatFix),
    'imu': ('imu', Imu),
    'fix_velocity': ('fix_velocity', TwistWithCovarianceStamped),
    'magnetic_field': ('mag', MagneticField),
    'pressure': ('pressure', FluidPressure),
    'range': ('range', Range),
    'flow': ('flow', Vector3Stamped),
    'airspeed': ('airspeed', TwistWithCovarianceStamped),
    'landed': ('landed', Bool),
    'armed': ('armed', Bool),
    'gps_heading': ('gps_heading', PoseWithCovarianceStamped),
    'aux_velocity': ('aux_velocity', TwistWithCovarianceStamped),
}
# Messages other than the usual ones, by the word in node.<role>_type.
OTHER_TYPES = {'twist': TwistStamped, 'pose': PoseStamped, 'imu': Imu}
STALL_S = 0.25


class FusionNode(Node):  # type: ignore[misc]
    """Queues messages, runs one FusionSession on a timer and publishes what comes of it.

    Raises ValueError, in one sentence, for parameters that cannot be used.
    """

    def __init__(self) -> None:
        super().__init__('fuser', automatically_declare_parameters_from_overrides=True)
        self._params = effective(declare_parameters(self))
        self._session = FusionSession(self._params, self._params.node.roles)
        self._intake = Intake(self._params.node.queue_limit)
        self._outputs = Publishers(self, self._params)
        self._navigation = NavigationPublisher(self, self._params)
        self._diagnostics = DiagnosticsPublisher(self)
        self._estimator_watch = EstimatorWatch()
        self._watches: dict[str, TopicWatch] = {}
        self._trouble = Counter(internal_errors=0, stalls=0)
        self._told: set[str] = set()
        self._last_run: float | None = None

    def prepare(self, stopped: Callable[[], bool]) -> None:
        """Make the kernels ready while nothing arrives; ends early once `stopped` says so."""
        if COMPILED:
            self.get_logger().info('preparing compiled kernels; the first time takes a minute')
        try:
            warm_up(self._session.params, stopped)
        except Exception as error:  # the filter may still do with what really comes
            self._tell_error('preparing the kernels', error)

    def start(self) -> None:
        """Subscribe and start the timers."""
        for role in self._params.node.roles:
            self._subscribe(role)
        unused = [role for role in TOPICS if role not in self._params.node.roles]
        if unused:
            self.get_logger().info(
                f'not listening to {", ".join(unused)}: set node.use_<name> to true to do so')
        # Not the ROS clock: the filter runs on stamps, also while /clock stands still.
        clock = Clock(clock_type=ClockType.STEADY_TIME)
        node = self._params.node
        self.create_timer(1.0 / node.core_rate, self._guarded(self._run_core), clock=clock)
        self.create_timer(1.0 / node.diagnostics_rate, self._guarded(self._report), clock=clock)

    def _subscribe(self, role: str) -> None:
        topic, kind = TOPICS[role]
        kind = OTHER_TYPES.get(getattr(self._params.node, f'{role}_type', ''), kind)
        subscription = self.create_subscription(
            kind, topic, lambda message: self._queue(role, message), input_qos(role),
            qos_overriding_options=QoSOverridingOptions.with_default_policies())
        self._watches[role] = TopicWatch(role, subscription.topic_name)
        self.get_logger().info(f'{role}: {kind.__name__} on {subscription.topic_name}')

    def _queue(self, role: str, message: Any) -> None:
        if not self._intake.put(role, message):
            self._session.refuse(
                role, 'queue_overflow',
                f'{len(self._intake)} messages already wait for the filter: lower the rate of '
                'the inputs or raise node.queue_limit')

    def _run_core(self) -> None:
        """Feed the session for one period at most, so that messages go on being queued."""
        started = time.monotonic()
        period = 1.0 / self._params.node.core_rate
        if self._last_run is not None and started - self._last_run > period + STALL_S:
            # The queues of DDS are short and overwrite without a word: say that it may be so.
            self._trouble['stalls'] += 1
        self._last_run = started
        deadline = started + period
        while self._intake and time.monotonic() < deadline:
            self._handle(*self._intake.take())
        self._navigation.publish(self._session.navigation)
        for event in self._session.drain_events():
            self.get_logger().info(f'{event.time_us / 1e6:.3f} s: {event.text}')

    def _handle(self, role: str, message: Any) -> None:
        try:
            for output in self._session.handle(role, message):
                self._outputs.publish(output)
        except Exception as error:  # one bad message must not end the node
            self._tell_error(f'a message of {role}', error)

    def _report(self) -> None:
        counts = self._session.statistics()
        reports = [self._estimator_watch.report(
            self._session.health(), self._trouble, len(self._intake))]
        reports.append(self._navigation.report(self._session))
        reports += [watch.report(counts[role]) for role, watch in self._watches.items()]
        self._diagnostics.publish(reports)

    def _guarded(self, work: Callable[[], None]) -> Callable[[], None]:
        def call() -> None:
            try:
                work()
            except Exception as error:  # nothing may leave a callback
                self._tell_error(work.__name__.strip('_').replace('_', ' '), error)
        return call

    def _tell_error(self, where: str, error: Exception) -> None:
        """Count an error nobody expected; log each kind once."""
        self._trouble['internal_errors'] += 1
        sentence = f'internal error at {where}, the node goes on: {type(error).__name__}: {error}'
        if sentence not in self._told:
            self._told.add(sentence)
            self.get_logger().error(f'{sentence}\n{"".join(traceback.format_exception(error))}')


def effective(params: Params) -> Params:
    """Return the parameters with the node's wish for one row a filter update carried out."""
    if not params.node.publish_every_update:
        return params
    return replace(params, session=replace(params.session, output_rate=0.0))


def make_executor() -> Executor:
    """Return the executor that keeps the order of arrival across topics, where there is one.

    The waiting executors serve one message a topic in turn, so a backlog reaches the filter in
    another order than it came.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor()
    return EventsExecutor()


class StopRequest:
    """Notes SIGINT and SIGTERM, any number of them.

    An exception or an invalid context in the middle of a call tears the executor apart, and
    `ros2 launch` together with the terminal sends SIGINT twice. So signals only leave a note,
    and the node ends between two callbacks with ROS still up.
    """

    def __init__(self) -> None:
        self.made = False
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, self._note)

    def _note(self, _signal: int, _frame: FrameType | None) -> None:
        self.made = True

    def ignore_more(self) -> None:
        """Let signals pass while Python ends."""
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, signal.SIG_IGN)


def spin(node: FusionNode, stop: StopRequest) -> None:
    """Start a node and serve it until it is asked to stop or ROS shuts down."""
    node.prepare(lambda: stop.made)
    node.start()
    executor = make_executor()
    executor.add_node(node)
    # EventsExecutor.spin() of rclpy 7.1 serves nothing; spin_once() does.
    while rclpy.ok() and not stop.made:
        executor.spin_once(1.0)
    executor.shutdown()
    node.destroy_node()


def make_node(arguments: Sequence[str]) -> FusionNode:
    """Return a node. Raises ValueError, in one sentence, for unusable arguments."""
    parser = argparse.ArgumentParser(
        'fuser', description=__doc__, epilog='ROS arguments follow --ros-args.')
    command = ['fuser', *arguments]
    try:
        parser.parse_args(remove_ros_args(command)[1:])
        rclpy.init(args=command, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise ValueError(f'unusable ROS arguments: {" ".join(str(error).split())}') from error
    return FusionNode()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node; 0 after Ctrl-C or SIGTERM, 2 where the arguments cannot be used."""
    stop = StopRequest()
    try:
        spin(make_node(sys.argv[1:] if argv is None else argv), stop)
    except ValueError as error:
        print(f'fuser: {error}', file=sys.stderr)
        return 2
    finally:
        rclpy.try_shutdown()
        stop.ignore_more()
    return 0


if __name__ == '__main__':
    sys.exit(main())
