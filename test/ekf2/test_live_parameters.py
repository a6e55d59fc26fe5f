"""Live parameters act at once: none is kept from the start, and a few are seen to act."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ekf2.bench import Bench
import pytest

import ekf_fusion_ros.ekf2 as package
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.spec import leaves

LIVE = [name for name, _, spec in leaves(Ekf2Params()) if spec.live]


def reads_at_the_start() -> Iterator[str]:
    """Yield the dotted names that constructors of the filter read."""
    for path in sorted(Path(package.__path__[0]).rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.FunctionDef) and node.name == '__init__':
                yield from (ast.unparse(one) for one in ast.walk(node)
                            if isinstance(one, ast.Attribute))


def test_no_constructor_keeps_a_live_parameter() -> None:
    read = set(reads_at_the_start())
    assert any(name.endswith('imu.accel_bias_limit') for name in read)
    kept = [name for name in LIVE for one in read if one.endswith('.'.join(name.split('.')[-2:]))]
    assert kept == []


def changed(bench: Bench, group: str, **values: float) -> Ekf2Params:
    params = bench.ekf.params
    return replace(params, **{group: replace(getattr(params, group), **values)})


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.run(4.0)
    bench.sending.add('fix')
    bench.run(12.0)
    return bench


def test_a_gate_acts_from_the_next_fix_on(bench: Bench) -> None:
    """A fix 20 m off is refused at 5 sigma and taken at 100."""
    bench.fix.lat += 20.0 / 111_180.0
    bench.run(1.0)
    status = {one.name: one for one in bench.ekf.aid_statuses()}['gnss_position']
    assert status.innovation_rejected
    bench.ekf.adopt(changed(bench, 'gnss', pos_gate=100.0))
    bench.run(1.0)
    status = {one.name: one for one in bench.ekf.aid_statuses()}['gnss_position']
    assert not status.innovation_rejected


def test_process_noise_acts_from_the_next_period_on() -> None:
    """The variance of velocity grows by noise^2 dt^2 a period, less what a held position tells."""
    variances = []
    for noise in (0.1, 0.8):
        bench = Bench()
        bench.run(4.0)
        bench.sending.clear()
        bench.ekf.adopt(changed(bench, 'imu', accel_noise=noise))
        bench.run(0.1)
        variances.append(bench.p[4])
    assert variances[1] - variances[0] == pytest.approx((0.64 - 0.01) * 0.01 * 0.1, rel=0.1)


def test_what_is_out_of_range_is_refused(bench: Bench) -> None:
    before = bench.ekf.params
    with pytest.raises(ValueError, match='pos_gate'):
        bench.ekf.adopt(changed(bench, 'gnss', pos_gate=0.0))
    assert bench.ekf.params is before


def test_a_reset_keeps_what_was_adopted(bench: Bench) -> None:
    bench.ekf.adopt(changed(bench, 'gnss', pos_gate=7.0))
    bench.ekf.reset()
    assert bench.ekf.filter.params.gnss.pos_gate == 7.0
