"""Velocity against a landing target."""

from __future__ import annotations

from ekf2.bench import Bench
import numpy as np
import pytest


def aided(*, with_fixes):
    bench = Bench()
    if with_fixes:
        bench.sending.add('fix')
    bench.sending.add('aux')
    bench.run(20.0)
    return bench


def test_it_is_fused_beside_another_source():
    bench = aided(with_fixes=True)
    assert bench.ekf.filter.observations.aux_vel.fused > 50
    # two sources agree on rest, so a smaller variance than fixes alone give
    alone = Bench()
    alone.sending.add('fix')
    alone.run(20.0)
    assert bench.p[4] < 0.5 * alone.p[4]
    np.testing.assert_allclose(bench.x[4:6], 0.0, atol=0.01)


def test_alone_it_is_left_out():
    bench = aided(with_fixes=False)
    assert bench.ekf.filter.observations.aux_vel.judged == 0
    assert bench.ekf.nav_state().dead_reckoning


def test_a_difference_beyond_five_sigma_is_rejected():
    bench = aided(with_fixes=True)
    bench.aux_velocity = np.array((3.0, 0.0, 0.0))
    bench.run(1.0)
    record = bench.ekf.filter.observations.aux_vel
    assert record.rejected_last
    assert record.innovation[0] == pytest.approx(-3.0, abs=0.1)
    assert record.test_ratio == pytest.approx(
        record.innovation[0] ** 2 / (25.0 * record.variance[0]), rel=1e-9)
    np.testing.assert_allclose(bench.x[4:6], 0.0, atol=0.05)
