"""One row per filter update: states, variances, flags and innovations in the reference's words."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from types import TracebackType

import numpy as np

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.ekf2.flags import FAULT_NAMES
from ekf_fusion_ros.ekf2.flags import FLAG_NAMES
from ekf_fusion_ros.ekf2.flags import ControlFlags
from ekf_fusion_ros.ekf2.gnss_checks import CHECK_NAMES
from ekf_fusion_ros.mathlib.rotation import quat_from_matrix

STATES = (
    'q0 q1 q2 q3 vn ve vd pn pe pd dax_b day_b daz_b dvx_b dvy_b dvz_b mag_n mag_e mag_d '
    'mag_bx mag_by mag_bz wind_n wind_e').split()
OUTPUT = [f'out_{name}' for name in STATES[0:10]]
WORDS = ['control_status', 'gps_check_fail', 'innov_check_fail', 'fault_status', 'soln_status',
         'warning_events', 'information_events']
SUMMARY = ['tr_mag', 'tr_vel', 'tr_pos', 'tr_hgt', 'tr_tas', 'tr_hagl', 'tr_beta']
RATIOS = ('r_gps_hvel r_gps_vvel r_gps_hpos r_gps_vpos r_ev_hvel r_ev_vvel r_ev_hpos r_ev_vpos '
          'r_baro r_rng r_yaw r_mag r_tas r_beta r_hagl r_flow r_auxvel').split()
COMPONENTS = ('gps_vn gps_ve gps_vd gps_pn gps_pe gps_pd ev_vn ev_ve ev_vd ev_pn ev_pe ev_pd '
              'baro yaw magx magy magz').split()
TAIL = ('gsf_yaw gsf_yaw_var ev_q0 ev_q1 ev_q2 ev_q3 terrain_vpos origin_lat origin_lon '
        'origin_alt quat_resets velNE_resets velD_resets posNE_resets posD_resets dead_reckoning '
        'd_q0 d_q1 d_q2 d_q3 d_vn d_ve d_vd d_pn d_pe d_pd hagl_valid i_rng i_tas i_beta '
        'i_drag_x i_drag_y i_flow_x i_flow_y i_hagl i_aux_n i_aux_e').split()
COLUMNS = [
    'time_us', 'now_us', *STATES, *(f'P_{name}' for name in STATES), *OUTPUT, *WORDS, *SUMMARY,
    *RATIOS, *(f'i_{name}' for name in COMPONENTS), *(f'iv_{name}' for name in COMPONENTS), *TAIL]

WARNINGS = (
    EventKind.GPS_QUALITY_POOR, EventKind.GPS_FUSION_TIMEOUT, EventKind.GPS_DATA_STOPPED,
    EventKind.GPS_DATA_STOPPED_ALTERNATE, EventKind.HEIGHT_RESET, EventKind.NAVIGATION_STOPPED,
    EventKind.ACCEL_BIAS_RESET, EventKind.BAD_YAW_COURSE_USED, EventKind.MAG_STOPPED,
    EventKind.VISION_STOPPED, EventKind.EMERGENCY_YAW_RESET)
INFORMATION = (
    EventKind.ORIGIN_SET, EventKind.VEL_RESET_GPS, EventKind.VEL_RESET_FLOW,
    EventKind.VEL_RESET_VISION, EventKind.VEL_RESET_ZERO, EventKind.POS_RESET_LAST_KNOWN,
    EventKind.POS_RESET_GPS, EventKind.POS_RESET_VISION, EventKind.GPS_STARTED,
    EventKind.VISION_POS_STARTED, EventKind.VISION_VEL_STARTED, EventKind.VISION_YAW_STARTED,
    EventKind.YAW_ALIGNED_IMU_GPS)


def word(bits: list[bool]) -> int:
    """Return an integer with bit i set where bits[i] is true."""
    return sum(1 << i for i, bit in enumerate(bits) if bit)


class EstimatorLog:
    """Writes estimator.csv."""

    def __init__(self, path: Path) -> None:
        """Create the file with its header."""
        self._stream = path.open('w', newline='', encoding='utf-8')
        self._writer = csv.writer(self._stream, lineterminator='\n')
        self._writer.writerow(COLUMNS)

    def write(self, ekf: Ekf2) -> None:
        """Append the state of a filter that has just advanced."""
        self._writer.writerow([
            str(v) if isinstance(v, int) else format(v, '.10g') for v in row(ekf)])

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def __enter__(self) -> EstimatorLog:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()


def row(ekf: Ekf2) -> list[float]:
    """Return the values of COLUMNS."""
    f = ekf.filter
    values: list[float] = [f.t_horizon, f.t_now]
    values += f.x.tolist()
    values += np.diag(f.cov.p).tolist()
    values += _output(ekf)
    values += [word([getattr(f.flags, name) for name in FLAG_NAMES]),
               word([bool(ekf.control.checks.results[name].failed) for name in CHECK_NAMES]),
               _rejections(ekf), word([getattr(f.faults, name) for name in FAULT_NAMES]),
               _solution_status(ekf),
               word([kind in f.events.seen for kind in WARNINGS]),
               word([kind in f.events.seen for kind in INFORMATION])]
    values += _summary(ekf)
    values += _ratios(ekf)
    values += _components(ekf, 'innovation')
    values += _components(ekf, 'variance')
    values += _tail(ekf)
    return values


def _output(ekf: Ekf2) -> list[float]:
    out = ekf.filter.output
    lever = np.asarray(ekf.params.imu.position)
    return [*out.now[0:4].tolist(), *out.velocity_at_origin(lever).tolist(),
            *out.position_at_origin(lever).tolist()]


def _rejections(ekf: Ekf2) -> int:
    r = ekf.filter.rejections
    # bit 3 is shared: the 3-axis magnetometer writes its x axis where height writes its verdict
    bit3 = r.mag_x if r.mag_judged_after_height else r.ver_pos
    # and bit 10: height above ground and flow about x
    bit10 = r.flow_x if r.flow_judged_after_hagl else r.hagl
    return word([r.hor_vel, r.ver_vel, r.hor_pos, bit3, r.mag_y, r.mag_z, False, r.yaw,
                 r.airspeed, r.sideslip, bit10, r.flow_y])


def _solution_status(ekf: Ekf2) -> int:
    f = ekf.filter
    flags, seen = f.flags, f.observations
    clean = not f.faults.any()
    horizontal = flags.aided_horizontally() and clean
    relative = flags.gps or flags.ev_pos or flags.opt_flow
    absolute = flags.gps or flags.ev_pos
    height = flags.has_height()
    gnss_bad = max(seen.gps_hor_vel.test_ratio, seen.gps_ver_vel.test_ratio,
                   _horizontal_position(ekf).test_ratio) > 1.0
    mag_good = seen.mag.test_ratio < 1.0 and seen.yaw.test_ratio < 1.0
    return word([
        flags.tilt_align and flags.yaw_align and clean, horizontal, height and clean,
        relative and clean, absolute and clean, height and clean,
        ekf.control.terrain.valid, not horizontal, relative and clean, absolute and clean,
        gnss_bad and mag_good, f.faults.accel_vertical])


def _horizontal_position(ekf: Ekf2):  # type: ignore[no-untyped-def]
    """Return the record of GNSS or fake position, whichever was tried last."""
    seen = ekf.filter.observations
    gnss_is_newer = seen.gps_hor_pos.time_us > seen.fake_pos.time_us
    return seen.gps_hor_pos if gnss_is_newer else seen.fake_pos


def _summary(ekf: Ekf2) -> list[float]:
    f = ekf.filter
    flags: ControlFlags = f.flags
    seen = f.observations
    velocity, position = math.nan, math.nan
    tiny = float(np.finfo(np.float32).tiny)
    if flags.gps:
        velocity = max(seen.gps_hor_vel.test_ratio, seen.gps_ver_vel.test_ratio, tiny)
        position = max(seen.gps_hor_pos.test_ratio, tiny)
    if flags.ev_vel:
        velocity = max(seen.ev_hor_vel.test_ratio, seen.ev_ver_vel.test_ratio, tiny,
                       0.0 if math.isnan(velocity) else velocity)
    if flags.ev_pos:
        position = max(seen.ev_hor_pos.test_ratio, tiny,
                       0.0 if math.isnan(position) else position)
    if flags.opt_flow and not flags.aided_other_than(flags.opt_flow):
        velocity = max(seen.flow.test_ratio, tiny)
    height = ekf.control.height_source.active_record()
    return [math.sqrt(max(seen.yaw.test_ratio, seen.mag.test_ratio)), math.sqrt(velocity),
            math.sqrt(position), math.nan if height is None else math.sqrt(height.test_ratio),
            *(math.sqrt(r.test_ratio) for r in (seen.airspeed, seen.hagl, seen.sideslip))]


def _ratios(ekf: Ekf2) -> list[float]:
    seen = ekf.filter.observations
    return [
        seen.gps_hor_vel.test_ratio, seen.gps_ver_vel.test_ratio,
        _horizontal_position(ekf).test_ratio, seen.gps_height.test_ratio,
        seen.ev_hor_vel.test_ratio, seen.ev_ver_vel.test_ratio, seen.ev_hor_pos.test_ratio,
        seen.ev_height.test_ratio, seen.baro_height.test_ratio,
        seen.range_height.test_ratio, seen.yaw.test_ratio, seen.mag.test_ratio,
        seen.airspeed.test_ratio, seen.sideslip.test_ratio, seen.hagl.test_ratio,
        seen.flow.test_ratio, seen.aux_vel.test_ratio]


def _components(ekf: Ekf2, kind: str) -> list[float]:
    seen = ekf.filter.observations
    records = (
        seen.gps_hor_vel, seen.gps_ver_vel, _horizontal_position(ekf), seen.gps_height,
        seen.ev_hor_vel, seen.ev_ver_vel, seen.ev_hor_pos, seen.ev_height, seen.baro_height,
        seen.yaw, seen.mag)
    return [value for record in records for value in getattr(record, kind)]


def _tail(ekf: Ekf2) -> list[float]:
    f = ekf.filter
    bank, count = ekf.control.bank, ekf.control.resets.counters
    running = bank.running
    origin = f.earth.origin
    seen = f.observations
    further = (seen.range_height, seen.airspeed, seen.sideslip, seen.drag, seen.flow, seen.hagl,
               seen.aux_vel)
    place = [math.nan] * 3 if origin is None else [origin.lat, origin.lon, origin.alt]
    return [
        bank.yaw if running else math.nan, bank.variance if running else math.nan,
        *quat_from_matrix(f.rot_ev).tolist(), ekf.control.terrain.down, *place,
        count.quat % 256, count.vel_ne % 256, count.vel_d % 256, count.pos_ne % 256,
        count.pos_d % 256, int(f.dead_reckoning),
        *count.d_quat.tolist(), *count.d_vel_ne.tolist(), count.d_vel_d,
        *count.d_pos_ne.tolist(), count.d_pos_d, int(ekf.control.terrain.valid),
        *(value for record in further for value in record.innovation)]
