"""A fixed wing with a wrong compass finds its yaw from the course of the fixes."""

from __future__ import annotations

import math

from ekf2.bench import EARTH_FIELD
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.aid_sources.magnetic_course import CourseAlignment
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.filter import GnssFix
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.mathlib.rotation import matrix_from_quat
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.samples import LandedSample


def launched(compass_error, *, on_wings=True, speed=15.0):
    """Launch due north with a compass that is wrong by an angle in rad."""
    bench = Bench()
    c, s = math.cos(compass_error), math.sin(compass_error)
    bench.field = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ EARTH_FIELD
    bench.sending.add('fix')
    bench.run(15.0)
    bench.fly(on_wings=on_wings)
    return climb(bench, speed, 5.0)


def climb(bench, speed, seconds):
    for _ in range(round(10 * seconds)):
        bench.altitude += 0.2
        bench.fix.alt += 0.2
        bench.travel(speed, 0.1)
    return bench


def announced(bench):
    return bench.ekf.filter.events.seen


def in_flight(yaw, *, aligned=False, speed=15.0):
    """A filter that flies at a speed in m/s along a yaw in rad, with a fix that goes north."""
    f = Filter(Ekf2Params(), 12)
    f.x[0:4] = (math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw))
    f.rot = matrix_from_quat(f.x[0:4])
    f.x[4:6] = speed * math.cos(yaw), speed * math.sin(yaw)
    f.x[19:22] = 0.03
    f.cov.set_variances(4, np.full(3, 0.09))
    f.fix = GnssFix(0, np.zeros(2), 0.0, np.array((speed, 0.0, 0.0)), hacc=0.5, vacc=0.8,
                    sacc=0.4, has_velocity=True, lat=0.0, lon=0.0)
    f.flags.gps = f.flags.in_air = f.flags.fixed_wing = f.flags.yaw_align = True
    f.flags.mag_aligned_in_flight = aligned
    f.observations.gps_hor_vel.test_ratio = 1.5
    return f, CourseAlignment(f, Resets(f), lambda: False)


def yaw_of_state(f):
    return math.atan2(2.0 * (f.x[0] * f.x[3] + f.x[1] * f.x[2]),
                      1.0 - 2.0 * (f.x[2] ** 2 + f.x[3] ** 2))


@pytest.mark.parametrize('degrees', [60.0, -80.0])
def test_a_bad_heading_is_turned_by_the_difference_of_the_courses(degrees):
    f, course = in_flight(math.radians(degrees))
    field = np.array((0.2, 0.05, 0.4))
    course.align(course.usable_fix(), field)
    assert yaw_of_state(f) == pytest.approx(0.0, abs=1e-9)
    # the nose points north now, so the field of the earth is the one that was measured
    np.testing.assert_allclose(f.x[16:19], field, atol=1e-9)
    assert not f.x[19:22].any()
    assert course.must_reset and f.flags.mag_aligned_in_flight and not f.flags.mag_fault
    # 0.4 m/s of the fix and twice 0.3 of the state across 15 m/s; q3 takes a half of the angle
    spread = math.asin(math.sqrt(0.16 + 2 * 0.09) / 15.0)
    assert f.cov.p[3, 3] == pytest.approx(0.25 * spread ** 2, rel=1e-6)


def test_once_aligned_the_nose_is_turned_into_the_relative_wind():
    f, course = in_flight(1.2, aligned=True)
    f.flags.wind = True
    f.x[22:24] = 0.0, 5.0
    course.align(course.usable_fix(), EARTH_FIELD)
    assert yaw_of_state(f) == pytest.approx(math.atan2(-5.0, 15.0), abs=1e-9)


def test_the_second_bad_heading_of_a_flight_ends_the_compass():
    f, course = in_flight(1.2, aligned=True)
    course.align(course.usable_fix(), EARTH_FIELD)
    assert not f.flags.mag_fault
    f.x[4:6] = 0.0, 15.0
    course.align(course.usable_fix(), EARTH_FIELD)
    assert f.flags.mag_fault
    assert EventKind.MAG_STOPPED in f.events.seen


@pytest.mark.parametrize(('error', 'ratio'), [(0.4, 1.5), (1.2, 0.9)])
def test_courses_that_agree_or_a_velocity_that_passes_leave_yaw_alone(error, ratio):
    f, course = in_flight(error)
    f.observations.gps_hor_vel.test_ratio = ratio
    course.align(course.usable_fix(), EARTH_FIELD)
    assert yaw_of_state(f) == pytest.approx(error)
    assert not course.must_reset
    np.testing.assert_allclose(f.x[16:19], f.rot @ EARTH_FIELD, atol=1e-9)


@pytest.mark.parametrize(('speed', 'sacc', 'usable'), [
    (15.0, 0.4, True), (4.9, 0.4, False), (6.0, 0.95, False)])
def test_a_course_needs_speed_and_accuracy(speed, sacc, usable):
    f, course = in_flight(0.0, speed=speed)
    f.fix = f.fix._replace(sacc=sacc)
    assert (course.usable_fix() is not None) is usable


def test_a_good_heading_is_kept():
    bench = launched(0.0)
    climb(bench, 15.0, 20.0)
    assert 'mag_aligned_in_flight' in bench.flags
    assert EventKind.BAD_YAW_COURSE_USED not in announced(bench)
    assert abs(bench.attitude[2]) < math.radians(5.0)


def test_too_slow_for_a_course_the_field_is_used():
    bench = launched(math.radians(60.0), speed=3.0)
    assert 'mag_aligned_in_flight' in bench.flags
    assert EventKind.BAD_YAW_COURSE_USED not in announced(bench)
    assert bench.attitude[2] == pytest.approx(math.radians(60.0), abs=0.15)


def test_on_the_ground_the_flight_is_forgotten():
    bench = launched(0.0)
    bench.ekf.push(LandedSample(bench.now_us, landed=True, fixed_wing=True))
    bench.run(0.1)
    assert 'mag_aligned_in_flight' not in bench.flags


def test_a_bad_heading_is_left_to_a_bank_that_is_certain_of_another():
    f, _ = in_flight(1.2)
    course = CourseAlignment(f, Resets(f), lambda: True)
    assert not course.align(course.usable_fix(), EARTH_FIELD)
    assert yaw_of_state(f) == pytest.approx(1.2)
    assert not f.flags.mag_aligned_in_flight


@pytest.mark.parametrize(('thorough', 'sigma', 'wind'), [(True, 0.1, False), (False, 1e-3, True)])
def test_what_a_false_yaw_has_taught_is_doubted(thorough, sigma, wind):
    f = Filter(Ekf2Params(gnss=GnssParams(thorough_yaw_recovery=thorough)), 12)
    f.flags.wind = True
    f.cov.set_variances(10, np.full(3, (1e-3 * f.dt_avg) ** 2))
    Resets(f).false_yaw(1.0, 0.005)
    assert yaw_of_state(f) == pytest.approx(1.0)
    np.testing.assert_allclose(np.sqrt(np.diag(f.cov.p)[10:13]) / f.dt_avg, sigma)
    assert f.flags.wind is wind
