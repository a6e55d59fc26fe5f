"""The filter as the outside sees it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.lpe.state import ACCEL_BIAS
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import POSITION
from ekf_fusion_ros.lpe.state import STATES
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.state import VELOCITY

if TYPE_CHECKING:
    from ekf_fusion_ros.lpe.lpe import Lpe


def nav_state(lpe: Lpe) -> NavState:
    """Return the present state; corrections enter it smoothly."""
    f = lpe.filter
    attitude, x, P = f.attitude, f.smoothing.published(f.x), f.P
    position = x[POSITION].copy()
    if f.params.agl_as_height:
        position[PD] -= x[TERRAIN]
    fresh = not lpe.sensors.gnss.timed_out
    return NavState(
        time_us=f.now_us,
        quaternion=attitude.quaternion.copy(),
        velocity=x[VELOCITY].copy(),
        position=position,
        angular_rate=attitude.rate.copy(),
        pose_cov=_pose_covariance(P, attitude.covariance()),
        velocity_cov=P[VELOCITY, VELOCITY].copy(),
        gyro_bias=attitude.gyro_bias.copy(),
        accel_bias=f.x[ACCEL_BIAS].copy(),
        origin=f.map.origin,
        yaw_aligned=attitude.yaw_aligned,
        dead_reckoning=not lpe.sensors.aided,
        local_position_valid=f.valid.horizontal,
        global_position_valid=f.valid.horizontal and f.map.origin is not None,
        gnss_started=fresh or lpe.sensors.gnss.observation.starts > 0 or f.map.fake,
        in_air=f.landed is False or lpe.sensors.gnss.moves,
        yaw_jump=attitude.yaw_jump,
        acceleration=f.acceleration.copy(),
        ground_down=float(x[TERRAIN]) if f.valid.terrain else None,
        ground_variance=float(P[TERRAIN, TERRAIN]),
    )


def _pose_covariance(
    P: NDArray[np.float64], rotations: NDArray[np.float64],
) -> NDArray[np.float64]:
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = P[POSITION, POSITION]
    covariance[3:, 3:] = rotations
    return covariance


def health(lpe: Lpe) -> Health:
    """Return the first thing that is not as it should be, or what is being fused."""
    level, text = _state(lpe)
    return Health(level, text, _values(lpe))


def _state(lpe: Lpe) -> tuple[HealthLevel, str]:
    f, sensors = lpe.filter, lpe.sensors
    if not f.now_us:
        return HealthLevel.WARN, 'waiting for inertial data'
    if not f.attitude.ready:
        return HealthLevel.WARN, f'waiting for attitude (lpe.attitude.source: ' \
                                 f'{f.params.attitude.source})'
    if not f.attitude.yaw_aligned:
        return HealthLevel.WARN, 'aligning yaw'
    if not sensors.aided:
        return HealthLevel.ERROR if f.valid.horizontal else HealthLevel.WARN, \
            'no sensor of horizontal position or velocity'
    if not f.valid.horizontal:
        return HealthLevel.WARN, 'velocity not precise enough yet'
    faulty = sensors.faulty()
    if faulty:
        return HealthLevel.WARN, f'{", ".join(faulty)} contradict the estimate'
    return HealthLevel.OK, f'ok: fusing {", ".join(sensors.in_use())}'


def _values(lpe: Lpe) -> dict[str, str]:
    f = lpe.filter
    sigma = np.sqrt(np.maximum(np.diag(f.P), 0.0))
    valid = f.valid
    words = {'horizontal': valid.horizontal, 'height': valid.height, 'terrain': valid.terrain}
    values = {
        'attitude_source': f.attitude.source or 'none',
        'valid': ' '.join(word for word, on in words.items() if on) or 'nothing',
        'in_use': ' '.join(lpe.sensors.in_use()) or 'nothing',
        'faulty': ' '.join(lpe.sensors.faulty()) or 'nothing',
        'eph': f'{math.hypot(sigma[0], sigma[1]):.3f}', 'epv': f'{sigma[2]:.3f}',
        'evh': f'{math.hypot(sigma[3], sigma[4]):.3f}', 'evv': f'{sigma[5]:.3f}',
        'resets': str(f.state_resets + f.covariance_resets),
    }
    for name, place in STATES.items():
        values[f'state.{name}'] = ' '.join(f'{value:.4g}' for value in f.x[place])
        values[f'sigma.{name}'] = ' '.join(f'{value:.4g}' for value in sigma[place])
    return values
