"""The session: exact counts, order of stamps, pairing, outputs that are due, restarts."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.session import FusionSession

ALL = ('imu', 'fix', 'fix_velocity', 'magnetic_field', 'pressure')
START = 1000.0


def session_of(estimator, *roles, **overrides):
    params = with_overrides(
        Params(), {name.replace('__', '.'): value for name, value in overrides.items()})
    return FusionSession(params, roles, estimator=estimator)


def run_imu(session, build, first, last, rate=100):
    """Push inertial messages over [first, last] and return the outputs."""
    outputs = []
    for step in range(round(first * rate), round(last * rate) + 1):
        outputs += session.handle('imu', build.imu(step / rate))
    return outputs


def assert_exact(session):
    """Received is accepted plus refused, for every role."""
    session.finish()
    for role, counts in session.statistics().items():
        assert counts.received == counts.accepted + sum(counts.refused.values()), role


def test_counts_every_message_once(build, estimator):
    session = session_of(estimator, *ALL)
    run_imu(session, build, START, START + 1)
    for step in range(5):
        t = START + 1 + 0.1 * step
        session.handle('imu', build.imu(t + 0.05))
        session.handle('fix', build.fix(t))
        session.handle('fix_velocity', build.fix_velocity(t))
        session.handle('magnetic_field', build.magnetic_field(t))
        session.handle('pressure', build.pressure(t))
    assert_exact(session)
    counts = session.statistics()
    assert counts['imu'].accepted == 106
    assert [counts[role].accepted for role in ALL[1:]] == [5, 5, 5, 5]
    assert len(estimator.of(GnssSample)) == 5
    assert len(estimator.of(MagSample)) == 5
    assert len(estimator.of(BaroSample)) == 5


@pytest.mark.parametrize('role', ALL)
def test_bad_stamps_are_refused_by_reason(build, estimator, role):
    session = session_of(estimator, *ALL)
    run_imu(session, build, START, START + 1)
    message = getattr(build, role)
    t = START + 1.02
    session.handle(role, message(t))
    session.handle(role, message(t))
    session.handle(role, message(t - 0.03))
    zero = message(0.0)
    session.handle(role, zero)
    session.handle(role, message(t + 0.02))
    run_imu(session, build, START + 1.1, START + 1.2)
    refused = dict(session.statistics()[role].refused)
    refused.pop('unpaired', None)
    assert refused == {'repeated_stamp': 1, 'backward_stamp': 1, 'zero_stamp': 1}
    assert_exact(session)


def test_aiding_far_from_inertial_time_is_refused(build, estimator):
    session = session_of(estimator, 'imu', 'fix', 'pressure')
    run_imu(session, build, START, START + 3)
    session.handle('pressure', build.pressure(START + 1))
    session.handle('pressure', build.pressure(START + 1e6))
    session.handle('pressure', build.pressure(START + 3))
    assert session.statistics()['pressure'].refused == {'too_old': 1, 'stamp_ahead': 1}
    assert session.statistics()['pressure'].accepted == 1


def test_what_a_refused_stamp_advises_helps(build, estimator):
    """A fix that comes a second late is taken once both parameters of the sentence are raised."""
    def first_refusal(**overrides):
        session = session_of(estimator, 'imu', 'fix', **overrides)
        run_imu(session, build, START, START + 2)
        session.handle('fix', build.fix(START + 1))
        return session.statistics()['fix'].details.get('too_old', '')

    told = first_refusal()
    assert 'session.horizon_ms' in told
    assert 'session.stamp_age_max' in told
    assert first_refusal(session__horizon_ms=1500.0)
    assert not first_refusal(session__horizon_ms=1500.0, session__stamp_age_max=1.5)


@pytest.mark.parametrize(('shift', 'reason'), [(-3600.0, 'too_old'), (1e6, 'stamp_ahead')])
def test_stamps_of_another_clock_are_named_so(build, estimator, shift, reason):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, 2 * START + 3000, 2 * START + 3001)
    session.handle('fix', build.fix(2 * START + 3001 + shift))
    assert 'different clocks' in session.statistics()['fix'].details[reason]


def test_wild_first_stamp_does_not_block_a_role(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    session.handle('fix', build.fix(START + 5e8))
    run_imu(session, build, START, START + 1)
    session.handle('fix', build.fix(START + 1))
    run_imu(session, build, START + 1.01, START + 1.1)
    assert session.statistics()['fix'].accepted == 2
    assert estimator.of(GnssSample)[-1].time_us == round(1e6 * (START + 1))


@pytest.mark.parametrize(('spoil', 'reason'), [
    (lambda m: setattr(m.status, 'status', -1), 'no_fix'),
    (lambda m: setattr(m, 'latitude', math.nan), 'not_finite'),
    (lambda m: setattr(m, 'longitude', math.inf), 'not_finite'),
    (lambda m: setattr(m, 'latitude', 91.0), 'bad_latitude'),
    (lambda m: m.position_covariance.__setitem__(0, -1.0), 'negative_covariance'),
    (lambda m: m.position_covariance.__setitem__(4, math.nan), 'nan_covariance'),
])
def test_bad_fix_between_good_ones(build, estimator, spoil, reason):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    for step in range(3):
        message = build.fix(START + 1 + 0.2 * step)
        if step == 1:
            spoil(message)
        session.handle('fix', message)
        run_imu(session, build, START + 1.01 + 0.2 * step, START + 1.2 + 0.2 * step)
    counts = session.statistics()['fix']
    assert (counts.accepted, counts.refused) == (2, {reason: 1})
    assert counts.details[reason]
    assert [event for event in session.drain_events() if reason in event.text]


def test_fix_without_height_carries_no_height_weight(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    session.handle('fix', build.fix(START + 1))
    message = build.fix(START + 1.2)
    message.altitude = math.nan
    run_imu(session, build, START + 1.01, START + 1.2)
    session.handle('fix', message)
    run_imu(session, build, START + 1.21, START + 1.3)
    first, second = estimator.of(GnssSample)
    assert second.alt == first.alt == 500.0
    assert second.epv > 100 * first.epv


@pytest.mark.parametrize('altitude', [math.nan, 500.0])
def test_fixes_that_never_tell_an_altitude_are_told(build, estimator, altitude):
    session = session_of(estimator, 'imu', 'fix')
    for step in range(3):
        run_imu(session, build, START + step, START + step + 0.9)
        message = build.fix(START + step + 0.9)
        message.altitude = altitude
        session.handle('fix', message)
    assert any('no altitude' in text for text in session.warnings()) == math.isnan(altitude)


def test_velocity_joins_the_fix_of_its_stamp(build, estimator):
    session = session_of(estimator, *ALL)
    run_imu(session, build, START, START + 1)
    session.handle('fix_velocity', build.fix_velocity(START + 1, east=3.0))
    session.handle('fix', build.fix(START + 1))
    session.handle('fix', build.fix(START + 1.2))
    session.handle('fix_velocity', build.fix_velocity(START + 1.22, east=4.0))
    run_imu(session, build, START + 1.01, START + 1.5)
    fixes = estimator.of(GnssSample)
    assert [fix.velocity[1] for fix in fixes] == [3.0, 4.0]
    assert [fix.velocity[0] for fix in fixes] == [2.0, 2.0]
    assert_exact(session)


def test_fix_does_not_wait_for_ever(build, estimator):
    session = session_of(estimator, *ALL)
    run_imu(session, build, START, START + 1)
    session.handle('fix', build.fix(START + 1))
    run_imu(session, build, START + 1.01, START + 1.14)
    assert estimator.of(GnssSample) == []
    # The horizon could not take it for as long as the 200 ms of pairing_wait.
    run_imu(session, build, START + 1.15, START + 1.3)
    fix, = estimator.of(GnssSample)
    assert not fix.has_velocity
    session.handle('fix_velocity', build.fix_velocity(START + 1))
    assert_exact(session)
    assert session.statistics()['fix_velocity'].refused == {'unpaired': 1}


def test_order_of_arrival_across_topics_does_not_matter(build, estimator):
    """Within the hold, any interleaving of topics feeds the estimator alike."""
    rows = []
    for step in range(100):
        t = START + step / 100
        rows.append((t, 'imu'))
        rows += [(t, role) for role, every in
                 (('fix', 20), ('fix_velocity', 20), ('magnetic_field', 5), ('pressure', 5))
                 if step % every == 0]
    fed = []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        late = {'imu': 0.0} | {role: rng.uniform(0.0, 0.015) for role in ALL[1:]}
        one = type(estimator)()
        session = session_of(one, *ALL)
        for t, role in sorted(rows, key=lambda row: (row[0] + late[row[1]], rng.uniform())):
            session.handle(role, getattr(build, role)(t))
        fed.append([(type(sample).__name__, sample.time_us) for sample in one.samples])
    assert all(order == fed[0] for order in fed)
    assert len(fed[0]) > 140


def test_outputs_stand_at_multiples_of_the_period(build, estimator):
    session = session_of(estimator, 'imu', 'fix', session__output_rate=10)
    session.handle('fix', build.fix(START))
    outputs = run_imu(session, build, START, START + 2)
    times = [output.time_us for output in outputs]
    grid = [round(1e6 * START) + 100_000 * k for k in range(1, 21)]
    assert times[-20:] == grid


def test_no_output_before_origin_and_yaw(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    estimator.yaw_aligned = False
    assert run_imu(session, build, START, START + 1) == []
    session.handle('fix', build.fix(START + 1))
    assert run_imu(session, build, START + 1.01, START + 2) == []
    estimator.yaw_aligned = True
    outputs = run_imu(session, build, START + 2.01, START + 3)
    assert outputs and not outputs[0].local
    assert [fix.lat for fix in outputs[0].fixes] == [47.0]
    assert session.milestones['origin'] < session.milestones['yaw'] == outputs[0].time_us


def test_without_fix_the_frame_is_local(build, estimator):
    session = session_of(estimator, 'imu', 'magnetic_field')
    outputs = run_imu(session, build, START, START + 1)
    assert session.local and outputs and all(output.local for output in outputs)


def test_rate_zero_gives_every_update(build, estimator):
    session = session_of(estimator, 'imu', 'magnetic_field', session__output_rate=0)
    outputs = run_imu(session, build, START, START + 1)
    assert len(outputs) == len(estimator.of(ImuSample))


def test_bag_loop_restarts_the_estimator_once(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 20)
    run_imu(session, build, START, START + 2)
    assert estimator.resets == 1
    assert session.statistics()['imu'].refused == {'stamp_jump': 1}
    assert any('starts again' in event.text for event in session.drain_events())
    session.handle('fix', build.fix(START + 2))
    run_imu(session, build, START + 2.01, START + 2.1)
    assert estimator.of(GnssSample)[-1].time_us == round(1e6 * (START + 2))
    assert_exact(session)


def test_a_gap_in_the_inertial_input_is_told(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    run_imu(session, build, START + 2, START + 3)
    told = [event.text for event in session.drain_events()]
    assert [text for text in told if 'imu' in text] == ['no imu message for 1.000 s']
    assert estimator.resets == 0


def test_restart_keeps_the_first_origin(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    session.handle('fix', build.fix(START, lat=47.0))
    run_imu(session, build, START, START + 20)
    session.handle('imu', build.imu(START))
    run_imu(session, build, START + 0.01, START + 1)
    session.handle('fix', build.fix(START + 1, lat=47.001))
    outputs = run_imu(session, build, START + 1.01, START + 2)
    assert estimator.resets == 1
    assert outputs[-1].nav.origin.lat == 47.0
    assert session.resets() == {'attitude': 4, 'restarts': 1}


def test_one_wild_inertial_stamp_restarts_nothing(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    session.handle('imu', build.imu(START + 1e6))
    session.handle('imu', build.imu(1.0))
    run_imu(session, build, START + 1.01, START + 2)
    assert estimator.resets == 0
    assert session.statistics()['imu'].refused == {'stamp_jump': 2}
    assert estimator.now_us == round(1e6 * (START + 2))


@pytest.mark.parametrize('leap', [1.5, 3.0, 4.9])
def test_one_stamp_that_leaps_ahead_costs_no_other_message(build, estimator, leap):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    session.handle('imu', build.imu(START + 1 + leap))
    run_imu(session, build, START + 1.01, START + 2)
    assert session.statistics()['imu'].refused == {'stamp_jump': 1}
    assert estimator.now_us == round(1e6 * (START + 2))


def test_a_long_pause_is_believed_with_the_second_message(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    run_imu(session, build, START + 4, START + 5)
    assert session.statistics()['imu'].refused == {'stamp_jump': 1}
    assert estimator.resets == 0
    assert estimator.now_us == round(1e6 * (START + 5))


def test_messages_that_come_rarely_are_no_jumps(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    for second in range(0, 20, 2):
        session.handle('imu', build.imu(START + second))
    assert session.statistics()['imu'].refused == {}


def test_ground_contact_is_left_to_the_estimator(build, estimator):
    run_imu(session_of(estimator, 'imu', 'fix'), build, START, START + 1)
    assert not estimator.of(LandedSample)


def test_withheld_messages_are_counted_and_kept_back(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    run_imu(session, build, START, START + 1)
    session.refuse('fix', 'withheld')
    session.handle('fix', build.fix(START + 1))
    assert_exact(session)
    assert session.statistics()['fix'].as_dict() == {
        'received': 2, 'accepted': 1, 'refused': {'withheld': 1}, 'passed_over': {}}


def test_samples_go_straight_in_without_roles(estimator):
    params = with_overrides(Params(), {'ekf2.gnss.enabled': False})
    session = FusionSession(params, estimator=estimator)
    baro = BaroSample(5, 10.0)
    session.push(baro)
    assert estimator.samples == [baro]
    assert session.params is params
    assert session.local


def test_increments_of_a_caller_are_taken_as_they_are(estimator):
    session = session_of(estimator, 'imu', 'fix')
    pushed = [ImuSample(1_000_000 + 4000 * n, np.zeros(3), np.array([0.0, 0.0, -0.04]), 0.004,
                        0.004) for n in range(1, 4)]
    for sample in pushed:
        session.push(sample)
    assert estimator.samples == pushed
    assert session.statistics()['imu'].accepted == 3


def test_health_says_what_it_waits_for(build, estimator):
    session = session_of(estimator, 'imu', 'fix')
    assert 'waiting for imu' in session.health().text
    run_imu(session, build, START, START + 1)
    message = build.fix(START + 1)
    message.status.status = -1
    session.handle('fix', message)
    assert 'waiting for fix: 1 received' in session.health().text
    assert 'no_fix' in session.health().text
    session.handle('fix', build.fix(START + 1.1))
    assert session.health().text == 'fusing'
