"""Reports on one input: one sentence, a level, exact counts, measured times, verdicts."""

from __future__ import annotations

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.source_watch import SourceWatch
from ekf_fusion_ros.statistics import RoleStatistics


def watch(role: str = 'fix', topic: str = '/fix', arrived: float | None = 0.0) -> SourceWatch:
    made = SourceWatch(role, topic)
    made.arrived = arrived
    return made


def aid(name: str, ratio: float, *, rejected: bool = False) -> AidStatus:
    return AidStatus(name, True, 0, (3.0, 4.0), (1.0, 1.0), ratio, rejected, 7, 2, 0, 0, 1, 0)


def test_silent_topic_is_named() -> None:
    report = watch(topic='/gps/fix', arrived=None).report(RoleStatistics(), 5.0)
    assert report.level == HealthLevel.WARN
    assert report.text == 'nothing received on /gps/fix yet'


def test_counts_and_reasons_are_reported() -> None:
    counts = RoleStatistics(received=10, accepted=7)
    counts.refuse('no_fix', 'the receiver says so')
    counts.refuse('no_fix')
    counts.refuse('bad_latitude', 'latitude 91')
    report = watch().report(counts, 0.1)
    assert report.values['received'] == '10'
    assert report.values['accepted'] == '7'
    assert report.values['refused'] == '3'
    assert report.values['refused.no_fix'] == '2'
    assert report.values['detail.no_fix'] == 'the receiver says so'
    assert report.values['last_refusal'] == 'bad_latitude: latitude 91'
    assert report.text == '10 received on /fix, 1 refused: bad_latitude, 2 refused: no_fix'


def test_level_follows_what_is_new() -> None:
    fix = watch()
    counts = RoleStatistics(received=5, accepted=4)
    counts.refuse('no_fix')
    assert fix.report(counts, 0.1).level == HealthLevel.WARN
    counts.received, counts.accepted = 7, 6
    assert fix.report(counts, 0.5).level == HealthLevel.OK
    silent = fix.report(counts, 7.0)
    assert silent.level == HealthLevel.WARN
    assert silent.text.endswith('none for 7.0 s')
    assert silent.values['age'] == '7.000'


def test_a_slow_source_is_not_silent_between_two_messages() -> None:
    slow = watch(arrived=None)
    for second in range(0, 9, 2):
        slow.arrived = float(second)
        counts = RoleStatistics(received=second // 2, accepted=second // 2)
        report = slow.report(counts, float(second))
    assert report.values['rate'] == '0.5'
    assert slow.report(counts, 9.9).level == HealthLevel.OK


def test_landed_may_be_silent_once_it_has_spoken() -> None:
    assert watch('landed', '/landed', None).report(RoleStatistics(), 0.0).level == HealthLevel.WARN
    spoken = watch('landed', '/landed')
    counts = RoleStatistics(received=1, accepted=1)
    assert [spoken.report(counts, at).level for at in (1.0, 9.0, 99.0)] == 3 * [HealthLevel.OK]


def test_verdicts_of_the_filter_on_a_source() -> None:
    aids = [aid('gnss_position', 4.0, rejected=True), aid('gnss_height', 0.25), aid('yaw', 9.0)]
    report = watch().report(RoleStatistics(received=9, accepted=9), 0.1, aids)
    assert report.values['test_ratio'] == '2.000'
    assert (report.values['fused'], report.values['rejected']) == ('14', '4')
    assert report.values['last_rejection'] == (
        'gnss_position: innovation 5, 2.00 times its limit')
    assert report.text.endswith('gnss_position rejected by the filter')
    assert report.level == HealthLevel.WARN


def test_stamps_far_from_the_clock_are_told() -> None:
    counts = RoleStatistics(received=9, accepted=9)
    assert 'stamps are 3.1 s ahead' in watch().report(counts, 0.1, delay=-3.1).text
    assert 'use_sim_time' in watch().report(counts, 0.1, delay=1e6).text
    fine = watch().report(counts, 0.1, delay=0.02)
    assert (fine.level, fine.values['delay']) == (HealthLevel.OK, '0.020')


def test_a_source_that_is_switched_off_says_so() -> None:
    off = watch()
    off.switched_on = False
    report = off.report(RoleStatistics(received=9, accepted=9), 0.1)
    assert report.text.startswith('switched off, ')
    assert report.level == HealthLevel.WARN
