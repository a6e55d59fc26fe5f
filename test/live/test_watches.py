"""Output, work, receiver checks and switches: each told from what it was shown."""

from __future__ import annotations

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.output_watch import OutputWatch
from ekf_fusion_ros.live.receiver_checks import receiver_report
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.live.work_watch import EstimatorWatch
from ekf_fusion_ros.live.work_watch import WorkWatch


def test_silence_is_told_once_a_reason_and_again_after_a_while() -> None:
    output = OutputWatch('/odometry/filtered', 0.0)
    assert output.due(0.5, 'waiting') == ''
    assert output.due(1.0, 'aligning, drive 1 m') == (
        'nothing is published: aligning, drive 1 m')
    assert output.due(2.0, 'aligning, drive 2.5 m') == ''
    assert output.due(3.0, 'waiting') == 'nothing is published: waiting'
    assert output.due(12.9, 'waiting') == ''
    assert output.due(13.0, 'waiting') == 'nothing is published: waiting'


def test_the_end_of_silence_is_told() -> None:
    output = OutputWatch('/odometry/filtered', 0.0)
    output.due(1.0, 'waiting')
    output.note(1.5)
    assert output.due(2.0, 'ok') == 'publishing /odometry/filtered'
    output.note(2.5)
    assert output.due(3.0, 'ok') == ''
    assert output.due(3.6, 'waiting') == 'nothing is published: waiting'


def test_the_rate_of_the_output_is_measured() -> None:
    output = OutputWatch('/odometry/filtered', 0.0)
    assert output.report(0.0, None).level == HealthLevel.WARN
    for step in range(1, 101):
        output.note(0.02 * step)
    report = output.report(2.0, 0.03)
    assert report.text == '/odometry/filtered at 50.0 Hz'
    assert report.values['published'] == '100'
    assert report.values['delay'] == '0.030'


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


def test_work_is_measured_and_stalls_are_counted() -> None:
    work = WorkWatch(0.01, 0.25)
    for start, end in ((0.0, 0.004), (0.01, 0.012), (0.5, 0.501)):
        work.begin(start)
        work.end(end)
    assert work.trouble['stalls'] == 1
    report = work.report(1.0, 0.3, 3, 2, '0.200')
    assert (report.level, report.text) == (
        HealthLevel.OK, 'busy 30 % of the time, 3 messages waiting')
    assert report.values['busy_share'] == '0.007'
    assert report.values['longest_run_ms'] == '4.00'
    assert (report.values['queued'], report.values['late_samples']) == ('3', '2')
    flooded = work.report(2.0, 1.25, 0, 2, '0.200')
    assert (flooded.level, flooded.text) == (
        HealthLevel.WARN, 'busy 95 % of the time, 0 messages waiting')
    assert flooded.values['runs'] == '0'


def test_receiver_checks_pass_fail_or_are_skipped() -> None:
    values = {
        'gps_check.gps_fix': 'pass', 'gps_check_detail.gps_fix': '3, limit 3',
        'gps_check.max_horz_err': 'fail', 'gps_check_detail.max_horz_err': '8.2, limit 3',
        'gps_check.max_pdop': 'fail',
        'gps_check_detail.max_pdop': '4, limit 2.5, not selected',
        'gps_check.min_sat_count': 'skipped', 'resets': '0'}
    report = receiver_report(values)
    assert report is not None
    assert report.level == HealthLevel.WARN
    assert report.text == (
        'failing: max_horz_err (8.2, limit 3); skipped, as the fixes do not tell: min_sat_count')
    assert report.values['max_pdop'] == 'fail: 4, limit 2.5, not selected'
    assert report.values['min_sat_count'] == 'skipped'
    assert len(report.values) == 4


def test_an_estimator_without_receiver_checks_has_no_such_report() -> None:
    assert receiver_report({'resets': '0'}) is None


def test_an_input_is_switched_off_and_on() -> None:
    switches = Switches(('odometry', 'fix', 'fix_velocity'), 'odometry', enabled=True)
    assert switches.refusal('fix') is None
    assert switches.switch('fix', False) == ''
    assert [switches.refusal(role) is None for role in ('odometry', 'fix', 'fix_velocity')] == [
        True, False, False]
    assert switches.refusal('fix')[0] == 'switched_off'
    assert switches.switch('fix', True) == ''
    assert switches.refusal('fix_velocity') is None


def test_what_cannot_be_switched_is_said() -> None:
    switches = Switches(('odometry',), 'odometry', enabled=True)
    assert 'carries the time' in switches.switch('odometry', False)
    assert 'node.use_imu' in switches.switch('imu', True)
    assert switches.refusal('odometry') is None


def test_nothing_passes_while_disabled() -> None:
    switches = Switches(('odometry',), 'odometry', enabled=False)
    assert switches.refusal('odometry')[0] == 'disabled'
    switches.enabled = True
    assert switches.refusal('odometry') is None
