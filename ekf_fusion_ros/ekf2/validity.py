"""Whether position can be trusted: dead reckoning and its duration."""

from __future__ import annotations

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.state import SECOND

AIDING_RECENT_US = SECOND


class Validity:
    """Derived from the fusion times; nothing feeds back but the flag itself."""

    def __init__(self, f: Filter) -> None:
        """Act on a filter."""
        self._f = f
        self._timeout_us = round(f.params.aiding.valid_timeout * SECOND)

    def step(self) -> None:
        """Run once per filter period, last."""
        f = self._f
        times, flags, oldest = f.times, f.flags, f.t_now - AIDING_RECENT_US
        aided = ((flags.gps or flags.ev_pos or flags.ev_vel)
                 and (times.hor_pos > oldest or times.hor_vel > oldest))
        flow_aided = flags.opt_flow and times.flow > oldest
        air_aided = flags.wind and times.airspeed > oldest and times.sideslip > oldest
        f.wind_dead_reckoning = air_aided and not aided and not flow_aided
        f.dead_reckoning = not aided and not flow_aided and not air_aided
        if not f.dead_reckoning:
            f.last_aiding_us = oldest

    @property
    def local_position(self) -> bool:
        """True while the local position is constrained by measurements."""
        f = self._f
        if f.holding_position or not f.last_aiding_us:
            return False
        return not f.late(f.last_aiding_us, self._timeout_us)

    @property
    def global_position(self) -> bool:
        """True while the position on the earth is known."""
        return self.local_position and self._f.earth.has_origin
