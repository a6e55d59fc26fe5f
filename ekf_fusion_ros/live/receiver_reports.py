"""What becomes of each of several receivers, as lines of diagnostics."""

from __future__ import annotations

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report
from ekf_fusion_ros.receivers.bank import ReceiverStatus
from ekf_fusion_ros.receivers.reading import KINDS


def receiver_status_report(status: ReceiverStatus) -> Report:
    """Return the report on one receiver: its weights and offset, or why it is not used."""
    shares = dict(zip(KINDS, status.weights, strict=True))
    values = {f'weight.{kind}': f'{share:.3f}' for kind, share in shares.items()}
    values['offset'] = ' '.join(f'{metres:.3f}' for metres in status.offset)
    values.update({f'obstacle.{kind}': text for kind, text in status.obstacles.items()})
    return Report(f'receiver {status.name}', _level(status), _sentence(status), values)


def _level(status: ReceiverStatus) -> HealthLevel:
    unused = not status.live or not status.weights[0]
    return HealthLevel.WARN if unused else HealthLevel.OK


def _sentence(status: ReceiverStatus) -> str:
    if not status.live:
        return 'silent: not in the blend'
    used = [f'{kind} {100 * share:.0f} %'
            for kind, share in zip(KINDS, status.weights, strict=True) if share]
    words = [f'in the blend: {", ".join(used)}' if used else 'not in the blend']
    words += [f'{kind}: {text}' for kind, text in status.obstacles.items()]
    return '; '.join(words)
