"""Distance of fixes to the causal track, by hand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pymap3d
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.replay.fix_distance import FixDistance

ORIGIN = GeoPoint(47.0, 8.0, 400.0)


def fix_at(time_us, north, east, eph=1.0):
    lat, lon, _ = pymap3d.enu2geodetic(east, north, 0.0, ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    return SimpleNamespace(time_us=time_us, lat=lat, lon=lon, eph=eph)


def row(time_us, north, *fixes):
    """A track that goes north with 10 m/s."""
    nav = SimpleNamespace(position=np.array([north, 0.0, 0.0]), origin=ORIGIN)
    return SimpleNamespace(time_us=time_us, nav=nav, fixes=fixes)


def take(distance, rows):
    distance.note(rows, [fix for one in rows for fix in one.fixes])


def test_a_fix_counts_at_its_stamp_less_the_delay():
    distance = FixDistance(Params())
    # the fix of 1.11 s is that of 1.00 s, where the track was at 10 m
    take(distance, [row(900_000, 9.0), row(1_100_000, 11.0, fix_at(1_110_000, 10.0, 3.0))])
    assert distance.as_dict() == {
        'count': 1, 'rms': pytest.approx(3.0, abs=1e-3),
        'largest': pytest.approx(3.0, abs=1e-3), 'over_limit': 0}


def test_the_limit_is_three_sigmas_and_two_metres():
    distance = FixDistance(Params())
    rows = [row(k * 100_000, float(k)) for k in range(1, 40)]
    rows.append(row(4_000_000, 40.0, fix_at(3_110_000, 30.0, 4.9), fix_at(3_210_000, 31.0, 5.1)))
    # batches may part them
    take(distance, rows[:20])
    take(distance, rows[20:])
    found = distance.as_dict()
    assert (found['count'], found['over_limit']) == (2, 1)
    assert found['largest'] == pytest.approx(5.1, abs=1e-3)
    assert found['rms'] == pytest.approx(np.sqrt((4.9 ** 2 + 5.1 ** 2) / 2), abs=1e-3)


def test_fixes_before_the_track_do_not_count():
    distance = FixDistance(Params())
    take(distance, [row(1_000_000, 10.0, fix_at(900_000, 0.0, 0.0))])
    assert distance.as_dict() is None


def test_a_fix_waits_for_the_track():
    distance = FixDistance(Params())
    distance.note([row(1_000_000, 10.0)], [fix_at(2_110_000, 20.0, 4.0)])
    assert distance.as_dict() is None
    distance.note([], [])
    distance.note([row(2_500_000, 25.0)], [])
    assert distance.as_dict()['largest'] == pytest.approx(4.0, abs=1e-3)
