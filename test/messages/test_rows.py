"""Messages that are decoded together mean what each of them means by itself."""

import math

import numpy as np
import pytest
from rosbags.typesys import Stores
from rosbags.typesys import get_typestore

from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.decode_imu import decode_imu_rows
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field_rows
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.replay.cdr_reader import rows_of

STORE = get_typestore(Stores.ROS2_JAZZY)
IMU = 'sensor_msgs/msg/Imu'
TURNED = MessageParams(imu=ImuMessageParams(mount_rpy=(0.1, -0.2, 0.3)))
RATE, RATE_COVARIANCE, FORCE, FORCE_COVARIANCE, ORIENTATION_COVARIANCE = 13, 16, 25, 28, 4


def good_imu(rows=40):
    numbers = np.random.default_rng(3).normal(0.0, 1.0, (rows, 37))
    numbers[:, 0:4] /= np.linalg.norm(numbers[:, 0:4], axis=1)[:, None]
    for first in (4, 16, 28):
        numbers[:, first:first + 9] = 0.01 * np.eye(3).ravel()
    return FlatRows(np.arange(1, rows + 1), np.full(rows, 1499), 'imu_link', numbers)


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
    rows = rows_of(37, [imu_message(frame, sec, (0.1 * sec, 0.2, 0.3)) for sec in (7, 8)])
    assert rows.frame_id == frame
    assert rows.sec.tolist() == [7, 8]
    assert rows.nanosec.tolist() == [5, 5]
    np.testing.assert_array_equal(rows.numbers[:, RATE], [0.1 * 7, 0.1 * 8])
    np.testing.assert_array_equal(rows.numbers[1, FORCE:FORCE + 3], [1.0, 2.0, 9.8])


def test_bytes_of_several_layouts_are_not_read_together():
    message = imu_message('imu')
    assert rows_of(37, [message, imu_message('imu_0')]) is None
    assert rows_of(37, [message, imu_message('two')]) is None
    assert rows_of(37, [message[:-20], message[:-20]]) is None
    assert rows_of(37, [message, b'\x00\x00' + message[2:]]) is None
    with pytest.raises(ValueError, match='does not fit'):
        rows_of(37, [message[:12] + b'\xff' * 4 + message[16:]])
