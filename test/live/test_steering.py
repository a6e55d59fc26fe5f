"""What an operator asks: done and announced, or refused in one sentence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.live.steering import LOCAL
from ekf_fusion_ros.live.steering import NO_MAP
from ekf_fusion_ros.live.steering import NO_STATE
from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.session import FusionSession


class Bench:
    """A session, its switches and what steers them."""

    def __init__(self, *roles: str) -> None:
        self.session = FusionSession(Params(), roles)
        self.switches = Switches(roles, self.session.inertial_role, enabled=True)
        self.steering = Steering(self.session, self.switches, 'map')

    def told(self) -> list[str]:
        return [event.text for event in self.session.drain_events()]


@pytest.fixture
def bench() -> Bench:
    return Bench('odometry', 'fix')


def pose(frame: str = 'map') -> Any:
    return SimpleNamespace(
        header=SimpleNamespace(frame_id=frame), pose=SimpleNamespace(
            covariance=np.eye(6).ravel(), pose=SimpleNamespace(
                position=SimpleNamespace(x=0.0, y=0.0, z=0.0),
                orientation=SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0))))


def test_a_role_is_switched_and_that_is_announced_once(bench: Bench) -> None:
    assert bench.steering.switch('fix', False) == ''
    assert bench.steering.switch('fix', False) == ''
    assert bench.told() == ['fix is switched off on request']
    assert bench.steering.switches() == {'fix': False, 'odometry': True}
    refusal = bench.switches.refusal('fix')
    assert refusal is not None and refusal[0] == 'switched_off'
    assert bench.steering.switch('fix', True) == ''
    assert bench.told() == ['fix is switched on on request']


def test_what_cannot_be_switched_is_said(bench: Bench) -> None:
    assert 'carries the time of the filter' in bench.steering.switch('odometry', False)
    assert 'is not subscribed to' in bench.steering.switch('range', True)
    assert bench.told() == []


def test_the_fusion_is_disabled_and_enabled(bench: Bench) -> None:
    bench.steering.enable(True)
    assert bench.told() == []
    bench.steering.enable(False)
    assert not bench.steering.enabled
    assert bench.told() == ['the fusion is disabled on request']
    bench.steering.enable(True)
    assert bench.steering.enabled


def test_origin_is_set_or_refused(bench: Bench) -> None:
    assert 'is not a point of the earth' in bench.steering.set_origin(GeoPoint(91.0, 0.0, 0.0))
    assert bench.steering.set_origin(GeoPoint(47.0, 8.0, 400.0)) == ''
    assert bench.told() == [
        'origin of the map set on request: latitude 47.0, longitude 8.0, altitude 400.0']


def test_without_a_fix_there_is_no_place_on_the_earth() -> None:
    steering = Bench('odometry').steering
    assert steering.set_origin(GeoPoint(47.0, 8.0, 400.0)) == LOCAL
    with pytest.raises(ValueError, match='no fix takes part'):
        steering.point_of_map(0.0, 0.0, 0.0)


def test_a_pose_needs_a_state_and_the_right_frame(bench: Bench) -> None:
    assert bench.steering.set_pose(pose()) == NO_STATE
    assert "give it in 'map'" in bench.steering.set_pose(pose('odom'))


def test_home_is_set_or_refused(bench: Bench) -> None:
    assert bench.steering.set_home(GeoPoint(99.0, 8.0, 400.0)) == (
        'latitude 99.0, longitude 8.0, altitude 400.0 is not a point of the earth: give deg '
        'within -90 .. 90 and -180 .. 180, and m')
    assert bench.steering.set_home(None) == 'home cannot be here: there is no estimate yet'
    assert bench.steering.set_home(GeoPoint(47.0, 8.0, 400.0)) == ''


def test_points_need_a_map(bench: Bench) -> None:
    with pytest.raises(ValueError, match=NO_MAP):
        bench.steering.point_of_map(0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match=NO_MAP):
        bench.steering.map_of_point(GeoPoint(47.0, 8.0, 400.0))


def test_reset_is_announced(bench: Bench) -> None:
    assert bench.steering.reset() == ''
    assert bench.session.resets()['restarts'] == 1
    assert any('starts again on request' in text for text in bench.told())
