"""Messages that are decoded together mean what each of them means by itself."""

import math

import numpy as np
import pytest
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.messages.decode_imu import ImuIntegrator
from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.decode_imu import decode_imu_rows
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field_rows
from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.decode_odometry_rows import decode_odometry_rows
from ekf_fusion_ros.messages.decode_pressure import decode_pressure
from ekf_fusion_ros.messages.decode_pressure import decode_pressure_rows
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.messages import OdometryMessageParams
from ekf_fusion_ros.replay.cdr_reader import rows_of

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU = 'sensor_msgs/msg/Imu'
ODOMETRY = 'nav_msgs/msg/Odometry'
TURNED = MessageParams(imu=ImuMessageParams(mount_rpy=(0.1, -0.2, 0.3)))
RATE, RATE_COVARIANCE, FORCE, FORCE_COVARIANCE, ORIENTATION_COVARIANCE = 13, 16, 25, 28, 4


def good_imu(rows=40):
    numbers = np.random.default_rng(3).normal(0.0, 1.0, (rows, 37))
    numbers[:, 0:4] /= np.linalg.norm(numbers[:, 0:4], axis=1)[:, None]
    for first in (4, 16, 28):
        numbers[:, first:first + 9] = 0.01 * np.eye(3).ravel()
    return FlatRows(np.arange(1, rows + 1), np.full(rows, 1499), numbers, 'imu_link')


def bad_rows():
    """Break one thing in each of the first rows."""
    rows = good_imu()
    changes = [(RATE, math.nan), (RATE + 2, -math.inf), (FORCE + 1, 1e6), (RATE_COVARIANCE, -1.0),
               (FORCE_COVARIANCE + 4, math.nan), (FORCE_COVARIANCE + 8, -2.0)]
    for row, (place, value) in enumerate(changes):
        rows.numbers[row, place] = value
    rows.nanosec[len(changes)] = 1_000_000_000
    rows.sec[len(changes) + 1] = -5
    return rows, len(changes) + 2


@pytest.mark.parametrize('params', [MessageParams(), TURNED])
@pytest.mark.parametrize('frame', ['imu_link', 'imu_frd'])
@pytest.mark.parametrize('oriented', [True, False])
def test_imu_rows_equal_single_messages_to_the_bit(params, frame, oriented):
    rows = good_imu()._replace(frame_id=frame)
    if not oriented:
        rows.numbers[::2, ORIENTATION_COVARIANCE] = -1.0
    for k, reading in enumerate(decode_imu_rows(rows, params)):
        alone = decode_imu(rows.row(k), params)
        assert (reading.time_us, tuple(reading.rate), tuple(reading.specific_force)) == (
            alone.time_us, tuple(alone.rate), tuple(alone.specific_force))
        assert np.array_equal(reading.orientation, alone.orientation) or (
            reading.orientation is None and alone.orientation is None)


def test_imu_rows_know_their_increments_since_the_reading_before():
    rows = good_imu()
    rows.sec[20:] += 3
    rows.numbers[30, RATE] = math.nan
    params = MessageParams(imu=ImuMessageParams(max_gap=10.0))
    together, alone = ImuIntegrator(params), ImuIntegrator(params)
    readings = decode_imu_rows(rows, params)
    # The third is withheld: what follows it counts from the one before.
    for k in (k for k in range(len(readings)) if k not in (2, 30)):
        samples = together.push(readings[k])
        expected = alone.push(decode_imu(rows.row(k), params))
        assert len(samples) == len(expected)
        for sample, other in zip(samples, expected, strict=True):
            assert (sample.time_us, sample.delta_angle_dt, sample.delta_velocity_dt) == (
                other.time_us, other.delta_angle_dt, other.delta_velocity_dt)
            assert np.array_equal(sample.delta_angle, other.delta_angle)
            assert np.array_equal(sample.delta_velocity, other.delta_velocity)
            assert np.array_equal(sample.orientation, other.orientation)


def test_imu_rows_leave_to_the_single_decoder_what_it_refuses():
    rows, broken = bad_rows()
    readings = decode_imu_rows(rows, MessageParams())
    assert [reading is None for reading in readings] == [
        k < broken for k in range(len(readings))]
    for k in range(broken):
        with pytest.raises(Refused):
            decode_imu(rows.row(k), MessageParams())


def test_field_rows_equal_single_messages_and_leave_bad_ones():
    rows = good_imu(6)
    numbers = np.zeros((6, 12))
    numbers[:, 0:3] = np.random.default_rng(4).normal(0.0, 3e-5, (6, 3))
    numbers[0, 0:3] = 0.0
    numbers[1, 1] = math.nan
    numbers[2, 7] = -1.0
    numbers[3, 0] = 1.0
    rows = rows._replace(numbers=numbers)
    samples = decode_magnetic_field_rows(rows, MessageParams())
    assert [sample is None for sample in samples] == [True] * 4 + [False] * 2
    for k in range(4):
        with pytest.raises(Refused):
            decode_magnetic_field(rows.row(k), MessageParams())
    for k in (4, 5):
        alone = decode_magnetic_field(rows.row(k), MessageParams())
        assert np.array_equal(samples[k].field, alone.field)
        assert samples[k].time_us == alone.time_us


def test_pressure_rows_equal_single_messages_and_leave_bad_ones():
    pressures = (math.nan, -1.0, 10.1325, math.inf, 101325.0, 54019.9)
    rows = good_imu(6)._replace(numbers=np.column_stack((pressures, np.zeros(6))))
    samples = decode_pressure_rows(rows, MessageParams())
    assert [sample is None for sample in samples] == [True] * 4 + [False] * 2
    for k in range(4):
        with pytest.raises(Refused):
            decode_pressure(rows.row(k), MessageParams())
    assert samples[4:] == [decode_pressure(rows.row(k), MessageParams()) for k in (4, 5)]


POSE_COVARIANCE, LINEAR, TWIST_COVARIANCE = 7, 43, 49
ODOMETRY_CHANGES = {
    'position': ((0, math.nan), (2, math.inf), (1, 2e8)),
    'orientation': ((3, math.nan), (6, 7.0)),
    'velocity': ((LINEAR + 1, math.nan), (LINEAR, 2e3)),
    'pose_covariance': ((POSE_COVARIANCE, -1.0), (POSE_COVARIANCE + 35, math.nan),
                        (POSE_COVARIANCE + 1, 9.0), (POSE_COVARIANCE + 22, 9.0)),
    'twist_covariance': ((TWIST_COVARIANCE, -1.0), (TWIST_COVARIANCE + 3, math.nan),
                         (TWIST_COVARIANCE + 13, 9.0)),
}
ODOMETRY_UNUSUAL = {
    'no_height': ((POSE_COVARIANCE + 14, 1e6),),
    'planar': ((POSE_COVARIANCE + 14, 0.0), (POSE_COVARIANCE + 21, 0.0)),
    'no_yaw': ((POSE_COVARIANCE + 35, math.inf),),
    'no_side_velocity': ((TWIST_COVARIANCE + 7, 1e9),),
}
SAMPLE_ARRAYS = ('position', 'quaternion', 'velocity', 'position_var', 'velocity_cov')


def good_odometry(rows=12, frames=('odom', 'base_link')):
    rng = np.random.default_rng(5)
    numbers = rng.normal(0.0, 2.0, (rows, 85))
    numbers[:, 3:7] /= np.linalg.norm(numbers[:, 3:7], axis=1)[:, None]
    for first in (POSE_COVARIANCE, TWIST_COVARIANCE):
        root = rng.normal(0.0, 0.1, (rows, 6, 6))
        numbers[:, first:first + 36] = (root @ root.transpose(0, 2, 1)).reshape(rows, 36)
    numbers[1, POSE_COVARIANCE:LINEAR] = 0.0
    numbers[2, TWIST_COVARIANCE:] = 0.0
    numbers[3, [0, 2, LINEAR, LINEAR + 1]] = 0.0
    return FlatRows(np.arange(1, rows + 1), np.full(rows, 1499), numbers, *frames)


@pytest.mark.parametrize('frame', ['odom', 'odom_ned', 'odom_frd'])
@pytest.mark.parametrize('child', ['base_link', 'base_link_frd'])
def test_odometry_rows_equal_single_messages_to_the_bit(frame, child):
    rows = good_odometry(frames=(frame, child))
    for k, sample in enumerate(decode_odometry_rows(rows, MessageParams())):
        alone = decode_odometry(rows.row(k), MessageParams())
        for name in SAMPLE_ARRAYS:
            ours, other = getattr(sample, name), getattr(alone, name)
            assert (ours + 0.0).tobytes() == (other + 0.0).tobytes(), name
            # of one type for the kernels, which would be compiled again for another
            assert ours.flags.c_contiguous, name
            assert ours.flags.writeable, name
        assert (sample.time_us, sample.angular_var, sample.velocity_frame) == (
            alone.time_us, alone.angular_var, alone.velocity_frame)


@pytest.mark.parametrize('part', ODOMETRY_CHANGES)
def test_odometry_rows_leave_what_is_refused_to_the_single_decoder(part):
    for change in ODOMETRY_CHANGES[part]:
        rows = good_odometry()
        rows.numbers[4][change[0]] = change[1]
        samples = decode_odometry_rows(rows, MessageParams())
        assert [k for k, sample in enumerate(samples) if sample is None] == [4]
        with pytest.raises(Refused):
            decode_odometry(rows.row(4), MessageParams())


@pytest.mark.parametrize('case', ODOMETRY_UNUSUAL)
def test_odometry_rows_leave_what_is_partly_measured_to_the_single_decoder(case):
    rows = good_odometry()
    for place, value in ODOMETRY_UNUSUAL[case]:
        rows.numbers[4, place] = value
    samples = decode_odometry_rows(rows, MessageParams())
    assert [k for k, sample in enumerate(samples) if sample is None] == [4]
    decode_odometry(rows.row(4), MessageParams())


@pytest.mark.parametrize('changes', [
    {'twist_frame': 'parent'}, {'mount_rpy': (0.1, 0.0, 0.0)}, {'frame': 'ned'}])
def test_odometry_of_unusual_parameters_is_decoded_singly(changes):
    params = MessageParams(odometry=OdometryMessageParams(**changes))
    assert not any(decode_odometry_rows(good_odometry(), params))


def test_odometry_bytes_are_read_together():
    types = STORE.types
    numbers = np.random.default_rng(6).normal(size=85)
    vector, point = types['geometry_msgs/msg/Vector3'], types['geometry_msgs/msg/Point']
    stamp = types['builtin_interfaces/msg/Time'](sec=7, nanosec=5)
    for frames in (('odom', 'base_link'), ('o', 'b'), ('', ''), ('camera_odom', 'x')):
        message = types[ODOMETRY](
            types['std_msgs/msg/Header'](stamp=stamp, frame_id=frames[0]), frames[1],
            types['geometry_msgs/msg/PoseWithCovariance'](
                types['geometry_msgs/msg/Pose'](
                    point(*numbers[0:3]), types['geometry_msgs/msg/Quaternion'](*numbers[3:7])),
                numbers[7:43]),
            types['geometry_msgs/msg/TwistWithCovariance'](
                types['geometry_msgs/msg/Twist'](vector(*numbers[43:46]), vector(*numbers[46:49])),
                numbers[49:85]))
        data = bytes(STORE.serialize_cdr(message, ODOMETRY))
        rows = rows_of(ODOMETRY, [data, data])
        assert (rows.frame_id, rows.child_frame_id) == frames
        np.testing.assert_array_equal(rows.numbers, [numbers, numbers])
        assert rows.sec.tolist() == [7, 7]


def imu_message(frame='imu', sec=7, rate=(0.1, 0.2, 0.3)):
    types = STORE.types
    stamp = types['builtin_interfaces/msg/Time'](sec=sec, nanosec=5)
    vector = types['geometry_msgs/msg/Vector3']
    message = types[IMU](
        types['std_msgs/msg/Header'](stamp=stamp, frame_id=frame),
        types['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0), np.zeros(9), vector(*rate),
        np.arange(9.0), vector(1.0, 2.0, 9.8), np.zeros(9))
    return bytes(STORE.serialize_cdr(message, IMU))


@pytest.mark.parametrize('frame', ['', 'i', 'imu', 'imu_link', 'a/longer/name'])
def test_bytes_of_one_layout_are_read_together(frame):
    rows = rows_of(IMU, [imu_message(frame, sec, (0.1 * sec, 0.2, 0.3)) for sec in (7, 8)])
    assert rows.frame_id == frame
    assert rows.sec.tolist() == [7, 8]
    assert rows.nanosec.tolist() == [5, 5]
    np.testing.assert_array_equal(rows.numbers[:, RATE], [0.1 * 7, 0.1 * 8])
    np.testing.assert_array_equal(rows.numbers[1, FORCE:FORCE + 3], [1.0, 2.0, 9.8])


def test_bytes_of_several_layouts_are_not_read_together():
    message = imu_message('imu')
    assert rows_of(IMU, [message, imu_message('imu_0')]) is None
    assert rows_of(IMU, [message, imu_message('two')]) is None
    assert rows_of(IMU, [message[:-20], message[:-20]]) is None
    assert rows_of(IMU, [message, b'\x00\x00' + message[2:]]) is None
    with pytest.raises(ValueError, match='does not fit'):
        rows_of(IMU, [message[:12] + b'\xff' * 4 + message[16:]])
