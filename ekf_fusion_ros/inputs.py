"""Per role: which decoder turns its messages into samples, and what drives time."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING
from typing import Any

from ekf_fusion_ros.messages.decode_fix import decode_fix
from ekf_fusion_ros.messages.decode_fix import decode_fix_velocity
from ekf_fusion_ros.messages.decode_imu import ImuIntegrator
from ekf_fusion_ros.messages.decode_imu import decode_imu
from ekf_fusion_ros.messages.decode_magnetic_field import decode_magnetic_field
from ekf_fusion_ros.messages.decode_odometry import decode_odometry
from ekf_fusion_ros.messages.decode_pressure import decode_pressure
from ekf_fusion_ros.odometry_imu import OdometryImu
from ekf_fusion_ros.pairing import FixVelocity
from ekf_fusion_ros.roles import FIX
from ekf_fusion_ros.roles import FIX_VELOCITY
from ekf_fusion_ros.roles import IMU
from ekf_fusion_ros.roles import MAGNETIC_FIELD
from ekf_fusion_ros.roles import ODOMETRY
from ekf_fusion_ros.roles import PRESSURE
from ekf_fusion_ros.samples import ImuSample

if TYPE_CHECKING:
    from ekf_fusion_ros.params.tree import Params

DECODERS: dict[str, Callable[..., Any]] = {
    ODOMETRY: decode_odometry,
    FIX: decode_fix,
    IMU: decode_imu,
    MAGNETIC_FIELD: decode_magnetic_field,
    PRESSURE: decode_pressure,
}


def decoder_of(role: str, params: Params) -> Callable[[Any], Any]:
    """Return the function that turns a message of `role` into a stamped sample."""
    if role == FIX_VELOCITY:
        return lambda message: FixVelocity(*decode_fix_velocity(message, params.messages))
    return partial(DECODERS[role], params=params.messages)


class InertialInput:
    """Turns the messages of the inertial role into increments for the estimator."""

    def __init__(self, params: Params, role: str) -> None:
        self._imu = ImuIntegrator(params.messages) if role == IMU else None
        self._odometry = OdometryImu(params.two_topic) if role == ODOMETRY else None

    def push(self, reading: Any) -> list[ImuSample]:
        """Return the increments that end with this reading."""
        if self._imu is not None:
            sample = self._imu.push(reading)
            return [] if sample is None else [sample]
        assert self._odometry is not None
        return self._odometry.push(reading)
