"""Parameters of a PX4 log, against the table that its origin gives of them."""

from __future__ import annotations

import builtins
import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import load_file
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.px4 import translate
from ekf_fusion_ros.params.spec import leaves

FLIGHT = 'px4_sitl_v19_position'
RECORDINGS = (FLIGHT, 'px4_v111_ground_6s', 'px4_sitl_events')


def ulog_of(shared: Path, name: str) -> Path:
    return next((shared / 'data' / name / 'raw').glob('*.ulg'))


def table_of(shared: Path, name: str) -> dict[str, float]:
    path = shared / 'data' / name / 'reference' / 'px4_parameters.csv'
    with path.open(encoding='utf-8', newline='') as stream:
        return {row[0]: float(row[1]) for row in csv.reader(stream)}


@pytest.mark.parametrize('name', RECORDINGS)
def test_every_parameter_is_used_or_listed(shared: Path, name: str) -> None:
    """Each EKF2 name of the log is listed, or our parameter of that PX4 name has its value."""
    pytest.importorskip('pyulog')
    loaded = load_file(ulog_of(shared, name))
    ours = {spec.px4: value for _, value, spec in leaves(loaded.params) if spec.px4}
    listed = {line.split()[0] for line in loaded.unused}
    flown = {key: value for key, value in table_of(shared, name).items()
             if key.startswith('EKF2_')}
    compared = 0
    for key, value in flown.items():
        if key in ours:
            assert key not in listed
            scale = 1e-6 if key == 'EKF2_NOAID_TOUT' else 1.0
            assert ours[key] == pytest.approx(value * scale, rel=1e-6), key
            compared += 1
    assert compared > 45
    for key, value in flown.items():
        values, unused = translate({key: value}, Ekf2Params())
        assert values or unused, key


def test_flight_by_hand(shared: Path) -> None:
    """Values read in the log's own table; 245 = all checks but PDOP and vertical accuracy."""
    pytest.importorskip('pyulog')
    loaded = load_file(ulog_of(shared, FLIGHT))
    ekf2 = loaded.params.ekf2
    assert ekf2.gnss.checks.req_hacc == 3.0 and ekf2.gnss.checks.req_sacc == 0.5
    assert ekf2.gnss.checks.hdrift and not ekf2.gnss.checks.pdop and not ekf2.gnss.checks.vacc
    assert ekf2.mag.type == 'heading' and ekf2.height.reference == 'baro'
    assert ekf2.mag.declination_deg == pytest.approx(2.5636821, abs=1e-6)
    assert ekf2.aiding.airspeed_threshold == 0.0
    assert ekf2.timing.sensor_interval_min_ms == 20.0
    # Single precision would make it 0.003000000026.
    assert ekf2.imu.accel_bias_process_noise == 0.003
    assert loaded.params.messages.odometry.position_noise == 0.05
    assert loaded.params.ekf2.aiding.vehicle == 'multirotor'
    # The nine of the commander that navigation health goes by are none of these.
    assert '443 parameters of other PX4 modules' in loaded.unused
    assert 'EKF2_MAGBIAS_ID' in loaded.unused


def test_log_and_file_of_the_same_parameters_agree(shared: Path, tmp_path: Path) -> None:
    pytest.importorskip('pyulog')
    lines = [f'1\t1\t{name}\t{value!r}\t{6 if value.is_integer() else 9}'
             for name, value in table_of(shared, FLIGHT).items()]
    path = tmp_path / 'vehicle.params'
    # The table has the EKF2 parameters only.
    lines.append('1\t1\tMAV_TYPE\t2\t6')
    path.write_text('# Onboard parameters for Vehicle 1\n' + '\n'.join(lines) + '\n')
    from_file, from_log = load_file(path), load_file(ulog_of(shared, FLIGHT))
    assert from_file.params == from_log.params != Params()
    assert sorted(n for n in from_file.unused if n.startswith('EKF2_')) == sorted(
        n for n in from_log.unused if n.startswith('EKF2_'))


def test_a_parameter_changed_in_flight_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    pyulog = pytest.importorskip('pyulog')

    log = SimpleNamespace(
        initial_parameters={'EKF2_GPS_DELAY': 110.0, 'EKF2_GPS_P_NOISE': 0.5, 'MC_ROLL_P': 6.5,
                            'MAV_TYPE': 1.0, 'EKF2_FUSE_BETA': 0.0},
        changed_parameters=[
            (5, 'EKF2_GPS_DELAY', 150.0), (6, 'MC_ROLL_P', 7.0), (7, 'EKF2_GPS_P_NOISE', 0.5)])
    monkeypatch.setattr(pyulog, 'ULog', lambda *_, **__: log)
    path = tmp_path / 'flight.ulg'
    path.write_bytes(b'ULog\x01\x12\x35')
    loaded = load_file(path)
    assert loaded.params.ekf2.gnss.delay_ms == 110.0
    assert loaded.params.ekf2.aiding.vehicle == 'fixed_wing'
    assert not loaded.params.ekf2.air_data.use_sideslip
    assert loaded.unused == [
        '1 parameters of other PX4 modules', 'EKF2_GPS_DELAY as it was changed during the log']


@pytest.mark.parametrize('content', [b'', b'no log at all', b'ULog\x01\x12\x35\x01cut'])
def test_what_is_no_log_is_said(tmp_path: Path, content: bytes) -> None:
    pytest.importorskip('pyulog')
    path = tmp_path / 'flight.ulg'
    path.write_bytes(content)
    with pytest.raises(ValueError, match='not a ULog file') as refusal:
        load_file(path)
    assert 'flight.ulg' in str(refusal.value) and '\n' not in str(refusal.value)


def test_missing_log_and_missing_library_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip('pyulog')
    with pytest.raises(ValueError, match='cannot be read'):
        load_file(tmp_path / 'none.ulg')
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == 'pyulog':
            raise ModuleNotFoundError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, '__import__', without)
    with pytest.raises(ValueError, match='needs the library pyulog'):
        load_file(tmp_path / 'none.ulg')
