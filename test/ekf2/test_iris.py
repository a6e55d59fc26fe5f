"""PX4-ECL's own regression recording: a simulated quadrotor waits, then takes off."""

from __future__ import annotations

from ekf2.iris import samples
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.samples import ImuSample

END = 34_500_000
TOLERANCE = {
    'quaternion': (slice(0, 4), 5e-6),
    'velocity': (slice(4, 7), 5e-5),
    'position': (slice(7, 10), 5e-4),
    'gyro bias': (slice(10, 13), 5e-9),
    'accel bias': (slice(13, 16), 1e-7),
    'magnetic field': (slice(16, 22), 1e-6),
    'wind': (slice(22, 24), 0.0),
}


def print_error(values):
    """Return half a unit of the last of six significant digits."""
    with np.errstate(divide='ignore'):
        exponent = np.floor(np.log10(np.abs(values)))
    return np.where(values == 0.0, 0.0, 0.5 * 10.0 ** (exponent - 5.0))


@pytest.fixture(scope='module')
def runs(shared, repository):
    """Times (N,), the expected states and variances, and ours, each (N, 48)."""
    folder = shared / 'data' / 'ecl_replay_iris_gps'
    expected = np.loadtxt(folder / 'reference' / 'ecl_states_expected_iris_gps.csv',
                          delimiter=',', skiprows=1)
    ekf = Ekf2(load_file(repository / 'config' / 'px4_ecl.yaml').params.ekf2)
    rows = {}
    for sample in samples(folder / 'raw' / 'iris_gps.csv', END + 500_000):
        ekf.push(sample)
        if isinstance(sample, ImuSample) and ekf.update():
            f = ekf.filter
            rows[f.t_horizon] = np.concatenate([f.x, np.diag(f.cov.p)])
    initialised = np.any(expected[:, 2:4] != 0.0, axis=1)
    expected = expected[initialised & (expected[:, 0] <= END)]
    times = expected[:, 0].astype(int)
    return times, expected[:, 1:], np.array([rows[t] for t in times])


def test_the_run_is_compared_from_alignment_to_take_off(runs):
    times, expected, _ = runs
    assert times[0] == 185_000
    assert times[-1] == 34_485_000
    assert len(times) == 344
    assert expected[:, 9].min() < -3.5


@pytest.mark.parametrize('name', TOLERANCE)
def test_states_agree_beyond_print_precision(runs, name):
    columns, tolerance = TOLERANCE[name]
    _, expected, ours = runs
    excess = np.abs(ours - expected)[:, columns] - print_error(expected[:, columns])
    assert excess.max() <= tolerance


def test_variances_agree(runs):
    _, expected, ours = runs
    variances, reference = ours[:, 24:], expected[:, 24:]
    used = reference > 1e-9 * reference.max(axis=0)
    assert np.abs(np.log(variances[used] / reference[used])).max() < 2e-3
