"""An IMU with fixes that starts while the vehicle moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Circle
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

ROLES = ('imu', 'fix', 'magnetic_field', 'pressure')
SECONDS = 40.0


@pytest.mark.parametrize('trajectory', [
    Circle(duration=SECONDS), FigureOfEight(duration=SECONDS, size=60.0, period=60.0)])
def test_fixes_without_velocity_find_a_vehicle_under_way(trajectory):
    """By the first fused fix, 10 s on, the vehicle has 5 to 8 m/s, and nothing has told so."""
    sensors = default_sensors(ROLES)
    sensors['fix'] = replace(sensors['fix'], has_velocity=False)
    scenario = Scenario(trajectory=trajectory, sensors=sensors, seed=1)
    session, rows = FusionSession(Params(), ROLES), []
    for arrival in scenario.arrivals():
        rows += [(output.nav.time_us, *output.nav.position[0:2])
                 for output in session.push(arrival.sample)]
    time = np.array([1e-6 * (row[0] - scenario.start_us) for row in rows])
    assert time[0] < 12.0
    # The origin lies where the vehicle was by a fix of 1.3 m.
    truth = trajectory.motion(time).position[:, 0:2]
    moved = np.array([row[1:] for row in rows])
    error = moved - truth
    error -= np.median(error, axis=0)
    assert np.hypot(*error.T).max() < 10.0
