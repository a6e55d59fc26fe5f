"""Encoding: by hand, against scipy and pymap3d, and back through the decoder."""

from __future__ import annotations

import math
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.projection import make_projection
from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.encode import encode_fix
from ekf_fusion_ros.messages.encode import encode_gnss_odometry
from ekf_fusion_ros.messages.encode import encode_odometry
from ekf_fusion_ros.messages.stamps import seconds_nanoseconds
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import GnssSample

ORIGIN = GeoPoint(47.4, 8.5, 500.0)


def random_nav(seed, valid=True, origin=ORIGIN):
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    pose_root = rng.normal(size=(6, 6))
    velocity_root = rng.normal(size=(3, 3))
    return NavState(
        time_us=1_700_000_000_123_456, quaternion=quaternion / np.linalg.norm(quaternion),
        velocity=rng.normal(0, 5, 3), position=rng.normal(0, 500, 3),
        angular_rate=rng.normal(size=3), pose_cov=pose_root @ pose_root.T,
        velocity_cov=velocity_root @ velocity_root.T, gyro_bias=np.zeros(3),
        accel_bias=np.zeros(3), origin=origin, yaw_aligned=True, dead_reckoning=False,
        local_position_valid=True, global_position_valid=valid)


def as_message(fields):
    """Return the fields as a message, as a publisher would."""
    def vector(triple):
        return SimpleNamespace(x=triple[0], y=triple[1], z=triple[2])

    sec, nanosec = seconds_nanoseconds(fields.time_us)
    x, y, z, w = fields.orientation
    pose = SimpleNamespace(
        position=vector(fields.position), orientation=SimpleNamespace(x=x, y=y, z=z, w=w))
    twist = SimpleNamespace(linear=vector(fields.linear), angular=vector(fields.angular))
    return SimpleNamespace(
        header=SimpleNamespace(
            stamp=SimpleNamespace(sec=sec, nanosec=nanosec), frame_id=fields.frame_id),
        child_frame_id=fields.child_frame_id,
        pose=SimpleNamespace(pose=pose, covariance=fields.pose_covariance),
        twist=SimpleNamespace(twist=twist, covariance=fields.twist_covariance))


def test_odometry_by_hand():
    half = math.sqrt(0.5)
    # Nose to the east, 3 m/s east, climbing 1 m/s, turning right.
    nav = random_nav(0)
    nav = NavState(**{name: getattr(nav, name) for name in NavState._fields} | {
        'quaternion': np.array((half, 0.0, 0.0, half)), 'velocity': np.array((0.0, 3.0, -1.0)),
        'position': np.array((10.0, 20.0, -30.0)), 'angular_rate': np.array((0.1, 0.2, 0.3)),
        'velocity_cov': np.diag((1.0, 2.0, 3.0))})
    fields = encode_odometry(nav, 'map', 'base_link')
    assert fields.position == (20.0, 10.0, 30.0)
    assert np.abs(fields.orientation) == pytest.approx((0.0, 0.0, 0.0, 1.0))
    assert fields.linear == pytest.approx((3.0, 0.0, 1.0))
    assert fields.angular == (0.1, -0.2, -0.3)
    # Along the nose is east.
    assert np.diag(fields.twist_covariance.reshape(6, 6))[:3] == pytest.approx((2.0, 1.0, 3.0))
    assert (fields.frame_id, fields.child_frame_id) == ('map', 'base_link')


@given(st.integers(0, 2**32 - 1))
def test_decoding_gives_the_state_back(seed):
    nav = random_nav(seed)
    sample = decode_odometry(as_message(encode_odometry(nav, 'map', 'base_link')), MessageParams())
    assert sample.time_us == nav.time_us
    assert sample.position == pytest.approx(nav.position, abs=1e-12)
    assert abs(float(sample.quaternion @ nav.quaternion)) == pytest.approx(1.0, abs=1e-12)
    assert sample.position_var == pytest.approx(np.diag(nav.pose_cov)[:3], rel=1e-12)
    assert sample.angular_var == pytest.approx(nav.pose_cov[5, 5], rel=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_twist_is_in_the_body_like_scipy(seed):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    nav = random_nav(seed)
    fields = encode_odometry(nav, 'map', 'base_link')
    # Turn the twist back to the earth by the published attitude.
    attitude = rotation.from_quat(fields.orientation)
    north, east, down = nav.velocity
    assert attitude.apply(fields.linear) == pytest.approx((east, north, -down), abs=1e-12)
    matrix = attitude.as_matrix()
    swap = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    back = matrix @ fields.twist_covariance.reshape(6, 6)[:3, :3] @ matrix.T
    assert back == pytest.approx(swap @ nav.velocity_cov @ swap.T, abs=1e-10)


def test_pose_covariance_is_turned_as_a_whole():
    nav = random_nav(3)
    got = encode_odometry(nav, 'map', 'base_link').pose_covariance.reshape(6, 6)
    swap = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, -1.0)))
    block = np.kron(np.eye(2), swap)
    assert got == pytest.approx(block @ nav.pose_cov @ block.T, abs=1e-14)


@given(st.integers(0, 2**32 - 1))
def test_fix_is_where_pymap3d_says(seed):
    pymap3d = pytest.importorskip('pymap3d')
    nav = random_nav(seed)
    projection = make_projection('wgs84', ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    fields = encode_fix(nav, projection, 'base_link')
    assert fields.altitude == pytest.approx(500.0 - nav.position[2])
    # At the origin's altitude the plane is exact.
    east, north, _ = pymap3d.geodetic2enu(
        fields.latitude, fields.longitude, ORIGIN.alt, ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    assert (north, east) == pytest.approx(nav.position[:2], abs=1e-6)
    covariance = fields.position_covariance.reshape(3, 3)
    assert np.diag(covariance) == pytest.approx(np.diag(nav.pose_cov)[[1, 0, 2]])
    assert fields.position_covariance_type == 3


def test_fix_status_follows_validity():
    projection = make_projection('sphere', ORIGIN.lat, ORIGIN.lon)
    assert encode_fix(random_nav(1), projection, 'base_link').status == 0
    assert encode_fix(random_nav(1, valid=False), projection, 'base_link').status == -1
    with pytest.raises(ValueError, match='origin'):
        encode_fix(random_nav(1, origin=None), projection, 'base_link')


def test_gnss_odometry():
    projection = make_projection('wgs84', ORIGIN.lat, ORIGIN.lon, ORIGIN.alt)
    fix = GnssSample(5_000_000, 47.401, 8.5, 512.0, 1.5, 2.5)
    fields = encode_gnss_odometry(fix, ORIGIN, projection, 'map')
    east, north, up = fields.position
    assert north == pytest.approx(111.19, abs=0.02)
    assert (east, up) == (pytest.approx(0.0, abs=1e-9), 12.0)
    variances = np.diag(fields.pose_covariance.reshape(6, 6))
    assert variances.tolist() == [2.25, 2.25, 6.25, 1e6, 1e6, 1e6]
    without_height = GnssSample(5_000_000, 47.401, 8.5, math.nan, 1.5, 2.5)
    fields = encode_gnss_odometry(without_height, ORIGIN, projection, 'map')
    assert fields.position[2] == 0.0
    assert fields.pose_covariance[14] == 1e6
