"""Samples written as a rosbag2 recording: ENU/FLU messages as drivers publish them."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.frames import swap_attitude
from ekf_fusion_ros.frames import swap_enu_ned
from ekf_fusion_ros.frames import swap_flu_frd
from ekf_fusion_ros.geo.atmosphere import pressure_at
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]
TESLA_PER_GAUSS = 1e-4
DIAGONAL_KNOWN = 2
GPS_AND_ALL_ELSE = 15
TOPICS = {
    'nav_msgs/msg/Odometry': '/odom',
    'sensor_msgs/msg/NavSatFix': '/fix',
    'geometry_msgs/msg/TwistWithCovarianceStamped': '/fix_velocity',
    'sensor_msgs/msg/Imu': '/imu/data_raw',
    'sensor_msgs/msg/MagneticField': '/mag',
    'sensor_msgs/msg/FluidPressure': '/pressure',
}


def write_recording(path: Path, arrivals: Iterable[tuple[int, str, Sample]]) -> dict[str, int]:
    """Write samples to a new rosbag2 folder (MCAP); return the messages per topic.

    arrivals: log time in us, role (not used), sample. Raises WriterError where the folder exists.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = _Messages(store.types)
    counts: dict[str, int] = {}
    connections: dict[str, Any] = {}
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for time_us, _, sample in arrivals:
            for message in messages.of(sample):
                kind = message.__msgtype__
                topic = TOPICS[kind]
                if topic not in connections:
                    connections[topic] = bag.add_connection(topic, kind, typestore=store)
                    counts[topic] = 0
                bag.write(connections[topic], time_us * 1000, store.serialize_cdr(message, kind))
                counts[topic] += 1
    return counts


class _Messages:
    """Builds the messages of a sample from the types of a store."""

    def __init__(self, types: Any) -> None:
        self._types = types
        self._of: dict[type, Callable[[Any], list[Any]]] = {
            ImuSample: self._imu,
            VisionSample: self._odometry,
            GnssSample: self._fix,
            MagSample: self._magnetic_field,
            BaroSample: self._pressure,
        }

    def of(self, sample: Sample) -> list[Any]:
        if type(sample) not in self._of:
            raise TypeError(f'{type(sample).__name__} has no ROS message here')
        return self._of[type(sample)](sample)

    def _make(self, kind: str, **fields: Any) -> Any:
        package, name = kind.split('/')
        return self._types[f'{package}/msg/{name}'](**fields)

    def _header(self, time_us: int, frame_id: str) -> Any:
        sec, nanosec = seconds_nanoseconds(time_us)
        stamp = self._make('builtin_interfaces/Time', sec=sec, nanosec=nanosec)
        return self._make('std_msgs/Header', stamp=stamp, frame_id=frame_id)

    def _vector(self, v: Array) -> Any:
        return self._make(
            'geometry_msgs/Vector3', x=float(v[0]), y=float(v[1]), z=float(v[2]))

    def _quaternion(self, q: Array) -> Any:
        w, x, y, z = (float(component) for component in q)
        return self._make('geometry_msgs/Quaternion', x=x, y=y, z=z, w=w)

    def _imu(self, sample: ImuSample) -> list[Any]:
        rate = swap_flu_frd(sample.delta_angle) / sample.delta_angle_dt
        force = swap_flu_frd(sample.delta_velocity) / sample.delta_velocity_dt
        absent = np.zeros(9)
        absent[0] = -1.0
        return [self._make(
            'sensor_msgs/Imu', header=self._header(sample.time_us, 'base_link'),
            orientation=self._quaternion(np.array([1.0, 0.0, 0.0, 0.0])),
            orientation_covariance=absent,
            angular_velocity=self._vector(rate), angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector(force), linear_acceleration_covariance=np.zeros(9))]

    def _odometry(self, sample: VisionSample) -> list[Any]:
        place = swap_enu_ned(sample.position)
        pose = self._make(
            'geometry_msgs/Pose',
            position=self._make('geometry_msgs/Point', **dict(zip('xyz', place.tolist(),
                                                                  strict=True))),
            orientation=self._quaternion(swap_attitude(sample.quaternion)))
        twist = self._make(
            'geometry_msgs/Twist', linear=self._vector(swap_flu_frd(sample.velocity)),
            angular=self._vector(np.zeros(3)))
        # The signs of ENU drop out of a diagonal; those of FLU stay in the off-diagonal terms.
        var = sample.position_var
        flip = np.diag([1.0, -1.0, -1.0])
        pose_cov = np.diag([var[1], var[0], var[2]] + 3 * [sample.angular_var])
        twist_cov = np.zeros((6, 6))
        twist_cov[:3, :3] = flip @ sample.velocity_cov @ flip
        # No angular rate is measured; a large variance says so.
        twist_cov[3:, 3:] = 1e6 * np.eye(3)
        return [self._make(
            'nav_msgs/Odometry', header=self._header(sample.time_us, 'odom'),
            child_frame_id='base_link',
            pose=self._make('geometry_msgs/PoseWithCovariance', pose=pose,
                            covariance=pose_cov.ravel()),
            twist=self._make('geometry_msgs/TwistWithCovariance', twist=twist,
                             covariance=twist_cov.ravel()))]

    def _fix(self, sample: GnssSample) -> list[Any]:
        header = self._header(sample.time_us, 'gps')
        fix = self._make(
            'sensor_msgs/NavSatFix', header=header,
            status=self._make('sensor_msgs/NavSatStatus', status=0, service=GPS_AND_ALL_ELSE),
            latitude=sample.lat, longitude=sample.lon, altitude=sample.alt,
            position_covariance=np.diag([sample.eph, sample.eph, sample.epv]).ravel() ** 2,
            position_covariance_type=DIAGONAL_KNOWN)
        if not sample.has_velocity:
            return [fix]
        twist = self._make(
            'geometry_msgs/Twist', linear=self._vector(swap_enu_ned(sample.velocity)),
            angular=self._vector(np.zeros(3)))
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = sample.sacc ** 2 * np.eye(3)
        covariance[3:, 3:] = 1e6 * np.eye(3)
        velocity = self._make(
            'geometry_msgs/TwistWithCovarianceStamped', header=header,
            twist=self._make('geometry_msgs/TwistWithCovariance', twist=twist,
                             covariance=covariance.ravel()))
        return [fix, velocity]

    def _magnetic_field(self, sample: MagSample) -> list[Any]:
        return [self._make(
            'sensor_msgs/MagneticField', header=self._header(sample.time_us, 'base_link'),
            magnetic_field=self._vector(TESLA_PER_GAUSS * swap_flu_frd(sample.field)),
            magnetic_field_covariance=np.zeros(9))]

    def _pressure(self, sample: BaroSample) -> list[Any]:
        return [self._make(
            'sensor_msgs/FluidPressure', header=self._header(sample.time_us, 'base_link'),
            fluid_pressure=pressure_at(sample.altitude), variance=0.0)]
