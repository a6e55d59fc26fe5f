"""Compare a log of the filter with reference rows, group by group.

The measures are those of the battery's own comparison: degrees between attitudes, differences in
SI units, logarithms of ratios of variances, innovations and test ratios in parts of one plus
their size.
"""

from __future__ import annotations

from collections.abc import Callable
import gzip
from pathlib import Path

import numpy as np

Table = dict[str, np.ndarray]

STATES = ('q0 q1 q2 q3 vn ve vd pn pe pd dax_b day_b daz_b dvx_b dvy_b dvz_b mag_n mag_e mag_d '
          'mag_bx mag_by mag_bz wind_n wind_e').split()
ANGLES = {
    'attitude': STATES[0:4],
    'out_attitude': ['out_q0', 'out_q1', 'out_q2', 'out_q3'],
    'ev_rotation': ['ev_q0', 'ev_q1', 'ev_q2', 'ev_q3'],
}
PERIODS_PER_SECOND = 100.0
DIFFERENCES = {
    'velocity': (STATES[4:7], 1.0),
    'position': (STATES[7:10], 1.0),
    'gyro_bias': (STATES[10:13], PERIODS_PER_SECOND),
    'accel_bias': (STATES[13:16], PERIODS_PER_SECOND),
    'mag': (STATES[16:22], 1.0),
    'wind': (STATES[22:24], 1.0),
    'out_velocity': (['out_vn', 'out_ve', 'out_vd'], 1.0),
    'out_position': (['out_pn', 'out_pe', 'out_pd'], 1.0),
    'terrain': (['terrain_vpos'], 1.0),
}
VARIANCES = {
    'var_vel': slice(4, 7), 'var_pos': slice(7, 10), 'var_gyro_bias': slice(10, 13),
    'var_accel_bias': slice(13, 16), 'var_mag': slice(16, 22), 'var_wind': slice(22, 24),
}
WORDS = ('control_status', 'gps_check_fail', 'innov_check_fail', 'fault_status', 'soln_status',
         'warning_events', 'information_events', 'dead_reckoning', 'hagl_valid', 'quat_resets',
         'velNE_resets', 'velD_resets', 'posNE_resets', 'posD_resets')
DELTAS = 'd_q0 d_q1 d_q2 d_q3 d_vn d_ve d_vd d_pn d_pe d_pd'.split()
METRES_PER_DEGREE = 111195.0


def load(path: Path) -> Table:
    """Return the columns of a table with a header line."""
    opener = gzip.open if path.suffix == '.gz' else open
    with opener(path, 'rt', encoding='utf-8') as stream:
        names = stream.readline().strip().split(',')
        rows = np.loadtxt(stream, delimiter=',', ndmin=2)
    return dict(zip(names, rows.T, strict=True))


def matched(candidate: Table, times: np.ndarray) -> Table:
    """Return the rows at given times; KeyError where there is none."""
    index = {int(t): i for i, t in enumerate(candidate['time_us'])}
    rows = [index[int(t)] for t in times]
    return {name: column[rows] for name, column in candidate.items()}


def differing_words(reference: Table, candidate: Table) -> dict[str, int]:
    """Return the number of rows in which a flag word or a reset counter differs."""
    counts = {name: int(np.sum(reference[name] != candidate[name])) for name in WORDS}
    return {name: count for name, count in counts.items() if count}


def measures(reference: Table, candidate: Table) -> dict[str, tuple[float, float]]:
    """Return the largest difference and its 99 % quantile per group.

    Where the reference is finite the candidate must be, or the difference is infinite.
    """
    found = {name: _angle(reference, candidate, names) for name, names in ANGLES.items()}
    for name, (names, scale) in DIFFERENCES.items():
        found[name] = scale * _apply(np.subtract, reference, candidate, names)
    for name, states in VARIANCES.items():
        names = [f'P_{state}' for state in STATES[states]]
        found[name] = _apply(_log_ratio, reference, candidate, names)
    found['var_quat'] = _quaternion_variance(reference, candidate)
    found['gsf_yaw'] = _bank_yaw(reference, candidate)
    found['origin'] = _origin(reference, candidate)
    of = lambda *starts: [n for n in reference if n.startswith(starts)]  # noqa: E731
    found['innovations'] = _apply(_relative, reference, candidate, of('i_'))
    found['innovation_variances'] = _apply(_log_ratio, reference, candidate, of('iv_'))
    found['test_ratios'] = _apply(_relative, reference, candidate, of('r_', 'tr_'))
    return {name: _summary(values) for name, values in found.items()}


def largest_delta(reference: Table, candidate: Table) -> float:
    """Return the largest difference of the jumps made by resets."""
    return _summary(_apply(np.subtract, reference, candidate, DELTAS))[0]


def failures(
    reference: Table, candidate: Table, tolerances: dict[str, dict[str, float]],
) -> list[str]:
    """Return one line for each group beyond its tolerance."""
    return [
        f'{name}: max {largest:.3g} of {tolerances[name]["max"]:.3g}, '
        f'p99 {quantile:.3g} of {tolerances[name]["p99"]:.3g}'
        for name, (largest, quantile) in measures(reference, candidate).items()
        if largest > tolerances[name]['max'] or quantile > tolerances[name]['p99']]


def _stack(table: Table, names: list[str]) -> np.ndarray:
    return np.stack([table[name] for name in names], axis=1)


def _apply(
    measure: Callable[[np.ndarray, np.ndarray], np.ndarray], reference: Table, candidate: Table,
    names: list[str],
) -> np.ndarray:
    a, b = _stack(reference, names), _stack(candidate, names)
    difference = np.abs(measure(a, b))
    return np.where(np.isfinite(a), np.where(np.isfinite(difference), difference, np.inf), np.nan)


def _log_ratio(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    tiny = 1e-9 * np.nanmax(np.abs(a), axis=0) + 1e-14
    return np.log(np.maximum(b, tiny) / np.maximum(a, tiny))


def _relative(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a - b) / (1.0 + np.abs(a))


def _angle(reference: Table, candidate: Table, names: list[str]) -> np.ndarray:
    a, b = _stack(reference, names), _stack(candidate, names)
    a = a / np.linalg.norm(a, axis=1, keepdims=True)
    b = b / np.linalg.norm(b, axis=1, keepdims=True)
    sign = np.where(np.sum(a * b, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.degrees(4.0 * np.arcsin(0.5 * np.linalg.norm(a - sign * b, axis=1)))


def _quaternion_variance(reference: Table, candidate: Table) -> np.ndarray:
    names = [f'P_{state}' for state in STATES[0:4]]
    a, b = _stack(reference, names), _stack(candidate, names)
    return np.abs(a - b) / np.sum(a, axis=1, keepdims=True)


def _bank_yaw(reference: Table, candidate: Table) -> np.ndarray:
    turn = np.degrees(reference['gsf_yaw'] - candidate['gsf_yaw'])
    known = reference['gsf_yaw_var'] < 0.5
    return np.abs((turn[known] + 180.0) % 360.0 - 180.0)


def _origin(reference: Table, candidate: Table) -> np.ndarray:
    scale = np.array((METRES_PER_DEGREE, METRES_PER_DEGREE, 1.0))
    names = ['origin_lat', 'origin_lon', 'origin_alt']
    return _apply(np.subtract, reference, candidate, names) * scale


def _summary(values: np.ndarray) -> tuple[float, float]:
    values = values[~np.isnan(values)]
    if values.size == 0:
        return 0.0, 0.0
    return float(values.max()), float(np.quantile(values, 0.99, method='higher'))
