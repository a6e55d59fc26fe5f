"""Optical flow as a Vector3Stamped."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_flow import FlowIntegrator
from ekf_fusion_ros.messages.decode_flow import FlowReading
from ekf_fusion_ros.messages.decode_flow import decode_flow
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import FlowMessageParams
from ekf_fusion_ros.params.messages import MessageParams

HEIGHT, FORWARD, RIGHT = 5.0, 3.0, 2.0
# The convention, in FRD without rotation.
X, Y = RIGHT / HEIGHT, -FORWARD / HEIGHT


def params(**values):
    return MessageParams(flow=FlowMessageParams(**values))


@pytest.mark.parametrize(('x', 'y', 'frame_id', 'values'), [
    (X, Y, 'flow_frd', {}),
    (X, Y, 'flow_frd_rad_s', {}),
    (X, -Y, 'flow_link', {}),
    (X, Y, 'flow_link', {'axes': 'frd'}),
    (X, -Y, 'flow_frd', {'axes': 'flu'}),
    (-X, -Y, 'flow_frd', {'convention': 'mavlink'}),
    # A sensor whose x axis points left: it sees -y of the body (right) as its x.
    (-Y, X, 'flow_frd', {'mount_yaw': math.pi / 2}),
])
def test_every_convention_gives_the_same_flow(build, x, y, frame_id, values):
    reading = decode_flow(build.flow(x, y, 1.0, frame_id), params(**values))
    assert reading.rate == pytest.approx((X, Y), abs=1e-15)
    assert reading.quality == 255
    assert reading.time_us == 100_250_000


@pytest.mark.parametrize(('quality', 'steps'), [(0.0, 0), (0.5, 128), (1.0, 255)])
def test_quality(build, quality, steps):
    assert decode_flow(build.flow(quality=quality), params()).quality == steps


@pytest.mark.parametrize(('values', 'reason'), [
    ({'x': math.nan}, 'not_finite'), ({'y': math.inf}, 'not_finite'),
    ({'quality': math.nan}, 'not_finite'), ({'x': 101.0}, 'out_of_range'),
    ({'quality': 1.5}, 'bad_quality'), ({'quality': -0.1}, 'bad_quality')])
def test_bad_flow(build, values, reason):
    with pytest.raises(Refused) as refused:
        decode_flow(build.flow(**values), params())
    assert refused.value.reason == reason


def test_interval_is_the_step_of_the_stamps():
    integrator = FlowIntegrator(FlowMessageParams(max_interval=0.2))
    rate = np.array([0.5, -0.25])
    stamps = [1_000_000, 1_100_000, 1_180_000, 2_000_000, 2_100_000]
    samples = [integrator.push(FlowReading(stamp, rate, 200)) for stamp in stamps]
    # The first counts as the longest interval, the one after the gap as the one before it.
    assert [sample.dt for sample in samples] == pytest.approx([0.2, 0.1, 0.08, 0.08, 0.1])
    for sample in samples:
        assert sample.flow == pytest.approx(rate * sample.dt)
        assert np.isnan(sample.gyro).all()
        assert sample.quality == 200


def test_recorded_flow_has_the_signs_of_the_convention(recorded):
    """Flow of a real quadrotor by its gyro, range, GPS velocity and recorded heading.

    Least squares must give back the model rate = (-p + v_right / height, -q - v_forward / height):
    factors of one with these signs. GPS tells the velocity 0.2 s late.
    """
    name = 'inav_quad_optflow'
    integrator = FlowIntegrator(FlowMessageParams())
    samples = [integrator.push(decode_flow(m, params())) for m in recorded(name, '/flow')]
    time = np.array([s.time_us for s in samples]) * 1e-6
    rate = np.array([s.flow / s.dt for s in samples])
    turn = mean_rates(recorded(name, '/imu/data_raw'), time, 0.1)
    height = at(time, recorded(name, '/range'), lambda m: (m.range,))[:, 0]
    east, north = at(time + 0.2, recorded(name, '/fix_velocity'), lambda m: (
        m.twist.twist.linear.x, m.twist.twist.linear.y)).T
    c, s = heading(time, recorded.folder / name / 'reference' / 'onboard_estimate_enu_flu.csv')
    forward, right = c * east + s * north, s * east - c * north
    flying = height > 1.0
    assert flying.sum() > 7000
    for axis, seen in ((0, right), (1, forward)):
        model = np.stack([turn[:, axis], seen / height], axis=1)[flying]
        factors = np.linalg.lstsq(model, rate[flying, axis])[0]
        assert factors == pytest.approx((-1.0, (1.0, -1.0)[axis]), abs=0.2)
    assert np.median([s.dt for s in samples]) == pytest.approx(0.105, abs=0.01)


def stamps(messages):
    return np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for m in messages])


def at(time, messages, read):
    """Return numbers of messages (N, k), interpolated to the times (N,)."""
    values = np.array([read(message) for message in messages])
    return np.stack([np.interp(time, stamps(messages), column) for column in values.T], axis=1)


def mean_rates(messages, time, interval):
    """Return the mean rate (N, 2) FRD over the interval before each time."""
    known = stamps(messages)
    rates = np.array([(m.angular_velocity.x, -m.angular_velocity.y) for m in messages])
    angle = np.cumsum(rates * np.diff(known, prepend=known[:1])[:, None], axis=0)
    return np.stack([
        (np.interp(time, known, angle[:, k]) - np.interp(time - interval, known, angle[:, k]))
        / interval for k in (0, 1)], axis=1)


def heading(time, path):
    """Return cosine and sine (N,) of the recorded yaw (ENU) at the times."""
    table = np.genfromtxt(path, delimiter=',', names=True)
    yaw = np.arctan2(2.0 * (table['qw'] * table['qz'] + table['qx'] * table['qy']),
                     1.0 - 2.0 * (table['qy'] ** 2 + table['qz'] ** 2))
    now = np.interp(time, table['t_sec'], np.unwrap(yaw))
    return np.cos(now), np.sin(now)
