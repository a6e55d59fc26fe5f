"""The drift of odometry, found against fixes, on walks whose drift is chosen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.odometry_drift import OdometryDrift
from ekf_fusion_ros.params.two_topic import DriftParams

SECOND = 1_000_000
SPEED = 2.0
PER_POINT = 5


def walk(drift=0.0, scale=0.0, white=0.0, wrong=(0.0, 0.0), seconds=200, seed=1, **params):
    """Return what is found on a winding way along which the odometry drifts, m/sqrt(m).

    white: noise of each fix, m; wrong: from when to when the fixes are 15 m off, s.
    """
    rng = np.random.default_rng(seed)
    found = OdometryDrift(DriftParams(factor=1.0, **params))
    step = SPEED / PER_POINT
    place = strayed = 0j
    for k in range(seconds):
        odometry, fixes = [], []
        for i in range(PER_POINT):
            heading = 0.8 * math.sin(0.05 * (k + i / PER_POINT))
            move = step * complex(math.cos(heading), math.sin(heading))
            place += move
            strayed += scale * move + drift * math.sqrt(step) * complex(*rng.standard_normal(2))
            off = 15.0 if wrong[0] <= k < wrong[1] else 0.0
            odometry.append((place + strayed) * np.exp(1.1j))
            fixes.append(place + off + white * complex(*rng.standard_normal(2)))
        found.note(k * SECOND, SPEED * k, odometry, fixes)
    news = found.news(seconds * SECOND)
    return math.inf if news is None else news.walk


@pytest.mark.parametrize('drift', [0.1, 0.4])
def test_it_is_the_drift_that_shows_or_more(drift):
    """The largest of several windows counts, and one of them says little of a random walk."""
    found = [walk(drift, seed=seed) for seed in range(8)]
    assert drift < np.median(found) < 2.5 * drift


def test_white_noise_of_the_fixes_is_no_drift():
    assert walk(0.1, white=1.0) < walk(0.1) + 0.1
    assert walk(white=1.0) < 0.15


def test_an_error_of_the_scale_shows():
    assert walk(scale=0.1) > 0.3


@pytest.mark.parametrize(('until', 'shows'), [(199.0, False), (170.0, True)])
def test_wrong_fixes_show_once_they_are_old(until, shows):
    found = walk(0.1, wrong=(until - 5.0, until), hold=15.0)
    assert (found > 1.0) is shows


def test_fixes_that_stand_still_make_no_good_odometry():
    found = OdometryDrift(DriftParams(hold=0.0))
    for k in range(60):
        found.note(k * SECOND, 1.0 * k, [complex(k)], [0j])
    assert found.news(0).walk > 5.0


def test_standing_adds_nothing():
    found = OdometryDrift(DriftParams(hold=0.0, path=5.0))
    for k in range(10):
        found.note(k * SECOND, 1.0 * k, [complex(k)], [complex(k, 0.1)])
    straight = found.news(0)
    for k in range(10, 200):
        found.note(k * SECOND, 9.0, [9.0 + 0j], [complex(9.0, 0.05 * k)])
    assert straight.walk < 0.01
    assert found.news(0) is None


def test_nothing_is_known_before_the_path_is_long_enough():
    assert walk(0.1, seconds=20) == math.inf
    found = OdometryDrift(DriftParams(hold=0.0, path=5.0))
    for k in range(10):
        found.note(k * SECOND, 1.0 * k, [complex(k)], [complex(k, 0.1 * (k % 2))])
    first = found.news(0)
    assert math.isfinite(first.walk)
    assert found.news(0) is None
    found.forget()
    assert found.news(0).walk == math.inf
