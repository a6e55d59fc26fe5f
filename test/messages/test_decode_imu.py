"""Imu: REP-145, mounting, refusals, and increments from readings."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ekf_fusion_ros.messages.decode_imu import ImuIntegrator
from ekf_fusion_ros.messages.decode_imu import ImuReading
from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import ImuMessageParams
from ekf_fusion_ros.params.messages import MessageParams

PARAMS = MessageParams()
# The husky's, by physics: gravity is read on +y, the yaw rate on y, the nose is -z.
HUSKY = MessageParams(imu=ImuMessageParams(mount_rpy=(math.pi / 2, 0.0, -math.pi / 2)))


def test_flu_becomes_frd(build):
    reading = decode_imu(build.imu(), PARAMS)
    assert reading.time_us == 100_250_000
    assert list(reading.rate) == [0.1, -0.2, -0.3]
    assert list(reading.specific_force) == [1.0, -2.0, -9.8]


def test_frd_passes(build):
    reading = decode_imu(build.imu('imu_frd'), PARAMS)
    assert list(reading.rate) == [0.1, 0.2, 0.3]


def test_orientation_is_optional(build):
    message = build.imu()
    half = math.sqrt(0.5)
    assert decode_imu(message, PARAMS).orientation == pytest.approx((half, 0, 0, half))
    message.orientation_covariance[0] = -1.0
    assert decode_imu(message, PARAMS).orientation is None
    message.orientation_covariance[0] = 0.0
    message.orientation = build.quaternion(0.0, 0.0, 0.0, 0.0)
    assert decode_imu(message, PARAMS).orientation is None


def test_increments_carry_the_orientation_at_their_end(build):
    integrator, tilted = ImuIntegrator(PARAMS), np.array((0.8, 0.6, 0.0, 0.0))
    integrator.push(ImuReading(1_000_000, (0.0,) * 3, (0.0,) * 3, np.array((1.0, 0, 0, 0))))
    sample, = integrator.push(ImuReading(1_010_000, (0.0,) * 3, (0.0,) * 3, tilted))
    assert sample.orientation is tilted


def test_mounting_turns_vectors_and_orientation_like_scipy(build):
    rotation = pytest.importorskip('scipy.spatial.transform').Rotation
    rpy = (0.3, -0.2, 1.1)
    mounting = rotation.from_euler('xyz', rpy)
    body_to_enu = rotation.from_euler('xyz', (0.2, -0.1, 0.9))
    x, y, z, w = (body_to_enu * mounting).as_quat()
    message = build.imu()
    message.orientation = build.quaternion(w, x, y, z)
    reading = decode_imu(message, MessageParams(imu=ImuMessageParams(mount_rpy=rpy)))
    flip = np.diag((1.0, -1.0, -1.0))
    assert reading.rate == pytest.approx(flip @ mounting.apply((0.1, 0.2, 0.3)), abs=1e-15)
    assert reading.specific_force == pytest.approx(
        flip @ mounting.apply((1.0, 2.0, 9.8)), abs=1e-14)
    got = rotation.from_quat(np.roll(reading.orientation, -1)).as_matrix()
    to_ned = rotation.from_euler('xyz', (math.pi, 0.0, math.pi / 2)).as_matrix()
    assert got == pytest.approx(to_ned @ body_to_enu.as_matrix() @ flip, abs=1e-14)


@pytest.mark.parametrize(('field', 'index', 'value', 'reason'), [
    ('angular_velocity_covariance', 0, -1.0, 'no_angular_velocity'),
    ('linear_acceleration_covariance', 0, -1.0, 'no_linear_acceleration'),
    ('angular_velocity_covariance', 4, math.nan, 'nan_covariance'),
    ('linear_acceleration_covariance', 8, -0.1, 'negative_covariance'),
])
def test_covariances_by_rep_145(build, field, index, value, reason):
    message = build.imu()
    getattr(message, field)[index] = value
    with pytest.raises(Refused) as refused:
        decode_imu(message, PARAMS)
    assert refused.value.reason == reason


@pytest.mark.parametrize(('field', 'value', 'reason'), [
    ('angular_velocity', math.nan, 'not_finite'),
    ('linear_acceleration', math.inf, 'not_finite'),
    ('angular_velocity', 1e3, 'out_of_range'),
    ('linear_acceleration', -1e30, 'out_of_range'),
])
def test_bad_readings_are_refused(build, field, value, reason):
    message = build.imu()
    getattr(message, field).z = value
    with pytest.raises(Refused) as refused:
        decode_imu(message, PARAMS)
    assert refused.value.reason == reason


def reading_at(time_us):
    return ImuReading(time_us, np.array((0.1, 0.2, 0.3)), np.array((1.0, 0.0, -9.8)))


def test_increments_span_the_gap_between_stamps():
    integrator = ImuIntegrator(PARAMS)
    assert integrator.push(reading_at(1_000_000)) == []
    sample, = integrator.push(reading_at(1_004_000))
    assert sample.time_us == 1_004_000
    assert sample.delta_angle == pytest.approx((0.0004, 0.0008, 0.0012))
    assert sample.delta_velocity == pytest.approx((0.004, 0.0, -0.0392))
    assert sample.delta_angle_dt == sample.delta_velocity_dt == pytest.approx(0.004)


def test_a_long_gap_counts_and_is_no_giant_increment():
    integrator = ImuIntegrator(PARAMS)
    for time_us in (1_000_000, 1_010_000):
        integrator.push(reading_at(time_us))
    sample, = integrator.push(reading_at(6_000_000))
    assert sample.time_us == 6_000_000
    assert sample.delta_angle_dt == pytest.approx(0.01)
    assert integrator.gaps == 1
    samples = integrator.push(reading_at(6_020_000))
    assert sum(sample.delta_angle_dt for sample in samples) == pytest.approx(0.02)
    assert integrator.gaps == 1


@pytest.mark.parametrize('step_us', [13_001, 20_000, 30_303, 100_000])
def test_a_slow_imu_is_split_without_loss(step_us):
    integrator = ImuIntegrator(PARAMS)
    north = np.array((1.0, 0.0, 0.0, 0.0))
    for k in range(40):
        samples = integrator.push(reading_at(1_000_000 + k * step_us)._replace(orientation=north))
    assert max(sample.delta_angle_dt for sample in samples) < 0.0051
    assert sum(sample.delta_angle_dt for sample in samples) == pytest.approx(1e-6 * step_us)
    assert sum(sample.delta_angle for sample in samples) == pytest.approx(
        1e-6 * step_us * np.array((0.1, 0.2, 0.3)))
    assert sum(sample.delta_velocity for sample in samples) == pytest.approx(
        1e-6 * step_us * np.array((1.0, 0.0, -9.8)))
    times_us = [1_000_000 + 38 * step_us, *(sample.time_us for sample in samples)]
    assert np.diff(times_us) * 1e-6 == pytest.approx(
        [sample.delta_velocity_dt for sample in samples], abs=1e-9)
    assert times_us[-1] == 1_000_000 + 39 * step_us
    assert all(sample.orientation is None for sample in samples[:-1])
    assert samples[-1].orientation is north


def test_missing_readings_of_an_impact_are_interpolated():
    """A touchdown of which every fourth mean over 4 ms is lost, as loggers lose them."""
    times = np.arange(1, 401)
    since = 0.004 * (times - 301)
    force = -9.8 - 300.0 * (since >= 0.0) * np.exp(-since / 0.03)
    held, integrated = 0.0, 0.0
    integrator = ImuIntegrator(PARAMS)
    last = 0
    for k, value in zip(times, force, strict=True):
        if k % 4 == 2:
            continue
        samples = integrator.push(ImuReading(int(k) * 4000, (0.0, 0.0, 0.0), (0.0, 0.0, value)))
        if samples:
            assert sum(s.delta_velocity_dt for s in samples) == pytest.approx(0.004 * (k - last))
            integrated += sum(s.delta_velocity[2] for s in samples)
            held += value * 0.004 * (k - last)
        last = k
    truth = 0.004 * force[1:].sum()
    assert abs(integrated - truth) < 0.2 * abs(held - truth)


@pytest.mark.parametrize(('step', 'reason'), [(0, 'repeated_stamp'), (-5, 'backward_stamp')])
def test_time_must_advance(step, reason):
    integrator = ImuIntegrator(PARAMS)
    integrator.push(reading_at(1_000_000))
    with pytest.raises(Refused) as refused:
        integrator.push(reading_at(1_000_000 + step))
    assert refused.value.reason == reason
    sample, = integrator.push(reading_at(1_010_000))
    assert sample.delta_angle_dt == pytest.approx(0.01)


def test_reset_forgets_the_last_reading():
    integrator = ImuIntegrator(PARAMS)
    integrator.push(reading_at(1_000_000))
    integrator.reset()
    assert integrator.push(reading_at(500_000)) == []


def test_husky_imu_reads_up_and_turns_with_the_wheels(recorded):
    readings = [decode_imu(message, HUSKY) for message in recorded('rl_husky', '/imu/data')]
    force = np.mean([reading.specific_force for reading in readings], axis=0)
    assert force[2] == pytest.approx(-9.8, abs=0.1)
    assert np.hypot(force[0], force[1]) < 0.4
    stamps = np.array([reading.time_us for reading in readings])
    rate = np.array([reading.rate[2] for reading in readings])
    wheels = recorded('rl_husky', '/husky_velocity_controller/odom')
    times = [m.header.stamp.sec * 10**6 + m.header.stamp.nanosec // 1000 for m in wheels]
    yaw = np.unwrap([2 * math.atan2(m.pose.pose.orientation.z, m.pose.pose.orientation.w)
                     for m in wheels])
    # Counter-clockwise seen from above is negative about the down axis.
    turned = -np.gradient(yaw, np.array(times) * 1e-6)
    assert np.corrcoef(np.interp(times, stamps, rate), turned)[0, 1] > 0.9


def test_rover_imu_has_no_orientation(recorded):
    message = recorded('rover_canada_openvins_gps_imu', '/imu/data_raw')[0]
    reading = decode_imu(message, PARAMS)
    assert reading.orientation is None
    assert reading.specific_force[2] == pytest.approx(-9.81, abs=0.1)


def test_a_gap_is_bridged_at_the_usual_interval():
    """A turn that speeds up evenly is known to the last degree after half a second of silence."""
    integrator = ImuIntegrator(PARAMS)
    times_us = [*range(0, 1_000_000, 10_000), *range(1_500_000, 2_000_000, 10_000)]
    samples = [
        sample for time_us in times_us for sample in integrator.push(
            # the mean rate over the 10 ms that end here
            ImuReading(time_us, (0.0, 0.0, 1e-6 * (time_us - 5_000)), (0.0, 0.0, -9.8)))]
    assert [s.time_us for s in samples] == list(range(10_000, 2_000_000, 10_000))
    assert [s.delta_angle_dt for s in samples] == pytest.approx([0.01] * len(samples))
    assert sum(s.delta_angle[2] for s in samples) == pytest.approx(0.5 * 1.99 ** 2)
