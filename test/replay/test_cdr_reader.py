"""Input messages read from CDR bytes against those that the rosbags library builds."""

from __future__ import annotations

from dataclasses import replace
import struct

import numpy as np
import pytest

from ekf_fusion_ros.inputs import DECODERS
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MessageParams

SerdeError = pytest.importorskip('rosbags.serde').SerdeError
typesys = pytest.importorskip('rosbags.typesys')
cdr_reader = pytest.importorskip('ekf_fusion_ros.replay.cdr_reader')
TYPES = pytest.importorskip('ekf_fusion_ros.replay.topics').TYPES

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
RNG = np.random.default_rng(8)


def random_message(kind, text):
    """Return a message of `kind` with random numbers in every field."""
    values = {}
    for name, (node, detail) in STORE.fielddefs[kind][1]:
        if node.name == 'NAME':
            values[name] = random_message(detail, text)
        elif node.name == 'ARRAY':
            values[name] = RNG.uniform(size=detail[1])
        else:
            values[name] = random_value(detail[0], text)
    return STORE.types[kind](**values)


def random_value(base, text):
    if base == 'string':
        return text
    if base == 'float64':
        return float(RNG.normal())
    if base == 'float32':
        return float(np.float32(RNG.normal()))
    return int(RNG.integers(0, 100))


def numbers_of(message):
    """Yield the numbers below the header in the order of the definition."""
    for name, _ in STORE.fielddefs[message.__msgtype__][1]:
        value = getattr(message, name)
        if isinstance(value, np.ndarray):
            yield from value.tolist()
        elif hasattr(value, '__msgtype__'):
            if name != 'header':
                yield from numbers_of(value)
        elif not isinstance(value, str):
            yield value


@pytest.mark.parametrize('kind', cdr_reader.READERS)
@pytest.mark.parametrize('text', ['', 'a', 'ab', 'abc', 'abcd', 'base_link', 'odom_frame_ü'])
def test_every_field_as_rosbags_reads_it(kind, text):
    data = bytes(STORE.serialize_cdr(random_message(kind, text), kind))
    expected = STORE.deserialize_cdr(data, kind)
    flat = cdr_reader.reader_of(kind)(data)
    assert (flat.sec, flat.nanosec) == (expected.header.stamp.sec, expected.header.stamp.nanosec)
    assert flat.frame_id == expected.header.frame_id
    assert flat.child_frame_id == getattr(expected, 'child_frame_id', '')
    assert list(flat.numbers) == list(numbers_of(expected))


@pytest.mark.parametrize('kind', cdr_reader.READERS)
@pytest.mark.parametrize(('parent', 'child'), [('o', 'base'), ('odom_ned', 'b'), ('', 'a' * 30)])
def test_samples_are_those_of_the_message_objects(kind, parent, child):
    role = next(role for role, kinds in TYPES.items() if kind in kinds)
    message = random_message(kind, parent)
    if hasattr(message, 'child_frame_id'):
        message = replace(message, child_frame_id=child)
    data = bytes(STORE.serialize_cdr(message, kind))
    flat, whole = cdr_reader.reader_of(kind)(data), STORE.deserialize_cdr(data, kind)
    assert said(role, flat) == said(role, whole)


def said(role, message):
    """Return the sample in words, or why there is none."""
    try:
        return repr(DECODERS[role](message, MessageParams()))
    except Refused as refusal:
        return str(refusal)


@pytest.mark.parametrize('kind', cdr_reader.READERS)
def test_big_endian_is_read_too(kind):
    message = random_message(kind, 'base_link')
    data = bytes(STORE.serialize_cdr(message, kind, little_endian=False))
    read = cdr_reader.reader_of(kind)(data)
    assert read.header.frame_id == 'base_link'
    assert read.header.stamp.sec == message.header.stamp.sec


@pytest.mark.parametrize('kind', cdr_reader.READERS)
def test_bytes_cut_short_raise(kind):
    data = bytes(STORE.serialize_cdr(random_message(kind, 'base_link'), kind))
    read = cdr_reader.reader_of(kind)
    # The last field ends the message, padding aside.
    for length in (0, 3, 4, 10, 20, len(data) // 2, len(data) - 9):
        with pytest.raises((ValueError, struct.error, IndexError, SerdeError)):
            read(data[:length])


def test_range_of_humble_has_no_variance():
    kind = 'sensor_msgs/msg/Range'
    message = random_message(kind, 'lidar')
    read = cdr_reader.reader_of(kind)(bytes(STORE.serialize_cdr(message, kind))[:-4])
    assert list(read.numbers) == list(numbers_of(message))[:-1]


def test_a_message_without_header():
    kind = 'std_msgs/msg/Bool'
    data = bytes(STORE.serialize_cdr(STORE.types[kind](data=True), kind))
    assert cdr_reader.reader_of(kind)(data).data is True


def test_a_huge_string_length_is_no_message():
    kind = 'sensor_msgs/msg/Imu'
    data = bytearray(STORE.serialize_cdr(random_message(kind, 'imu'), kind))
    data[12:16] = b'\xff\xff\xff\xff'
    with pytest.raises(ValueError, match='does not fit'):
        cdr_reader.reader_of(kind)(bytes(data))
