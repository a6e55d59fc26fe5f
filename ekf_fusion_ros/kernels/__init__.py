"""Numeric hot paths: functions on preallocated arrays that numba compiles when it is there."""
