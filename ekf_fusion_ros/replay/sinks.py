"""Where a replay puts its outputs: trajectory, alignment, bag."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
from typing import Any
from typing import TextIO

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.fused_output import FusedOutput
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.messages.encode import OdometryFields
from ekf_fusion_ros.messages.encode import encode_fix
from ekf_fusion_ros.messages.encode import encode_gnss_odometry
from ekf_fusion_ros.messages.encode import odometry_numbers
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.replay.cdr import fix_cdr
from ekf_fusion_ros.replay.cdr import odometry_cdr
from ekf_fusion_ros.replay.fused_bag import make_room
from ekf_fusion_ros.session import FusionSession

Array = NDArray[np.float64]
HEADER = 't,x,y,z,qx,qy,qz,qw,vx,vy,vz,yaw,var_x,var_y,var_z,var_yaw'
ODOMETRY = 'nav_msgs/msg/Odometry'
NAV_SAT_FIX = 'sensor_msgs/msg/NavSatFix'
POSE_WORDS = 8
ROW = ','.join(['%.14g'] * (len(HEADER.split(',')) - 1))
HALF_SQRT = math.sqrt(0.5)


class TrajectorySink:
    """trajectory.tum and trajectory.csv: ENU, body FLU, to 14 digits.

    All 17 of a double would take three times as long to write.
    """

    def __init__(self, folder: Path) -> None:
        self._tum: TextIO = (folder / 'trajectory.tum').open('w', encoding='utf-8')
        self._csv: TextIO = (folder / 'trajectory.csv').open('w', encoding='utf-8')
        self._csv.write(HEADER + '\n')
        self.rows = 0

    def write(self, navs: Sequence[NavState]) -> None:
        """Add one row for each state to each file."""
        tum, table = [], []
        for nav, row in zip(navs, _rows(navs), strict=True):
            second, micro = divmod(nav.time_us, 1_000_000)
            line = f'{second}.{micro:06d},{ROW % tuple(row)}'
            table.append(line)
            tum.append(' '.join(line.split(',', POSE_WORDS)[:POSE_WORDS]))
        for stream, rows in ((self._tum, tum), (self._csv, table)):
            stream.write('\n'.join([*rows, '']))
        self.rows += len(navs)

    def close(self) -> None:
        """Finish the files."""
        self._tum.close()
        self._csv.close()


def _rows(navs: Sequence[NavState]) -> list[list[float]]:
    """Return the numbers of the table in the order of its header, FLU to ENU.

    frames.swap_attitude and its like written out for many states at once.
    """
    if not navs:
        return []
    north, east, down = np.array([nav.position for nav in navs]).T
    w, x, y, z = np.array([nav.quaternion for nav in navs]).T
    v_north, v_east, v_down = np.array([nav.velocity for nav in navs]).T
    variances = np.array([nav.pose_cov.diagonal() for nav in navs]).T
    return np.stack((
        east, north, -down, HALF_SQRT * (x + y), HALF_SQRT * (x - y), HALF_SQRT * (w - z),
        HALF_SQRT * (w + z), v_east, v_north, -v_down, _yaws(w, x, y, z),
        variances[1], variances[0], variances[2], variances[5]), axis=1).tolist()


def _yaws(w: Array, x: Array, y: Array, z: Array) -> list[float]:
    """Return the yaws from east, counter-clockwise, rad."""
    sines, cosines = 2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)
    # For the arctangent of numpy differs in its last bit between processors.
    headings = map(math.atan2, sines.tolist(), cosines.tolist())
    return [math.remainder(0.5 * math.pi - heading, 2.0 * math.pi) for heading in headings]


class AlignmentSink:
    """alignment.csv: heading of the odometry frame against ENU, one row a second."""

    def __init__(self, folder: Path) -> None:
        self._csv: TextIO = (folder / 'alignment.csv').open('w', encoding='utf-8')
        self._csv.write('t,odom_yaw,sigma\n')
        self._second = -1

    def write(self, output: FusedOutput, session: FusionSession) -> None:
        """Add a row when the output begins a new second."""
        second, micro = divmod(output.time_us, 1_000_000)
        if second == self._second:
            return
        alignment = session.alignment()
        if alignment is None:
            return
        self._second = second
        self._csv.write(f'{second}.{micro:06d},{alignment[0]!r},{alignment[1]!r}\n')

    def close(self) -> None:
        """Finish the file."""
        self._csv.close()


class BagSink:
    """fused/: a rosbag2 with the topics that the node publishes."""

    def __init__(self, folder: Path, params: Params, *, local: bool) -> None:
        self._frames = params.node.output_frame, params.node.base_link_frame
        self._projection_name = params.ekf2.earth.projection
        self._writer = Writer(make_room(folder), version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.open()
        store = get_typestore(Stores.ROS2_JAZZY)
        topics = {'/odometry/filtered': ODOMETRY}
        if not local:
            topics |= {'/odometry/gps': ODOMETRY, '/gps/filtered': NAV_SAT_FIX}
        self._connections: dict[str, Any] = {
            topic: self._writer.add_connection(topic, kind, typestore=store)
            for topic, kind in topics.items()}

    def write(self, outputs: Sequence[FusedOutput]) -> None:
        """Add the messages of some outputs; log time is the stamp."""
        numbers = odometry_numbers([output.nav for output in outputs])
        for output, row in zip(outputs, numbers, strict=True):
            fields = OdometryFields(output.time_us, *self._frames, row)
            self._put('/odometry/filtered', output.time_us, odometry_cdr(fields))
            if not output.local and output.nav.origin is not None:
                self._put_fixes(output, output.nav.origin)

    def _put_fixes(self, output: FusedOutput, origin: GeoPoint) -> None:
        """Add the position on the globe and the fixes that came with it."""
        nav, time_us = output.nav, output.time_us
        projection = make_projection(
            self._projection_name, origin.lat, origin.lon, origin.alt)
        fix = encode_fix(nav, projection, self._frames[1])
        self._put('/gps/filtered', time_us, fix_cdr(fix))
        for sample in output.fixes:
            fields = encode_gnss_odometry(sample, origin, projection, self._frames[0])
            self._put('/odometry/gps', time_us, odometry_cdr(fields))

    def _put(self, topic: str, time_us: int, data: bytes) -> None:
        self._writer.write(self._connections[topic], time_us * 1000, data)

    def close(self) -> None:
        """Finish the bag."""
        self._writer.close()


class StateSink:
    """estimator.csv: one row a filter update; of EKF2 the columns of the parity comparison."""

    def __init__(self, folder: Path, estimator: str) -> None:
        from ekf_fusion_ros.replay.estimator_log import EstimatorLog
        from ekf_fusion_ros.replay.lpe_log import LpeLog
        kind = LpeLog if estimator == 'lpe' else EstimatorLog
        self._log: LpeLog | EstimatorLog = kind(folder / 'estimator.csv')

    def write(self, estimator: Any) -> None:
        """Add a row; called after each filter update."""
        self._log.write(estimator)

    def close(self) -> None:
        """Finish the file."""
        self._log.close()
