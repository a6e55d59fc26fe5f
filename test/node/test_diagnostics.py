"""Reports: one sentence, a level and exact counts."""

from __future__ import annotations

import pytest

pytest.importorskip('rclpy')

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.node.diagnostics import EstimatorWatch
from ekf_fusion_ros.node.diagnostics import TopicWatch
from ekf_fusion_ros.statistics import RoleStatistics


def test_silent_topic_is_named() -> None:
    report = TopicWatch('fix', '/gps/fix').report(RoleStatistics())
    assert report.level == HealthLevel.WARN
    assert report.text == 'nothing received on /gps/fix yet'


def test_counts_and_reasons_are_reported() -> None:
    counts = RoleStatistics(received=10, accepted=7)
    counts.refuse('no_fix', 'the receiver says so')
    counts.refuse('no_fix')
    counts.refuse('bad_latitude', 'latitude 91')
    report = TopicWatch('fix', '/fix').report(counts)
    assert report.values['received'] == '10'
    assert report.values['accepted'] == '7'
    assert report.values['refused'] == '3'
    assert report.values['refused.no_fix'] == '2'
    assert report.values['detail.no_fix'] == 'the receiver says so'
    assert report.text == '10 received on /fix, 1 refused: bad_latitude, 2 refused: no_fix'


def test_level_follows_what_is_new() -> None:
    watch = TopicWatch('fix', '/fix')
    counts = RoleStatistics(received=5, accepted=4)
    counts.refuse('no_fix')
    levels = [watch.report(counts).level]
    counts.received, counts.accepted = 7, 6
    levels.append(watch.report(counts).level)
    silent = watch.report(counts)
    levels.append(silent.level)
    assert levels == [HealthLevel.WARN, HealthLevel.OK, HealthLevel.WARN]
    assert 'none since the last report' in silent.text


def test_landed_may_be_silent_once_it_has_spoken() -> None:
    watch = TopicWatch('landed', '/landed')
    assert watch.report(RoleStatistics()).level == HealthLevel.WARN
    counts = RoleStatistics(received=1, accepted=1)
    assert [watch.report(counts).level for _ in range(3)] == 3 * [HealthLevel.OK]


def test_trouble_of_the_node_raises_the_level_once() -> None:
    watch = EstimatorWatch()
    health = Health(HealthLevel.OK, 'ok: gnss position', {'horizon': '0.2'})
    trouble = {'internal_errors': 0, 'stalls': 0}
    assert watch.report(health, trouble, 0).level == HealthLevel.OK
    trouble['internal_errors'] = 2
    troubled = watch.report(health, trouble, 7)
    assert troubled.level == HealthLevel.WARN
    assert troubled.text == 'ok: gnss position; 2 internal errors, see the log'
    assert troubled.values == {
        'horizon': '0.2', 'queued': '7', 'internal_errors': '2', 'stalls': '0'}
    after = watch.report(health, trouble, 0)
    assert (after.level, after.text) == (HealthLevel.OK, 'ok: gnss position')
    assert after.values['internal_errors'] == '2'


def test_trouble_does_not_hide_an_error() -> None:
    health = Health(HealthLevel.ERROR, 'filter fault', {})
    report = EstimatorWatch().report(health, {'stalls': 1}, 0)
    assert report.level == HealthLevel.ERROR
    assert report.text.startswith('filter fault; 1 times busy')
