"""PX4's EKF2: 24 states at a delayed fusion horizon, predicted to now.

Reference behaviour: PX4-ECL of July 2021. What differs, and why: docs/px4_differences.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.buffer import SampleBuffer
from ekf_fusion_ros.ekf2.accel_bias_check import AccelBiasCheck
from ekf_fusion_ros.ekf2.admission import admitted
from ekf_fusion_ros.ekf2.admission import admitted_imu
from ekf_fusion_ros.ekf2.alignment import Alignment
from ekf_fusion_ros.ekf2.control import Control
from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.ground_contact import GroundContact
from ekf_fusion_ros.ekf2.inertial_input import InertialInput
from ekf_fusion_ros.ekf2.inertial_input import buffer_lengths
from ekf_fusion_ros.ekf2.inertial_lapse import InertialLapse
from ekf_fusion_ros.ekf2.report import health
from ekf_fusion_ros.ekf2.report import nav_state
from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.estimator import GeoPoint
from ekf_fusion_ros.estimator import GivenPose
from ekf_fusion_ros.estimator import Health
from ekf_fusion_ros.estimator import NavState
from ekf_fusion_ros.geo.magnetic_field import check_field
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.spec import validate
from ekf_fusion_ros.samples import NO_CLIPPING
from ekf_fusion_ros.samples import AirspeedSample
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
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.samples import VisionSample

Array = NDArray[np.float64]


class Ekf2:
    """Attitude, velocity, position, sensor biases, magnetic field and wind from many sensors.

    Measurements wait in buffers until the fusion horizon, which lags now by the largest sensor
    delay, has passed them. The horizon advances with the inertial data; the output predictor
    carries its state to now.
    """

    def __init__(self, params: Ekf2Params | None = None) -> None:
        """Raise ValueError, naming the parameter, when one is out of range or cannot be had."""
        self.params = params or Ekf2Params()
        if not isinstance(self.params, Ekf2Params):
            raise TypeError(
                f'{type(params).__name__}: expected Ekf2Params; of Params they are `.ekf2`')
        validate(self.params)
        check_field(self.params.mag.field_model)
        self._imu_length, self._observation_length = buffer_lengths(
            max_delay_ms(self.params), self.params.timing.sensor_interval_min_ms)
        self.reset()

    def reset(self) -> None:
        """Forget everything but the parameters."""
        self.filter = Filter(self.params, self._imu_length)
        self.control = Control(self.filter, self._observation_length, self._imu_length)
        self.inertial = InertialInput(self._imu_length, self._observation_length,
                                      self.params.imu.moving_scaler)
        self._alignment = Alignment(self.filter, self.control.mag, self.control.baro,
                                    self.control.height_source, self._observation_length)
        self._accel_bias_check = AccelBiasCheck(self.filter)
        self.lapse = InertialLapse(self.filter, self.control.resets, self.control.bank)
        self._ground_contact = GroundContact(self.filter)
        self._raw: ImuSample | None = None
        self._nav: NavState | None = None
        self._too_early: Counter[type] = Counter()
        self.initialised = False
        self._queues = self._make_queues()

    def _make_queues(self) -> dict[type, Callable[[Any, int], object]]:
        """Return what takes each kind of sample, with the least interval between two in us."""
        control = self.control
        return {
            MagSample: control.mag.push,
            BaroSample: control.baro.push,
            VisionSample: control.vision.push,
            GnssSample: self._push_fix,
            RangeSample: control.range.push,
            FlowSample: control.flow.push,
            AirspeedSample: control.airspeed.push,
            AuxVelocitySample: control.aux_velocity.push,
            HeadingSample: lambda sample, _: control.vision.heading.push(sample),
            DriftSample: lambda sample, _: self.filter.cov.limit_position_drift(sample.walk),
            LandedSample: lambda sample, _: self._ground_contact.tell(sample),
        }

    def push(self, sample: Sample) -> None:
        """Queue a measurement; those before the first ImuSample have no effect.

        Raises ValueError for a sample with an array of wrong shape, or with numbers that are not
        finite where they must be (an ImuSample at its update), and TypeError for what is no
        sample; the state stays as it is.
        """
        self._nav = None
        if isinstance(sample, ImuSample):
            sample = admitted_imu(sample)
            if self._raw is not None:
                self.update()
            self._raw = sample
            self.inertial.started = True
            return
        queue = self._queues.get(type(sample))
        if queue is None:
            raise TypeError(f'{type(sample).__name__}: expected one of '
                            + ', '.join(kind.__name__ for kind in (ImuSample, *self._queues)))
        if self.inertial.started:
            queue(admitted(sample), self.inertial.min_interval_us)
        else:
            self._too_early[type(sample)] += 1

    def update(self) -> bool:
        """Process the pushed ImuSample; True when the filter advanced by a period.

        Raises ValueError for one whose numbers are not finite, as if it had not been pushed.
        """
        raw, self._raw = self._raw, None
        if raw is None:
            return False
        self._nav = None
        f, inertial = self.filter, self.inertial
        complete = inertial.add(raw, f.flags.in_air, f.output, f.x, f.dt_avg)
        f.t_now = raw.time_us
        if not complete and self.initialised:
            return False
        f.flags.vehicle_at_rest = inertial.at_rest and not self._ground_contact.moves_evenly()
        if complete:
            f.t_horizon = inertial.ring[0].time_us
            if self.control.drag.enabled:
                self.control.drag.add(raw)
        if not self.initialised:
            return self._start(complete)
        self._advance()
        return True

    def _start(self, complete: bool) -> bool:
        """Align with what there is; True when that has begun with a complete filter period."""
        ring = self.inertial.ring
        if not ring or not self._alignment.attempt(ring[-1]):
            return False
        f = self.filter
        self.control.terrain.initialise()
        times = f.times
        times.hgt = times.hor_pos = times.hor_vel = times.flow = f.t_now
        f.output.align(f.x)
        self.initialised = True
        if complete:
            self._advance()
        else:
            f.output.propagate(self.inertial.state, f.x, f.dt_avg)
        return complete

    def _advance(self) -> None:
        """Step the filter by the period that the newest raw sample has completed."""
        f = self.filter
        self._predict()
        self._ground_contact.step(self.inertial.quiet)
        control = self.control
        control.step()
        delay = 1e-6 * (f.t_now - f.t_horizon)
        f.output.finish_period(
            self.inertial.state, f, delay, control.bank, control.bank_airspeed())
        control.correct_bank()

    def _predict(self) -> None:
        """Carry states and covariance over the filter period at the horizon."""
        f, ring = self.filter, self.inertial.ring
        imu, faults = ring[0], f.faults
        f.imu = imu
        f.dt_avg, down_bias, learned = f.cov.predict(
            f.x, f.rot, imu, f.earth.rate_ned, f.dt_avg, f.flags.in_air, faults.accel_vertical)
        faults.accel_clipping = imu.clipping != NO_CLIPPING
        if learned:
            self._accel_bias_check.step(down_bias)
        self.lapse.step(ring[-1])

    def _push_fix(self, sample: GnssSample, min_interval_us: int) -> None:
        altitude_before = self.filter.earth.alt_ref
        origin_set = self.control.gnss.push(sample, min_interval_us, self.initialised)
        if origin_set:
            self.control.height_source.refer_to(self.filter.earth.alt_ref - altitude_before)
        if origin_set and self.params.height.reference == 'gnss':
            self.control.height_source.start_gnss()

    def nav_state(self) -> NavState | None:
        """Return the state predicted to the newest IMU sample, None before initialisation."""
        if self._nav is None and self.initialised:
            self._nav = nav_state(self)
        return self._nav

    def alignment_obstacle(self) -> str:
        """Return what keeps the filter from starting, in words."""
        return self._alignment.obstacle

    def states(self) -> Array:
        """Return the states (24,) at the fusion horizon; `ekf2.state.STATES` is their index map.

        Units: rad and m/s per filter period for the biases, G for fields, else SI; NED and FRD.
        """
        return self.filter.x.copy()

    def variances(self) -> Array:
        """Return the variances (24,) of `states`, in the squares of their units."""
        return np.diag(self.filter.cov.p).copy()

    def aid_statuses(self) -> Sequence[AidStatus]:
        """Return one record per kind of observation that was ever tried."""
        return [o.status() for o in self.filter.observations.all() if o.judged or o.starts]

    def passed_over(self) -> dict[type, dict[str, int]]:
        """Return by type and reason how many samples never reached an aid source."""
        control = self.control
        buffers: dict[type, SampleBuffer[Any]] = {
            MagSample: control.mag.buffer, BaroSample: control.baro.buffer,
            VisionSample: control.vision.buffer, GnssSample: control.gnss.buffer,
            RangeSample: control.range.buffer, FlowSample: control.flow.buffer,
            AirspeedSample: control.airspeed.buffer,
            AuxVelocitySample: control.aux_velocity.buffer}
        counts = {kind: dict(buffer.passed_over) for kind, buffer in buffers.items()}
        for kind, count in self._too_early.items():
            counts.setdefault(kind, {})['before_inertial'] = count
        return counts

    def reset_counts(self) -> dict[str, int]:
        """Return how often attitude, velocity and position have jumped."""
        counters = self.control.resets.counters
        return {'attitude': counters.quat, 'velocity_ne': counters.vel_ne,
                'velocity_d': counters.vel_d, 'position_ne': counters.pos_ne,
                'position_d': counters.pos_d}

    def drain_events(self) -> Sequence[Event]:
        """Return and forget the events since the last call."""
        return self.filter.events.drain()

    def health(self) -> Health:
        """Say in one sentence what the filter is doing."""
        return health(self)

    def set_origin(self, origin: GeoPoint) -> bool:
        """Move the origin of the local frame, keeping the place of the vehicle on the earth."""
        self._nav = None
        return self.control.move_origin(origin)

    def adopt(self, params: Ekf2Params) -> None:
        """Go on with other parameters.

        They may differ from the present ones in live ones, and in the mounting of sensors of which
        nothing was fused yet. Raises ValueError, naming the parameter, when one is out of range.
        """
        validate(params)
        self._nav = None
        self.params = params
        self.filter.adopt(params)
        self.filter.cov.set_noise(params)

    def set_pose(self, pose: GivenPose) -> bool:
        """Jump to a pose of the body origin (NED, m, rad) at the newest IMU sample.

        What the pose does not give stays; the velocity turns with the yaw. Sensors that measure
        the same go on and may contradict it. False before initialisation.
        """
        self._nav = None
        if self.initialised:
            self.control.set_pose(pose)
        return self.initialised


def max_delay_ms(params: Ekf2Params) -> float:
    """Return the delay of the fusion horizon in ms: the largest of the sensors in use."""
    delays = [params.timing.horizon_min_ms, params.baro.delay_ms, params.aiding.auxvel_delay_ms]
    if params.aiding.airspeed_threshold > 0.0:
        delays.append(params.aiding.airspeed_delay_ms)
    if params.mag.type != 'none':
        delays.append(params.mag.delay_ms)
    if params.gnss.enabled:
        delays.append(params.gnss.delay_ms)
    vision = params.vision
    if vision.use_position or vision.use_velocity or vision.use_yaw:
        delays.append(vision.delay_ms)
    if params.range.aid or params.height.reference == 'range':
        delays.append(params.range.delay_ms)
    if params.flow.enabled:
        delays.append(params.flow.delay_ms)
    return max(delays)
