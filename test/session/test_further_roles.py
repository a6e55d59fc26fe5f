"""Range, flow, airspeed, landed and gps_heading through the session."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import NAN3
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import VisionSample
from ekf_fusion_ros.session import FusionSession

START = 1000.0
NAN = math.nan
LEVEL = np.array((1.0, 0.0, 0.0, 0.0))


@pytest.fixture
def fly(build, estimator):
    """Return a function that makes a session and one that runs its inertial input."""
    def make(*roles, **overrides):
        names = {name.replace('__', '.'): value for name, value in overrides.items()}
        session = FusionSession(
            with_overrides(Params(), names), ('imu', *roles), estimator=estimator)

        def run(first, last):
            for step in range(round(100 * first), round(100 * last) + 1):
                session.handle('imu', build.imu(START + step / 100))
        return session, run
    return make


def microseconds(seconds):
    return round(1e6 * (START + seconds))


def test_range_and_flow_reach_the_estimator(build, estimator, fly):
    session, run = fly('range', 'flow')
    run(0.0, 1.0)
    for step in range(5):
        t = 1.0 + 0.1 * step
        session.handle('range', build.range(START + t, 4.0 + step))
        session.handle('flow', build.flow(START + t))
        run(t + 0.01, t + 0.1)
    assert [sample.distance for sample in estimator.of(RangeSample)] == [4.0, 5.0, 6.0, 7.0, 8.0]
    flows = estimator.of(FlowSample)
    assert [sample.time_us for sample in flows] == [microseconds(1.0 + 0.1 * n) for n in range(5)]
    assert [sample.dt for sample in flows[1:]] == pytest.approx(4 * [0.1])
    assert flows[1].flow == pytest.approx((0.05, 0.0))


def test_auxiliary_velocity_reaches_the_estimator(build, estimator, fly):
    session, run = fly('fix', 'aux_velocity')
    run(0.0, 1.0)
    session.handle('aux_velocity', build.aux_velocity(START + 1.0, east=3.0))
    run(1.01, 1.1)
    sample, = estimator.of(AuxVelocitySample)
    assert sample.time_us == microseconds(1.0)
    assert sample.velocity.tolist() == [2.0, 3.0, 0.0]


def test_airspeed_takes_the_density_of_the_pressure(build, estimator, fly):
    session, run = fly('fix', 'pressure', 'airspeed')
    run(0.0, 1.0)
    session.handle('airspeed', build.airspeed(START + 1.0, speed=20.0))
    message = build.pressure(START + 1.01)
    message.fluid_pressure = 89874.6
    session.handle('pressure', message)
    session.handle('airspeed', build.airspeed(START + 1.02, speed=20.0))
    run(1.01, 1.2)
    before, after = estimator.of(AirspeedSample)
    assert before.true_airspeed == 20.0
    # ISO 2533 at 1000 m: 1.11166 kg/m^3.
    assert after.true_airspeed == pytest.approx(20.0 * math.sqrt(1.2250 / 1.11166), rel=1e-5)


@pytest.mark.parametrize(('overrides', 'refused'), [
    ({}, {'below_threshold': 3}),
    ({'ekf2__aiding__airspeed_threshold': 9.5}, {'below_threshold': 4}),
    ({'ekf2__aiding__airspeed_threshold': 0.0}, {'switched_off': 5}),
    ({'ekf2__aiding__vehicle': 'multirotor'}, {'rotary_wing': 5}),
    ({'ekf2__aiding__vehicle': 'fixed_wing'}, {'below_threshold': 3}),
    ({'ekf2__aiding__airspeed_conditions': False}, {}),
])
def test_airspeed_that_tells_nothing_is_refused_by_reason(
        build, estimator, fly, overrides, refused):
    session, run = fly('fix', 'airspeed', **overrides)
    run(0.0, 1.0)
    for step, speed in enumerate((0.0, 1.0, 2.0, 9.0, 10.0)):
        session.handle('airspeed', build.airspeed(START + 1.0 + 0.1 * step, speed=speed))
        run(1.01 + 0.1 * step, 1.1 + 0.1 * step)
    session.finish()
    counts = session.statistics()['airspeed']
    assert counts.refused == refused
    assert counts.accepted == len(estimator.of(AirspeedSample)) == 5 - sum(refused.values())


def test_airspeed_samples_meet_the_same_conditions(estimator):
    session = FusionSession(Params(), ('imu', 'airspeed'), estimator=estimator)
    for step, speed in enumerate((1.9, 2.1)):
        session.push(AirspeedSample(microseconds(step), 1.2 * speed, 1.2))
    session.finish()
    assert [s.true_airspeed / 1.2 for s in estimator.of(AirspeedSample)] == pytest.approx([2.1])
    assert session.statistics()['airspeed'].refused == {'below_threshold': 1}


def test_landed_acts_at_the_inertial_time_of_its_arrival(build, estimator, fly):
    session, run = fly('landed')
    run(0.0, 1.0)
    session.handle('landed', build.landed(True))
    assert estimator.of(LandedSample)[0].time_us == microseconds(1.0)
    run(1.01, 2.0)
    session.handle('landed', build.landed(False))
    told = estimator.of(LandedSample)
    assert [(sample.time_us, sample.landed) for sample in told] == [
        (microseconds(1.0), True), (microseconds(2.0), False)]
    assert session.statistics()['landed'].accepted == 2


def test_landed_before_the_inertial_input_waits_for_it(build, estimator, fly):
    session, run = fly('landed')
    session.handle('landed', build.landed(False))
    session.handle('landed', build.landed(True))
    run(0.0, 0.1)
    # Not before the estimator knows time.
    kinds = [type(sample) for sample in estimator.samples[:3]]
    assert kinds == [ImuSample, LandedSample, ImuSample]
    assert [sample.landed for sample in estimator.of(LandedSample)] == [True]


def test_landed_is_told_again_after_a_restart(build, estimator, fly):
    session, run = fly('landed')
    run(0.0, 1.0)
    session.handle('landed', build.landed(False))
    session.reset()
    run(1.01, 1.2)
    first, second = estimator.of(LandedSample)
    assert (first.landed, second.landed) == (False, False)
    assert second.time_us > first.time_us


def test_landed_that_is_no_truth_value_is_refused(build, estimator, fly):
    session, run = fly('landed')
    run(0.0, 0.1)
    session.handle('landed', build.landed(None))
    assert session.statistics()['landed'].refused == {'not_boolean': 1}
    assert estimator.of(LandedSample) == []


@pytest.mark.parametrize('order', [
    ('fix', 'fix_velocity', 'gps_heading'), ('gps_heading', 'fix', 'fix_velocity'),
    ('fix_velocity', 'gps_heading', 'fix')])
def test_a_fix_is_put_together_from_three_topics(build, estimator, fly, order):
    session, run = fly('fix', 'fix_velocity', 'gps_heading')
    run(0.0, 1.0)
    messages = {'fix': build.fix(START + 1), 'fix_velocity': build.fix_velocity(START + 1, 3.0),
                'gps_heading': build.gps_heading(START + 1, yaw=0.25)}
    for role in order:
        session.handle(role, messages[role])
    run(1.01, 1.1)
    fix, = estimator.of(GnssSample)
    assert fix.velocity[1] == 3.0
    assert fix.yaw == pytest.approx(math.pi / 2 - 0.25)
    assert fix.yaw_accuracy == pytest.approx(0.01)
    session.finish()
    assert [session.statistics()[role].accepted for role in order] == [1, 1, 1]


def test_heading_alone_joins_its_fix_and_strays_are_counted(build, estimator, fly):
    session, run = fly('fix', 'gps_heading')
    run(0.0, 1.0)
    session.handle('fix', build.fix(START + 1.0))
    session.handle('gps_heading', build.gps_heading(START + 1.02))
    session.handle('gps_heading', build.gps_heading(START + 1.1))
    session.handle('fix', build.fix(START + 1.2))
    run(1.01, 2.0)
    first, second = estimator.of(GnssSample)
    assert math.isfinite(first.yaw) and math.isnan(second.yaw)
    assert session.statistics()['gps_heading'].refused == {'unpaired': 1}


def test_fixes_keep_their_order_and_wait_once(build, estimator, fly):
    """A fix without velocity and heading is out after one wait, not two."""
    session, run = fly('fix', 'fix_velocity', 'gps_heading')
    run(0.0, 1.0)
    session.handle('fix', build.fix(START + 1.0))
    run(1.01, 1.21)
    fix, = estimator.of(GnssSample)
    assert math.isnan(fix.yaw) and not fix.has_velocity


@pytest.mark.parametrize(('sample', 'reason'), [
    (RangeSample(1, NAN), 'not_finite'), (RangeSample(1, -1.0), 'negative_range'),
    (RangeSample(1, 1.0, -1, 5.0, 4.0), 'bad_limits'),
    (FlowSample(1, np.array((NAN, 0.0)), np.full(3, NAN), 9, 0.1), 'not_finite'),
    (FlowSample(1, np.zeros(2), np.full(3, math.inf), 9, 0.1), 'not_finite'),
    (FlowSample(1, np.zeros(2), np.full(3, NAN), 9, 0.0), 'bad_interval'),
    (FlowSample(1, np.zeros(2), np.full(3, NAN), 256, 0.1), 'bad_quality'),
    (AirspeedSample(1, NAN, 1.0), 'not_finite'),
    (AirspeedSample(1, -1.0, 1.0), 'negative_airspeed'),
    (AirspeedSample(1, 1.0, 0.0), 'negative_airspeed'),
    (AuxVelocitySample(1, np.zeros(3), np.full(3, -1.0)), 'negative_covariance'),
    (GnssSample(1, 47.0, 8.0, 0.0, 1.0, 1.0, yaw=math.inf), 'not_finite'),
    (GnssSample(1, 47.0, 8.0, 0.0, 1.0, 1.0, np.zeros(3)), 'not_finite'),
    (GnssSample(1, 47.0, 8.0, 0.0, 1.0, 1.0, np.zeros(3), -0.1), 'negative_covariance'),
    (GnssSample(1, 47.0, 8.0, 0.0, 1.0, 1.0, yaw=1.0, yaw_offset=NAN), 'not_finite'),
    (VisionSample(1, NAN3, LEVEL, angular_var=NAN), 'not_finite'),
    (VisionSample(1, NAN3, LEVEL, np.array((0.0, 0.0, NAN))), 'not_finite'),
])
def test_samples_are_checked_at_the_door(estimator, sample, reason):
    session = FusionSession(Params(), estimator=estimator)
    session.push(sample)
    counts, = session.statistics().values()
    assert counts.refused == {reason: 1}
    assert estimator.samples == []


@pytest.mark.parametrize('sample', [
    RangeSample(1, 25.0, 0), FlowSample(1, np.zeros(2), np.array((0.0, 0.0, NAN)), 0, 0.02),
    AirspeedSample(1, 0.0, 1.0)])
def test_what_means_not_measured_passes(estimator, sample):
    session = FusionSession(Params(), estimator=estimator)
    session.push(sample)
    assert estimator.samples == [sample]
