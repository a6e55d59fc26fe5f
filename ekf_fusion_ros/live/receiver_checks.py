"""The receiver checks as one line of diagnostics."""

from __future__ import annotations

from collections.abc import Mapping

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report

VERDICT = 'gps_check.'
DETAIL = 'gps_check_detail.'
NOT_SELECTED = 'not selected'


def receiver_report(values: Mapping[str, str]) -> Report | None:
    """Return the report on the checks in the values of an estimator's health, None without any.

    Each check has a verdict (pass, fail, skipped) and a detail as '8.2, limit 3', with
    ', not selected' behind it where the verdict does not count.
    """
    verdicts = {name.removeprefix(VERDICT): text for name, text in values.items()
                if name.startswith(VERDICT)}
    if not verdicts:
        return None
    details = {name: values.get(DETAIL + name, '') for name in verdicts}
    failed = [f'{name} ({details[name]})' for name, verdict in verdicts.items()
              if verdict == 'fail' and NOT_SELECTED not in details[name]]
    skipped = [name for name, verdict in verdicts.items() if verdict == 'skipped']
    words = [f'failing: {", ".join(failed)}' if failed else 'none failing']
    if skipped:
        words.append(f'skipped, as the fixes do not tell: {", ".join(skipped)}')
    level = HealthLevel.WARN if failed else HealthLevel.OK
    told = {name: f'{verdict}: {details[name]}' if details[name] else verdict
            for name, verdict in verdicts.items()}
    return Report('gps checks', level, '; '.join(words), told)
