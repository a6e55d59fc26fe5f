"""What LPE says after each update, as a table."""

from __future__ import annotations

import csv
from pathlib import Path

from ekf_fusion_ros.lpe.lpe import Lpe

AXES = ('n', 'e', 'd')
STATES = (*(f'pos_{axis}' for axis in AXES), *(f'vel_{axis}' for axis in AXES),
          'acc_bias_x', 'acc_bias_y', 'acc_bias_z', 'terrain')
SENSORS = ('gnss', 'baro', 'lidar', 'sonar', 'optical_flow', 'vision', 'mocap', 'land',
           'landing_target')
COLUMNS = ('t_us', *STATES, *(f'var_{name}' for name in STATES), 'valid_xy', 'valid_z',
           'valid_terrain', *(f'ratio_{name}' for name in SENSORS))


class LpeLog:
    """Writes estimator.csv; the ratio of a sensor never initialised is nan."""

    def __init__(self, path: Path) -> None:
        """Create the file with its header."""
        self._stream = path.open('w', newline='', encoding='utf-8')
        self._writer = csv.writer(self._stream, lineterminator='\n')
        self._writer.writerow(COLUMNS)

    def write(self, lpe: Lpe) -> None:
        """Append the state of a filter that has just advanced."""
        valid = lpe.filter.valid
        ratios = {status.name: status.test_ratio for status in lpe.aid_statuses()}
        values = [*lpe.states().tolist(), *lpe.variances().tolist(), valid.horizontal,
                  valid.height, valid.terrain, *(ratios.get(name, float('nan'))
                                                 for name in SENSORS)]
        self._writer.writerow([lpe.filter.now_us, *(format(float(v), '.10g') for v in values)])

    def close(self) -> None:
        """Close the file."""
        self._stream.close()
