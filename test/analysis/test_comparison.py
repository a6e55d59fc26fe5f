"""The comparison on tracks with errors made by hand."""

import numpy as np
import pytest

from ekf_fusion_ros.analysis.comparison import Comparison
from ekf_fusion_ros.analysis.errors import Track

TIME = np.arange(0.0, 100.0, 0.1)
OUTAGE = (60.0, 80.0)
OFFSET = np.array([0.3, 0.4, 0.0])


def circle(time):
    return np.stack([50 * np.cos(time / 10), 50 * np.sin(time / 10), 0.0 * time], axis=1)


@pytest.fixture
def flight():
    fix_time = np.array([t for t in np.arange(0.0, 100.0, 0.2) if not 60.0 <= t < 80.0])
    # Fixes 2 m off, alternating so that they do not move a fit.
    side = np.where(np.arange(len(fix_time)) % 2, 2.0, -2.0)[:, np.newaxis]
    rotated = circle(TIME)[:, [1, 0, 2]] * (1.0, -1.0, 1.0)
    drift = np.where(TIME > 60.0, 3.0, 0.0)[:, np.newaxis] * (0.0, 0.0, 1.0)
    fused_time = TIME[200:]
    return Comparison(
        truth=Track(TIME, circle(TIME)), odometry=Track(TIME, rotated + drift),
        fixes=Track(fix_time, circle(fix_time) + side * (1.0, 0.0, 0.0)),
        fused=Track(fused_time, circle(fused_time) + OFFSET),
        fused_sigma=np.ones((len(fused_time), 3)), outage=OUTAGE)


def test_fused_error(flight):
    score = flight.score()
    assert score.outside.fused == pytest.approx((0.5, 0.5))
    assert score.inside.fused == pytest.approx((0.5, 0.5))


def test_gps_is_judged_where_it_was_measured_and_held_when_lost(flight):
    score = flight.score()
    assert score.outside.gps == pytest.approx((2.0, 2.0))
    # Held from 59.8 s on while the vehicle flies along its circle.
    lost = TIME[(TIME >= 60.0) & (TIME < 80.0)]
    last = flight.fixes.position[flight.fixes.time < 60.0][-1]
    by_hand = np.sqrt(np.mean(np.sum((circle(lost) - last) ** 2, axis=1)))
    assert score.inside.gps == pytest.approx((by_hand, by_hand))


def test_odometry_is_fitted_before_the_outage_only(flight):
    score = flight.score()
    assert score.inside.odometry[0] == pytest.approx(0.0, abs=0.01)
    assert score.inside.odometry[1] == pytest.approx(3.0, abs=0.05)


def test_nothing_before_the_first_fused_row_counts(flight):
    assert flight.start == pytest.approx(20.0)
    assert flight.errors(flight.fixes).time[0] >= 20.0


def test_ratio_takes_the_better_source(flight):
    score = flight.score()
    assert score.outside.ratio(1) == pytest.approx(
        0.5 / min(score.outside.odometry[1], score.outside.gps[1]))
    assert score.inside.ratio(1) == pytest.approx(0.5 / 3.0, rel=0.02)


def test_picture_shows_the_outage(flight, tmp_path):
    pytest.importorskip('matplotlib')
    image = pytest.importorskip('matplotlib.image')
    from ekf_fusion_ros.analysis.plots import draw_comparison

    path = tmp_path / 'flight.png'
    draw_comparison(path, flight, 'by hand')
    pixels = image.imread(path)
    assert pixels.shape[0] > 600
    assert pixels.shape[1] > 1000
    # The fused red and the outage's sand must be on the page.
    red = np.all(np.abs(pixels[..., :3] - (0.839, 0.153, 0.157)) < 0.03, axis=2)
    sand = np.all(np.abs(pixels[..., :3] - (0.965, 0.843, 0.655)) < 0.03, axis=2)
    assert red.sum() > 500
    assert sand.sum() > 500
