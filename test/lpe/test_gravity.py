"""Gravity from the departure of velocity from the integrated force, by closed-form motion."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.lpe.gravity import ForceHistory
from ekf_fusion_ros.lpe.gravity import Gravity

START_US = 1_700_000_000_000_000
STEP_US = 5_000
G = np.array((0.0, 0.0, 9.80665))
RADIUS, TURN = 20.0, 0.4


def velocity(t):
    """On a circle that is flown in 16 s, 3.2 m/s^2 across."""
    return RADIUS * TURN * np.array((-np.sin(TURN * t), np.cos(TURN * t), 0.0))


def fly(seconds, every, *, window=0.0, late=0.0, turned=None, noise=0.0):
    """Return gravity after a flight; `turned` (3, 3) is an error of the attitude."""
    rng = np.random.default_rng(3)
    force = ForceHistory()
    gravity = Gravity(force, round(1e6 * window))
    turned = np.eye(3) if turned is None else turned
    for k in range(1, round(1e6 * seconds) // STEP_US + 1):
        t = 1e-6 * STEP_US * k
        change = velocity(t) - velocity(t - 1e-6 * STEP_US)
        force.carry(START_US + STEP_US * k, turned @ (change - G * 1e-6 * STEP_US))
        if k % every == 0:
            measured = velocity(t - late) + noise * rng.standard_normal(3)
            gravity.note(START_US + STEP_US * k - round(1e6 * late), measured)
    return gravity.at(START_US + STEP_US * k), gravity


@pytest.mark.parametrize('options', [
    {'every': 40}, {'every': 40, 'late': 0.3}, {'every': 1, 'window': 0.1},
    {'every': 10, 'window': 0.5}])
def test_the_motion_of_the_vehicle_does_not_show(options):
    found, _ = fly(10.0, **options)
    np.testing.assert_allclose(found, G, atol=1e-6)


def test_an_attitude_that_is_wrong_shows_as_gravity_aslant():
    angle = 0.1
    turned = np.array(((np.cos(angle), 0.0, np.sin(angle)), (0.0, 1.0, 0.0),
                       (-np.sin(angle), 0.0, np.cos(angle))))
    found, _ = fly(10.0, 10, window=0.5, turned=turned)
    # What turns the force turns gravity; the motion, turned too, adds up to 3.2 m/s^2 times 0.1.
    np.testing.assert_allclose(found, turned @ G, atol=0.4)


def test_a_longer_window_stills_the_noise():
    spread = [np.std([fly(3.0 + 0.05 * k, 10, window=window, noise=0.2)[0][0]
                      for k in range(40)]) for window in (0.0, 0.5)]
    assert spread[1] < 0.2 * spread[0]


def test_it_is_not_known_before_two_velocities_and_when_they_are_old():
    assert fly(0.3, 40)[0] is None
    found, gravity = fly(5.0, 40)
    assert found is not None
    assert gravity.at(START_US + 6_600_000) is None


def test_a_velocity_from_before_the_history_is_passed_over():
    found, _ = fly(10.0, 40, late=1.2)
    assert found is None
