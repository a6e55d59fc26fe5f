"""PX4 and ECL parameters in ours; expectations from PX4's parameter reference."""

from __future__ import annotations

from pathlib import Path

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.px4 import shortest
from ekf_fusion_ros.params.px4 import translate
from ekf_fusion_ros.params.spec import leaves

QGC_FILE = """\
# Onboard parameters for Vehicle 1
#
# Vehicle-Id Component-Id Name Value Type
1\t1\tEKF2_AID_MASK\t321\t6
1\t1\tEKF2_GPS_CHECK\t245\t6
1\t1\tEKF2_GPS_DELAY\t120.000000000000000000\t9
1\t1\tEKF2_GPS_P_NOISE\t0.300000011920928955\t9
1\t1\tEKF2_HGT_MODE\t3\t6
1\t1\tEKF2_IMU_POS_Y\t-0.25\t9
1\t1\tEKF2_MAG_TYPE\t5\t6
1\t1\tEKF2_MULTI_IMU\t3\t6
1\t1\tEKF2_NOAID_TOUT\t3000000\t6
1\t1\tEKF2_REQ_GPS_H\t4.5\t9
1\t1\tMC_ROLL_P\t6.5\t9
1\t1\tSYS_AUTOSTART\t4001\t6
"""


def test_px4_file(tmp_path: Path) -> None:
    path = tmp_path / 'vehicle.params'
    path.write_text(QGC_FILE, encoding='utf-8')
    loaded = load_file(path)
    ekf2 = loaded.params.ekf2

    # 321 = 1 + 64 + 256: GPS, rotate external vision, vision velocity.
    assert ekf2.gnss.enabled and ekf2.vision.rotate and ekf2.vision.use_velocity
    assert not (ekf2.vision.use_position or ekf2.vision.use_yaw or ekf2.gnss.yaw)
    # 245 = all but PDOP (2) and vertical accuracy (8), without vertical speed (256).
    checks = ekf2.gnss.checks
    assert checks.nsats and checks.hacc and checks.sacc
    assert checks.hdrift and checks.vdrift and checks.hspeed
    assert not (checks.pdop or checks.vacc or checks.vspeed)
    assert ekf2.gnss.delay_ms == 120.0
    assert ekf2.gnss.pos_noise == pytest.approx(0.3, abs=1e-7)
    assert ekf2.height.reference == 'vision'
    assert ekf2.imu.position == (0.0, -0.25, 0.0)
    assert ekf2.mag.type == 'none'
    assert ekf2.aiding.valid_timeout == pytest.approx(3.0)
    assert checks.health_time == 4.5
    assert loaded.unused == ['EKF2_MULTI_IMU', '2 parameters of other PX4 modules']


def test_ecl_file(tmp_path: Path) -> None:
    path = tmp_path / 'params.txt'
    path.write_text(
        'fusion_mode=331\nvehicle.fixed_wing=1\nvehicle.flow_limits=6;0;50\noutput.every=5\n'
        'imu_pos_body=0.06;-0.04;0.03\nmag_fusion_type=4\nvalid_timeout_max=4000000\n'
        'bcoef_x=25\nauxvel_noise=0.5\nterrain_fusion_mode=1\nrange_aid=1\n'
        'mag_declination_source=1\ncheck_mag_strength=1\n', encoding='utf-8')
    loaded = load_file(path)
    ekf2 = loaded.params.ekf2

    # 331 = 1 + 2 + 8 + 64 + 256: GPS, flow, vision position, rotate, vision velocity.
    assert ekf2.gnss.enabled and ekf2.vision.use_position and ekf2.vision.rotate
    assert ekf2.vision.use_velocity and not ekf2.vision.use_yaw
    assert ekf2.imu.position == (0.06, -0.04, 0.03)
    assert ekf2.mag.type == 'indoor' and ekf2.mag.check_strength
    assert ekf2.mag.declination_from_table and not ekf2.mag.declination_always
    assert ekf2.aiding.valid_timeout == pytest.approx(4.0)
    assert loaded.vehicle == {'fixed_wing': 1.0, 'flow_limits': (6.0, 0.0, 50.0)}
    assert loaded.output == {'every': 5.0}
    assert loaded.unused == ['auxvel_noise']
    assert ekf2.flow.enabled and not ekf2.air_data.use_drag
    assert ekf2.flow.max_rate == 6.0
    assert ekf2.air_data.ballistic_coef_x == 25.0
    assert ekf2.terrain.use_range and not ekf2.terrain.use_flow
    assert ekf2.range.aid


def test_modern_vision_control_bits() -> None:
    values, unused = translate({'EKF2_EV_CTRL': 15, 'EKF2_HGT_REF': 1}, Ekf2Params())

    assert values == {
        'ekf2.vision.use_position': True,
        'ekf2.vision.use_velocity': True,
        'ekf2.vision.use_yaw': True,
        'ekf2.height.reference': 'gnss',
    }
    assert unused == ['EKF2_EV_CTRL bit 1 (vision height beside the height reference)']


def test_modern_gnss_control_bits() -> None:
    values, unused = translate({'EKF2_GPS_CTRL': 15}, Ekf2Params())

    assert values == {'ekf2.gnss.enabled': True, 'ekf2.gnss.yaw': True}
    assert unused == ['EKF2_GPS_CTRL bit 1 (GNSS height beside the height reference)',
                      'EKF2_GPS_CTRL bit 2 (GNSS velocity, which goes with position here)']


def test_magnetic_check_bits() -> None:
    values, unused = translate({'EKF2_MAG_CHECK': 7, 'EKF2_MAG_CHK_INC': 15.0}, Ekf2Params())
    assert values == {'ekf2.mag.check_strength': True, 'ekf2.mag.check_inclination': True,
                      'ekf2.mag.inclination_tolerance': 15.0}
    assert unused == ['EKF2_MAG_CHECK bit 2 (waiting for the field model)']


@pytest.mark.parametrize(('number', 'vehicle'), [
    (1, 'fixed_wing'), (2, 'multirotor'), (4, 'multirotor'), (10, 'rover'), (13, 'multirotor')])
def test_kind_of_vehicle(tmp_path: Path, number: int, vehicle: str) -> None:
    path = tmp_path / 'vehicle.params'
    path.write_text(f'1\t1\tMAV_TYPE\t{number}\t6\n1\t1\tMAV_SYS_ID\t1\t6\n')
    loaded = load_file(path)
    assert loaded.params.ekf2.aiding.vehicle == vehicle
    assert loaded.unused == ['1 parameters of other PX4 modules']


def test_a_vtol_is_no_kind_of_its_own() -> None:
    values, unused = translate({'MAV_TYPE': 22.0}, Ekf2Params())
    assert values == {} and unused == ['MAV_TYPE 22 (no kind of vehicle that makes a difference)']


@pytest.mark.parametrize('used', [True, False])
def test_sideslip(used: bool) -> None:
    assert translate({'EKF2_FUSE_BETA': float(used)}, Ekf2Params()) == (
        {'ekf2.air_data.use_sideslip': used}, [])


def test_names_outside_of_the_estimator() -> None:
    values, unused = translate({'EKF2_EVP_NOISE': 0.2, 'EKF2_MIN_OBS_DT': 30.0}, Ekf2Params())

    assert values == {'messages.odometry.position_noise': 0.2,
                      'ekf2.timing.sensor_interval_min_ms': 30.0}
    assert unused == []


@pytest.mark.parametrize(('stored', 'meant'), [
    (0.100000001490116120, 0.1), (0.300000011920928955, 0.3), (9.999999747378752e-05, 1e-4),
    (3.0, 3.0), (16777217.0, 16777217.0), (float('inf'), float('inf'))])
def test_single_precision_is_read_as_it_was_meant(stored: float, meant: float) -> None:
    assert shortest(stored) == meant


def test_bits_nobody_knows_are_listed() -> None:
    _, unused = translate({'gps_check_mask': 512}, Ekf2Params())
    assert unused == ['gps_check_mask bit 9 (not a bit that is known)']


def test_foreign_names_are_unique_and_translated_names_exist() -> None:
    ours = {name for name, _, _ in leaves(Params())}
    specs = [spec for _, _, spec in leaves(Params())]
    for names in ([s.px4 for s in specs if s.px4], [s.ecl for s in specs if s.ecl]):
        assert len(names) == len(set(names))

    numbers = dict.fromkeys(
        'fusion_mode gps_check_mask mag_declination_source EKF2_EV_CTRL vdist_sensor_type '
        'mag_fusion_type check_mag_strength synthesize_mag_z valid_timeout_max '
        'reset_timeout_max EKF2_REQ_GPS_H EKF2_IMU_POS_X EKF2_GPS_POS_Y EKF2_EV_POS_Z'.split(), 1)
    values, _ = translate(numbers, Ekf2Params())
    assert set(values) <= ours


def test_defaults_are_those_of_the_reference_battery(shared: Path) -> None:
    """The table of defaults that the reference filter was run with (FORMAT.md section 6)."""
    text = (shared / 'reference' / 'battery' / 'FORMAT.md').read_text(encoding='utf-8')
    by_ecl_name = {spec.ecl: value for _, value, spec in leaves(Ekf2Params()) if spec.ecl}
    compared = 0
    for line in text[text.index('## 6.'):].splitlines():
        for half in line.strip('|').split('||'):
            cells = [cell.strip() for cell in half.split('|')]
            value = by_ecl_name.get(cells[0])
            if isinstance(value, float) and len(cells) > 1:
                assert value == pytest.approx(float(cells[1].split()[0])), cells[0]
                compared += 1
    assert compared > 40
