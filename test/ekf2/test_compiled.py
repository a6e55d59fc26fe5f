"""Compiled kernels and plain Python give the same states."""

from __future__ import annotations

import os
from pathlib import Path
import subprocess
import sys

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.replay.sensor_csv import read_sensor_csv
from ekf_fusion_ros.samples import ImuSample

CASE = Path(__file__).resolve().parents[1] / 'battery_cut' / '28a_ev_vel_body_frame'
SECONDS = 17.0
"""Alignment, start of fixes and odometry, take-off, realignment of yaw above the ground."""


def flown() -> np.ndarray:
    """Return states and variances (N, 48) of the beginning of a case, ten times a second."""
    loaded = load_file(CASE / 'params.txt')
    ekf = Ekf2(loaded.params.ekf2)
    rows, updates, begin = [], 0, None
    for sample in read_sensor_csv(CASE / 'sensors.csv.gz', vehicle=loaded.vehicle):
        begin = begin or sample.time_us
        if sample.time_us > begin + SECONDS * 1e6:
            break
        ekf.push(sample)
        if isinstance(sample, ImuSample) and ekf.update():
            updates += 1
            if updates % 10 == 0:
                f = ekf.filter
                rows.append(np.concatenate([f.x, np.diag(f.cov.p), f.output.now]))
    return np.array(rows)


@pytest.mark.skipif(not COMPILED, reason='kernels are not compiled here')
def test_compiled_and_plain_agree(tmp_path):
    result = tmp_path / 'plain.npy'
    environment = {**os.environ, 'EKF_FUSION_NUMBA': '0',
                   'PYTHONPATH': os.pathsep.join(path for path in sys.path if path)}
    subprocess.run([sys.executable, __file__, str(result)], env=environment, check=True)
    plain, compiled = np.load(result), flown()
    assert len(plain) > 150
    assert plain[-1, 6] != 0.0
    np.testing.assert_allclose(compiled, plain, rtol=1e-9, atol=1e-9)


if __name__ == '__main__':
    from ekf_fusion_ros.kernels import compile as switch

    assert not switch.COMPILED
    np.save(sys.argv[1], flown())
