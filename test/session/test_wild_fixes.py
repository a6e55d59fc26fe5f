"""Odometry and fixes alone: fixes that are wrong for a moment are not followed."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import Flight

WRONG_FROM = 45.0
AFTER = 10.0
EARTH_RADIUS = 6.371e6


def tracks(
    rate, seed, wrong_for, wrong_by, *, roles=('odometry', 'fix'), wrong_from=WRONG_FROM,
):
    """Return the position NE (N, 2) without and with wrong fixes, from the first one on."""
    sensors = default_sensors(roles)
    sensors['fix'] = replace(sensors['fix'], rate=rate)
    flight = Scenario(trajectory=Flight(duration=wrong_from + AFTER, height=15.0),
                      sensors=sensors, seed=seed)
    both = []
    for shift in (0.0, wrong_by):
        session, rows = FusionSession(Params(), roles), []
        for arrival in flight.arrivals():
            sample, seconds = arrival.sample, 1e-6 * (arrival.time_us - flight.start_us)
            if arrival.role == 'fix' and wrong_from <= seconds < wrong_from + wrong_for:
                sample = sample._replace(lat=sample.lat + math.degrees(shift / EARTH_RADIUS))
            outputs = session.push(sample)
            rows += [output.nav.position[0:2] for output in outputs if seconds >= wrong_from]
        both.append(np.array(rows))
    return both


@pytest.mark.parametrize('rate', [1.0, 5.0, 10.0])
@pytest.mark.parametrize('seed', [1, 2])
def test_a_fix_that_is_off_for_less_than_a_second_is_refused(rate, seed):
    without, with_wrong = tracks(rate, seed, wrong_for=0.9, wrong_by=25.0)
    assert np.abs(with_wrong - without).max() < 1.0


@pytest.mark.parametrize('roles', [
    ('odometry', 'fix'), ('odometry', 'fix', 'imu', 'magnetic_field', 'pressure')])
def test_odometry_that_was_seen_to_be_good_outlasts_ten_seconds_of_wrong_fixes(roles):
    without, with_wrong = tracks(
        5.0, 1, wrong_for=10.0, wrong_by=15.0, roles=roles, wrong_from=90.0)
    assert np.abs(with_wrong - without).max() < 3.0
