"""Fusion of velocity and position, which are states themselves."""

from __future__ import annotations

from collections.abc import Sequence
import math

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import VerticalCheck
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import VD
from ekf_fusion_ros.ekf2.state import VN
from ekf_fusion_ros.observation import Observation


def fuse_horizontal_velocity(
    f: Filter, record: Observation, innovation: Sequence[float], noise: Sequence[float],
    gate: float,
) -> bool:
    """Gate and fuse NE velocity; innovation in m/s, noise variances in (m/s)^2."""
    north, east, ratio, faults = f.cov.fuse_two_states(f.x, VN, innovation, noise, gate, 1.0)
    passed = record.note(f.t_now, innovation, (north, east), ratio, ratio <= 1.0)
    f.rejections.hor_vel = not passed
    if passed:
        f.times.hor_vel = f.t_now
        f.faults.vel_n, f.faults.vel_e = faults & 1 != 0, faults & 2 != 0
    return passed


def fuse_horizontal_position(
    f: Filter, record: Observation, innovation: Sequence[float], noise: Sequence[float],
    gate: float, *, enforce_up_to: float = 1.0,
) -> bool:
    """Gate and fuse NE position; innovation in m, noise variances in m^2.

    A test ratio above `enforce_up_to` is rejected.
    """
    north, east, ratio, faults = f.cov.fuse_two_states(
        f.x, PN, innovation, noise, gate, enforce_up_to)
    passed = record.note(
        f.t_now, innovation, (north, east), ratio, ratio <= enforce_up_to)
    f.rejections.hor_pos = not passed
    if passed:
        f.times.hor_pos = f.t_now
        f.faults.pos_n, f.faults.pos_e = faults & 1 != 0, faults & 2 != 0
    return passed


def fuse_vertical_velocity(
    f: Filter, record: Observation, innovation: float, noise: float, gate: float,
) -> bool:
    """Gate and fuse down velocity; innovation in m/s, noise variance in (m/s)^2."""
    variance, ratio, healthy = f.cov.fuse_state(f.x, VD, innovation, noise, gate)
    f.ver_vel_check = VerticalCheck(innovation / math.sqrt(variance), f.t_now)
    passed = record.note(f.t_now, (innovation,), (variance,), ratio, ratio <= 1.0)
    f.rejections.ver_vel = not passed
    if passed:
        f.times.ver_vel = f.t_now
        f.faults.vel_d = not healthy
    return passed


def fuse_vertical_position(
    f: Filter, record: Observation, innovation: float, noise: float, gate: float,
) -> bool:
    """Gate and fuse down position; innovation in m, noise variance in m^2."""
    variance, ratio, healthy = f.cov.fuse_state(f.x, PD, innovation, noise, gate)
    f.ver_pos_check = VerticalCheck(innovation / math.sqrt(variance), f.t_now)
    passed = record.note(f.t_now, (innovation,), (variance,), ratio, ratio <= 1.0)
    f.rejections.ver_pos = not passed
    f.rejections.mag_judged_after_height = False
    if passed:
        f.times.hgt = f.t_now
        f.faults.pos_d = not healthy
    return passed
