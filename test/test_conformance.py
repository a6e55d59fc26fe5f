"""What every estimator owes a session, asked of each of them in the same way."""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np
import pytest

from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params.tree import ESTIMATORS
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.params.tree import with_overrides
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Hover

ROLES = ('imu', 'fix', 'magnetic_field', 'pressure', 'landed')
REST = Hover(duration=30.0)
ASIDE = np.array((2.0, 0.0, 0.0))
EIGHT = FigureOfEight(duration=90.0)

pytestmark = pytest.mark.parametrize('name', ESTIMATORS)


class Run:
    """A session over a scenario; `change` may spoil or drop (None) a sample."""

    def __init__(self, name, trajectory, *, seed=1, change=lambda sample, t: sample, **sensors):
        built = {**default_sensors(ROLES), **sensors}
        # Stamped by the default delay of both estimators after the measurement.
        built['fix'] = replace(built['fix'], stamp_delay=0.11)
        self.scenario = Scenario(trajectory=trajectory, sensors=built, seed=seed)
        self.session = FusionSession(with_overrides(Params(), {'estimator': name}), set(ROLES))
        self.outputs = []
        self._change = change
        for arrival in self.scenario.arrivals():
            self.push(arrival.sample)

    def push(self, sample):
        t = 1e-6 * (sample.time_us - self.scenario.start_us)
        sample = self._change(sample, t)
        if sample is not None:
            self.outputs += self.session.push(sample)

    @property
    def nav(self):
        return self.session.estimator.nav_state()

    def after(self, start, end=math.inf):
        begin = self.scenario.start_us
        return [o.nav for o in self.outputs if start <= 1e-6 * (o.nav.time_us - begin) < end]

    def errors(self, start, end=math.inf):
        """Return errors of position and velocity (N, 3) NED against the truth."""
        navs = self.after(start, end)
        times = 1e-6 * (np.array([nav.time_us for nav in navs]) - self.scenario.start_us)
        truth = self.scenario.trajectory.motion(times)
        origin = self.place(navs[-1].origin)
        return (np.array([nav.position for nav in navs]) + origin - truth.position,
                np.array([nav.velocity for nav in navs]) - truth.velocity)

    @staticmethod
    def place(origin):
        east, north, up = LocalTangent(ORIGIN.lat, ORIGIN.lon, ORIGIN.alt).to_enu(
            origin.lat, origin.lon, origin.alt)
        return np.array((north, east, -up))


def horizontal_rms(error):
    return float(np.sqrt(np.mean(np.sum(error[:, :2] ** 2, axis=1))))


def test_nothing_is_told_before_there_is_anything(name):
    session = FusionSession(with_overrides(Params(), {'estimator': name}), set(ROLES))
    estimator = session.estimator
    assert estimator.nav_state() is None
    assert estimator.update() is False
    assert list(estimator.aid_statuses()) == []
    assert estimator.health().level is HealthLevel.WARN
    assert not estimator.set_pose(GivenPose(np.zeros(3), np.ones(3), 0.0, 0.1))


def test_rest_stays_at_rest(name):
    run = Run(name, REST)
    position, velocity = run.errors(20.0)
    # no more than the error of a single fix
    assert horizontal_rms(position) < math.hypot(1.2, 0.5) * math.sqrt(2.0)
    assert np.abs(velocity).max() < 0.3
    nav = run.nav
    assert nav.yaw_aligned
    assert nav.gnss_started
    assert nav.local_position_valid
    assert nav.global_position_valid
    assert not nav.dead_reckoning
    assert np.linalg.norm(nav.quaternion) == pytest.approx(1.0)
    assert np.linalg.norm(nav.angular_rate) < 0.1
    assert np.linalg.norm(nav.acceleration) < 0.5


def test_covariances_are_symmetric_and_positive(name):
    nav = Run(name, REST).nav
    for covariance in (nav.pose_cov, nav.velocity_cov):
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-9)
        assert np.linalg.eigvalsh(covariance).min() > 0.0


@pytest.mark.slow
def test_the_truth_is_followed_and_the_error_as_large_as_stated(name):
    run = Run(name, EIGHT)
    position, velocity = run.errors(45.0)
    assert horizontal_rms(position) < 1.5
    assert horizontal_rms(velocity) < 0.6
    assert run.session.health().level is HealthLevel.OK
    sigma = math.sqrt(run.nav.pose_cov[0, 0] + run.nav.pose_cov[1, 1])
    assert 0.1 < sigma < 3.0
    fused = {status.name: status.fused for status in run.session.estimator.aid_statuses()}
    assert any(count > 100 for aid, count in fused.items() if aid.startswith('gnss'))


@pytest.mark.slow
def test_a_gap_of_the_fixes_is_told_and_survived(name):
    fix = replace(default_sensors(ROLES)['fix'], outages=((50.0, 65.0),))
    run = Run(name, EIGHT, fix=fix)
    grown = math.sqrt(run.after(64.5, 65.0)[-1].pose_cov[0, 0])
    assert grown > math.sqrt(run.after(49.0, 50.0)[-1].pose_cov[0, 0])
    assert any('gnss' in event.text.lower() for event in run.session.drain_events())
    position, _ = run.errors(75.0)
    assert horizontal_rms(position) < 1.5


@pytest.mark.slow
def test_a_gap_of_the_imu_is_survived(name):
    def without(sample, t):
        return None if isinstance(sample, ImuSample) and 50.0 <= t < 51.0 else sample

    position, _ = Run(name, EIGHT, change=without).errors(70.0)
    assert horizontal_rms(position) < 2.0


def test_backward_stamps_are_refused_and_harmless(name):
    run = Run(name, REST)
    before = run.nav
    for sample_us in (before.time_us, before.time_us - 4000):
        run.push(ImuSample(sample_us, np.ones(3), np.ones(3), 0.004, 0.004))
    after = run.nav
    assert after.time_us == before.time_us
    np.testing.assert_array_equal(after.position, before.position)
    assert sum(run.session.statistics()['imu'].refused.values()) == 2


@pytest.mark.parametrize('value', [-1.0, math.nan, math.inf])
def test_fixes_of_bad_covariance_change_nothing(name, value):
    def spoilt(sample, t):
        bad = isinstance(sample, GnssSample) and t > 20.0
        return sample._replace(eph=value, lat=sample.lat + 1.0) if bad else sample

    run = Run(name, REST, change=spoilt)
    position, _ = run.errors(20.0, 24.0)
    assert np.abs(position[:, :2]).max() < 3.0
    assert run.session.statistics()['fix'].refused_total > 40


def test_a_reset_forgets_and_begins_again(name):
    run = Run(name, REST)
    estimator = run.session.estimator
    estimator.reset()
    assert estimator.nav_state() is None
    assert list(estimator.aid_statuses()) == []
    assert not any(estimator.reset_counts().values())


def test_the_same_input_gives_the_same_output(name):
    first, second = Run(name, Hover(duration=15.0)), Run(name, Hover(duration=15.0))
    np.testing.assert_array_equal(first.nav.position, second.nav.position)
    np.testing.assert_array_equal(first.nav.pose_cov, second.nav.pose_cov)


def test_the_origin_moves_under_a_vehicle_that_stays(name):
    run = Run(name, REST)
    estimator = run.session.estimator
    before = run.nav
    tangent = LocalTangent(before.origin.lat, before.origin.lon, before.origin.alt)
    lat, lon, _ = tangent.to_geodetic(40.0, -30.0, 0.0)
    moved = GeoPoint(lat, lon, before.origin.alt + 12.0)
    assert estimator.set_origin(moved)
    after = run.nav
    assert after.origin == moved
    np.testing.assert_allclose(
        after.position, before.position + np.array((30.0, -40.0, 12.0)), atol=0.02)
    assert not estimator.set_origin(GeoPoint(95.0, 0.0, 0.0))


def test_after_the_origin_has_moved_the_sensors_agree_with_it(name):
    run = Run(name, REST)
    origin = run.nav.origin
    run.session.estimator.set_origin(replace(origin, alt=origin.alt + 50.0))
    before = run.nav.position
    again = Scenario(trajectory=REST, sensors=run.scenario.sensors, seed=2,
                     start_us=run.scenario.start_us + 30_100_000)
    for arrival in again.arrivals():
        run.session.estimator.push(arrival.sample)
        run.session.estimator.update()
    assert np.abs(run.nav.position - before).max() < 3.0
    assert all(abs(status.test_ratio) < 1.0 for status in run.session.estimator.aid_statuses())


def test_a_pose_that_is_given_is_taken(name):
    run = Run(name, REST)
    before = run.nav
    yaw = yaw_of(matrix_from_quat(before.quaternion)) + 0.3
    pose = GivenPose(before.position + ASIDE, np.array((0.04, 0.04, 0.0)), yaw, 0.01)
    assert run.session.estimator.set_pose(pose)
    after = run.nav
    np.testing.assert_allclose(after.position, before.position + ASIDE, atol=0.05)
    assert yaw_of(matrix_from_quat(after.quaternion)) == pytest.approx(yaw, abs=0.02)
    assert after.yaw_jump - before.yaw_jump == pytest.approx(0.3, abs=0.02)
    assert after.pose_cov[0, 0] == pytest.approx(0.04, rel=0.2)
