"""Messages as plain attributes and an estimator that only records what it is given."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample


class RecordingEstimator:
    """Keeps every sample in order; steps with every IMU sample; origin at the first fix."""

    def __init__(self):
        self.resets = 0
        self.samples = []
        self.poses = []
        self.forget()

    def forget(self):
        self.now_us = None
        self.origin = None
        self.yaw_aligned = True

    def push(self, sample):
        self.samples.append(sample)
        if isinstance(sample, GnssSample) and self.origin is None:
            self.origin = GeoPoint(sample.lat, sample.lon, sample.alt)
        if isinstance(sample, ImuSample):
            self.now_us = sample.time_us

    def update(self):
        return True

    def nav_state(self):
        if self.now_us is None:
            return None
        return NavState(
            self.now_us, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.zeros(3), np.zeros(3),
            np.eye(6), np.eye(3), np.zeros(3), np.zeros(3), self.origin, self.yaw_aligned,
            dead_reckoning=False, local_position_valid=True, global_position_valid=True)

    def aid_statuses(self):
        return []

    def passed_over(self):
        return {}

    def reset_counts(self):
        return {'attitude': 2}

    def drain_events(self):
        return [Event(0, 'reset')] if self.resets == 1 else []

    def health(self):
        return Health(HealthLevel.OK, 'fusing', {})

    def set_origin(self, origin):
        self.origin = origin
        return True

    def adopt(self, params):
        self.params = params

    def set_pose(self, pose):
        self.poses.append(pose)
        return True

    def reset(self):
        self.resets += 1
        self.forget()

    def of(self, kind):
        return [sample for sample in self.samples if isinstance(sample, kind)]


class Build:
    """Builds good messages at a time in seconds; a test may spoil a field."""

    @staticmethod
    def header(t, frame_id=''):
        time_us = round(1e6 * t)
        stamp = SimpleNamespace(sec=time_us // 1_000_000, nanosec=time_us % 1_000_000 * 1000)
        return SimpleNamespace(stamp=stamp, frame_id=frame_id)

    @staticmethod
    def vector(x=0.0, y=0.0, z=0.0):
        return SimpleNamespace(x=x, y=y, z=z)

    def imu(self, t):
        return SimpleNamespace(
            header=self.header(t), orientation=SimpleNamespace(w=1.0, x=0.0, y=0.0, z=0.0),
            orientation_covariance=np.array([-1.0] + 8 * [0.0]), angular_velocity=self.vector(),
            angular_velocity_covariance=np.zeros(9), linear_acceleration=self.vector(z=9.81),
            linear_acceleration_covariance=np.zeros(9))

    def fix(self, t, lat=47.0):
        return SimpleNamespace(
            header=self.header(t), status=SimpleNamespace(status=0, service=1), latitude=lat,
            longitude=8.0, altitude=500.0, position_covariance=np.diag([1.0, 1.0, 4.0]).ravel(),
            position_covariance_type=2)

    def fix_velocity(self, t, east=0.0):
        return SimpleNamespace(
            header=self.header(t), twist=SimpleNamespace(
                twist=SimpleNamespace(linear=self.vector(east, 2.0, 0.0), angular=self.vector()),
                covariance=0.04 * np.eye(6).ravel()))

    def magnetic_field(self, t):
        return SimpleNamespace(
            header=self.header(t), magnetic_field=self.vector(2e-5, 0.0, -4e-5),
            magnetic_field_covariance=np.zeros(9))

    def pressure(self, t):
        return SimpleNamespace(header=self.header(t), fluid_pressure=95000.0, variance=0.0)

    def range(self, t, distance=4.0):
        return SimpleNamespace(
            header=self.header(t), radiation_type=1, field_of_view=0.05, min_range=0.2,
            max_range=20.0, range=distance, variance=0.0)

    def flow(self, t, x=0.5):
        return SimpleNamespace(header=self.header(t, 'flow_frd'), vector=self.vector(x, 0.0, 1.0))

    def airspeed(self, t, speed=20.0):
        message = self.fix_velocity(t)
        message.twist.twist.linear = self.vector(speed)
        return message

    def aux_velocity(self, t, east=0.0):
        return self.fix_velocity(t, east)

    @staticmethod
    def landed(landed=True):
        return SimpleNamespace(data=landed)

    @staticmethod
    def armed(armed=True):
        return SimpleNamespace(data=armed)

    def gps_heading(self, t, yaw=0.25):
        orientation = SimpleNamespace(
            w=math.cos(0.5 * yaw), x=0.0, y=0.0, z=math.sin(0.5 * yaw))
        return SimpleNamespace(
            header=self.header(t), pose=SimpleNamespace(
                pose=SimpleNamespace(position=self.vector(), orientation=orientation),
                covariance=1e-4 * np.eye(6).ravel()))

    def odometry(self, t, x=0.0):
        return SimpleNamespace(
            header=self.header(t, 'odom'), child_frame_id='base_link',
            pose=SimpleNamespace(
                pose=SimpleNamespace(
                    position=self.vector(x), orientation=SimpleNamespace(
                        w=1.0, x=0.0, y=0.0, z=0.0)),
                covariance=0.01 * np.eye(6).ravel()),
            twist=SimpleNamespace(
                twist=SimpleNamespace(linear=self.vector(1.0), angular=self.vector()),
                covariance=0.01 * np.eye(6).ravel()))


@pytest.fixture(scope='session')
def build():
    return Build()


@pytest.fixture
def estimator():
    return RecordingEstimator()
