"""The way of fixes to the estimator: put together from their topics, blended where several."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Collection
from collections.abc import Mapping
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.fix_assembly import RELEASE_US
from ekf_fusion_ros.fix_assembly import FixAssembly
from ekf_fusion_ros.frames import swap_flu_frd
from ekf_fusion_ros.pairing import Part
from ekf_fusion_ros.receivers.bank import Receiver
from ekf_fusion_ros.receivers.bank import ReceiverBank
from ekf_fusion_ros.receivers.bank import ReceiverStatus
from ekf_fusion_ros.roles import FIX
from ekf_fusion_ros.roles import FIX_OF_PART
from ekf_fusion_ros.roles import FIXES
from ekf_fusion_ros.roles import age_limit_us
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.statistics import RoleStatistics

if TYPE_CHECKING:
    from ekf_fusion_ros.params.tree import Params


class FixIntake:
    """An assembly for each receiver, and behind them a bank where there are several.

    With one receiver a fix leaves as its assembly gives it.
    """

    def __init__(
        self, statistics: Mapping[str, RoleStatistics], roles: Collection[str], params: Params,
        state: Callable[[], NavState | None],
    ) -> None:
        """Take the fixes of the receivers in `roles`; `state` returns the present estimate."""
        fixes = [role for role in FIXES if role in roles] or [FIX]
        self._assemblies = {
            role: FixAssembly(role, statistics, roles, params.session, age_limit_us(params, role))
            for role in fixes}
        self._bank: ReceiverBank | None = None
        if len(fixes) > 1:
            limit_us = min(age_limit_us(params, role) for role in fixes) - RELEASE_US
            self._bank = ReceiverBank(
                {role: receiver_of(role, params) for role in fixes}, params.receivers,
                params.ekf2.earth.projection, limit_us, state)
        self.waiting = False

    def push_fix(self, role: str, fix: GnssSample) -> Sequence[GnssSample]:
        """Return the fixes that are complete, or will stay as they are."""
        return self._settled(self._through(role, self._assemblies[role].push_fix(fix)))

    def push(self, role: str, part: Part) -> Sequence[GnssSample]:
        """Return the fixes that this part completes."""
        fix = FIX_OF_PART[role]
        return self._settled(self._through(fix, self._assemblies[fix].push(role, part)))

    def advance(self, now_us: int) -> Sequence[GnssSample]:
        """Return the fixes whose wait is over at inertial time `now_us`."""
        fixes = [ready for role, assembly in self._assemblies.items() if assembly.waiting
                 for ready in self._through(role, assembly.advance(now_us))]
        if self._bank is not None:
            fixes += self._bank.advance(now_us)
        return self._settled(fixes)

    def flush(self) -> Sequence[GnssSample]:
        """Give up waiting."""
        fixes = [ready for role, assembly in self._assemblies.items()
                 for ready in self._through(role, assembly.flush())]
        if self._bank is not None:
            fixes += self._bank.flush()
        return self._settled(fixes)

    def drain_events(self) -> Sequence[Event]:
        """Return and forget what happened to the receivers."""
        return self._bank.drain_events() if self._bank is not None else ()

    def statuses(self) -> Sequence[ReceiverStatus]:
        """Return what becomes of each of several receivers, nothing where there is one."""
        return self._bank.statuses() if self._bank is not None else ()

    def passed_over(self) -> Mapping[str, Counter[str]]:
        """Return by role and reason the fixes that the bank had no use for."""
        return self._bank.passed_over if self._bank is not None else {}

    def _through(self, role: str, fixes: Sequence[GnssSample]) -> Sequence[GnssSample]:
        bank = self._bank
        if bank is None:
            return fixes
        return [blended for fix in fixes for blended in bank.push(role, fix)]

    def _settled(self, fixes: Sequence[GnssSample]) -> Sequence[GnssSample]:
        self.waiting = any(assembly.waiting for assembly in self._assemblies.values()) or (
            self._bank is not None and self._bank.waiting)
        return fixes


def receiver_of(role: str, params: Params) -> Receiver:
    """Return antenna and delay of a receiver; those of the first are the estimator's."""
    if role == FIX:
        gnss = params.ekf2.gnss
        delay_ms = 1e3 * params.lpe.gnss.delay if params.estimator == 'lpe' else gnss.delay_ms
        return Receiver(np.array(gnss.position), round(1e3 * delay_ms))
    antenna = swap_flu_frd(np.array(getattr(params.messages, role).mount_xyz))
    return Receiver(antenna, round(1e3 * getattr(params.receivers, role).delay_ms))
