"""A session that drives LPE."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.lpe.lpe import Lpe
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.roles import configure
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

LPE = with_overrides(Params(), {'estimator': 'lpe'})


def test_the_parameter_chooses_and_changes_reach_it():
    session = FusionSession(LPE, {'imu', 'fix'})
    assert isinstance(session.estimator, Lpe)
    session.adopt(with_overrides(LPE, {'lpe.baro.noise': 1.5}))
    assert session.estimator.params.baro.noise == 1.5


def test_roles_choose_what_is_fused():
    with_fix = configure(LPE, {'odometry', 'fix'}).lpe
    assert with_fix.gnss.enabled
    assert not with_fix.vision.enabled
    assert not with_fix.attitude.odometry_yaw
    alone = configure(LPE, {'odometry', 'flow'}).lpe
    assert not alone.gnss.enabled
    assert alone.vision.enabled
    assert alone.attitude.odometry_yaw
    assert alone.flow.enabled


def run(roles, duration=90.0, **sensors):
    scenario = Scenario(
        trajectory=FigureOfEight(duration=duration),
        sensors={**default_sensors(roles), **sensors}, seed=3)
    session = FusionSession(LPE, set(roles))
    outputs = [output for arrival in scenario.arrivals()
               for output in session.push(arrival.sample)]
    session.finish()
    return scenario, session, outputs


def errors(scenario, outputs, start):
    kept = [o.nav for o in outputs if o.nav.time_us > scenario.start_us + 1e6 * start]
    times = 1e-6 * (np.array([nav.time_us for nav in kept]) - scenario.start_us)
    truth = scenario.trajectory.motion(times).position
    return np.array([nav.position for nav in kept]) - truth


def test_odometry_and_fix_are_enough():
    scenario, session, outputs = run(('odometry', 'fix'))
    assert outputs[0].nav.yaw_aligned
    assert session.alignment() is not None
    error = errors(scenario, outputs, 45.0)
    assert np.sqrt(np.mean(np.sum(error[:, :2] ** 2, axis=1))) < 2.5
    assert session.statistics()['odometry'].passed_over == {}


def test_odometry_alone_gives_its_own_frame():
    """The odometry of the simulator begins where the truth does and looks north."""
    scenario, session, outputs = run(('odometry',), duration=30.0)
    assert session.local
    assert outputs[-1].nav.origin is None
    assert outputs[-1].nav.local_position_valid
    error = errors(scenario, outputs, 5.0)
    assert np.abs(error - error[0]).max() < 0.3


@pytest.mark.slow
def test_imu_fix_and_compass():
    scenario, session, outputs = run(('imu', 'fix', 'magnetic_field', 'pressure'))
    error = errors(scenario, outputs, 45.0)
    assert np.sqrt(np.mean(np.sum(error[:, :2] ** 2, axis=1))) < 2.5
    assert session.health().text.startswith('ok: fusing gnss, baro')
