"""What the filter is doing, what it found wrong, and what it last rejected."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import fields


@dataclass(slots=True)
class ControlFlags:
    """Modes of operation, named as PX4 names its filter control status."""

    tilt_align: bool = False
    yaw_align: bool = False
    gps: bool = False
    opt_flow: bool = False
    mag_hdg: bool = False
    mag_3d: bool = False
    mag_dec: bool = False
    in_air: bool = False
    wind: bool = False
    baro_hgt: bool = False
    rng_hgt: bool = False
    gps_hgt: bool = False
    ev_pos: bool = False
    ev_yaw: bool = False
    ev_hgt: bool = False
    fuse_beta: bool = False
    mag_disturbed: bool = False
    fixed_wing: bool = False
    mag_fault: bool = False
    fuse_aspd: bool = False
    gnd_effect: bool = False
    rng_stuck: bool = False
    gps_yaw: bool = False
    mag_aligned_in_flight: bool = False
    ev_vel: bool = False
    synthetic_mag_z: bool = False
    vehicle_at_rest: bool = False

    def horizontal_aids(self) -> int:
        """Count the sources that constrain horizontal velocity or position."""
        return (self.gps + self.opt_flow + self.ev_pos + self.ev_vel
                + (self.fuse_aspd and self.fuse_beta))

    def aided_horizontally(self) -> bool:
        """True while any source constrains horizontal velocity or position."""
        return (self.gps or self.opt_flow or self.ev_pos or self.ev_vel
                or (self.fuse_aspd and self.fuse_beta))

    def aided_other_than(self, active: bool) -> bool:
        """True where a horizontal source beside the one whose flag is given is in use."""
        return self.horizontal_aids() > int(active)

    def has_height(self) -> bool:
        """True while a height source is selected."""
        return self.baro_hgt or self.gps_hgt or self.rng_hgt or self.ev_hgt


FLAG_NAMES = tuple(f.name for f in fields(ControlFlags))


@dataclass(slots=True)
class FaultFlags:
    """Numerical and sensor faults of the latest attempt of each kind."""

    mag_x: bool = False
    mag_y: bool = False
    mag_z: bool = False
    heading: bool = False
    declination: bool = False
    airspeed: bool = False
    sideslip: bool = False
    flow_x: bool = False
    flow_y: bool = False
    vel_n: bool = False
    vel_e: bool = False
    vel_d: bool = False
    pos_n: bool = False
    pos_e: bool = False
    pos_d: bool = False
    accel_bias: bool = False
    accel_vertical: bool = False
    accel_clipping: bool = False

    def any(self) -> bool:
        """True when any fault is set."""
        return any(getattr(self, name) for name in FAULT_NAMES)


FAULT_NAMES = tuple(f.name for f in fields(FaultFlags))


@dataclass(slots=True)
class Rejections:
    """Which observation failed its innovation gate the last time it was tried."""

    hor_vel: bool = False
    ver_vel: bool = False
    hor_pos: bool = False
    ver_pos: bool = False
    mag_x: bool = False
    mag_y: bool = False
    mag_z: bool = False
    yaw: bool = False
    airspeed: bool = False
    sideslip: bool = False
    hagl: bool = False
    flow_x: bool = False
    flow_y: bool = False
    mag_judged_after_height: bool = False
    flow_judged_after_hagl: bool = False


@dataclass(slots=True)
class FusionTimes:
    """Time in us at which each kind of observation was last fused; 0 = never."""

    hor_vel: int = 0
    ver_vel: int = 0
    hor_pos: int = 0
    hgt: int = 0
    flow: int = 0
    flow_terrain: int = 0
    hagl: int = 0
    airspeed: int = 0
    sideslip: int = 0
