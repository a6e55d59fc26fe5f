"""State and covariance with what the sensors share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.lpe.attitude import Attitude
from ekf_fusion_ros.lpe.correction import Innovation
from ekf_fusion_ros.lpe.correction import corrected
from ekf_fusion_ros.lpe.delay import DelayedStates
from ekf_fusion_ros.lpe.map_reference import MapReference
from ekf_fusion_ros.lpe.prediction import GRAVITY
from ekf_fusion_ros.lpe.prediction import dynamics_matrix
from ekf_fusion_ros.lpe.prediction import initial_covariance
from ekf_fusion_ros.lpe.prediction import is_sound
from ekf_fusion_ros.lpe.prediction import noise_intensity
from ekf_fusion_ros.lpe.prediction import predicted_covariance
from ekf_fusion_ros.lpe.prediction import predicted_state
from ekf_fusion_ros.lpe.smoothing import Smoothing
from ekf_fusion_ros.lpe.state import ACCEL_BIAS
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.validity import Validity
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.samples import ImuSample

Array = NDArray[np.float64]


class Filter:
    """x (10,) by the index map of `state`, its covariance P (10, 10), and the present time."""

    def __init__(self, params: LpeParams) -> None:
        """Start at the origin, at rest, with nothing valid."""
        self.params = params
        self.x = np.zeros(SIZE)
        self.P = initial_covariance(params.process)
        self.now_us = 0
        self.attitude = Attitude(params.attitude)
        self.acceleration = np.zeros(3)
        self.valid = Validity()
        self.history = DelayedStates()
        self.smoothing = Smoothing()
        self.map = MapReference(params.gnss.projection)
        self.landed: bool | None = None
        self.state_resets = 0
        self.covariance_resets = 0
        self._rot_before: Array | None = None
        self._events: list[Event] = []

    @property
    def agl(self) -> float:
        """Height above ground, m."""
        return float(self.x[TERRAIN] - self.x[PD])

    def tell(self, text: str) -> None:
        """Announce something that happens now."""
        self._events.append(Event(self.now_us, text))

    def drain_events(self) -> list[Event]:
        """Return and forget the events since the last call."""
        events, self._events = self._events, []
        return events

    def check(self) -> None:
        """Begin again with a state or a covariance that has ceased to be one."""
        if not np.isfinite(self.x).all():
            self.x[:] = 0.0
            self.smoothing.clear()
            self.state_resets += 1
            self.tell('the state was not finite: it begins again at zero')
        if not is_sound(self.P):
            self.P = initial_covariance(self.params.process)
            self.covariance_resets += 1
            self.tell('the covariance was not positive: it begins again')

    def predict(self, imu: ImuSample) -> None:
        """Carry state and covariance over an inertial increment, whose attitude is known."""
        dt, rot, params = imu.delta_velocity_dt, self.attitude.rot, self.params.process
        before = rot if self._rot_before is None else self._rot_before
        # The force acts along the way from one attitude to the next.
        mean_rot = 0.5 * (before + rot)
        u = mean_rot @ (imu.delta_velocity / dt) + GRAVITY
        A = dynamics_matrix(mean_rot)
        intensity = noise_intensity(self.x, params)
        self.x = predicted_state(self.x, A, u, dt, self.valid)
        self.P = predicted_covariance(self.P, A, intensity, dt)
        self.acceleration = u - rot @ self.x[ACCEL_BIAS]
        self.smoothing.step(dt, params.smoothing)
        self._rot_before = rot

    def correct(self, C: Array, innovation: Innovation) -> None:
        """Correct by a measurement whose innovation has passed."""
        change, self.P = corrected(self.P, C, innovation)
        self.x = self.x + change
        self.smoothing.note(change)

    def jump(self, change: Array) -> None:
        """Add a change (10,) to the state and its past on request, at once."""
        self.x = self.x + change
        self.history.move(change)

    def place_terrain(self, distance: float, variance: float) -> None:
        """Begin the terrain `distance` m below, m^2; what is not valid has no past to keep."""
        self.x[TERRAIN] = self.x[PD] + distance
        self.P[TERRAIN] = self.P[PD]
        self.P[:, TERRAIN] = self.P[:, PD]
        self.P[TERRAIN, TERRAIN] = self.P[PD, PD] + variance
