"""What one line of diagnostics says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.estimator import HealthLevel


@dataclass(frozen=True, slots=True)
class Report:
    """One line of diagnostics: a subject, its level, one sentence and the numbers behind it."""

    subject: str
    level: HealthLevel
    text: str
    values: Mapping[str, str] = field(default_factory=dict)
