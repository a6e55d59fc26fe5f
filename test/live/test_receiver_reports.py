"""The lines of diagnostics on several receivers."""

from __future__ import annotations

import pytest

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.receiver_reports import receiver_status_report
from ekf_fusion_ros.receivers.bank import ReceiverStatus

OFFSET = (0.1, -0.25, 1.0)
LIE = '20.3 m from the majority, limit 6.0'


@pytest.mark.parametrize(('status', 'level', 'text'), [
    (ReceiverStatus('fix', True, (0.8, 0.75, 0.5), OFFSET, {}), HealthLevel.OK,
     'in the blend: position 80 %, height 75 %, velocity 50 %'),
    (ReceiverStatus('fix', True, (1.0, 1.0, 0.0), OFFSET, {'velocity': 'not measured'}),
     HealthLevel.OK, 'in the blend: position 100 %, height 100 %; velocity: not measured'),
    (ReceiverStatus('fix_2', True, (0.0, 0.25, 0.5), OFFSET, {'position': LIE}),
     HealthLevel.WARN, f'in the blend: height 25 %, velocity 50 %; position: {LIE}'),
    (ReceiverStatus('fix_2', False, (0.0, 0.0, 0.0), OFFSET, {}), HealthLevel.WARN,
     'silent: not in the blend'),
])
def test_each_receiver_says_what_becomes_of_it(
    status: ReceiverStatus, level: HealthLevel, text: str,
) -> None:
    report = receiver_status_report(status)
    assert (report.subject, report.level, report.text) == (
        f'receiver {status.name}', level, text)
    assert report.values['offset'] == '0.100 -0.250 1.000'
    assert report.values['weight.position'] == f'{status.weights[0]:.3f}'
