"""Each way to use a magnetometer, on the bench: what it may correct, and when it is left alone."""

from __future__ import annotations

import math

from ekf2.bench import EARTH_FIELD
from ekf2.bench import Bench
import numpy as np
import pytest

from ekf_fusion_ros.ekf2.aid_sources.magnetic_fusion import synthetic_z
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.mathlib.rotation import matrix_from_euler_321
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams
from ekf_fusion_ros.params.ekf2 import MagParams
from ekf_fusion_ros.params.ekf2 import VisionParams
from ekf_fusion_ros.samples import LandedSample

LAT, LON = 47.3566094, 8.5190237
MOTORS = np.array((0.0, 0.06, 0.0))
"""Field in Gauss of the motors of forward flight: it turns a compass by 17 degrees."""


def compass(kind, **params):
    mag = MagParams(type=kind, **params.pop('mag', {}))
    return Bench(Ekf2Params(mag=mag, **params))


def looking(yaw):
    return matrix_from_euler_321(0.0, 0.0, yaw).T @ EARTH_FIELD


def yaw_deg(bench):
    return math.degrees(bench.attitude[2])


def flying(kind, **mag):
    """Three metres up on fixes, aligned there."""
    bench = compass(kind, mag=mag)
    bench.sending.add('fix')
    bench.run(12.0)
    assert 'gps' in bench.flags
    bench.fly()
    for _ in range(30):
        bench.altitude += 0.1
        bench.fix.alt += 0.1
        bench.run(0.1)
    return bench


def weave(bench, seconds, rate=0.5):
    """Turn to and fro, which shows the field of the body."""
    for _ in range(round(seconds)):
        for direction in (1.0, -1.0, -1.0, 1.0):
            for _ in range(25):
                bench.rate = np.array((0.0, 0.0, direction * rate))
                bench.turned += direction * rate * 0.01
                bench.field = looking(bench.turned)
                bench.run(0.01)
    bench.rate = np.zeros(3)


# Automatic, heading, three axes.

def test_automatic_is_heading_on_the_ground_and_three_axes_while_turning_in_flight():
    bench = compass('auto')
    bench.sending.add('fix')
    bench.run(6.0)
    weave(bench, 3.0)
    assert 'mag_hdg' in bench.flags
    bench = flying('auto')
    assert 'mag_hdg' in bench.flags and 'mag_aligned_in_flight' in bench.flags
    weave(bench, 3.0)
    assert 'mag_3d' in bench.flags and 'mag_hdg' not in bench.flags
    bench.run(1.5)
    assert 'mag_3d' in bench.flags
    bench.run(1.0)
    assert 'mag_hdg' in bench.flags and 'mag_3d' not in bench.flags


@pytest.mark.parametrize(('kind', 'flag'), [('heading', 'mag_hdg'), ('three_axis', 'mag_3d')])
def test_what_is_chosen_is_used_on_the_ground_and_in_flight(kind, flag):
    bench = compass(kind)
    bench.sending.add('fix')
    bench.run(6.0)
    assert flag in bench.flags
    bench = flying(kind)
    weave(bench, 3.0)
    assert flag in bench.flags


def test_variances_of_the_field_survive_a_pause_of_the_three_axes():
    bench = flying('auto')
    weave(bench, 6.0)
    assert 'mag_3d' in bench.flags
    while 'mag_3d' in bench.flags:
        before = bench.p[16:22].copy()
        bench.run(0.01)
    bench.run(3.0)
    assert not bench.p[16:22].any()
    while 'mag_3d' not in bench.flags:
        bench.rate = np.array((0.0, 0.0, 0.5))
        bench.turned += 0.005
        bench.field = looking(bench.turned)
        bench.run(0.01)
    # one fusion of the axes and one of the declination have only told it more
    assert (bench.p[16:22] > 0.0).all()
    assert (bench.p[16:22] <= before * 1.001).all()
    assert bench.p[19:22].max() < 0.5 * 0.05 ** 2


# In-flight alignment.

def test_yaw_is_aligned_once_above_the_steel_in_the_ground():
    bench = compass('auto')
    bench.sending.add('fix')
    bench.field = looking(0.4)
    bench.run(12.0)
    wrong = yaw_deg(bench)
    bench.fly()
    resets = bench.resets.quat
    for step in range(30):
        bench.altitude += 0.1
        bench.fix.alt += 0.1
        if step == 10:
            bench.field = looking(0.0)
        bench.run(0.2)
        if -bench.x[9] < 1.4:
            assert 'mag_aligned_in_flight' not in bench.flags
    assert 'mag_aligned_in_flight' in bench.flags
    assert bench.resets.quat == resets + 1
    assert yaw_deg(bench) == pytest.approx(wrong - math.degrees(0.4), abs=3.0)


def test_alignment_in_flight_ends_with_the_landing():
    bench = flying('auto')
    assert 'mag_aligned_in_flight' in bench.flags
    bench.ekf.push(LandedSample(bench.now_us, landed=True))
    bench.run(0.1)
    assert 'mag_aligned_in_flight' not in bench.flags


# VTOL: only the field is learned while airspeed is fused.

def in_forward_flight(kind, *, motors, airspeed=True):
    """Fly north at 15 m/s on wings of air; then the motors disturb the field, or not."""
    bench = flying(kind)
    bench.travel(15.0, 20.0)
    if airspeed:
        bench.airspeed = 15.0
        bench.sending.add('airspeed')
        bench.travel(15.0, 5.0)
        assert 'fuse_aspd' in bench.flags
    if motors:
        bench.field = bench.field + MOTORS
    bench.travel(15.0, 20.0)
    return bench


def difference(kind, **more):
    return (in_forward_flight(kind, motors=True, **more).x
            - in_forward_flight(kind, motors=False, **more).x)


def test_vtol_lets_the_field_correct_nothing_but_its_own_states():
    change = difference('vtol')
    assert np.abs(change[16:22]).max() > 0.005
    assert not change[0:16].any() and not change[22:24].any()


def test_vtol_uses_three_axes_while_airspeed_is_fused_and_then_chooses_as_ever():
    bench = in_forward_flight('vtol', motors=False)
    assert 'mag_3d' in bench.flags and 'mag_dec' not in bench.flags
    bench.sending.discard('airspeed')
    bench.travel(15.0, 15.0)
    assert 'fuse_aspd' not in bench.flags
    assert 'mag_hdg' in bench.flags and 'mag_3d' not in bench.flags


@pytest.mark.parametrize(('kind', 'airspeed'), [('auto', True), ('vtol', False)])
def test_otherwise_the_motors_turn_yaw(kind, airspeed):
    change = difference(kind, airspeed=airspeed)
    assert math.degrees(np.linalg.norm(2.0 * change[1:4])) > 3.0


def test_vtol_aligns_on_the_ground_as_automatic_does():
    benches = [compass(kind, gnss=GnssParams(enabled=False)) for kind in ('vtol', 'auto')]
    for bench in benches:
        bench.field = looking(0.7)
        bench.run(5.0)
    np.testing.assert_array_equal(benches[0].x, benches[1].x)
    assert math.radians(yaw_deg(benches[0])) == pytest.approx(0.7, abs=0.01)


# Indoor: only while fixes or odometry aid.

def test_indoors_a_field_is_not_used():
    bench = compass('indoor')
    bench.field = looking(1.0)
    bench.run(10.0)
    assert yaw_deg(bench) == pytest.approx(0.0, abs=0.1)
    bench.field = looking(-0.5)
    bench.run(10.0)
    assert yaw_deg(bench) == pytest.approx(0.0, abs=0.1)


def test_fixes_tell_that_it_is_outdoors():
    bench = compass('indoor', mag={'declination_from_table': False})
    bench.field = looking(1.0)
    bench.run(10.0)
    bench.sending.add('fix')
    bench.run(12.0)
    assert 'gps' in bench.flags
    assert math.radians(yaw_deg(bench)) == pytest.approx(1.0, abs=0.01)
    bench.sending.discard('fix')
    bench.fly()
    bench.run(12.0)
    assert 'gps' not in bench.flags
    bench.field = looking(0.5)
    bench.run(5.0)
    assert math.radians(yaw_deg(bench)) == pytest.approx(1.0, abs=0.01)


def test_odometry_lets_the_field_be_used():
    bench = compass('indoor', gnss=GnssParams(enabled=False),
                    vision=VisionParams(use_velocity=True))
    bench.sending.add('vision')
    bench.run(10.0)
    assert 'ev_vel' in bench.flags
    bench.field = looking(0.1)
    bench.run(60.0)
    assert math.radians(yaw_deg(bench)) == pytest.approx(0.1, abs=0.03)


# None.

def test_none_leaves_the_field_alone():
    bench = compass('none')
    bench.sending.add('fix')
    bench.run(15.0)
    assert not {'mag_hdg', 'mag_3d', 'mag_dec', 'yaw_align'} & bench.flags
    assert not bench.x[16:22].any() and not bench.p[16:22].any()


# Disturbance.

def disturbed(field, *, located=True, **checks):
    bench = compass('heading', mag=checks)
    if located:
        bench.sending.add('fix')
    bench.run(13.0)
    assert 'mag_disturbed' not in bench.flags
    bench.fly()
    before = yaw_deg(bench)
    bench.field = field
    bench.run(3.0)
    return bench, yaw_deg(bench) - before


@pytest.mark.parametrize(('factor', 'implausible'), [(1.3, False), (1.7, True), (0.4, True)])
def test_a_field_of_implausible_strength_is_not_used(factor, implausible):
    bench, turned = disturbed(factor * looking(0.3), check_strength=True)
    assert ('mag_disturbed' in bench.flags) == implausible
    assert abs(turned) < 0.1 if implausible else turned > 1.0


@pytest.mark.parametrize(('gauss', 'implausible'), [(0.8, False), (0.9, True), (0.04, True)])
def test_without_a_place_the_strength_must_be_found_on_earth(gauss, implausible):
    field = gauss * EARTH_FIELD / np.linalg.norm(EARTH_FIELD)
    bench, _ = disturbed(field, located=False, check_strength=True)
    assert ('mag_disturbed' in bench.flags) == implausible


@pytest.mark.parametrize(('degrees', 'implausible'), [
    (63.2 - 18.0, False), (63.2 - 22.0, True), (63.2 + 18.0, False), (63.2 + 22.0, True)])
def test_a_field_of_implausible_inclination_is_not_used(degrees, implausible):
    """The world magnetic model gives 63.2 degrees at Zurich."""
    inclination = math.radians(degrees)
    field = 0.45 * np.array((math.cos(inclination), 0.0, math.sin(inclination)))
    bench, _ = disturbed(field, check_inclination=True)
    assert ('mag_disturbed' in bench.flags) == implausible


def test_tilt_does_not_make_an_inclination_implausible():
    bench = Bench(Ekf2Params(mag=MagParams(type='heading', check_inclination=True)),
                  roll=0.5, pitch=-0.4, yaw=1.0)
    bench.sending.add('fix')
    bench.run(13.0)
    assert 'mag_disturbed' not in bench.flags


def test_after_a_disturbance_in_flight_yaw_is_aligned_anew():
    bench, _ = disturbed(1.7 * looking(0.3), check_strength=True)
    bench.field = looking(0.3)
    resets = bench.resets.quat
    bench.run(1.0)
    assert bench.resets.quat == resets and 'mag_disturbed' not in bench.flags
    bench.field = 1.7 * looking(0.3)
    bench.run(6.0)
    bench.field = looking(0.3)
    bench.run(1.0)
    assert bench.resets.quat == resets + 1


# Synthetic z.

@pytest.mark.parametrize(('roll', 'sign'), [(0.0, 1.0), (math.pi, -1.0)])
def test_synthetic_z_completes_the_strength_of_the_model(roll, sign):
    f = Filter(Ekf2Params(), 12)
    assert synthetic_z(f, EARTH_FIELD) is None
    f.earth.look_around(LAT, LON, 0)
    f.rot = matrix_from_euler_321(roll, 0.0, 0.0)
    measured = np.array((0.18, 0.05, 7.0))
    strength = f.earth.field.strength
    assert synthetic_z(f, measured) == pytest.approx(
        sign * math.sqrt(strength ** 2 - 0.18 ** 2 - 0.05 ** 2))
    assert synthetic_z(f, np.array((0.9, 0.0, 0.1))) == 0.0


def test_synthetic_z_hides_a_bad_axis():
    bench = flying('three_axis', synthesize_z=True)
    bench.field = bench.field + np.array((0.0, 0.0, 0.5))
    bench.run(10.0)
    assert 'synthetic_mag_z' in bench.flags
    assert np.abs(np.degrees(bench.attitude[0:2])).max() < 0.2
    innovation = bench.ekf.filter.observations.mag.innovation
    assert innovation[2] == 0.0 and np.abs(innovation).max() < 0.02
    plain = flying('three_axis')
    plain.field = plain.field + np.array((0.0, 0.0, 0.5))
    plain.run(10.0)
    assert plain.ekf.filter.observations.mag.test_ratio > 1.0
