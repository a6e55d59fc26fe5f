"""Yaw from two antennas: start, convergence, jumps, and the way back to the compass."""

from __future__ import annotations

import math

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.mathlib.angles import wrap_pi
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.samples import LandedSample

YAW = GnssParams(yaw=True)


def turned(yaw, offset=0.0, **mag):
    """Fixes with a yaw in rad, of antennas at an offset, that start after the compass has."""
    bench = Bench(Ekf2Params(gnss=YAW, mag=MagParams(**mag)))
    bench.run(6.0)
    bench.fix.yaw, bench.fix.yaw_offset = yaw, offset
    bench.sending.add('fix')
    return bench


def heading(bench):
    return bench.attitude[2]


@pytest.mark.parametrize('degrees', [20.0, 10.0, -10.0])
def test_a_different_yaw_resets_once_and_ends_with_the_fixes(degrees):
    bench = turned(math.nan)
    # the first fix tells the declination, by which the compass turns yaw
    bench.run(5.1)
    before = bench.resets.quat
    bench.fix.yaw = wrap_pi(heading(bench) + math.radians(degrees))
    bench.run(8.0)
    assert {'gps_yaw', 'gps'} <= bench.flags
    assert not {'mag_hdg', 'mag_3d'} & bench.flags
    assert bench.ekf.nav_state().yaw_aligned
    assert bench.resets.quat == before + 1
    assert heading(bench) == pytest.approx(bench.fix.yaw, abs=0.02)
    bench.run(5.0)
    assert bench.resets.quat == before + 1
    bench.sending.discard('fix')
    bench.run(11.0)
    assert not {'gps_yaw', 'gps'} & bench.flags


@pytest.mark.parametrize(('yaw', 'offset'), [
    (0.0, 0.0), (60.0, 90.0), (180.0, 10.0), (-120.0, -45.0), (-30.0, 180.0)])
def test_yaw_is_that_of_the_vehicle_whatever_the_antennas(yaw, offset):
    bench = turned(math.radians(yaw), math.radians(offset))
    bench.run(16.0)
    assert 'gps_yaw' in bench.flags
    assert wrap_pi(heading(bench) - math.radians(yaw)) == pytest.approx(0.0, abs=0.01)


def test_a_step_is_followed_slowly():
    bench = turned(0.3)
    bench.run(16.0)
    resets = bench.resets.quat
    bench.fix.yaw = 0.3 + math.radians(2.0)
    bench.run(1.0)
    assert 0.3 < heading(bench) < bench.fix.yaw
    bench.run(25.0)
    assert heading(bench) == pytest.approx(bench.fix.yaw, abs=0.01)
    assert bench.resets.quat == resets


def test_a_step_beyond_the_gate_is_clipped_on_the_ground():
    """Interference is likelier than a turn: each fix may pull by the gate and no more."""
    bench = turned(0.3)
    bench.run(16.0)
    resets, step = bench.resets.quat, math.radians(120.0)
    bench.fix.yaw = wrap_pi(0.3 + step)
    bench.run(1.0)
    (status,) = [s for s in bench.ekf.aid_statuses() if s.name == 'yaw']
    assert status.test_ratio > 1.0
    assert not status.innovation_rejected
    limit = 2.6 * math.sqrt(status.innovation_variance[0])
    assert abs(status.innovation[0]) == pytest.approx(limit)
    assert limit < step
    assert 'gps_yaw' in bench.flags
    assert bench.resets.quat == resets


def test_without_yaw_in_the_fixes_the_compass_takes_over_again():
    bench = turned(math.radians(20.0))
    bench.run(16.0)
    assert 'gps_yaw' in bench.flags
    resets = bench.resets.quat
    bench.fix.yaw = math.nan
    bench.run(6.5)
    assert 'gps_yaw' in bench.flags
    bench.run(1.5)
    assert 'gps_yaw' not in bench.flags
    # on the ground a heading that is not measured any more is given up; the compass gives a new
    bench.run(8.0)
    assert {'mag_hdg', 'yaw_align', 'gps'} <= bench.flags
    assert bench.resets.quat == resets + 1
    # its field points north: what is left is the declination
    assert abs(heading(bench)) < math.radians(5.0)


def test_in_flight_a_first_jump_is_taken_after_a_while_and_a_second_ends_it():
    bench = turned(0.2)
    bench.run(16.0)
    bench.fly()
    bench.run(2.0)
    resets = bench.resets.quat
    bench.fix.yaw = wrap_pi(0.2 + math.pi)
    bench.run(6.0)
    assert bench.resets.quat == resets
    assert bench.ekf.filter.rejections.yaw
    bench.run(2.0)
    assert bench.resets.quat == resets + 1
    assert wrap_pi(heading(bench) - 0.2 - math.pi) == pytest.approx(0.0, abs=0.02)
    assert 'gps_yaw' in bench.flags
    bench.fix.yaw = 0.2
    bench.run(8.0)
    assert 'gps_yaw' not in bench.flags
    # and it is not tried again
    bench.run(10.0)
    assert 'gps_yaw' not in bench.flags


def test_losing_yaw_on_the_ground_without_a_compass_ends_gnss_too():
    bench = turned(0.4, type='none')
    bench.run(16.0)
    assert {'gps_yaw', 'gps', 'yaw_align'} <= bench.flags
    bench.fix.yaw = math.nan
    bench.run(8.0)
    assert not {'gps_yaw', 'gps', 'yaw_align'} & bench.flags
    bench.run(20.0)
    assert bench.p[0:4].sum() < 0.01


def test_in_flight_yaw_stays_aligned_without_it():
    bench = turned(0.4, type='none')
    bench.run(16.0)
    bench.fly()
    bench.fix.yaw = math.nan
    bench.run(8.0)
    assert 'gps_yaw' not in bench.flags
    assert {'gps', 'yaw_align'} <= bench.flags


def test_yaw_is_not_taken_from_fixes_without_the_parameter():
    bench = Bench(Ekf2Params(mag=MagParams(type='none')))
    bench.fix.yaw = 0.4
    bench.sending.add('fix')
    bench.run(16.0)
    assert not {'gps_yaw', 'yaw_align'} & bench.flags


def test_antennas_one_above_the_other_tell_nothing():
    # nose up by 70 degrees: the axis along the body is within 30 degrees of vertical
    bench = Bench(Ekf2Params(gnss=YAW, mag=MagParams(type='none')), pitch=math.radians(70.0))
    bench.fix.yaw = 0.4
    bench.sending.add('fix')
    bench.run(16.0)
    assert not {'gps_yaw', 'yaw_align'} & bench.flags


def test_yaw_from_antennas_takes_the_place_of_the_compass_after_landing_too():
    bench = turned(0.2)
    bench.run(16.0)
    bench.fly()
    bench.run(3.0)
    bench.ekf.push(LandedSample(bench.now_us, landed=True))
    bench.run(3.0)
    assert 'gps_yaw' in bench.flags
    np.testing.assert_allclose(heading(bench), 0.2, atol=0.01)
