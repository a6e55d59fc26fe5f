"""PX4's local position estimator (LPE): a Kalman filter of 10 states, attitude given.

Reference behaviour: PX4 1.13. What differs, and why: docs/px4_differences.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.report import health
from ekf_fusion_ros.lpe.report import nav_state
from ekf_fusion_ros.lpe.sensors.suite import Suite
from ekf_fusion_ros.lpe.state import PD
from ekf_fusion_ros.lpe.state import POSITION
from ekf_fusion_ros.lpe.state import SECOND
from ekf_fusion_ros.lpe.state import SIZE
from ekf_fusion_ros.lpe.state import TERRAIN
from ekf_fusion_ros.lpe.state import VELOCITY
from ekf_fusion_ros.mathlib.rotation import yaw_of
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.params.spec import validate
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import HeadingSample
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import MagSample
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]


class Lpe:
    """Position, velocity, accelerometer bias and terrain at the newest inertial sample.

    There is no fusion horizon: a measurement corrects the present state when it comes, by what
    the state of its own time should have measured.
    """

    def __init__(self, params: LpeParams | None = None) -> None:
        """Raise ValueError, naming the parameter, when one is out of range."""
        self.params = params or LpeParams()
        validate(self.params)
        self.reset()

    def reset(self) -> None:
        """Forget everything but the parameters."""
        self.filter = Filter(self.params)
        self.sensors = Suite(self.filter)
        self._imu: ImuSample | None = None
        self._passed_over: dict[type, Counter[str]] = {}
        self.initialised = False

    def push(self, sample: Sample) -> None:
        """Queue a measurement for the next update; an ImuSample is what updates."""
        attitude = self.filter.attitude
        if isinstance(sample, ImuSample):
            if self._imu is not None:
                self.update()
            self._imu = sample
        elif isinstance(sample, HeadingSample):
            attitude.push_heading(sample)
        elif isinstance(sample, MagSample):
            if not attitude.push_field(sample):
                self._pass_over(MagSample, 'attitude_has_another_source')
        else:
            self._push_to_sensor(sample)

    def _push_to_sensor(self, sample: Sample) -> None:
        attitude, used = self.filter.attitude, False
        if isinstance(sample, VisionSample):
            used = attitude.push_odometry(sample)
        elif isinstance(sample, GnssSample):
            attitude.push_fix(sample, round(SECOND * self.params.gnss.delay))
        sensor_of = self.sensors.takes.get(type(sample))
        if sensor_of is None:
            self._pass_over(type(sample), 'no_such_sensor')
        elif not used or sensor_of(sample).enabled():
            sensor_of(sample).push(sample)

    def _pass_over(self, kind: type, reason: str) -> None:
        self._passed_over.setdefault(kind, Counter())[reason] += 1

    def update(self) -> bool:
        """Process the pushed ImuSample; True when the filter has advanced by it."""
        imu, self._imu = self._imu, None
        if imu is None:
            return False
        f, sensors = self.filter, self.sensors
        f.now_us = imu.time_us
        f.attitude.step(imu)
        if not f.attitude.ready:
            return False
        self.initialised = True
        f.valid.step(f.P, self.params.process, aided=sensors.aided,
                     gnss=not sensors.gnss.timed_out, baro=not sensors.baro.timed_out)
        sensors.check_timeouts()
        self._fake_origin()
        f.check()
        f.predict(imu)
        sensors.step()
        if f.valid.horizontal:
            f.attitude.push_estimate(f.now_us, f.x[VELOCITY])
        f.history.note(f.now_us, f.x)
        return True

    def _fake_origin(self) -> None:
        """Place the map by parameters where no fix does."""
        f, params = self.filter, self.params.origin
        if params.fake and f.map.origin is None and f.valid.horizontal:
            f.map.tie(GeoPoint(params.latitude, params.longitude, 0.0), fake=True)
            f.tell('origin set by lpe.origin, not by a fix')

    def nav_state(self) -> NavState | None:
        """Return the state at the newest IMU sample, None before there is an attitude."""
        return nav_state(self) if self.initialised else None

    def states(self) -> Array:
        """Return the states (10,); `lpe.state.STATES` is their index map."""
        return self.filter.x.copy()

    def variances(self) -> Array:
        """Return the variances (10,) of `states`, in the squares of their units."""
        return np.diag(self.filter.P).copy()

    def aid_statuses(self) -> Sequence[AidStatus]:
        """Return one record per sensor that was ever initialised."""
        return [sensor.observation.status() for sensor in self.sensors.all
                if sensor.observation.judged or sensor.observation.starts]

    def passed_over(self) -> dict[type, dict[str, int]]:
        """Return by type and reason how many samples had no effect."""
        counts = {kind: Counter(reasons) for kind, reasons in self._passed_over.items()}
        for kind, sensors in self.sensors.of_type.items():
            for sensor in sensors:
                counts.setdefault(kind, Counter()).update(sensor.passed_over)
        return {kind: dict(reasons) for kind, reasons in counts.items() if reasons}

    def reset_counts(self) -> dict[str, int]:
        """Return how often attitude has jumped, and state and covariance begun again."""
        f = self.filter
        return {'attitude': f.attitude.jumps, 'state': f.state_resets,
                'covariance': f.covariance_resets}

    def drain_events(self) -> Sequence[Event]:
        """Return and forget the events since the last call."""
        return self.filter.drain_events()

    def health(self) -> Health:
        """Say in one sentence what the filter is doing."""
        return health(self)

    def set_origin(self, origin: GeoPoint) -> bool:
        """Move the origin of the local frame, keeping the place of the vehicle on the earth.

        Before there is an origin the local frame is tied to the point as it is.
        """
        if not origin.on_earth:
            return False
        f = self.filter
        before = f.map.origin
        f.map.tie(origin)
        if before is not None:
            self._move(f.map.position_of(before))
        return True

    def _move(self, shift: Array) -> None:
        """Add a shift (3,) to the position and to all that is measured in the local frame."""
        f, sensors = self.filter, self.sensors
        change = np.zeros(SIZE)
        change[POSITION] = shift
        change[TERRAIN] = shift[PD]
        f.jump(change)
        sensors.baro.move(float(shift[PD]))
        for external in (sensors.vision, sensors.mocap):
            external.offset = external.offset + shift

    def adopt(self, params: LpeParams) -> None:
        """Go on with other parameters, which differ from the present ones only in live ones.

        Raises ValueError, naming the parameter, when one is out of range.
        """
        validate(params)
        self.params = self.filter.params = params
        self.filter.attitude.params = params.attitude

    def set_pose(self, pose: GivenPose) -> bool:
        """Jump to a pose of the body origin (NED, m, rad) at the newest IMU sample.

        What the pose does not give stays; the velocity turns with the yaw. What is measured in
        the local frame follows, fixes may contradict. False before initialisation.
        """
        if not self.initialised:
            return False
        f = self.filter
        given = pose.position_var > 0.0
        self._move(np.where(given, pose.position - f.x[POSITION], 0.0))
        for i in np.flatnonzero(given):
            f.P[i], f.P[:, i] = 0.0, 0.0
            f.P[i, i] = pose.position_var[i]
        if pose.yaw_var > 0.0:
            self._turn(pose.yaw - yaw_of(f.attitude.rot))
            f.attitude.take_yaw(pose.yaw, pose.yaw_var)
        f.smoothing.clear()
        f.tell('pose set on request')
        return True

    def _turn(self, angle: float) -> None:
        """Turn the horizontal velocity by an angle in rad."""
        c, s = math.cos(angle), math.sin(angle)
        x = self.filter.x
        x[VELOCITY] = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))) @ x[VELOCITY]
