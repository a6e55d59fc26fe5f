"""The made-up flight makes every kernel ready that a real one needs."""

from __future__ import annotations

import subprocess
import sys

import pytest

from ekf_fusion_ros.kernels.compile import COMPILED

PROGRAM = """
import sys

import numpy as np

from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.mathlib.rigid import compose
from ekf_fusion_ros.mathlib.rigid import interpolate
from ekf_fusion_ros.mathlib.rigid import inverse
from ekf_fusion_ros.mathlib.rotation import euler_321
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.roles import SUPPORTED
from ekf_fusion_ros.roles import configure
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.warm_up import warm_up


def compiled():
    found = set()
    for name in [name for name in sys.modules if name.startswith('ekf_fusion_ros.')]:
        for value in vars(sys.modules[name]).values():
            if hasattr(value, 'py_func'):
                found |= {(value.py_func.__qualname__, str(one)) for one in value.signatures}
    return found


warm_up(configure(Params(), SUPPORTED))
before = compiled()
flight = Scenario(trajectory=Flight(duration=40.0, height=15.0), sensors=default_sensors(),
                  seed=1)
session = FusionSession(Params(), ['imu', 'odometry', 'fix', 'magnetic_field', 'pressure'])
for arrival in flight.arrivals():
    session.push(arrival.sample)
fused = {status.name: status.fused for status in session.estimator.aid_statuses()}
assert fused['magnetic_field'] > 0, fused
assert fused['gnss_position'] > 0, fused
assert fused['vision_velocity'] > 0, fused
assert len(before) > 10, before
assert session.set_pose(GivenPose(np.zeros(3), np.ones(3), 1.0, 0.1))
pose = Pose(np.zeros(3), np.array((0.6, 0.0, 0.0, 0.8)))
compose(inverse(pose), interpolate(pose, inverse(pose), 0.3))
euler_321(matrix_from_quat(pose.quaternion))
late = compiled() - before
assert not late, late
"""


@pytest.mark.slow
@pytest.mark.skipif(not COMPILED, reason='kernels are not compiled: numba is absent or off')
def test_a_flight_after_the_warm_up_compiles_nothing():
    done = subprocess.run(
        [sys.executable, '-c', PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
