"""Exact counts of what came in: every message is accepted or refused, once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field
from dataclasses import replace

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import NavState

JUDGED_FROM, MOSTLY = 50, 0.9
"""Number of messages from which their use is judged, and the share that is nearly all of them."""


@dataclass(slots=True)
class RoleStatistics:
    """Counts of one role.

    `pending` messages wait for a partner and will be one or the other. `details` holds the
    first sentence said for each reason, `last` reason and sentence of the newest refusal.
    `passed_over` counts, by reason, accepted ones that the filter had no use for.
    """

    received: int = 0
    accepted: int = 0
    refused: dict[str, int] = field(default_factory=dict)
    details: dict[str, str] = field(default_factory=dict)
    last: tuple[str, str] = ('', '')
    passed_over: dict[str, int] = field(default_factory=dict)

    def refuse(self, reason: str, detail: str = '') -> bool:
        """Count a refusal; True when this reason is new."""
        first = reason not in self.refused
        self.refused[reason] = self.refused.get(reason, 0) + 1
        self.last = (reason, detail)
        if first:
            self.details[reason] = detail
        return first

    @property
    def last_refusal(self) -> str:
        """Newest refusal in words, '' without one."""
        return ': '.join(part for part in self.last if part)

    @property
    def refused_total(self) -> int:
        """Number of refused messages over all reasons."""
        return sum(self.refused.values())

    @property
    def complaint(self) -> str:
        """Sentence on messages of which hardly any is usable, '' where that is not so."""
        refused = self.refused_total - self.refused.get('withheld', 0)
        if self.received < JUDGED_FROM or refused < MOSTLY * self.received:
            return ''
        return (f'{refused} of {self.received} messages are refused, the last one as '
                f'{self.last_refusal}')

    @property
    def pending(self) -> int:
        """Messages received and not yet judged."""
        return self.received - self.accepted - self.refused_total

    def summary(self) -> str:
        """Say in words what became of the messages."""
        reasons = ', '.join(f'{count} {reason}' for reason, count in self.refused.items())
        taken = f'{self.accepted} accepted' if self.accepted else 'none accepted'
        return f'{self.received} received, {taken}' + (f' ({reasons})' if reasons else '')

    def as_dict(self) -> dict[str, object]:
        """Return the counts as plain types, for summary.json and diagnostics."""
        return {
            'received': self.received,
            'accepted': self.accepted,
            'refused': dict(sorted(self.refused.items())),
            'passed_over': dict(sorted(self.passed_over.items())),
        }


def note_milestones(milestones: dict[str, int], nav: NavState) -> None:
    """Keep when the filter started, its yaw was aligned and its origin set, each once."""
    if len(milestones) == 3:
        return
    milestones.setdefault('filter', nav.time_us)
    if nav.yaw_aligned:
        milestones.setdefault('yaw', nav.time_us)
    if nav.origin is not None:
        milestones.setdefault('origin', nav.time_us)


def counted_together(before: Sequence[AidStatus], now: Sequence[AidStatus]) -> list[AidStatus]:
    """Return the verdicts of now, counted on from those of before a restart.

    A kind of observation that has not come again since is there with what it had, not active.
    """
    found = {aid.name: replace(aid, active=False) for aid in before}
    for aid in now:
        earlier = found.get(aid.name)
        found[aid.name] = aid if earlier is None else _added(earlier, aid)
    return list(found.values())


def _added(earlier: AidStatus, later: AidStatus) -> AidStatus:
    return replace(
        later, fused=earlier.fused + later.fused, rejected=earlier.rejected + later.rejected,
        starts=earlier.starts + later.starts, stops=earlier.stops + later.stops,
        first_fused_us=earlier.first_fused_us if earlier.fused else later.first_fused_us,
        last_fused_us=later.last_fused_us if later.fused else earlier.last_fused_us)
