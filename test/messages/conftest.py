"""Messages as plain attributes, and the recordings beside the repository."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

SHARED_DATA = Path(__file__).resolve().parents[2] / '..' / 'shared' / 'data'


def diagonal(variances):
    """Return a row-major covariance."""
    return np.diag(np.array(variances, dtype=float)).ravel()


class Build:
    """Builds messages that decode; a test then spoils one field."""

    @staticmethod
    def header(frame_id='', sec=100, nanosec=250_000_000):
        return SimpleNamespace(
            stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=frame_id)

    @staticmethod
    def vector(x=0.0, y=0.0, z=0.0):
        return SimpleNamespace(x=x, y=y, z=z)

    @staticmethod
    def quaternion(w=1.0, x=0.0, y=0.0, z=0.0):
        return SimpleNamespace(w=w, x=x, y=y, z=z)

    def odometry(self, parent='odom', child='base_link', pose_var=(0.01,) * 6,
                 twist_var=(0.04,) * 6):
        pose = SimpleNamespace(position=self.vector(1.0, 2.0, 3.0), orientation=self.quaternion())
        twist = SimpleNamespace(linear=self.vector(0.5, -0.25, 0.125), angular=self.vector())
        return SimpleNamespace(
            header=self.header(parent), child_frame_id=child,
            pose=SimpleNamespace(pose=pose, covariance=diagonal(pose_var)),
            twist=SimpleNamespace(twist=twist, covariance=diagonal(twist_var)))

    def fix(self, kind=2, variances=(1.0, 4.0, 9.0)):
        return SimpleNamespace(
            header=self.header('gps'), status=SimpleNamespace(status=0, service=1),
            latitude=47.4, longitude=8.5, altitude=488.0,
            position_covariance=diagonal(variances), position_covariance_type=kind)

    def fix_velocity(self, variances=(0.09, 0.16, 0.25), frame_id='gps'):
        twist = SimpleNamespace(linear=self.vector(1.0, 2.0, 3.0), angular=self.vector())
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = np.diag(variances)
        return SimpleNamespace(
            header=self.header(frame_id),
            twist=SimpleNamespace(twist=twist, covariance=covariance.ravel()))

    def imu(self, frame_id='imu_link'):
        return SimpleNamespace(
            header=self.header(frame_id), orientation=self.quaternion(),
            orientation_covariance=np.zeros(9), angular_velocity=self.vector(0.1, 0.2, 0.3),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self.vector(1.0, 2.0, 9.8),
            linear_acceleration_covariance=np.zeros(9))

    def magnetic_field(self):
        return SimpleNamespace(
            header=self.header('base_link'), magnetic_field=self.vector(2e-5, -1e-5, -4e-5),
            magnetic_field_covariance=np.zeros(9))

    def pressure(self):
        return SimpleNamespace(
            header=self.header('base_link'), fluid_pressure=101325.0, variance=0.0)

    def range(self, distance=4.0):
        return SimpleNamespace(
            header=self.header('range_link'), radiation_type=1, field_of_view=0.05,
            min_range=0.2, max_range=20.0, range=distance, variance=0.0)

    def flow(self, x=0.5, y=-0.25, quality=0.8, frame_id='flow_frd', **stamp):
        return SimpleNamespace(
            header=self.header(frame_id, **stamp), vector=self.vector(x, y, quality))

    def airspeed(self, speed=20.0):
        message = self.fix_velocity(frame_id='base_link')
        message.twist.twist.linear = self.vector(speed)
        return message

    def aux_velocity(self, east=3.0, north=2.0, up=-0.5, frame_id='map'):
        message = self.fix_velocity(frame_id=frame_id)
        message.twist.twist.linear = self.vector(east, north, up)
        message.twist.covariance = diagonal((0.01, 0.04, 0.09, 1e6, 1e6, 1e6))
        return message

    def gps_heading(self, yaw=0.25, variance=1e-4):
        pose = SimpleNamespace(
            position=self.vector(),
            orientation=self.quaternion(w=math.cos(0.5 * yaw), z=math.sin(0.5 * yaw)))
        return SimpleNamespace(
            header=self.header('gps'), pose=SimpleNamespace(
                pose=pose, covariance=diagonal((0.0, 0.0, 0.0, 1e6, 1e6, variance))))


@pytest.fixture(scope='session')
def build():
    return Build()


@pytest.fixture
def recorded():
    """Return a function that reads the messages of one topic of a recording."""
    highlevel = pytest.importorskip('rosbags.highlevel')
    typesys = pytest.importorskip('rosbags.typesys')
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)

    def read(name, topic):
        path = SHARED_DATA / name / f'{name}_mcap'
        if not path.exists():
            pytest.skip(f'recording {name} is not beside the repository')
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            connections = [c for c in reader.connections if c.topic == topic]
            return [reader.deserialize(raw, connection.msgtype)
                    for connection, _, raw in reader.messages(connections)]

    read.folder = SHARED_DATA
    return read
