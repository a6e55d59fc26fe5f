"""The mounting of sensors from fixed frames: paths through the tree, and what is left alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from ekf_fusion_ros.live.static_mounting import StaticMounting
from ekf_fusion_ros.live.static_tree import StaticTree
from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.live.tuning import Tuning
from ekf_fusion_ros.mathlib.rigid import Pose
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.session import FusionSession

ROLES = ('imu', 'odometry', 'fix', 'magnetic_field')


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Pose:
    return Pose(np.array((x, y, z)),
                np.array((math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))))


def test_the_tree_is_walked_up_and_down() -> None:
    """From the left wheel over the base to a camera on a mast, which looks to the left."""
    tree = StaticTree()
    tree.add('base_link', 'wheel', pose(y=0.5))
    tree.add('base_link', 'mast', pose(x=1.0))
    tree.add('mast', 'camera', pose(z=2.0, yaw=math.pi / 2))
    found = tree.pose('wheel', 'camera')
    assert found is not None
    np.testing.assert_allclose(found.position, (1.0, -0.5, 2.0), atol=1e-12)
    np.testing.assert_allclose(found.quaternion, pose(yaw=math.pi / 2).quaternion, atol=1e-12)
    back = tree.pose('camera', 'wheel')
    assert back is not None
    np.testing.assert_allclose(back.position, (0.5, 1.0, -2.0), atol=1e-12)
    assert tree.pose('base_link', 'elsewhere') is None


def finder(**values: Any) -> StaticMounting:
    changes = {name.replace('__', '.'): value for name, value in values.items()}
    return StaticMounting(with_overrides(Params(), changes), ROLES)


def test_each_role_is_placed_once_as_soon_as_the_tree_reaches_it() -> None:
    one = finder()
    assert one.wants('imu')
    one.note('imu', '/imu_link')
    one.note('magnetic_field', 'imu_link')
    assert one.pending and not one.wants('imu')
    assert one.changes() == {}
    one.tree.add('base_link', 'imu_link', pose(0.1, 0.2, 0.3, yaw=math.pi / 2))
    changes = one.changes()
    assert set(changes) == {
        'messages.imu.mount_xyz', 'messages.imu.mount_rpy', 'messages.magnetic_field.mount_rpy'}
    assert changes['messages.imu.mount_xyz'] == pytest.approx((0.1, 0.2, 0.3))
    assert changes['messages.imu.mount_rpy'] == pytest.approx((0.0, 0.0, math.pi / 2))
    assert not one.pending and one.changes() == {} and not one.wants('imu')


def test_sensors_at_the_origin_of_the_body_need_nothing() -> None:
    one = finder()
    one.note('odometry', 'base_link')
    one.note('fix', '')
    one.note('imu', 'imu_frd')
    assert not one.pending
    one.note('magnetic_field', 'mag')
    one.tree.add('base_link', 'mag', pose(x=0.4))
    assert one.changes() == {}
    assert not one.pending


def test_what_the_parameters_give_stays() -> None:
    one = finder(messages__imu__mount_xyz=(0.1, 0.0, 0.0), ekf2__gnss__position=(0.0, 0.0, -1.0))
    assert [role for role in (*ROLES, 'flow') if one.wants(role)] == ['odometry', 'magnetic_field']


def test_what_is_missing_is_said_once() -> None:
    one = finder()
    one.note('fix', 'gps')
    assert one.missing() == [
        "fix: /tf_static does not tie its frame 'gps' to 'base_link': it is taken to be mounted "
        'there; publish that, or set messages.fix.mount_*']
    assert one.missing() == []
    assert not one.pending


def test_the_session_takes_the_mounting() -> None:
    """FLU becomes FRD; a later change of a live parameter leaves it alone."""
    session = FusionSession(Params(), ('imu', 'fix'))
    switches = Switches(('imu', 'fix'), 'imu', enabled=True)
    tuning = Tuning(Params(), session, Steering(session, switches, 'map'))
    tuning.mount({'messages.fix.mount_xyz': (0.5, 0.25, 1.0)})
    assert [event.text for event in session.drain_events()] == [
        'mounting by /tf_static: messages.fix.mount_xyz = (0.5, 0.25, 1)']
    tuning.change({'ekf2.gnss.pos_gate': 4.0})
    assert session.params.ekf2.gnss.position == (0.5, -0.25, -1.0)
    lever = session.estimator.filter.gnss_lever  # type: ignore[attr-defined]
    np.testing.assert_array_equal(lever, (0.5, -0.25, -1.0))
