"""Multirotors with compass, barometer and receiver, fused by default, against their autopilots."""

from __future__ import annotations

import json

import numpy as np
import pytest
from recordings.scores import attitude_errors
from recordings.scores import horizontal_errors
from recordings.scores import rms

from ekf_fusion_ros.__main__ import main

QUAD, OUTDOOR = 'inav_quad_optflow', 'px4_2015_outdoor_px4log'
REFERENCE = {QUAD: 'onboard_estimate_enu_flu.csv', OUTDOOR: 'px4_local_enu_flu.csv'}


@pytest.fixture(scope='module', params=[QUAD, OUTDOOR])
def flight(shared, request, tmp_path_factory):
    """Name, recording and replay."""
    recording = shared / 'data' / request.param / f'{request.param}_mcap'
    if not recording.exists():
        pytest.skip(f'no {recording.name} in the shared folder')
    output = tmp_path_factory.mktemp(request.param)
    assert main(['replay', str(recording), '--output', str(output), '--no-bag']) == 0
    return request.param, recording, output


@pytest.mark.slow
def test_the_track_stays_with_the_fixes(flight):
    _, recording, output = flight
    _, distance, limit = horizontal_errors(recording, output, 0.11, assumed_sigma=2.5)
    assert (distance < limit).all()
    assert rms(distance) < 1.0
    told = json.loads((output / 'summary.json').read_text(encoding='utf-8'))['fix_distance']
    assert told['rms'] == pytest.approx(rms(distance), rel=0.01)
    assert told['largest'] == pytest.approx(distance.max(), rel=0.01)


@pytest.mark.slow
def test_the_attitude_is_that_of_the_autopilot(flight):
    """Within 3 deg RMS; yaw of the 2015 flight does not count.

    There the recorded yaw is 17 deg off what receiver and accelerometer say together, ours 4 deg.
    """
    name, recording, output = flight
    reference = recording.parent / 'reference' / REFERENCE[name]
    _, angle, (roll, pitch, _) = attitude_errors(output, reference)
    assert rms(np.hypot(roll, pitch)) < 1.5
    if name == QUAD:
        assert rms(angle) < 3.0


@pytest.mark.slow
def test_flow_and_range_carry_the_quad_without_fixes(shared, tmp_path):
    """Fixes end 30 s after the first output; 1.3 km later the position is 1 % of the way off."""
    recording = shared / 'data' / QUAD / f'{QUAD}_mcap'
    if not recording.exists():
        pytest.skip(f'no {recording.name} in the shared folder')
    assert main(['replay', str(recording), '--output', str(tmp_path), '--no-bag', '--topic',
                 'flow=/flow', '--topic', 'range=/range', '--withhold', 'fix=40:900']) == 0
    time, distance, _ = horizontal_errors(recording, tmp_path, 0.11, assumed_sigma=2.5)
    flown = time < time[0] + 430.0
    assert distance[flown].max() < 0.015 * 1300.0
    reference = recording.parent / 'reference' / REFERENCE[QUAD]
    _, angle, _ = attitude_errors(tmp_path, reference)
    assert rms(angle) < 4.0
