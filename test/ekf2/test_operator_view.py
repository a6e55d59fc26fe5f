"""What an operator reads: each number against the situation that was set up."""

from __future__ import annotations

from dataclasses import fields
import math

from ekf2.bench import EARTH_FIELD
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.flags import FaultFlags
from ekf_fusion_ros.ekf2.flags import Rejections
from ekf_fusion_ros.ekf2.gnss_checks import CHECK_NAMES
from ekf_fusion_ros.ekf2.operator_view import FAULTS
from ekf_fusion_ros.ekf2.operator_view import GPS_CHECKS
from ekf_fusion_ros.ekf2.operator_view import INNOVATION_CHECKS
from ekf_fusion_ros.ekf2.state import STATES
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams


@pytest.fixture
def bench():
    """A level vehicle after 12 s, with fixes and range."""
    bench = Bench()
    bench.sending |= {'fix', 'range'}
    bench.run(12.0)
    return bench


def values(bench):
    return bench.ekf.health().values


def numbers(text):
    return [float(word) for word in text.split()]


def test_every_flag_has_its_word():
    assert tuple(GPS_CHECKS) == CHECK_NAMES
    assert list(FAULTS) == [f.name for f in fields(FaultFlags)]
    # two fields only tell which of two sources wrote a shared bit last
    assert list(INNOVATION_CHECKS) == [
        f.name for f in fields(Rejections) if '_judged_after_' not in f.name]


def test_before_the_first_sample_it_says_so():
    told = values(Bench())
    assert told['control_mode_flags'] == told['filter_fault_flags'] == 'none'
    assert told['gps_check.gps_fix'] == 'skipped'


def test_without_any_aid_it_reckons_since_the_start():
    bench = Bench(Ekf2Params(gnss=GnssParams(enabled=False)))
    bench.run(8.0)
    assert bench.ekf.health().text == 'dead reckoning on inertial data since the start'


def test_receiver_checks_pass_fail_or_are_skipped(bench):
    assert values(bench)['gps_check.min_sat_count'] == 'pass'
    bench.fix.nsats, bench.fix.pdop = 3, None
    bench.run(0.4)
    told = {name: text for name, text in values(bench).items() if name.startswith('gps_check.')}
    assert len(told) == 10
    assert told.pop('gps_check.min_sat_count') == 'fail'
    assert told.pop('gps_check.max_pdop') == 'skipped'
    assert set(told.values()) == {'pass'}


def test_flags_are_told_by_word(bench):
    told = values(bench)
    assert set(told['control_mode_flags'].split(', ')) == bench.flags
    assert told['filter_fault_flags'] == told['innovation_check_flags'] == 'none'
    bench.ekf.filter.faults.heading = bench.ekf.filter.faults.accel_clipping = True
    assert values(bench)['filter_fault_flags'] == 'bad_hdg, bad_acc_clipping'
    bench.fix.velocity = np.array((0.0, 30.0, 0.0))
    bench.run(0.6)
    assert 'reject_hor_vel' in values(bench)['innovation_check_flags']


def test_a_rejected_innovation_shows_in_its_ratio(bench):
    bench.fix.velocity = np.array((0.0, 30.0, 0.0))
    bench.run(0.6)
    told = values(bench)
    innovation = numbers(told['innovation.gnss_velocity'])
    variance = numbers(told['innovation_variance.gnss_velocity'])
    assert innovation == pytest.approx((0.0, -30.0), abs=1.0)
    gate = bench.ekf.params.gnss.vel_gate
    assert float(told['test_ratio.gnss_velocity']) == pytest.approx(
        abs(innovation[1]) / (gate * math.sqrt(variance[1])), rel=1e-3)
    assert float(told['test_ratio.gnss_velocity']) > 1.0 > float(told['test_ratio.baro_height'])


def test_states_and_variances_by_the_index_map(bench):
    states, variances = bench.ekf.states(), bench.ekf.variances()
    assert states.shape == variances.shape == (24,)
    assert sorted(i for where in STATES.values() for i in range(24)[where]) == list(range(24))
    assert states[STATES['quaternion']] == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=0.05)
    assert states[STATES['earth_field']] == pytest.approx(EARTH_FIELD, abs=0.05)
    assert numbers(values(bench)['state.earth_field']) == pytest.approx(
        states[16:19], rel=1e-5)
    assert numbers(values(bench)['variance.position']) == pytest.approx(
        variances[7:10], rel=1e-5)
    states[:] = variances[:] = -1.0
    assert bench.x[0] > 0.9 and bench.p[7] > 0.0


def test_height_above_ground(bench):
    bench.distance = 4.0
    bench.fly()
    bench.run(5.0)
    told = values(bench)
    assert told['height_above_ground_valid'] == 'true'
    assert float(told['height_above_ground']) == pytest.approx(4.0, abs=0.1)
    bench.sending.discard('range')
    bench.run(6.0)
    assert values(bench)['height_above_ground_valid'] == 'false'


def test_wind_is_told_while_it_is_estimated(bench):
    assert not any(name.startswith('wind_') for name in values(bench))
    bench.airspeed = 19.0
    bench.fly()
    bench.travel(15.0, 25.0)
    bench.sending.add('airspeed')
    bench.travel(15.0, 5.0)
    told = values(bench)
    # 15 m/s over ground and 19 through the air, both about north: 4 m/s from ahead
    assert float(told['wind_speed']) == pytest.approx(4.0, abs=0.5)
    assert math.cos(math.radians(float(told['wind_from_deg']))) > 0.9
    assert 0.0 < float(told['wind_sigma']) < 5.0
