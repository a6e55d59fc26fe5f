"""Whatever the numbers, a decoder returns a usable sample or refuses; real classes decode too."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import settings
from hypothesis import strategies as st
import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_airspeed import decode_airspeed
from ekf_fusion_ros.messages.decode_aux_velocity import decode_aux_velocity
from ekf_fusion_ros.messages.decode_fix import decode_fix
from ekf_fusion_ros.messages.decode_fix import decode_fix_velocity
from ekf_fusion_ros.messages.decode_flow import decode_flow
from ekf_fusion_ros.messages.decode_gps_heading import decode_gps_heading
from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.decode_pressure import decode_pressure
from ekf_fusion_ros.messages.decode_range import decode_range
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams()
DECODERS = {
    'odometry': decode_odometry, 'fix': decode_fix, 'fix_velocity': decode_fix_velocity,
    'imu': decode_imu, 'magnetic_field': decode_magnetic_field, 'pressure': decode_pressure,
    'range': decode_range, 'flow': decode_flow, 'airspeed': decode_airspeed,
    'gps_heading': decode_gps_heading, 'aux_velocity': decode_aux_velocity,
}

nasty = st.one_of(
    st.sampled_from((math.nan, math.inf, -math.inf, 0.0, -1.0, 1e308, -1e308, 1e6, 5e-324)),
    st.floats(-1e7, 1e7))


def slots(message):
    """Yield a setter for every number in a message."""
    for name, value in vars(message).items():
        if isinstance(value, np.ndarray):
            for index in range(value.size):
                yield lambda number, array=value, index=index: array.__setitem__(index, number)
        elif isinstance(value, float):
            yield lambda number, owner=message, name=name: setattr(owner, name, number)
        elif hasattr(value, '__dict__') and name not in ('header', 'status'):
            yield from slots(value)


def numbers(sample):
    for name in getattr(sample, '_fields', sample.__slots__):
        value = getattr(sample, name)
        if isinstance(value, np.ndarray | float | tuple):
            yield name, np.atleast_1d(value)


@pytest.mark.parametrize('role', DECODERS)
@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_spoiled_messages_are_refused_or_sane(build, role, data):
    message = getattr(build, role)()
    setters = list(slots(message))
    for _ in range(data.draw(st.integers(1, 4))):
        setters[data.draw(st.integers(0, len(setters) - 1))](data.draw(nasty))
    try:
        sample = DECODERS[role](message, PARAMS)
    except Refused as refused:
        assert refused.reason == refused.reason.lower().replace(' ', '_')
        return
    fields = list(numbers(sample))
    assert fields
    for name, value in fields:
        assert not np.isinf(value).any(), name
        if name in ('position_var', 'eph', 'epv', 'angular_var', 'accuracy'):
            assert (value > 0.0).all(), name


@pytest.mark.parametrize(('package', 'kind', 'role'), [
    ('nav_msgs.msg', 'Odometry', 'odometry'), ('sensor_msgs.msg', 'NavSatFix', 'fix'),
    ('geometry_msgs.msg', 'TwistStamped', 'fix_velocity'),
    ('geometry_msgs.msg', 'TwistWithCovarianceStamped', 'fix_velocity'),
    ('sensor_msgs.msg', 'Imu', 'imu'),
    ('sensor_msgs.msg', 'FluidPressure', 'pressure'),
    ('sensor_msgs.msg', 'MagneticField', 'magnetic_field'),
    ('sensor_msgs.msg', 'Range', 'range'),
    ('geometry_msgs.msg', 'Vector3Stamped', 'flow'),
    ('geometry_msgs.msg', 'TwistStamped', 'airspeed'),
    ('geometry_msgs.msg', 'TwistWithCovarianceStamped', 'airspeed'),
    ('geometry_msgs.msg', 'TwistStamped', 'aux_velocity'),
    ('geometry_msgs.msg', 'TwistWithCovarianceStamped', 'aux_velocity'),
    ('geometry_msgs.msg', 'PoseStamped', 'gps_heading'),
    ('geometry_msgs.msg', 'PoseWithCovarianceStamped', 'gps_heading'),
    ('sensor_msgs.msg', 'Imu', 'gps_heading'),
])
def test_ros_classes_decode(package, kind, role):
    message = getattr(pytest.importorskip(package), kind)()
    with pytest.raises(Refused) as refused:
        DECODERS[role](message, PARAMS)
    assert refused.value.reason == 'zero_stamp'
    message.header.stamp.sec = 7
    if kind == 'NavSatFix':
        message.latitude = 47.0
    if role == 'pressure':
        message.fluid_pressure = 101325.0
    elif role == 'magnetic_field':
        message.magnetic_field.x = 2e-5
    elif role == 'fix':
        message.status.status = 0
    elif role == 'range':
        message.max_range = 9.0
    elif role == 'odometry':
        message.pose.pose.position.x = 4.0
    assert DECODERS[role](message, PARAMS).time_us == 7_000_000
