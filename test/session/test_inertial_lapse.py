"""Time that passes without inertial data: the track is found again."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

ROLES = ('imu', 'fix', 'magnetic_field', 'pressure')
SECONDS = 75.0


@pytest.mark.parametrize(('start', 'lapse'), [(60.0, 2.0), (60.0, 4.0), (50.0, 3.0)])
def test_track_after_an_imu_was_silent(start, lapse):
    """The vehicle turns by 25 to 60 deg and goes 10 to 20 m meanwhile."""
    scenario = Scenario(
        trajectory=FigureOfEight(duration=SECONDS, size=60.0, period=60.0),
        sensors=default_sensors(ROLES), seed=1)
    session, rows = FusionSession(Params(), ROLES), []
    for arrival in scenario.arrivals():
        seconds = 1e-6 * (arrival.time_us - scenario.start_us)
        if arrival.role == 'imu' and start < seconds < start + lapse:
            continue
        for output in session.push(arrival.sample):
            nav = output.nav
            yaw = yaw_of(matrix_from_quat(nav.quaternion))
            sigmas = np.sqrt(nav.pose_cov.diagonal()[[0, 1, 5]])
            seconds = 1e-6 * (nav.time_us - scenario.start_us)
            rows.append((seconds, *nav.position[0:2], yaw, *sigmas))
    table = np.array(rows)
    truth = scenario.trajectory.motion(table[:, 0])
    error = table[:, 1:3] - truth.position[:, 0:2]
    error -= np.median(error, axis=0)
    # until the fusion horizon has passed the lapse only the sigma tells of it
    ahead = (table[:, 0] > start + lapse) & (table[:, 0] < start + lapse + 0.15)
    assert ahead.sum() > 5
    assert np.hypot(*error[ahead].T).min() > 3.0
    assert (np.abs(error[ahead]) < 3.0 * table[ahead, 4:6]).all()
    after = table[:, 0] > start + lapse + 3.0
    assert np.hypot(*error[after].T).max() < 5.0
    yaw = np.array([yaw_of(rotation) for rotation in truth.rotation])
    wrong = np.array([abs(wrap_pi(angle)) for angle in table[:, 3] - yaw])
    assert np.degrees(wrong[after].max()) < 12.0
    assert (wrong[ahead] < 3.0 * table[ahead, 6]).all()
    texts = [event.text for event in session.drain_events()]
    assert f'inertial data missing, attitude and motion doubted: {lapse:.1f} s' in texts
