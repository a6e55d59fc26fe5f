"""Heading of the odometry frame from motion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.motion_heading import MotionHeading
from ekf_fusion_ros.params.two_topic import TwoTopicParams
from ekf_fusion_ros.samples import NAN4
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import VisionSample

LAT, LON = 42.0, -71.0
FIX_PERIOD = 0.4


def fixes_of(track):
    """Return (lat, lon) of a track north + i east by the WGS84 ellipsoid (oracle pymap3d)."""
    pymap3d = pytest.importorskip('pymap3d')
    lat, lon, _ = pymap3d.enu2geodetic(track.imag, track.real, 0.0 * track.real, LAT, LON, 0.0)
    return np.stack([lat, lon], axis=1)


def markov(rng, times, sigma, tau):
    noise = np.zeros(len(times), complex)
    keep = math.exp(-(times[1] - times[0]) / tau)
    noise[0] = sigma * complex(*rng.normal(size=2))
    for k in range(1, len(times)):
        step = sigma * math.sqrt(1 - keep * keep) * complex(*rng.normal(size=2))
        noise[k] = keep * noise[k - 1] + step
    return noise


def drive(heading, yaw, duration, *, speed=1.0, eph=1.0, error=None, scale=1.0, held=None):
    """Drive along a gentle curve; return the headings announced.

    v_ned = exp(i yaw) v_odometry; error(times) is added to the fixes.
    """
    times = np.arange(0.0, duration, 0.1)
    direction = np.exp(1j * 0.3 * np.sin(times / 10.0))
    track = np.concatenate([[0.0], np.cumsum(0.1 * speed * direction[1:])])
    step = round(FIX_PERIOD / 0.1)
    seen = scale * track[::step] * np.exp(1j * yaw)
    if error is not None:
        seen = seen + error(times[::step])
    places = fixes_of(seen)
    announced = []
    for k, time in enumerate(times):
        stamp = round(1e6 * time)
        heading.push_odometry(
            VisionSample(stamp, np.array((track[k].real, track[k].imag, 0.0)), NAN4))
        if k % step == 0:
            lat, lon = places[k // step]
            found = heading.push_fix(GnssSample(stamp, lat, lon, 0.0, eph, 1.0), lambda: held)
            if found is not None:
                announced.append(found)
    return announced


def apart(a, b):
    return abs(math.remainder(a - b, 2 * math.pi))


@pytest.mark.parametrize('yaw', [-3.0, -1.2, 0.0, 0.7, 2.9])
def test_a_drive_without_errors_gives_the_heading(yaw):
    announced = drive(MotionHeading(TwoTopicParams()), yaw, 60.0)
    assert announced
    for heading in announced:
        assert apart(heading.yaw, yaw) < 1e-3
        assert 0.0 < heading.variance < 0.2 ** 2


def test_standing_still_announces_nothing_whatever_the_fixes_do():
    rng = np.random.default_rng(5)
    heading = MotionHeading(TwoTopicParams())
    assert not drive(heading, 1.0, 200.0, speed=0.0, error=lambda t: markov(rng, t, 2.5, 30.0))
    assert heading.status().path == 0.0
    assert 'aligning yaw from motion' in heading.status().text


def test_a_drive_shorter_than_the_errors_of_the_fixes_announces_nothing():
    heading = MotionHeading(TwoTopicParams())
    assert not drive(heading, 1.0, 10.0, speed=0.4)
    status = heading.status()
    assert status.sigma > 0.2
    assert status.path == pytest.approx(4.0, abs=1.0)


@pytest.mark.parametrize('scale', [2.0, 0.3])
def test_fixes_that_move_another_distance_announce_nothing(scale):
    heading = MotionHeading(TwoTopicParams())
    assert not drive(heading, 1.0, 60.0, scale=scale)
    assert 'times as far as the odometry' in heading.status().text


def test_sigma_is_honest_when_fixes_err_for_long():
    normalised = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        yaw = rng.uniform(-math.pi, math.pi)
        found = drive(
            MotionHeading(TwoTopicParams()), yaw, 40.0,
            error=lambda t, rng=rng: markov(rng, t, 1.5, 30.0) + markov(rng, t, 1.0, 0.1))
        normalised += [apart(h.yaw, yaw) / math.sqrt(h.variance) for h in found]
    assert len(normalised) >= 60
    assert 0.4 < np.sqrt(np.mean(np.square(normalised))) < 1.5
    assert np.mean(np.array(normalised) > 3.0) < 0.03


def test_more_fixes_of_a_standing_error_do_not_make_it_certain():
    """Ten times the rate must not tell ten times as much: errors last."""
    slow, fast = MotionHeading(TwoTopicParams()), MotionHeading(TwoTopicParams())
    drive(slow, 0.5, 25.0)
    times = np.arange(0.0, 25.0, 0.04)
    direction = np.exp(1j * 0.3 * np.sin(times / 10.0))
    track = np.concatenate([[0.0], np.cumsum(0.04 * direction[1:])])
    for time, place, (lat, lon) in zip(times, track, fixes_of(track), strict=True):
        stamp = round(1e6 * time)
        fast.push_odometry(VisionSample(stamp, np.array((place.real, place.imag, 0.0)), NAN4))
        fast.push_fix(GnssSample(stamp, lat, lon, 0.0, 1.0, 1.0))
    assert fast.status().sigma == pytest.approx(slow.status().sigma, rel=0.15)


def test_a_delay_of_the_fixes_is_taken_off():
    delay = 0.5
    late = MotionHeading(TwoTopicParams(), round(1e6 * delay))
    times = np.arange(0.0, 60.0, 0.1)
    track = 10.0 * np.exp(1j * times / 10.0)
    places = fixes_of(track * np.exp(0.4j))
    found = []
    for k, time in enumerate(times):
        stamp = round(1e6 * time)
        late.push_odometry(VisionSample(stamp, np.array((track[k].real, track[k].imag, 0)), NAN4))
        if k >= 5 and k % 4 == 0:
            lat, lon = places[k - 5]
            found.append(late.push_fix(GnssSample(stamp, lat, lon, 0.0, 1.0, 1.0)))
    found = [heading for heading in found if heading is not None]
    assert found
    assert all(apart(heading.yaw, 0.4) < 2e-3 for heading in found)


def test_a_wrong_heading_in_use_is_contradicted_and_a_right_one_is_left_alone():
    right, wrong = MotionHeading(TwoTopicParams()), MotionHeading(TwoTopicParams())
    calm = drive(right, 1.0, 120.0, held=(1.1, 0.05))
    loud = drive(wrong, 1.0, 120.0, held=(-1.5, 0.05))
    assert len(calm) <= 2
    assert len(loud) > len(calm)
    assert apart(loud[-1].yaw, 1.0) < 1e-3


def test_a_declared_jump_of_the_odometry_begins_a_new_window():
    heading = MotionHeading(TwoTopicParams())
    drive(heading, 1.0, 12.0)
    assert heading.status().path > 5.0
    heading.push_odometry(
        VisionSample(13_000_000, np.array((90.0, 0.0, 0.0)), NAN4, reset_counter=1))
    assert heading.status().path == 0.0


def test_fixes_that_do_not_move_at_all_match_nothing():
    """A receiver that holds its last place, while the odometry goes on."""
    heading = MotionHeading(TwoTopicParams())
    for k in range(400):
        stamp = 100_000 * k
        heading.push_odometry(VisionSample(stamp, np.array((0.1 * k, 0.0, 0.0)), NAN4))
        assert heading.push_fix(GnssSample(stamp, LAT, LON, 0.0, 1.0, 1.0)) is None
    assert math.isnan(heading.status().sigma) or heading.status().sigma > 1.0
