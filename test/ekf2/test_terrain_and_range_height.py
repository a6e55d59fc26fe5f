"""Terrain from range and flow, height from the range finder, and range aid."""

from __future__ import annotations

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import FlowParams
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import HeightParams
from ekf_fusion_ros.params.ekf2 import RangeParams
from ekf_fusion_ros.params.ekf2 import TerrainParams

NO_FIXES = GnssParams(enabled=False)


def over_ground(*, seen_by_range, seen_by_flow, **terrain):
    """Fly north at 3 m/s on fixes over ground that range and flow see at heights in m."""
    bench = Bench(Ekf2Params(terrain=TerrainParams(**terrain)))
    bench.sending |= {'fix', 'range', 'flow'}
    bench.distance = seen_by_range
    bench.run(15.0)
    bench.fly()
    bench.flow.rate = np.array((0.0, -3.0 / seen_by_flow))
    bench.travel(3.0, 20.0)
    assert 'gps' in bench.flags
    terrain = bench.ekf.control.terrain
    return terrain.down - bench.x[9], terrain.valid


def test_range_alone_tells_the_terrain():
    height, valid = over_ground(seen_by_range=2.4, seen_by_flow=8.0, use_flow=False)
    assert valid
    assert height == pytest.approx(2.4, abs=0.01)


def test_flow_alone_tells_the_terrain():
    height, valid = over_ground(seen_by_range=2.4, seen_by_flow=8.0, use_range=False)
    assert valid
    assert height == pytest.approx(8.0, abs=0.5)


def test_flow_tells_the_terrain_by_default_where_range_sees_nothing():
    height, valid = over_ground(seen_by_range=100.0, seen_by_flow=8.0)
    assert valid
    assert height == pytest.approx(8.0, abs=0.5)


def test_range_is_preferred_to_flow():
    height, valid = over_ground(seen_by_range=2.4, seen_by_flow=8.0)
    assert valid
    assert height == pytest.approx(2.4, abs=0.01)


def test_without_either_the_terrain_is_not_known():
    _, valid = over_ground(seen_by_range=2.4, seen_by_flow=8.0, use_range=False, use_flow=False)
    assert not valid


def test_a_step_in_the_ground_is_refused_and_then_taken():
    bench = Bench()
    bench.sending |= {'fix', 'range'}
    bench.distance = 6.0
    bench.run(15.0)
    bench.fly()
    bench.run(12.0)
    terrain = bench.ekf.control.terrain
    bench.distance = 16.0
    bench.run(1.0)
    assert terrain.down - bench.x[9] == pytest.approx(6.0, abs=0.1)
    assert bench.ekf.filter.rejections.hagl
    bench.run(12.0)
    assert terrain.down - bench.x[9] == pytest.approx(16.0, abs=0.1)


def test_the_terrain_becomes_uncertain_as_its_gradient_says():
    bench = Bench(Ekf2Params(terrain=TerrainParams(process_noise=0.0, gradient=0.5)))
    bench.sending.add('fix')
    bench.run(15.0)
    bench.fly()
    bench.travel(4.0, 10.0)
    # 0.5 m/m, one independent draw a period of 10 ms; 4 s up to 4 m/s, then 6 s at it
    speed_squared = 100 * (4.0 * 4.0 ** 2 / 3.0 + 6.0 * 4.0 ** 2)
    assert bench.ekf.control.terrain.variance == pytest.approx(
        0.1 ** 2 + (0.01 * 0.5) ** 2 * speed_squared, rel=0.05)


def ranging(**height):
    bench = Bench(Ekf2Params(gnss=NO_FIXES, height=HeightParams(reference='range', **height)))
    bench.sending.add('range')
    bench.distance = 1.0
    bench.run(6.0)
    return bench


def test_range_height_lasts_from_sample_to_sample_and_the_barometer_takes_over():
    bench = ranging()
    assert 'rng_hgt' in bench.flags and 'baro_hgt' not in bench.flags
    bench.sending.discard('range')
    bench.run(4.5)
    assert 'rng_hgt' in bench.flags
    bench.run(0.7)
    assert 'baro_hgt' in bench.flags and 'rng_hgt' not in bench.flags


def test_range_height_follows_the_ground_not_the_barometer():
    bench = ranging()
    bench.fly()
    bench.run(1.0)
    start = bench.x[9]
    for _ in range(100):
        bench.distance += 0.02
        bench.run(0.05)
    bench.run(3.0)
    assert bench.x[9] - start == pytest.approx(-2.0, abs=0.05)


def test_on_the_ground_a_blind_range_finder_is_taken_to_see_its_clearance():
    bench = ranging()
    # the ground was taken to be 0.1 m below, so that 1 m looks like 0.9 m up
    assert bench.x[9] == pytest.approx(-0.9, abs=0.02)
    bench.distance_quality = 0
    bench.run(10.0)
    assert 'rng_hgt' in bench.flags
    assert bench.ekf.filter.observations.range_height.fused > 20
    assert bench.x[9] == pytest.approx(0.0, abs=0.05)


def low_and_slow(distance=2.0, **ranging):
    bench = Bench(Ekf2Params(range=RangeParams(aid=True, **ranging)))
    bench.sending |= {'fix', 'range'}
    bench.distance = 0.3
    bench.run(15.0)
    bench.fly()
    bench.distance = distance
    bench.run(20.0)
    return bench


def test_range_aids_near_the_ground():
    bench = low_and_slow()
    assert 'rng_hgt' in bench.flags and 'baro_hgt' not in bench.flags


@pytest.mark.parametrize(('distance', 'aided'), [(3.4, True), (3.7, False)])
def test_range_aid_starts_at_seven_tenths_of_its_height(distance, aided):
    assert ('rng_hgt' in low_and_slow(distance=distance).flags) is aided


def test_range_aid_ends_when_the_vehicle_is_fast_and_starts_when_it_is_slow():
    bench = low_and_slow()
    bench.travel(0.75, 6.0)
    assert 'rng_hgt' in bench.flags
    bench.travel(1.5, 6.0)
    assert 'baro_hgt' in bench.flags and 'rng_hgt' not in bench.flags
    bench.travel(0.9, 6.0)
    assert 'rng_hgt' not in bench.flags
    bench.travel(0.0, 6.0)
    assert 'rng_hgt' in bench.flags


def test_range_aid_beside_gnss_height():
    bench = Bench(Ekf2Params(height=HeightParams(reference='gnss'),
                             range=RangeParams(aid=True)))
    bench.sending |= {'fix', 'range'}
    bench.distance = 0.3
    bench.run(15.0)
    assert 'gps_hgt' in bench.flags
    bench.fly()
    bench.distance = 2.0
    bench.run(20.0)
    assert 'rng_hgt' in bench.flags and 'gps_hgt' not in bench.flags
    bench.travel(2.0, 6.0)
    assert 'gps_hgt' in bench.flags and 'rng_hgt' not in bench.flags


def test_odometry_height_falls_back_to_range():
    bench = Bench(Ekf2Params(gnss=NO_FIXES, height=HeightParams(reference='vision')))
    bench.sending |= {'vision', 'range'}
    bench.distance = 1.0
    bench.run(8.0)
    assert 'ev_hgt' in bench.flags
    bench.sending.discard('vision')
    bench.run(6.0)
    assert 'rng_hgt' in bench.flags and 'ev_hgt' not in bench.flags


@pytest.mark.parametrize(('params', 'delay_ms'), [
    (Ekf2Params(range=RangeParams(aid=True, delay_ms=230.0)), 230.0),
    (Ekf2Params(height=HeightParams(reference='range'), range=RangeParams(delay_ms=240.0)), 240.0),
    (Ekf2Params(range=RangeParams(delay_ms=250.0)), 110.0),
    (Ekf2Params(flow=FlowParams(enabled=True, delay_ms=260.0)), 260.0),
    (Ekf2Params(flow=FlowParams(delay_ms=260.0)), 110.0)])
def test_the_horizon_waits_for_the_sensors_in_use(params, delay_ms):
    bench = Bench(params)
    bench.run(1.0)
    f = bench.ekf.filter
    # in whole filter periods
    assert f.t_now - f.t_horizon == pytest.approx(1000.0 * delay_ms, abs=10_000)
