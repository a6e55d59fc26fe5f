"""The output predictor: an exact strapdown, and an error that dies out."""

from __future__ import annotations

from hypothesis import given
from hypothesis import settings
import numpy as np
from oracles import from_scipy
from oracles import quaternions
from oracles import to_scipy
from oracles import vectors
import pytest

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.output_predictor import OutputPredictor
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.kernels.inertial import INERTIAL
from ekf_fusion_ros.kernels.output import attitude_error
from ekf_fusion_ros.kernels.output import propagate_output
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import OutputParams

DT = 0.005


@settings(deadline=None, max_examples=25)
@given(q=quaternions(), angle=vectors(3, 0.2), bias=vectors(3, 1e-3), correction=vectors(3, 1e-3))
def test_attitude_turns_by_increment_less_bias_plus_correction(q, angle, bias, correction):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    before = rotation.from_quat(to_scipy(q))
    out, rot, x = np.zeros(10), before.as_matrix(), np.zeros(24)
    yaw, rate = np.zeros(2), np.zeros(3)
    out[0:4], x[10:13] = q, bias
    propagate_output(out, rot, angle, np.zeros(3), DT, DT, x, 0.5, correction, yaw, rate,
                     np.zeros(3))
    step = angle - 0.5 * bias + correction
    expected = before * rotation.from_rotvec(step)
    np.testing.assert_allclose(rot, expected.as_matrix(), atol=1e-9)
    assert yaw[0] == pytest.approx(before.apply(step)[2], abs=1e-12)
    np.testing.assert_allclose(rate, angle / DT, atol=1e-9)


def test_free_fall():
    out, rot, acceleration = np.zeros(10), np.eye(3), np.zeros(3)
    out[0], out[4] = 1.0, 3.0
    for _ in range(400):
        propagate_output(out, rot, np.zeros(3), np.zeros(3), DT, DT, np.zeros(24), 0.5,
                         np.zeros(3), np.zeros(2), np.zeros(3), acceleration)
    np.testing.assert_allclose(acceleration, (0.0, 0.0, 9.80665))
    np.testing.assert_allclose(out[4:10], (3.0, 0.0, 2.0 * 9.80665, 6.0, 0.0, 2.0 * 9.80665))


@settings(deadline=None, max_examples=25)
@given(q=quaternions(), error=vectors(3, 0.02))
def test_attitude_error_takes_the_output_to_the_filter(q, error):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    filtered = rotation.from_quat(to_scipy(q)) * rotation.from_rotvec(error)
    found = attitude_error(from_scipy(filtered.as_quat()), q)
    np.testing.assert_allclose(found, error, atol=1e-5)


def test_an_error_of_the_output_dies_out_with_the_time_constants():
    params = OutputParams(vel_tau=0.25, pos_tau=0.25)
    predictor, f, bank = OutputPredictor(params, 12), Filter(Ekf2Params(), 12), YawEstimator()
    x, f.dt_avg = f.x, 2.0 * DT
    predictor.align(x)
    predictor.now[4:10] = (1.0, -1.0, 0.5, 2.0, -3.0, 1.0)
    predictor.now[0:4] = (np.cos(0.05), 0.0, 0.0, np.sin(0.05))
    at_rest = np.zeros(1, INERTIAL)
    at_rest[0]['raw'] = 0.0, 0.0, 0.0, 0.0, 0.0, -9.80665 * DT, DT, DT
    at_rest[0]['mean_dt'] = DT
    sizes = []
    for k in range(4000):
        if k % 2 == 0:
            predictor.propagate(at_rest, x, 2.0 * DT)
        else:
            predictor.finish_period(at_rest, f, 0.11, bank, 0.0)
            sizes.append(np.abs(predictor.now[4:10]).max())
    # a second, four time constants, after the delay has passed
    assert sizes[111] < 0.2 * sizes[11]
    np.testing.assert_allclose(predictor.now[4:10], 0.0, atol=5e-3)
    assert abs(predictor.now[3]) < 1e-4
    assert predictor.tracking_error.max() < 1e-2


def test_position_and_velocity_of_the_body_origin():
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    predictor = OutputPredictor(OutputParams(), 12)
    turn = rotation.from_euler('ZYX', (1.0, 0.2, -0.3))
    predictor.rot = turn.as_matrix()
    predictor.now[4:10] = (1.0, 2.0, 3.0, 10.0, 20.0, 30.0)
    predictor.rate[:] = (0.0, 0.0, 2.0)
    arm = np.array((0.5, 0.0, 0.1))
    np.testing.assert_allclose(
        predictor.position_at_origin(arm), (10.0, 20.0, 30.0) - turn.apply(arm))
    np.testing.assert_allclose(
        predictor.velocity_at_origin(arm), (1.0, 2.0, 3.0) - turn.apply((0.0, 1.0, 0.0)))
