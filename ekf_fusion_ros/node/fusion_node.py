"""The node `fuser`: odometry, fixes and their company in, fused odometry out."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from collections.abc import Sequence
from dataclasses import replace
import sys
import time
from typing import Any

import rclpy
from rclpy.clock import Clock
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.live.tuning import Tuning
from ekf_fusion_ros.live.work_watch import WorkWatch
from ekf_fusion_ros.node.estimator_numbers import EstimatorNumbers
from ekf_fusion_ros.node.events import EventsPublisher
from ekf_fusion_ros.node.guard import Guard
from ekf_fusion_ros.node.inputs import Inputs
from ekf_fusion_ros.node.intake import Intake
from ekf_fusion_ros.node.navigation import NavigationPublisher
from ekf_fusion_ros.node.parameters import accept_changes
from ekf_fusion_ros.node.parameters import declare_parameters
from ekf_fusion_ros.node.preparation import Preparation
from ekf_fusion_ros.node.process import StopRequest
from ekf_fusion_ros.node.process import make_executor
from ekf_fusion_ros.node.publishers import Publishers
from ekf_fusion_ros.node.reporting import Reporting
from ekf_fusion_ros.node.services import Services
from ekf_fusion_ros.node.static_frames import make_static_frames
from ekf_fusion_ros.node.transforms import make_transforms
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.roles import ODOMETRY
from ekf_fusion_ros.session import FusionSession

STALL_S = 0.25
READY_CHECK_S = 0.05


class FusionNode(Node):  # type: ignore[misc]
    """Queues messages, runs one FusionSession on a timer and publishes what comes of it.

    Raises ValueError, in one sentence, for parameters that cannot be used.
    """

    def __init__(self) -> None:
        super().__init__('fuser', automatically_declare_parameters_from_overrides=True)
        declared = declare_parameters(self)
        self._params = effective(declared)
        node = self._params.node
        self._session = FusionSession(self._params, node.roles)
        self._intake = Intake(node.queue_limit)
        self._work = WorkWatch(1.0 / node.core_rate, STALL_S)
        self._guard = Guard(self, self._work.trouble)
        self._switches = Switches(
            node.roles, self._session.inertial_role, enabled=not node.disabled_at_startup)
        steering = Steering(self._session, self._switches, node.output_frame)
        tuning = Tuning(declared, self._session, steering)
        accept_changes(self, tuning, self._guard)
        self._static_frames = make_static_frames(self, declared, tuning, self._guard)
        Services(self, steering, self._guard, node.roles)
        self._outputs = Publishers(self, self._params)
        self._navigation = NavigationPublisher(self, self._params)
        self._events = EventsPublisher(self)
        self._inputs = Inputs(self, node, self._queue)
        self._reporting = Reporting(
            self, self._session, self._inputs, self._switches, self._work, self._navigation,
            lambda: len(self._intake))
        self._transforms = make_transforms(
            self, self._params, lambda: self._session.params.messages.odometry, self._guard)
        if self._transforms is not None:
            self._reporting.further.append(self._transforms.report)
        self._preparation: Preparation | None = None
        # Not the ROS clock: the filter runs on stamps, also while /clock stands still.
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)

    def begin(self, stopped: Callable[[], bool]) -> None:
        """Make the kernels ready, then start; ends early once `stopped` says so.

        Meanwhile the node says on /diagnostics what it is about.
        """
        self._reporting.preparing = True
        self._preparation = Preparation(self._session.params, stopped)
        self._every(1.0 / self._params.node.diagnostics_rate, self._reporting.report)
        self._reporting.report()
        self._ready = self._every(READY_CHECK_S, self._start_when_ready)

    def _start_when_ready(self) -> None:
        preparation = self._preparation
        if preparation is None or not preparation.done:
            return
        self._ready.cancel()
        self._preparation = None
        self._reporting.preparing = False
        if preparation.error is not None:
            self._guard.tell('preparing the kernels', preparation.error)
        self.start()
        self._reporting.report()

    def start(self) -> None:
        """Subscribe and run the filter."""
        self._inputs.subscribe()
        self._every(1.0 / self._params.node.core_rate, self._run_core)
        if self._params.node.estimator_rate > 0.0:
            numbers = EstimatorNumbers(self, self._session)
            self._every(1.0 / self._params.node.estimator_rate, numbers.publish)

    def end(self) -> None:
        """Leave the network."""
        if self._preparation is not None:
            self._preparation.join()
        self.destroy_node()

    def _every(self, period: float, work: Callable[[], None]) -> Any:
        return self.create_timer(period, self._guard(work), clock=self._steady)

    def _queue(self, role: str, message: Any) -> None:
        if self._static_frames is not None:
            self._static_frames.note(role, message)
        refusal = self._switches.refusal(role)
        if refusal is not None:
            self._session.refuse(role, *refusal)
        elif not self._intake.put(role, message):
            self._session.refuse(
                role, 'queue_overflow',
                f'{len(self._intake)} messages already wait for the filter: lower the rate of '
                'the inputs or raise node.queue_limit')

    def _run_core(self) -> None:
        """Feed the session for one period at most, so that messages go on being queued."""
        started = time.monotonic()
        self._work.begin(started)
        deadline = started + 1.0 / self._params.node.core_rate
        waits = self._static_frames is not None and self._static_frames.waits()
        while self._intake and not waits and time.monotonic() < deadline:
            self._handle(*self._intake.take())
        self._navigation.publish(self._session.navigation)
        self._events.publish(self._session.drain_events())
        self._work.end(time.monotonic())

    def _handle(self, role: str, message: Any) -> None:
        try:
            if role == ODOMETRY and self._transforms is not None:
                self._transforms.note_odometry(message)
            for output in self._session.handle(role, message):
                self._outputs.publish(output)
                if self._transforms is not None:
                    self._transforms.publish(output.nav)
                self._reporting.note_output(output.time_us)
        except Exception as error:  # one bad message must not end the node
            self._guard.tell(f'a message of {role}', error)


def effective(params: Params) -> Params:
    """Return the parameters with the node's wish for one row a filter update carried out."""
    if not params.node.publish_every_update:
        return params
    return replace(params, session=replace(params.session, output_rate=0.0))


def spin(node: FusionNode, stop: StopRequest) -> None:
    """Start a node and serve it until it is asked to stop or ROS shuts down."""
    node.begin(lambda: stop.made)
    executor = make_executor()
    executor.add_node(node)
    # EventsExecutor.spin() of rclpy 7.1 serves nothing; spin_once() does.
    while rclpy.ok() and not stop.made:
        executor.spin_once(1.0)
    executor.shutdown()
    node.end()


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
