"""GNSS: start, loss, jumps, quality, and what happens beside another source."""

from __future__ import annotations

from ekf2 import bench as bench_module
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import VisionParams

METRES_PER_DEGREE = 111_180.0
METRES_PER_DEGREE_EAST = 75_550.0
"""On the ellipsoid at 47.36 N."""


def started(params=None, seconds=12.0):
    """A vehicle that uses fixes."""
    bench = Bench(params)
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(seconds)
    assert 'gps' in bench.flags
    return bench


def test_fixes_stop_and_come_back():
    bench = started()
    bench.sending.discard('fix')
    bench.run(9.0)
    assert 'gps' in bench.flags
    bench.run(2.0)
    assert 'gps' not in bench.flags
    assert not bench.ekf.nav_state().local_position_valid
    bench.sending.add('fix')
    bench.run(2.0)
    assert 'gps' in bench.flags
    assert bench.ekf.nav_state().global_position_valid
    (status,) = [s for s in bench.ekf.aid_statuses() if s.name == 'gnss_position']
    assert (status.starts, status.stops) == (2, 1)


def test_dead_reckoning_is_told_after_a_second_and_position_is_invalid_after_five():
    bench = started()
    bench.sending.discard('fix')
    bench.run(0.8)
    assert not bench.ekf.nav_state().dead_reckoning
    bench.run(1.0)
    assert bench.ekf.nav_state().dead_reckoning
    assert bench.ekf.nav_state().local_position_valid
    bench.run(6.0)
    assert not bench.ekf.nav_state().local_position_valid


def test_a_jump_of_the_position_is_not_followed():
    bench = started(seconds=16.0)
    before = bench.x.copy()
    bench.fix.lat += 20.0 / METRES_PER_DEGREE
    bench.run(12.0)
    change = bench.x - before
    assert np.abs(change[4:10]).max() < 0.01
    assert np.abs(change[13:16]).max() < 0.01 * 0.01
    assert bench.resets.pos_ne == 1
    (status,) = [s for s in bench.ekf.aid_statuses() if s.name == 'gnss_position']
    assert status.innovation_rejected
    assert status.innovation[0] == pytest.approx(-20.0, abs=0.1)
    assert status.rejected > 50


def test_a_place_that_stays_elsewhere_is_taken_after_twice_the_timeout():
    bench = started(seconds=16.0)
    bench.fix.lat += 20.0 / METRES_PER_DEGREE
    bench.run(16.0)
    assert bench.resets.pos_ne == 2
    assert bench.x[7] == pytest.approx(20.0, abs=0.1)


def test_after_an_outage_velocity_and_position_are_those_of_the_fix():
    bench = started()
    bench.sending.discard('fix')
    bench.run(11.0)
    velocity, position = bench.resets.vel_ne, bench.resets.pos_ne
    bench.fix.lon += 50.0 / METRES_PER_DEGREE_EAST
    bench.fix.velocity = np.array((1.5, -0.5, 0.3))
    bench.sending.add('fix')
    while bench.resets.pos_ne == position:
        bench.run(0.01)
    assert bench.resets.vel_ne == velocity + 1
    np.testing.assert_allclose(bench.x[4:7], bench.fix.velocity, atol=0.01)
    np.testing.assert_allclose(bench.x[7:9], (0.0, 50.0), atol=0.01)


def test_few_satellites_alone_do_not_stop_a_sole_source():
    bench = started()
    bench.fix.nsats = 3
    bench.run(20.0)
    assert 'gps' in bench.flags


@pytest.mark.parametrize('seconds', [4.0, 6.0])
def test_few_satellites_stop_fixes_where_odometry_aids(seconds):
    bench = started(Ekf2Params(vision=VisionParams(use_velocity=True, rotate=True)))
    bench.sending.add('vision')
    bench.run(1.0)
    assert {'gps', 'ev_vel'} <= bench.flags
    bench.fix.nsats = 3
    bench.run(seconds)
    assert ('gps' in bench.flags) == (seconds < 5.0)
    assert not bench.ekf.nav_state().dead_reckoning


def test_few_satellites_prevent_the_start():
    bench = Bench()
    bench.fix.nsats = 3
    bench.sending.add('fix')
    bench.run(20.0)
    assert 'gps' not in bench.flags
    assert bench.ekf.nav_state().origin is None
    assert 'nsats' in bench.ekf.health().text
    bench.fix.nsats = 12
    bench.run(9.5)
    assert 'gps' not in bench.flags
    bench.run(1.0)
    assert 'gps' in bench.flags


def test_the_origin_keeps_a_position_in_use_even_with_fixes_waiting(monkeypatch):
    """Fixes at 20 Hz wait in the buffer from before the origin is set."""
    monkeypatch.setitem(bench_module.PERIODS_US, 'fix', 50_000)
    bench = Bench(Ekf2Params(vision=VisionParams(use_position=True)))
    bench.odometry.position = np.array((30.0, -20.0, 0.0))
    bench.sending.add('vision')
    bench.run(5.0)
    bench.sending.add('fix')
    for _ in range(140):
        bench.run(0.1)
        np.testing.assert_allclose(bench.x[7:9], (30.0, -20.0), atol=0.5)
    assert 'gps' in bench.flags
    origin = bench.ekf.nav_state().origin
    assert (bench.fix.lat - origin.lat) * METRES_PER_DEGREE == pytest.approx(30.0, abs=0.5)


def test_gnss_height():
    bench = started(Ekf2Params(height=HeightParams(reference='gnss')))
    assert 'gps_hgt' in bench.flags
    assert 'baro_hgt' not in bench.flags
    bench.fix.alt += 2.0
    bench.run(15.0)
    assert bench.x[9] == pytest.approx(-2.0, abs=0.2)
    bench.sending.discard('fix')
    bench.run(11.0)
    assert 'gps_hgt' not in bench.flags
    assert 'baro_hgt' in bench.flags


def test_without_a_barometer_gnss_height_takes_over():
    bench = started()
    assert 'baro_hgt' in bench.flags
    bench.sending.discard('baro')
    bench.run(6.0)
    assert 'gps_hgt' in bench.flags
    assert abs(bench.x[9]) < 0.2


def test_barometric_height_stays_selected_without_data_or_alternative():
    bench = Bench()
    bench.run(4.0)
    bench.sending.discard('baro')
    bench.run(10.0)
    assert 'baro_hgt' in bench.flags
