"""Order of stamps: what is repeated, backward, ahead, too old or a restart."""

from __future__ import annotations

from enum import Enum

from ekf_fusion_ros.messages.refusal import Refused

# A pause this long may be a wild stamp, unless the messages come that rarely anyway.
PAUSE_US = 1_000_000
USUAL_STEPS = 4

# No message is late by so much: such stamps are those of another clock.
OTHER_CLOCK_US = 10_000_000
OTHER_CLOCK = 'they are of different clocks, stamp both by the same one'


class Step(Enum):
    """How an inertial stamp follows the one before."""

    FORWARD = 0
    PAUSE = 1
    RESTART = 2


def check_advance(time_us: int, last_us: int | None) -> None:
    """Raise Refused unless a stamp lies behind the last one."""
    if last_us is None or time_us > last_us:
        return
    if time_us == last_us:
        raise Refused('repeated_stamp', f'stamp {time_us / 1e6:.6f} s came twice')
    raise Refused('backward_stamp', f'stamp {(last_us - time_us) / 1e6:.6f} s before the last')


class InertialOrder:
    """Judges the stamps that drive time.

    A single wild stamp must neither restart the filter nor run ahead of the good ones, so a jump
    or a long pause is believed when the next message continues from it.
    """

    def __init__(self, jump_us: int, notice_us: int) -> None:
        """Take the least jump that begins a new time, and the least pause worth telling."""
        self._jump_us = jump_us
        self._notice_us = notice_us
        self._usual_us = min(jump_us, notice_us, PAUSE_US)
        self._suspect: int | None = None
        self._step = jump_us
        self.last: int | None = None

    def judge(self, time_us: int) -> Step:
        """Return the kind of step; raise Refused for a stamp that is not usable."""
        if self.last is None:
            self.last = time_us
            return Step.FORWARD
        step = time_us - self.last
        if 0 < step <= self._usual_us:
            self.last, self._step, self._suspect = time_us, step, None
            return Step.FORWARD
        if -self._jump_us <= step <= 0:
            check_advance(time_us, self.last)
        restart = abs(step) > self._jump_us
        if (restart or step > self._longest_step()) and not self._continues_suspect(time_us):
            self._suspect = time_us
            raise Refused('stamp_jump', f'stamp {step / 1e6:+.3f} s from the one before')
        self._step = self._jump_us if restart else step
        self.last, self._suspect = time_us, None
        if restart:
            return Step.RESTART
        return Step.PAUSE if step > self._notice_us else Step.FORWARD

    def _longest_step(self) -> int:
        return max(PAUSE_US, USUAL_STEPS * self._step)

    def _continues_suspect(self, time_us: int) -> bool:
        return self._suspect is not None and 0 < time_us - self._suspect <= self._jump_us


class AidingOrder:
    """Judges the stamps of an aiding role against their own order and inertial time."""

    def __init__(self, lead_us: int, age_us: int) -> None:
        self._lead_us = lead_us
        self._age_us = age_us
        self.last: int | None = None

    def judge(self, time_us: int, now_us: int | None) -> None:
        """Raise Refused for a stamp that is not usable; now_us: newest inertial stamp."""
        if now_us is not None:
            self._against_inertial(time_us, now_us)
        step = 1 if self.last is None else time_us - self.last
        # Far behind its predecessor yet close to inertial time: the predecessor was wrong.
        wild_before = now_us is not None and step < -(self._lead_us + self._age_us)
        if step == 0:
            raise Refused('repeated_stamp', f'stamp {time_us / 1e6:.6f} s came twice')
        if step < 0 and not wild_before:
            raise Refused('backward_stamp', f'stamp {-step / 1e6:.6f} s before the one before')
        self.last = time_us

    def _against_inertial(self, time_us: int, now_us: int) -> None:
        lead = time_us - now_us
        other_clock = abs(lead) > OTHER_CLOCK_US
        if lead > self._lead_us:
            advice = OTHER_CLOCK if other_clock else (
                f'session.stamp_lead_max allows {self._lead_us / 1e6:g} s')
            raise Refused(
                'stamp_ahead', f'stamp {lead / 1e6:.3f} s ahead of the inertial input: {advice}')
        if lead < -self._age_us:
            advice = OTHER_CLOCK if other_clock else (
                f'at most {self._age_us / 1e6:.3f} s can be used; where messages come that late '
                'raise session.horizon_ms, and session.stamp_age_max if that is less')
            raise Refused(
                'too_old', f'stamp {-lead / 1e6:.3f} s behind the inertial input: {advice}')
