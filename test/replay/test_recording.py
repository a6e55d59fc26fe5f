"""Recordings: read back through rosbags and decode, the samples are those that went in."""

from dataclasses import replace

import numpy as np
import pytest

from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.trajectory import FigureOfEight

rosbags = pytest.importorskip('rosbags.highlevel')


@pytest.fixture(scope='module')
def scenario():
    sensors = default_sensors()
    sensors['fix'] = replace(sensors['fix'], latency=0.05)
    return Scenario(trajectory=FigureOfEight(duration=20.0, climb=3.0, start=0.0),
                    sensors=sensors, seed=4)


@pytest.fixture(scope='module')
def messages(scenario, tmp_path_factory):
    """Messages (log time in ns, message) by topic."""
    from ekf_fusion_ros.replay.recording import write_recording

    path = tmp_path_factory.mktemp('recording') / 'bag'
    write_recording(path, scenario.arrivals())
    found = {}
    with rosbags.AnyReader([path]) as reader:
        for connection, log_time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append((log_time, message))
    return found


def samples(scenario, role):
    return [a for a in scenario.arrivals() if a.role == role]


def test_topics_and_counts(messages):
    assert {topic: len(rows) for topic, rows in messages.items()} == {
        '/odom': 601, '/fix': 101, '/fix_velocity': 101, '/imu/data_raw': 5000, '/mag': 1001,
        '/pressure': 1001}


def test_log_time_is_arrival(scenario, messages):
    assert [t // 1000 for t, _ in messages['/fix']] == [
        a.time_us for a in samples(scenario, 'fix')]


def test_odometry_returns(scenario, messages):
    from ekf_fusion_ros.messages.decode_odometry import decode_odometry

    params = MessageParams()
    for (_, message), arrival in zip(messages['/odom'], samples(scenario, 'odometry'),
                                     strict=True):
        sent, got = arrival.sample, decode_odometry(message, params)
        assert got.time_us == sent.time_us
        assert got.velocity_frame is VelocityFrame.BODY_FRD
        np.testing.assert_allclose(got.position, sent.position, atol=1e-12)
        np.testing.assert_allclose(got.velocity, sent.velocity, atol=1e-12)
        np.testing.assert_allclose(got.position_var, sent.position_var, rtol=1e-9)
        np.testing.assert_allclose(got.velocity_cov, sent.velocity_cov, atol=1e-12)
        assert abs(np.dot(got.quaternion, sent.quaternion)) == pytest.approx(1.0, abs=1e-12)


def test_fix_returns(scenario, messages):
    from ekf_fusion_ros.messages.decode_fix import decode_fix

    for (_, message), arrival in zip(messages['/fix'], samples(scenario, 'fix'), strict=True):
        sent, got = arrival.sample, decode_fix(message, MessageParams())
        assert (got.time_us, got.lat, got.lon, got.alt) == (
            sent.time_us, sent.lat, sent.lon, sent.alt)
        assert (got.eph, got.epv) == pytest.approx((sent.eph, sent.epv))


def test_vectors_are_forward_left_up(scenario, messages):
    first = samples(scenario, 'imu')[0].sample
    _, imu = messages['/imu/data_raw'][0]
    force = np.array([1.0, -1.0, -1.0]) * first.delta_velocity / first.delta_velocity_dt
    np.testing.assert_allclose(
        [imu.linear_acceleration.x, imu.linear_acceleration.y, imu.linear_acceleration.z], force)
    assert imu.linear_acceleration.z > 9.0
    _, mag = messages['/mag'][0]
    field = samples(scenario, 'magnetic_field')[0].sample.field
    np.testing.assert_allclose(
        [mag.magnetic_field.x, mag.magnetic_field.y, mag.magnetic_field.z],
        np.array([1e-4, -1e-4, -1e-4]) * field)


def test_velocity_is_east_north_up(scenario, messages):
    arrival = samples(scenario, 'fix')[40]
    _, message = messages['/fix_velocity'][40]
    linear = message.twist.twist.linear
    north, east, down = arrival.sample.velocity
    assert (linear.x, linear.y, linear.z) == (east, north, -down)
