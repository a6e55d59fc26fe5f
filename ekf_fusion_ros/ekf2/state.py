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

FILTER_PERIOD_US = 10_000
FILTER_PERIOD = 0.01
SECOND = 1_000_000
