"""What the README tells users to write does what it says."""

from __future__ import annotations

from pathlib import Path
import re

import numpy as np
import pytest

from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight

README = Path(__file__).resolve().parents[1] / 'README.md'
BLOCKS = re.findall(r'```python\n(.*?)```', README.read_text(encoding='utf-8'), re.DOTALL)


def flown(roles):
    flight = Scenario(
        trajectory=Flight(duration=60.0, height=15.0), sensors=default_sensors(roles), seed=4)
    return flight, [arrival.sample for arrival in flight.arrivals()]


def test_the_session_of_the_readme_gives_a_track(capsys):
    flight, samples = flown(('imu', 'odometry', 'fix'))
    names = {'samples': samples, 'track': []}
    exec(compile(BLOCKS[0], 'README.md', 'exec'), names)
    times_us, places, covariances = zip(*names['track'], strict=True)
    truth = flight.trajectory.motion(1e-6 * (np.array(times_us) - flight.start_us)).position
    apart = np.array(places) - truth
    assert len(times_us) > 1000
    assert np.linalg.norm((apart - apart.mean(axis=0))[:, :2], axis=1).max() < 5.0
    assert np.isfinite(covariances).all()
    assert capsys.readouterr().out.startswith('ok')


def test_the_filter_of_the_readme_gives_a_state():
    _, samples = flown(('imu', 'magnetic_field', 'pressure', 'fix'))
    names = {'samples': samples}
    exec(compile(BLOCKS[1], 'README.md', 'exec'), names)
    assert names['state'].yaw_aligned


@pytest.mark.parametrize('name', ['FusionSession', 'Ekf2'])
def test_the_library_is_shown_by(name):
    assert any(f'import {name}' in block for block in BLOCKS)
