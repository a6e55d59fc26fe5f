"""The demo's flight: what it promises, and the score of a perfect and of a useless fusion."""

import numpy as np
import pytest

from ekf_fusion_ros.simulation.showcase import DURATION
from ekf_fusion_ros.simulation.showcase import OUTAGE
from ekf_fusion_ros.simulation.showcase import showcase


@pytest.fixture(scope='module')
def flight():
    return showcase(3)


def test_flight_starts_and_ends_on_the_ground_at_rest(flight):
    motion = flight.trajectory.motion(np.array([0.0, DURATION]))
    np.testing.assert_allclose(motion.velocity, 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.position[:, 2], 0.0, atol=1e-9)


def test_speed_in_cruise_is_as_described(flight):
    velocity = flight.trajectory.motion(np.linspace(40.0, 560.0, 2000)).velocity
    speed = np.linalg.norm(velocity[:, :2], axis=1)
    assert speed.min() > 3.0
    assert speed.max() < 7.0


def test_fixes_carry_no_velocity_and_stop_in_the_outage(flight):
    fixes = [a.sample for a in flight.arrivals() if a.role == 'fix']
    assert not any(fix.has_velocity for fix in fixes)
    measured = np.array([fix.time_us - flight.start_us for fix in fixes]) * 1e-6 - 0.11
    assert not np.any((measured >= OUTAGE[0]) & (measured < OUTAGE[1] - 1e-6))
    assert np.diff(measured).max() == pytest.approx(OUTAGE[1] - OUTAGE[0] + 0.2)


def test_seeds_differ():
    def first_fix(seed):
        return next(a.sample.lat for a in showcase(seed).arrivals() if a.role == 'fix')

    assert first_fix(1) != first_fix(2)
    assert first_fix(1) == first_fix(1)
