"""Each receiver check holds up the start of GNSS where it is selected, and only there."""

from __future__ import annotations

from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.gnss_checks import GnssChecks
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssCheckParams
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.samples import GnssSample

NAMES = ('nsats', 'pdop', 'hacc', 'vacc', 'sacc', 'hdrift', 'vdrift', 'hspeed', 'vspeed')
DEGREES_PER_METRE = 1.0 / 111_180.0


def spoil(bench, name):
    """Make one check fail; the vehicle stays at rest."""
    fix = bench.fix
    if name == 'nsats':
        fix.nsats = 5
    elif name == 'pdop':
        fix.pdop = 2.5
    elif name == 'hacc':
        fix.eph = 6.0
    elif name == 'vacc':
        fix.epv = 9.0
    elif name == 'sacc':
        fix.sacc = 1.2
    elif name == 'hdrift':
        fix.lat += 3.0 * 0.2 * DEGREES_PER_METRE
    elif name == 'vdrift':
        fix.alt += 5.0 * 0.2
    elif name == 'hspeed':
        fix.velocity = np.array((2.0, 2.0, 0.0))
    else:
        fix.velocity = np.array((0.0, 0.0, 2.0))


def checked_only(name):
    selected = {other: other == name for other in NAMES}
    checks = GnssCheckParams(**selected, health_time=2.0, start_time=1.0)
    return Ekf2Params(gnss=GnssParams(checks=checks))


@pytest.mark.parametrize('name', NAMES)
def test_a_selected_check_prevents_the_origin(name):
    bench = Bench(checked_only(name))
    bench.run(4.0)
    bench.sending.add('fix')
    for _ in range(25):
        spoil(bench, name)
        bench.run(0.2)
    results = bench.ekf.control.checks.results
    assert [other for other, result in results.items() if result.failed] == [name]
    assert bench.ekf.nav_state().origin is None
    assert name in bench.ekf.health().text


@pytest.mark.parametrize('name', NAMES)
def test_a_check_that_is_not_selected_prevents_nothing(name):
    bench = Bench(checked_only('none of them'))
    bench.run(4.0)
    bench.sending.add('fix')
    for _ in range(25):
        spoil(bench, name)
        bench.run(0.2)
    assert bench.ekf.control.checks.results[name].failed
    assert bench.ekf.nav_state().origin is not None


def test_what_a_fix_does_not_tell_is_skipped_not_passed():
    f = Filter(Ekf2Params(), 12)
    f.t_now = 1_000_000
    checks = GnssChecks(f)
    checks.run(GnssSample(f.t_now, 47.0, 8.0, 400.0, eph=1.0, epv=2.0))
    skipped = {name for name, result in checks.results.items() if result.failed is None}
    assert {'nsats', 'pdop', 'sacc'} <= skipped
    assert checks.results['hacc'].failed is False


def test_drift_is_low_passed_with_ten_seconds():
    f = Filter(Ekf2Params(), 12)
    f.flags.vehicle_at_rest = True
    checks = GnssChecks(f)
    for k in range(101):
        f.t_now = 1_000_000 + 200_000 * k
        lat = 47.0 + 0.2 * k * 0.2 * DEGREES_PER_METRE
        checks.run(GnssSample(f.t_now, lat, 8.0, 400.0, eph=1.0, epv=2.0))
    # 20 s of 0.2 m/s: two time constants.
    assert checks.results['hdrift'].value == pytest.approx(0.2 * (1.0 - np.exp(-2.0)), rel=0.02)
    f.flags.in_air = True
    checks.run(GnssSample(f.t_now + 200_000, 48.0, 8.0, 400.0, eph=1.0, epv=2.0))
    assert checks.results['hdrift'].failed is False


def test_a_check_that_is_not_selected_is_not_blamed():
    bench = Bench(checked_only('nsats'))
    bench.run(4.0)
    bench.sending.add('fix')
    for _ in range(25):
        spoil(bench, 'nsats')
        spoil(bench, 'hdrift')
        bench.run(0.2)
    assert bench.ekf.control.checks.results['hdrift'].failed
    assert bench.ekf.health().text.endswith('(nsats failing)')
