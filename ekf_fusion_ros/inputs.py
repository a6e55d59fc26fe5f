"""Per role: which decoder turns its messages into samples, and what drives time."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Collection
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING
from typing import Any

from ekf_fusion_ros.estimator import Estimator
from ekf_fusion_ros.messages.decode_airspeed import decode_airspeed
from ekf_fusion_ros.messages.decode_armed import decode_armed
from ekf_fusion_ros.messages.decode_aux_velocity import decode_aux_velocity
from ekf_fusion_ros.messages.decode_fix import decode_fix
from ekf_fusion_ros.messages.decode_fix import decode_fix_velocity
from ekf_fusion_ros.messages.decode_flow import decode_flow
from ekf_fusion_ros.messages.decode_gps_heading import decode_gps_heading
from ekf_fusion_ros.messages.decode_imu import ImuIntegrator
from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.decode_imu import decode_imu_rows
from ekf_fusion_ros.messages.decode_landed import decode_landed
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field_rows
from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.decode_odometry_rows import decode_odometry_rows
from ekf_fusion_ros.messages.decode_pressure import decode_pressure
from ekf_fusion_ros.messages.decode_pressure import decode_pressure_rows
from ekf_fusion_ros.messages.decode_range import decode_range
from ekf_fusion_ros.messages.flat import FlatRows
from ekf_fusion_ros.roles import AIRSPEED
from ekf_fusion_ros.roles import ARMED
from ekf_fusion_ros.roles import AUX_VELOCITY
from ekf_fusion_ros.roles import FIX
from ekf_fusion_ros.roles import FIX_2
from ekf_fusion_ros.roles import FIX_3
from ekf_fusion_ros.roles import FIX_VELOCITY
from ekf_fusion_ros.roles import FIX_VELOCITY_2
from ekf_fusion_ros.roles import FIX_VELOCITY_3
from ekf_fusion_ros.roles import FLOW
from ekf_fusion_ros.roles import GPS_HEADING
from ekf_fusion_ros.roles import IMU
from ekf_fusion_ros.roles import LANDED
from ekf_fusion_ros.roles import MAGNETIC_FIELD
from ekf_fusion_ros.roles import ODOMETRY
from ekf_fusion_ros.roles import PRESSURE
from ekf_fusion_ros.roles import RANGE
from ekf_fusion_ros.samples import AirspeedSample
from ekf_fusion_ros.samples import ArmedSample
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import DriftSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import VisionSample

if TYPE_CHECKING:
    from ekf_fusion_ros.odometry_drift import OdometryDrift
    from ekf_fusion_ros.params.tree import Params

DECODERS: dict[str, Callable[..., Any]] = {
    ODOMETRY: decode_odometry,
    FIX: decode_fix,
    FIX_VELOCITY: decode_fix_velocity,
    IMU: decode_imu,
    FIX_2: decode_fix,
    FIX_VELOCITY_2: decode_fix_velocity,
    FIX_3: decode_fix,
    FIX_VELOCITY_3: decode_fix_velocity,
    MAGNETIC_FIELD: decode_magnetic_field,
    PRESSURE: decode_pressure,
    RANGE: decode_range,
    FLOW: decode_flow,
    AIRSPEED: decode_airspeed,
    LANDED: decode_landed,
    GPS_HEADING: decode_gps_heading,
    AUX_VELOCITY: decode_aux_velocity,
    ARMED: decode_armed,
}

ROWS_DECODERS: dict[str, Callable[..., Any]] = {
    ODOMETRY: decode_odometry_rows,
    IMU: decode_imu_rows,
    MAGNETIC_FIELD: decode_magnetic_field_rows,
    PRESSURE: decode_pressure_rows,
}

ROLE_OF_SAMPLE: dict[type, str] = {
    ImuSample: IMU,
    GnssSample: FIX,
    VisionSample: ODOMETRY,
    MagSample: MAGNETIC_FIELD,
    BaroSample: PRESSURE,
    RangeSample: RANGE,
    FlowSample: FLOW,
    AirspeedSample: AIRSPEED,
    AuxVelocitySample: AUX_VELOCITY,
    LandedSample: LANDED,
    ArmedSample: ARMED,
    HeadingSample: 'heading',
    DriftSample: 'drift',
}

JUMPS = {
    'position': 'the position of the odometry jumped: the frame is taken to have moved',
    'attitude': 'the attitude of the odometry jumped: the frame is taken to have turned',
    'declared': 'the odometry says that its frame has jumped',
    'velocity': 'the velocity of the odometry changed faster than two_topic.odometry.'
                'max_acceleration: it is limited',
}


def decoder_of(role: str, params: Params) -> Callable[[Any], Any]:
    """Return the function that turns a message of `role` into a stamped sample."""
    messages = params.messages
    if DECODERS[role] is decode_fix:
        messages = replace(messages, fix=getattr(messages, role))
    if DECODERS[role] is decode_fix_velocity:
        messages = replace(messages, fix_velocity=getattr(messages, role))
    return partial(DECODERS[role], params=messages)


def rows_decoder_of(role: str, params: Params) -> Callable[[FlatRows], Sequence[Any]] | None:
    """Return the function that decodes many messages of `role` at once, None without one."""
    decode = ROWS_DECODERS.get(role)
    return None if decode is None else partial(decode, params=params.messages)


class InertialInput:
    """Turns the messages of the inertial role into increments for the estimator."""

    def __init__(self, params: Params, role: str) -> None:
        self._imu = ImuIntegrator(params.messages) if role == IMU else None
        self._odometry = make_odometry_imu(params) if role == ODOMETRY else None

    def push(self, reading: Any) -> list[ImuSample]:
        """Return the increments that end with this reading."""
        if self._imu is not None:
            return [reading] if isinstance(reading, ImuSample) else self._imu.push(reading)
        assert self._odometry is not None
        samples: list[ImuSample] = self._odometry.push(reading)
        return samples

    def fused(self, reading: VisionSample) -> VisionSample:
        """Return the odometry sample that was just pushed as the estimator should fuse it."""
        if self._odometry is None:
            return reading
        sample: VisionSample | None = self._odometry.fused()
        return reading if sample is None else sample

    def jump(self) -> str:
        """Return in words how the odometry frame jumped with the last message, '' if it did not.

        Velocities that change too fast are counted all the time but told once.
        """
        if self._odometry is None:
            return ''
        kind = self._odometry.jump
        if kind in JUMPS and (kind != 'velocity' or self._odometry.jumps[kind] == 1):
            return JUMPS[kind]
        return ''


def make_estimator(params: Params) -> Estimator:
    """Return the estimator that the parameters name."""
    if params.estimator == 'lpe':
        from ekf_fusion_ros.lpe.lpe import Lpe
        return Lpe(params.lpe)
    from ekf_fusion_ros.ekf2.ekf2 import Ekf2
    return Ekf2(params.ekf2)


def adopt_params(estimator: Estimator, params: Params) -> None:
    """Let an estimator of `make_estimator` go on with other parameters."""
    estimator.adopt(params.lpe if params.estimator == 'lpe' else params.ekf2)


def uses_fixes(params: Params) -> bool:
    """Return whether the estimator that the parameters name takes fixes."""
    gnss = params.lpe.gnss if params.estimator == 'lpe' else params.ekf2.gnss
    return gnss.enabled


def make_odometry_imu(params: Params) -> Any:
    """Return what turns odometry into inertial increments."""
    from ekf_fusion_ros.odometry_imu import OdometryImu
    return OdometryImu(params.two_topic)


def make_odometry_drift(params: Params) -> OdometryDrift | None:
    """Return what learns the drift of the odometry, None where nothing would go by it."""
    if params.estimator != 'ekf2' or not params.two_topic.drift.learn:
        return None
    from ekf_fusion_ros.odometry_drift import OdometryDrift
    return OdometryDrift(params.two_topic.drift)


def make_motion_heading(
    params: Params, roles: Collection[str], drift: OdometryDrift | None,
) -> Any:
    """Return what finds the heading of the odometry frame from motion, None where not needed."""
    if not (FIX in roles and ODOMETRY in roles):
        return None
    from ekf_fusion_ros.motion_heading import MotionHeading
    delay_ms = params.ekf2.gnss.delay_ms - params.ekf2.vision.delay_ms
    if params.estimator == 'lpe':
        delay_ms = 1000.0 * (params.lpe.gnss.delay - params.lpe.vision.delay)
    return MotionHeading(params.two_topic, round(1000 * delay_ms), drift)
