"""Trajectories: derivatives against finite differences, attitude against physics."""

import numpy as np
import pytest

from ekf_fusion_ros.simulation.trajectory import GRAVITY
from ekf_fusion_ros.simulation.trajectory import Circle
from ekf_fusion_ros.simulation.trajectory import Drive
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.trajectory import Hover

H = 1e-4
TRAJECTORIES = [
    Hover(duration=20.0, heading=1.0),
    Circle(duration=60.0),
    FigureOfEight(duration=90.0, turn=0.7, climb=4.0),
    Drive(duration=120.0, stops=((40.0, 55.0),)),
    Flight(duration=150.0),
]


@pytest.fixture(params=TRAJECTORIES, ids=lambda t: type(t).__name__)
def trajectory(request):
    return request.param


@pytest.fixture
def instants(trajectory):
    return np.linspace(0.0, trajectory.duration, 1501)


def central(trajectory, instants, name):
    after = getattr(trajectory.motion(instants + H), name)
    before = getattr(trajectory.motion(instants - H), name)
    return (after - before) / (2.0 * H)


@pytest.mark.parametrize(('integral', 'name'), [
    ('position', 'velocity'), ('velocity', 'acceleration'), ('rate', 'rate_derivative')])
def test_derivatives(trajectory, instants, integral, name):
    exact = getattr(trajectory.motion(instants), name)
    np.testing.assert_allclose(central(trajectory, instants, integral), exact, atol=1e-7)


def test_rate_turns_the_attitude(trajectory, instants):
    motion = trajectory.motion(instants)
    slope = central(trajectory, instants, 'rotation')
    turned = np.einsum('nij,njk->nik', motion.rotation, np.array([cross(w) for w in motion.rate]))
    np.testing.assert_allclose(slope, turned, atol=1e-7)


def cross(w):
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def test_acceleration_is_smooth(trajectory):
    t = np.arange(0.0, trajectory.duration, 0.01)
    steps = np.abs(np.diff(trajectory.motion(t).acceleration, axis=0))
    assert steps.max() < 0.03


def test_quaternion_is_the_rotation(trajectory, instants):
    transform = pytest.importorskip('scipy.spatial.transform')
    motion = trajectory.motion(instants)
    oracle = transform.Rotation.from_matrix(motion.rotation).as_quat()[:, [3, 0, 1, 2]]
    same = np.abs(np.sum(oracle * motion.quaternion, axis=1))
    np.testing.assert_allclose(same, 1.0, atol=1e-12)


def test_multirotor_feels_force_along_its_thrust():
    motion = FigureOfEight(duration=90.0, climb=4.0).motion(np.linspace(0.0, 90.0, 500))
    force = motion.specific_force
    np.testing.assert_allclose(force[:, :2], 0.0, atol=1e-9)
    assert np.all(force[:, 2] < -0.8 * GRAVITY)
    tilt = np.arccos(motion.rotation[:, 2, 2])
    assert tilt.max() > np.radians(5.0)


def test_drive_is_level_and_never_slips():
    motion = Drive(duration=120.0, stops=((40.0, 55.0),)).motion(np.linspace(0.0, 120.0, 1000))
    np.testing.assert_allclose(motion.rotation[:, 2, 2], 1.0, atol=1e-12)
    np.testing.assert_allclose(motion.to_body(motion.velocity)[:, 1], 0.0, atol=1e-9)


def test_drive_stops_where_told():
    drive = Drive(duration=120.0, blend=5.0, stops=((40.0, 55.0),))
    speed = np.linalg.norm(drive.motion(np.array([39.0, 45.5, 54.5, 61.0])).velocity, axis=1)
    assert speed[0] > 1.0
    assert speed[3] > 1.0
    np.testing.assert_allclose(speed[1:3], 0.0, atol=1e-9)


def test_circle_keeps_radius_and_speed():
    motion = Circle(duration=60.0, radius=20.0, speed=5.0).motion(np.linspace(20.0, 60.0, 400))
    centre = np.array([0.0, 20.0])
    radius = np.linalg.norm(motion.position[:, :2] - centre, axis=1)
    np.testing.assert_allclose(radius, 20.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(motion.velocity, axis=1), 5.0, atol=1e-9)
    inward = np.linalg.norm(motion.acceleration, axis=1)
    np.testing.assert_allclose(inward, 5.0 ** 2 / 20.0, atol=1e-9)


def test_flight_rests_climbs_and_lands_at_rest():
    flight = Flight(duration=150.0, height=12.0)
    motion = flight.motion(np.array([0.0, 11.0, 80.0, 149.0]))
    np.testing.assert_allclose(motion.position[[0, 1, 3], 2], 0.0, atol=1e-9)
    assert motion.position[2, 2] == pytest.approx(-12.0)
    np.testing.assert_allclose(motion.velocity[[0, 1, 3]], 0.0, atol=1e-9)


def test_lever_arm_moves_as_its_own_position_does():
    arm = np.array([0.5, -0.3, 0.2])
    circle = Circle(duration=60.0)
    t = np.linspace(1.0, 59.0, 300)
    point = circle.motion(t).at_point(arm)
    before, after = (circle.motion(t + s * H).at_point(arm) for s in (-1.0, 1.0))
    np.testing.assert_allclose(
        (after.position - before.position) / (2.0 * H), point.velocity, atol=1e-7)
    np.testing.assert_allclose(
        (after.velocity - before.velocity) / (2.0 * H), point.acceleration, atol=1e-7)
