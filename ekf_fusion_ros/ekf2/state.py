"""Index map of the 24 states, the one of PX4's estimator_status."""

from __future__ import annotations

QUAT = slice(0, 4)
VEL = slice(4, 7)
POS = slice(7, 10)
GYRO_BIAS = slice(10, 13)
ACCEL_BIAS = slice(13, 16)
EARTH_FIELD = slice(16, 19)
BODY_FIELD = slice(19, 22)
WIND = slice(22, 24)

VN, VE, VD = 4, 5, 6
PN, PE, PD = 7, 8, 9
SIZE = 24

STATES = {
    'quaternion': QUAT,
    'velocity': VEL,
    'position': POS,
    'delta_angle_bias': GYRO_BIAS,
    'delta_velocity_bias': ACCEL_BIAS,
    'earth_field': EARTH_FIELD,
    'body_field': BODY_FIELD,
    'wind': WIND,
}
"""Slices of the state vector by name.

Units: velocity m/s and position m NED, biases rad and m/s per filter period FRD, earth field G
NED, body field G FRD, wind m/s NE; the quaternion turns body to earth.
"""

FILTER_PERIOD_US = 10_000
FILTER_PERIOD = 0.01
SECOND = 1_000_000
