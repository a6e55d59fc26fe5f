"""Every measurement Jacobian of the core against numeric derivatives."""

from __future__ import annotations

import math

from hypothesis import assume
from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import conjugate
from oracles import covariance
from oracles import difference
from oracles import from_scipy
from oracles import quaternions
from oracles import sandwich
from oracles import seeds
from oracles import to_scipy
import pytest

from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import fuse_declination
from ekf_fusion_ros.ekf2.aid_sources.vision_body_velocity import fuse_body_velocity
from ekf_fusion_ros.ekf2.covariance import Covariance
from ekf_fusion_ros.ekf2.covariance import quat_by_rotation_vector
from ekf_fusion_ros.ekf2.covariance import rotation_vector_variances
from ekf_fusion_ros.ekf2.delayed_imu import DelayedImu
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.heading import HeadingFusion
from ekf_fusion_ros.ekf2.heading import mag_yaw
from ekf_fusion_ros.kernels.heading import yaw_gradient
from ekf_fusion_ros.kernels.navigation import attitude_error_jacobian
from ekf_fusion_ros.kernels.navigation import fill_pose_covariance
from ekf_fusion_ros.params.ekf2 import Ekf2Params

Rotation = pytest.importorskip('scipy.spatial.transform').Rotation
MANY = settings(deadline=None, max_examples=40)
SEQUENCES = {True: 'ZYX', False: 'ZXY'}


def scipy_rotation(q):
    return Rotation.from_quat(to_scipy(q))


def filter_at(q, seed):
    """A filter with an attitude, a field and a covariance that no limit touches."""
    f = Filter(Ekf2Params(), 12)
    f.x[0:4] = q
    f.x[4:7] = (3.0, -4.0, 1.0)
    f.x[16:19] = (0.21, 0.05, 0.43)
    f.rot = scipy_rotation(q).as_matrix()
    f.flags.wind = f.cov.mag_active = f.cov.wind_active = True
    f.cov.p[:] = covariance(seed)
    return f


def information(p, h, noise):
    """Return the covariance after a scalar observation."""
    return np.linalg.inv(np.linalg.inv(p) + np.outer(h, h) / noise)


# ---- yaw ----

def yaw_jacobian(q, sequence_321):
    """Return d(yaw)/d(q), (4,), None at the singularity."""
    jacobian = np.empty(4)
    return jacobian if yaw_gradient(q, sequence_321, jacobian) else None


@MANY
@given(q=quaternions())
@pytest.mark.parametrize('sequence_321', [True, False])
def test_yaw(sequence_321, q):
    rot = scipy_rotation(q).as_matrix()
    assume(abs(rot[2, 0 if sequence_321 else 1]) < 0.9)

    def yaw(s):
        angle = scipy_rotation(s).as_euler(SEQUENCES[sequence_321])[0]
        reference = scipy_rotation(q).as_euler(SEQUENCES[sequence_321])[0]
        return math.remainder(angle - reference, 2.0 * math.pi)

    np.testing.assert_allclose(yaw_jacobian(q, sequence_321), difference(yaw, q)[0], atol=1e-6)


@pytest.mark.parametrize(('sequence_321', 'axis'), [(True, 'Y'), (False, 'X')])
def test_yaw_has_no_gradient_at_its_singularity(sequence_321, axis):
    q = from_scipy(Rotation.from_euler(axis, 0.5 * math.pi).as_quat())
    assert yaw_jacobian(q, sequence_321) is None


@settings(deadline=None, max_examples=15)
@given(q=quaternions(), seed=seeds())
def test_fused_yaw_corrects_as_the_information_form(q, seed):
    f = filter_at(q, seed)
    before, p = f.x.copy(), f.cov.p.copy()
    heading = HeadingFusion(f)
    measured = heading.predicted_yaw() - 0.02
    h = np.zeros(24)
    h[0:4] = yaw_jacobian(q, abs(f.rot[2, 0]) < abs(f.rot[2, 1]))
    noise = 0.05
    heading.fuse_measured(measured, noise)
    expected = information(p, h, noise)
    gain = expected @ h / noise
    moved = before - 0.02 * gain
    moved[0:4] /= np.linalg.norm(moved[0:4])
    # The field is left out: yaw shall not be explained by it.
    used = [*range(16), 22, 23]
    np.testing.assert_allclose(f.x[used], moved[used], atol=1e-9)
    np.testing.assert_array_equal(f.x[16:22], before[16:22])
    np.testing.assert_allclose(f.cov.p[np.ix_(used, used)], expected[np.ix_(used, used)],
                               rtol=1e-6, atol=1e-9)


@MANY
@given(q=quaternions())
def test_magnetic_yaw_is_the_yaw_where_the_field_points_north(q):
    f = filter_at(q, 0)
    assume(np.hypot(f.rot[2, 0], f.rot[2, 1]) < 0.99)
    declination = 0.05
    north = np.array((math.cos(declination), math.sin(declination), 1.7))
    sequence = SEQUENCES[abs(f.rot[2, 0]) < abs(f.rot[2, 1])]
    expected = scipy_rotation(q).as_euler(sequence)[0]
    found = mag_yaw(f, f.rot.T @ north, declination)
    assert math.remainder(found - expected, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-7)


# ---- declination ----

@settings(deadline=None, max_examples=15)
@given(seed=seeds())
def test_declination(seed):
    f = filter_at(np.array((1.0, 0.0, 0.0, 0.0)), seed)
    p, sigma = f.cov.p.copy(), 0.2
    h = difference(lambda x: np.arctan2(x[17], x[16]), f.x)[0]
    before = math.atan2(f.x[17], f.x[16])
    fuse_declination(f, sigma)
    variance = h @ p @ h + sigma ** 2
    record = f.observations.declination
    assert record.variance[0] == pytest.approx(variance, rel=1e-8)
    assert record.innovation[0] == pytest.approx(before)
    np.testing.assert_allclose(f.cov.p, information(p, h, sigma ** 2), rtol=1e-5, atol=1e-8)


# ---- velocity in the body ----

def velocity_in_body(x):
    return sandwich(conjugate(x[0:4]), x[4:7])


@settings(deadline=None, max_examples=10)
@given(q=quaternions(), seed=seeds())
def test_fused_body_velocity_is_that_of_the_information_form(q, seed):
    f = filter_at(q, seed)
    p, x = f.cov.p.copy(), f.x.copy()
    noise = np.array((0.1, 0.2, 0.3))
    h = difference(velocity_in_body, x, 1e-2)
    expected = np.linalg.inv(np.linalg.inv(p) + h.T @ np.diag(1.0 / noise) @ h)
    fuse_body_velocity(f, f.observations.ev_hor_vel, f.observations.ev_ver_vel,
                       velocity_in_body(x), noise, 3.0)
    # Nothing was wrong, so that all three axes are fused about the same state.
    np.testing.assert_allclose(f.x, x, atol=1e-12)
    np.testing.assert_allclose(f.cov.p, expected, rtol=1e-6, atol=1e-9)


# ---- attitude errors ----

@MANY
@given(q=quaternions())
def test_quaternion_by_rotation_vector(q):
    vector = scipy_rotation(q).as_rotvec()
    assume(1e-3 < np.linalg.norm(vector) < 3.1)

    def quaternion(r):
        found = from_scipy(Rotation.from_rotvec(r).as_quat())
        return found if found[0] >= 0.0 else -found

    np.testing.assert_allclose(quat_by_rotation_vector(q), difference(quaternion, vector, 1e-6),
                               atol=1e-6)


def test_quaternion_by_rotation_vector_near_zero():
    expected = 0.5 * np.eye(4)[:, 1:4]
    for angle in (0.0, 1e-5, 1e-3):
        q = from_scipy(Rotation.from_rotvec((angle, 0.0, 0.0)).as_quat())
        np.testing.assert_allclose(quat_by_rotation_vector(q), expected, atol=1e-3)


@MANY
@given(q=quaternions(), seed=seeds())
def test_rotation_vector_variances(q, seed):
    p = covariance(seed)
    positive = q if q[0] >= 0.0 else -q
    assume(0.01 < positive[0] < 0.999)

    def vector(s):
        return 2.0 * math.acos(s[0]) / math.sqrt(1.0 - s[0] * s[0]) * s[1:4]

    sign = np.diag(np.where(q[0] < 0.0, -1.0, 1.0) * np.ones(4))
    jacobian = difference(vector, positive, 1e-6) @ sign
    np.testing.assert_allclose(rotation_vector_variances(q, p),
                               np.diag(jacobian @ p[0:4, 0:4] @ jacobian.T), rtol=1e-4)


def test_tilt_variances_survive_the_way_into_the_quaternion_and_back():
    q = from_scipy(Rotation.from_euler('ZYX', (0.3, 0.2, -0.4)).as_quat())
    cov = Covariance(Ekf2Params())
    cov.set_attitude(q, np.array((0.01, 0.02, 0.03)))
    np.testing.assert_allclose(rotation_vector_variances(q, cov.p), (0.01, 0.02, 0.03), rtol=1e-9)


@MANY
@given(q=quaternions())
def test_attitude_error(q):
    def error(s):
        return (scipy_rotation(s) * scipy_rotation(q).inv()).as_rotvec()

    np.testing.assert_allclose(attitude_error_jacobian(q), difference(error, q, 1e-6), atol=1e-6)


def pose_covariance(q, p):
    covariance = np.empty((6, 6))
    fill_pose_covariance(q, p, covariance)
    return covariance


@MANY
@given(q=quaternions())
def test_yaw_variance_is_about_the_vertical_of_the_earth(q):
    cov = Covariance(Ekf2Params())
    cov.add_yaw_variance(q, 0.04)
    expected = np.zeros((6, 6))
    expected[5, 5] = 0.04
    np.testing.assert_allclose(pose_covariance(q, cov.p), expected, atol=1e-12)


# ---- noise of the prediction ----

def predict(cov, x, clipping):
    """Predict P over a period in free fall without rotation."""
    period = DelayedImu(0, np.zeros(8), clipping)
    cov.predict(x, np.eye(3), period, np.zeros(3), 0.01, in_air=True, bad_accel=False)


def test_inertial_noise_reaches_attitude_and_velocity():
    """Noise of increments over one nominal period, from a state that is known exactly."""
    params = Ekf2Params()
    cov = Covariance(params)
    q = from_scipy(Rotation.from_euler('ZYX', (0.3, 0.2, -0.4)).as_quat())
    x = np.zeros(24)
    x[0:4] = q
    predict(cov, x, (False, False, False))
    attitude = pose_covariance(q, cov.p)[3:6, 3:6]
    np.testing.assert_allclose(attitude, (0.01 * 1.5e-2) ** 2 * np.eye(3), atol=1e-15)
    np.testing.assert_allclose(cov.p[4:7, 4:7], (0.01 * 0.35) ** 2 * np.eye(3), atol=1e-15)
    np.testing.assert_allclose(np.diag(cov.p)[10:13], (1e-4 * 1e-3) ** 2, rtol=1e-12)


def test_a_clipped_axis_is_noisy_in_its_own_direction():
    cov = Covariance(Ekf2Params())
    turn = Rotation.from_euler('ZYX', (0.3, 0.2, -0.4))
    x = np.zeros(24)
    x[0:4] = from_scipy(turn.as_quat())
    predict(cov, x, (False, True, False))
    own = turn.as_matrix().T @ cov.p[4:7, 4:7] @ turn.as_matrix()
    np.testing.assert_allclose(own, np.diag((0.0035, 0.049, 0.0035)) ** 2, atol=1e-15)
