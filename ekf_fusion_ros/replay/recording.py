"""Samples written as a rosbag2 recording: ENU/FLU messages as drivers publish them."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterable
from collections.abc import Iterator
import math
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
from ekf_fusion_ros.frames import swap_yaw_enu_ned
from ekf_fusion_ros.geo.atmosphere import pressure_at
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]
TESLA_PER_GAUSS = 1e-4
DIAGONAL_KNOWN = 2
GPS_AND_ALL_ELSE = 15
UNMEASURED = 1e6
INFRARED = 1
BEST_FLOW = 255.0
SUFFIXES = {'fix_2': '_2', 'fix_3': '_3'}


def write_recording(path: Path, arrivals: Iterable[tuple[int, str, Sample]]) -> dict[str, int]:
    """Write samples to a new rosbag2 folder (MCAP); return the messages per topic.

    arrivals: log time in us, role, sample. The topics of a further receiver end as its role
    does, in _2 or _3; of other samples the type says the topic. Raises WriterError where the
    folder exists.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    messages = _Messages(store.types)
    counts: dict[str, int] = {}
    connections: dict[str, Any] = {}
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for time_us, role, sample in arrivals:
            for topic, message in messages.of(sample, SUFFIXES.get(role, '')):
                kind = message.__msgtype__
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
        self._of: dict[type, tuple[str, Callable[[Any], Any]]] = {
            ImuSample: ('/imu/data_raw', self._imu),
            VisionSample: ('/odom', self._odometry),
            GnssSample: ('/fix', self._fix),
            MagSample: ('/mag', self._magnetic_field),
            BaroSample: ('/pressure', self._pressure),
            RangeSample: ('/range', self._range),
            FlowSample: ('/flow', self._flow),
            AirspeedSample: ('/airspeed', self._airspeed),
            LandedSample: ('/landed', self._landed),
            ArmedSample: ('/armed', self._armed),
            AuxVelocitySample: ('/aux_velocity', self._aux_velocity),
        }

    def of(self, sample: Sample, suffix: str) -> Iterator[tuple[str, Any]]:
        """Yield topic, with a suffix, and message of a sample; a fix may have several."""
        if type(sample) not in self._of:
            raise TypeError(f'{type(sample).__name__} has no ROS message here')
        topic, make = self._of[type(sample)]
        yield topic + suffix, make(sample)
        if isinstance(sample, GnssSample) and sample.has_velocity:
            yield '/fix_velocity' + suffix, self._fix_velocity(sample)
        if isinstance(sample, GnssSample) and math.isfinite(sample.yaw):
            yield '/gps_heading' + suffix, self._gps_heading(sample)

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

    def _imu(self, sample: ImuSample) -> Any:
        rate = swap_flu_frd(sample.delta_angle) / sample.delta_angle_dt
        force = swap_flu_frd(sample.delta_velocity) / sample.delta_velocity_dt
        absent = np.zeros(9)
        absent[0] = -1.0
        return self._make(
            'sensor_msgs/Imu', header=self._header(sample.time_us, 'base_link'),
            orientation=self._quaternion(np.array([1.0, 0.0, 0.0, 0.0])),
            orientation_covariance=absent,
            angular_velocity=self._vector(rate), angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector(force), linear_acceleration_covariance=np.zeros(9))

    def _odometry(self, sample: VisionSample) -> Any:
        pose = self._pose(
            swap_enu_ned(sample.position), self._quaternion(swap_attitude(sample.quaternion)))
        # The signs of ENU drop out of a diagonal; those of FLU stay in the off-diagonal terms.
        var = sample.position_var
        flip = np.diag([1.0, -1.0, -1.0])
        pose_cov = np.diag([var[1], var[0], var[2]] + 3 * [sample.angular_var])
        return self._make(
            'nav_msgs/Odometry', header=self._header(sample.time_us, 'odom'),
            child_frame_id='base_link',
            pose=self._make('geometry_msgs/PoseWithCovariance', pose=pose,
                            covariance=pose_cov.ravel()),
            twist=self._twist(swap_flu_frd(sample.velocity), flip @ sample.velocity_cov @ flip))

    def _pose(self, position: Array, orientation: Any) -> Any:
        x, y, z = position.tolist()
        return self._make(
            'geometry_msgs/Pose', position=self._make('geometry_msgs/Point', x=x, y=y, z=z),
            orientation=orientation)

    def _twist(self, linear: Array, covariance: Array) -> Any:
        """Return a twist whose angular rate, by its variance, was not measured."""
        twist = self._make(
            'geometry_msgs/Twist', linear=self._vector(linear), angular=self._vector(np.zeros(3)))
        whole = np.zeros((6, 6))
        whole[:3, :3] = covariance
        whole[3:, 3:] = UNMEASURED * np.eye(3)
        return self._make(
            'geometry_msgs/TwistWithCovariance', twist=twist, covariance=whole.ravel())

    def _fix(self, sample: GnssSample) -> Any:
        return self._make(
            'sensor_msgs/NavSatFix', header=self._header(sample.time_us, 'gps'),
            status=self._make('sensor_msgs/NavSatStatus', status=0, service=GPS_AND_ALL_ELSE),
            latitude=sample.lat, longitude=sample.lon, altitude=sample.alt,
            position_covariance=np.diag([sample.eph, sample.eph, sample.epv]).ravel() ** 2,
            position_covariance_type=DIAGONAL_KNOWN)

    def _fix_velocity(self, sample: GnssSample) -> Any:
        return self._make(
            'geometry_msgs/TwistWithCovarianceStamped', header=self._header(sample.time_us, 'gps'),
            twist=self._twist(swap_enu_ned(sample.velocity), sample.sacc ** 2 * np.eye(3)))

    def _gps_heading(self, sample: GnssSample) -> Any:
        """Return the heading of the vehicle; neither place nor tilt are measured."""
        half = 0.5 * swap_yaw_enu_ned(sample.yaw)
        turn = self._quaternion(np.array([math.cos(half), 0.0, 0.0, math.sin(half)]))
        known = math.isfinite(sample.yaw_accuracy)
        variances = np.array(5 * [UNMEASURED] + [sample.yaw_accuracy ** 2 if known else 0.0])
        return self._make(
            'geometry_msgs/PoseWithCovarianceStamped', header=self._header(sample.time_us, 'gps'),
            pose=self._make('geometry_msgs/PoseWithCovariance', pose=self._pose(np.zeros(3), turn),
                            covariance=np.diag(variances).ravel()))

    def _magnetic_field(self, sample: MagSample) -> Any:
        return self._make(
            'sensor_msgs/MagneticField', header=self._header(sample.time_us, 'base_link'),
            magnetic_field=self._vector(TESLA_PER_GAUSS * swap_flu_frd(sample.field)),
            magnetic_field_covariance=np.zeros(9))

    def _pressure(self, sample: BaroSample) -> Any:
        return self._make(
            'sensor_msgs/FluidPressure', header=self._header(sample.time_us, 'base_link'),
            fluid_pressure=pressure_at(sample.altitude), variance=0.0)

    def _range(self, sample: RangeSample) -> Any:
        """Return a Range by REP-117: without a distance it is infinite, to the nearer side."""
        distance = sample.distance
        if sample.quality == 0:
            near = distance - sample.min_distance < sample.max_distance - distance
            distance = -math.inf if near else math.inf
        return self._make(
            'sensor_msgs/Range', header=self._header(sample.time_us, 'range_link'),
            radiation_type=INFRARED, field_of_view=0.05, min_range=sample.min_distance,
            max_range=sample.max_distance, range=distance, variance=0.0)

    def _flow(self, sample: FlowSample) -> Any:
        x, y = (sample.flow / sample.dt).tolist()
        return self._make(
            'geometry_msgs/Vector3Stamped', header=self._header(sample.time_us, 'flow_frd'),
            vector=self._vector(np.array((x, y, sample.quality / BEST_FLOW))))

    def _airspeed(self, sample: AirspeedSample) -> Any:
        """Return equivalent airspeed, which is all that a pitot tube knows."""
        speed = np.array((sample.true_airspeed / sample.eas2tas, 0.0, 0.0))
        return self._make(
            'geometry_msgs/TwistWithCovarianceStamped',
            header=self._header(sample.time_us, 'base_link'),
            twist=self._twist(speed, np.diag((0.0, UNMEASURED, UNMEASURED))))

    def _aux_velocity(self, sample: AuxVelocitySample) -> Any:
        variance = np.abs(swap_enu_ned(sample.variance))
        return self._make(
            'geometry_msgs/TwistWithCovarianceStamped',
            header=self._header(sample.time_us, 'base_link'),
            twist=self._twist(swap_enu_ned(sample.velocity), np.diag(variance)))

    def _landed(self, sample: LandedSample) -> Any:
        return self._make('std_msgs/Bool', data=sample.landed)

    def _armed(self, sample: ArmedSample) -> Any:
        return self._make('std_msgs/Bool', data=sample.armed)
