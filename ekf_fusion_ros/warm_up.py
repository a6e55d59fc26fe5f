"""Loads or compiles the kernels before the first message needs them.

Compiling takes most of a minute the first time, loading what was compiled takes seconds: longer
than the queues of a running system hold.
"""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
import math
from typing import TYPE_CHECKING

import numpy as np

from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.inputs import make_estimator
from ekf_fusion_ros.inputs import make_odometry_imu
from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

if TYPE_CHECKING:
    from ekf_fusion_ros.params.tree import Params

STEP_US = 10_000
STEPS = 1800
STEADY_S = 6.0
CLIMB = 3.0
ACCELERATION = 1.5
SEEN_HEIGHT = 10.0
ANTENNAS_S = 9.0
"""Time in s of the run-up after which antennas give yaw, so that the compass has had its turn."""

METRES_PER_DEGREE = 111_195.0
UP = np.array([0.0, 0.0, -1.0])
NORTH = np.array([1.0, 0.0, 0.0])
FIELD = np.array([0.21, 0.0, 0.43])
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])


def warm_up(params: Params, stopped: Callable[[], bool] = lambda: False) -> None:
    """Run an estimator on a made-up flight so that its kernels are ready.

    `stopped` is asked before every sample; True ends the work. Nothing is done without numba.
    """
    if not COMPILED:
        return
    estimator = make_estimator(params)
    odometry_imu = make_odometry_imu(params)
    for sample in climb():
        if stopped():
            return
        if isinstance(sample, VisionSample):
            odometry_imu.push(sample)
        estimator.push(sample)
        if isinstance(sample, ImuSample):
            estimator.update()
            estimator.nav_state()
    estimator.set_pose(GivenPose(np.zeros(3), np.ones(3), 0.0, 0.01))


def climb() -> Iterator[Sample]:
    """Yield the samples of a climb with every sensor, inertial ones last.

    It is steady at first, for the alignment, and then gains speed to the north: acceleration
    lets the filter take the magnetometer on three axes.
    """
    for number in range(1, STEPS):
        time_us = number * STEP_US
        run_up = max(0.0, time_us * 1e-6 - STEADY_S)
        if time_us == round(1e6 * STEADY_S):
            yield LandedSample(time_us, landed=False, fuse_beta=True)
        place = CLIMB * time_us * 1e-6 * UP + 0.5 * ACCELERATION * run_up ** 2 * NORTH
        velocity = CLIMB * UP + ACCELERATION * run_up * NORTH
        if number % 5 == 0:
            yield MagSample(time_us, FIELD)
            yield BaroSample(time_us, 100.0 - place[2])
            seen = np.array((velocity[1], -velocity[0])) / SEEN_HEIGHT
            yield RangeSample(time_us, SEEN_HEIGHT)
            yield FlowSample(time_us, 0.05 * seen, np.zeros(3), 255, 0.05)
            yield AirspeedSample(time_us, 1.0 + ACCELERATION * run_up, 1.0)
        if number % 4 == 0:
            yield VisionSample(
                time_us, place, LEVEL, velocity, np.full(3, 0.1), 0.1 * np.eye(3))
        if number % 20 == 0:
            yield GnssSample(
                time_us, 47.0 + place[0] / METRES_PER_DEGREE, 8.0, 100.0 - place[2], 0.5, 0.8,
                velocity, 0.2, yaw=0.0 if run_up > ANTENNAS_S else math.nan)
        if number % 600 == 0:
            yield HeadingSample(time_us, 0.0, math.radians(3.0) ** 2)
        dt = STEP_US * 1e-6
        force = 9.80665 * UP + (ACCELERATION * NORTH if run_up else 0.0)
        yield ImuSample(time_us, np.zeros(3), dt * force, dt, dt)
