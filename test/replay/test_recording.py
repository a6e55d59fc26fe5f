"""Recordings: read back through rosbags and decode, the samples are those that went in."""

from dataclasses import replace
import json

import numpy as np
import pytest

from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.messages import GpsHeadingMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import VelocityFrame
from ekf_fusion_ros.simulation.scenario import FURTHER_ROLES
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import default_sensors
from ekf_fusion_ros.simulation.surroundings import Wind
from ekf_fusion_ros.simulation.trajectory import FigureOfEight
from ekf_fusion_ros.simulation.trajectory import Loiter

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


@pytest.fixture(scope='module')
def further(tmp_path_factory):
    """Scenario and recording of the further roles on an aeroplane."""
    from ekf_fusion_ros.replay.recording import write_recording

    roles = ('fix', 'pressure', 'gps_heading', 'range', 'flow', 'airspeed', 'landed',
             'aux_velocity', 'imu')
    sensors = default_sensors(roles)
    sensors['fix'] = replace(sensors['fix'], heading_outages=((5.0, 10.0),), antenna_offset=0.4)
    sensors['range'] = replace(sensors['range'], dropout=0.1)
    sensors['landed'] = replace(sensors['landed'], fixed_wing=True)
    flight = Loiter(duration=40.0, wind=Wind(mean=(3.0, -2.0, 0.0)))
    scenario = Scenario(trajectory=flight, sensors=sensors, seed=4)
    path = tmp_path_factory.mktemp('further') / 'bag'
    write_recording(path, scenario.arrivals())
    with rosbags.AnyReader([path]) as reader:
        found = {}
        for connection, time_ns, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append((time_ns, message))
    return path, scenario, found


def pairs(further, role, topic):
    """Yield what was sent and what was recorded."""
    _, scenario, found = further
    rows = zip(samples(scenario, role), found[topic], strict=True)
    return [(arrival.sample, message) for arrival, (_, message) in rows]


def test_range_returns(further):
    from ekf_fusion_ros.messages.decode_range import decode_range

    rows = pairs(further, 'range', '/range')
    for sent, message in rows:
        got = decode_range(message, MessageParams())
        assert (got.time_us, got.quality) == (sent.time_us, sent.quality)
        assert got.distance == pytest.approx(sent.distance, rel=1e-6)
        assert (got.min_distance, got.max_distance) == pytest.approx((0.2, 20.0), rel=1e-6)
    seen = {message.range for sent, message in rows if sent.quality == 0}
    assert seen == {np.inf, -np.inf}


def test_flow_returns(further):
    from ekf_fusion_ros.messages.decode_flow import FlowIntegrator
    from ekf_fusion_ros.messages.decode_flow import decode_flow

    params = MessageParams()
    integrator = FlowIntegrator(params.flow)
    for number, (sent, message) in enumerate(pairs(further, 'flow', '/flow')):
        got = integrator.push(decode_flow(message, params))
        assert (got.time_us, got.quality) == (sent.time_us, sent.quality)
        np.testing.assert_allclose(got.flow / got.dt, sent.flow / sent.dt, atol=1e-12)
        assert number == 0 or got.dt == pytest.approx(sent.dt)


def test_auxiliary_velocity_returns(further):
    from ekf_fusion_ros.messages.decode_aux_velocity import decode_aux_velocity

    for sent, message in pairs(further, 'aux_velocity', '/aux_velocity'):
        got = decode_aux_velocity(message, MessageParams())
        assert got.time_us == sent.time_us
        np.testing.assert_allclose(got.velocity, sent.velocity, atol=1e-12)
        np.testing.assert_allclose(got.variance, sent.variance, atol=1e-12)


def test_airspeed_returns(further):
    from ekf_fusion_ros.messages.decode_airspeed import decode_airspeed

    for sent, message in pairs(further, 'airspeed', '/airspeed'):
        got = decode_airspeed(message, MessageParams())
        assert got.time_us == sent.time_us
        assert got.speed * sent.eas2tas == pytest.approx(sent.true_airspeed, abs=1e-9)


def test_ground_contact_returns(further):
    sent = [sample.landed for sample, _ in pairs(further, 'landed', '/landed')]
    assert [message.data for _, message in pairs(further, 'landed', '/landed')] == sent
    assert True in sent and False in sent
    times = [time_ns // 1000 for time_ns, _ in further[2]['/landed']]
    assert times == [sample.time_us for sample, _ in pairs(further, 'landed', '/landed')]


def test_antenna_heading_returns(further):
    from ekf_fusion_ros.messages.decode_gps_heading import decode_gps_heading

    sent = [a.sample for a in samples(further[1], 'fix') if np.isfinite(a.sample.yaw)]
    params = MessageParams(gps_heading=GpsHeadingMessageParams(antenna_yaw=-0.4))
    got = [decode_gps_heading(message, params) for _, message in further[2]['/gps_heading']]
    assert [h.time_us for h in got] == [s.time_us for s in sent]
    assert len(sent) == 201 - 25
    np.testing.assert_allclose([h.yaw for h in got], [s.yaw for s in sent], atol=1e-12)
    assert [h.accuracy for h in got] == pytest.approx(len(sent) * [0.02])
    assert {h.offset for h in got} == {0.4}


def test_replay_takes_in_all_further_roles(further, tmp_path):
    pytest.importorskip('tqdm')
    from ekf_fusion_ros.replay.cli import main

    switches = [f'--set=node.use_{role}=true' for role in FURTHER_ROLES]
    arguments = [str(further[0]), '--output', str(tmp_path), '--no-bag', *switches,
                 '--topic', 'gps_heading=/gps_heading', '--withhold', 'landed=20:30']
    assert main(arguments) == 0
    topics = json.loads((tmp_path / 'summary.json').read_text())['topics']
    counts = {name: (topic['role'], topic['received'], topic['accepted'], topic['refused'])
              for name, topic in topics.items()}
    assert counts['/range'] == ('range', 1201, 1201, {})
    assert counts['/flow'] == ('flow', 800, 800, {})
    slow = sum(sent.true_airspeed / sent.eas2tas <= AidingParams().airspeed_threshold
               for sent, _ in pairs(further, 'airspeed', '/airspeed'))
    assert 0 < slow < 40
    assert counts['/airspeed'] == ('airspeed', 801, 801 - slow, {'below_threshold': slow})
    assert counts['/aux_velocity'] == ('aux_velocity', 801, 801, {})
    assert counts['/gps_heading'] == ('gps_heading', 176, 176, {})
    assert counts['/landed'] == ('landed', 201, 151, {'withheld': 50})


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
