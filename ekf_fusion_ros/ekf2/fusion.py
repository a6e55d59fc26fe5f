"""Fusion of velocity and position, and of any scalar with a Jacobian."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import VerticalCheck
from ekf_fusion_ros.ekf2.observation import Observation
from ekf_fusion_ros.ekf2.state import PD
from ekf_fusion_ros.ekf2.state import PN
from ekf_fusion_ros.ekf2.state import VD
from ekf_fusion_ros.ekf2.state import VN

Array = NDArray[np.float64]


def test_ratio(innovation: float, variance: float, gate: float) -> float:
    """Return innovation^2 / (gate^2 variance); the gate is at least one sigma."""
    gate = max(gate, 1.0)
    return innovation * innovation / (gate * gate * variance)


def _fuse_pair(
    f: Filter, first: int, faults: tuple[str, str], innovation: Sequence[float],
    variance: Sequence[float],
) -> None:
    word = f.cov.fuse_pair(f.x, first, variance, innovation)
    setattr(f.faults, faults[0], bool(word & 1))
    setattr(f.faults, faults[1], bool(word & 2))


def _judge_pair(
    f: Filter, record: Observation, first: int, innovation: Sequence[float],
    noise: Sequence[float], gate: float,
) -> bool:
    p = f.cov.p
    variance = (p.item(first, first) + noise[0], p.item(first + 1, first + 1) + noise[1])
    ratio = max(test_ratio(innovation[0], variance[0], gate),
                test_ratio(innovation[1], variance[1], gate))
    record.record(f.t_now, innovation, variance, ratio)
    return ratio <= 1.0


def fuse_horizontal_velocity(
    f: Filter, record: Observation, innovation: Sequence[float], noise: Sequence[float],
    gate: float,
) -> bool:
    """Gate and fuse NE velocity; innovation in m/s, noise variances in (m/s)^2."""
    passed = _judge_pair(f, record, VN, innovation, noise, gate)
    f.rejections.hor_vel = not passed
    if not passed:
        record.reject()
        return False
    record.accept()
    f.times.hor_vel = f.t_now
    _fuse_pair(f, VN, ('vel_n', 'vel_e'), record.innovation, record.variance)
    return True


def fuse_horizontal_position(
    f: Filter, record: Observation, innovation: Sequence[float], noise: Sequence[float],
    gate: float, *, enforce_up_to: float = 1.0,
) -> bool:
    """Gate and fuse NE position; innovation in m, noise variances in m^2.

    A test ratio above `enforce_up_to` is rejected.
    """
    _judge_pair(f, record, PN, innovation, noise, gate)
    if record.test_ratio > enforce_up_to:
        record.reject()
        f.rejections.hor_pos = True
        return False
    record.accept()
    f.rejections.hor_pos = False
    f.times.hor_pos = f.t_now
    _fuse_pair(f, PN, ('pos_n', 'pos_e'), record.innovation, record.variance)
    return True


def _judge_down(
    f: Filter, record: Observation, state: int, innovation: float, noise: float, gate: float,
) -> VerticalCheck:
    variance = f.cov.p.item(state, state) + noise
    record.record(f.t_now, (innovation,), (variance,), test_ratio(innovation, variance, gate))
    return VerticalCheck(innovation / math.sqrt(variance), f.t_now)


def fuse_vertical_velocity(
    f: Filter, record: Observation, innovation: float, noise: float, gate: float,
) -> bool:
    """Gate and fuse down velocity; innovation in m/s, noise variance in (m/s)^2."""
    f.ver_vel_check = _judge_down(f, record, VD, innovation, noise, gate)
    passed = record.test_ratio <= 1.0
    f.rejections.ver_vel = not passed
    if not passed:
        record.reject()
        return False
    record.accept()
    f.times.ver_vel = f.t_now
    f.faults.vel_d = not f.cov.fuse_direct(f.x, VD, record.variance[0], innovation)
    return True


def fuse_vertical_position(
    f: Filter, record: Observation, innovation: float, noise: float, gate: float,
) -> bool:
    """Gate and fuse down position; innovation in m, noise variance in m^2."""
    f.ver_pos_check = _judge_down(f, record, PD, innovation, noise, gate)
    passed = record.test_ratio <= 1.0
    f.rejections.ver_pos = not passed
    f.rejections.mag_judged_after_height = False
    if not passed:
        record.reject()
        return False
    record.accept()
    f.times.hgt = f.t_now
    f.faults.pos_d = not f.cov.fuse_direct(f.x, PD, record.variance[0], innovation)
    return True
