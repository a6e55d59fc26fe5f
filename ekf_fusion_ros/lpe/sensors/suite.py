"""All sensors in their order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ekf_fusion_ros.lpe.filter import Filter
from ekf_fusion_ros.lpe.sensors.baro import Baro
from ekf_fusion_ros.lpe.sensors.external_position import ExternalPosition
from ekf_fusion_ros.lpe.sensors.gnss import Gnss
from ekf_fusion_ros.lpe.sensors.land import Land
from ekf_fusion_ros.lpe.sensors.landing_target import LandingTarget
from ekf_fusion_ros.lpe.sensors.lidar import Lidar
from ekf_fusion_ros.lpe.sensors.mocap import Mocap
from ekf_fusion_ros.lpe.sensors.optical_flow import OpticalFlow
from ekf_fusion_ros.lpe.sensors.sensor import Sensor
from ekf_fusion_ros.lpe.sensors.sonar import Sonar
from ekf_fusion_ros.lpe.sensors.vision import Vision
from ekf_fusion_ros.samples import AuxVelocitySample
from ekf_fusion_ros.samples import BaroSample
from ekf_fusion_ros.samples import FlowSample
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.samples import LandedSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.samples import VisionSample


class Suite:
    """Steps the sensors as PX4 does: time-outs of all, then each with what has come."""

    def __init__(self, f: Filter) -> None:
        """Build them on a filter."""
        self.gnss = Gnss(f)
        self.baro = Baro(f)
        self.lidar = Lidar(f)
        self.sonar = Sonar(f, self.lidar)
        self.flow = OpticalFlow(f)
        self.vision = Vision(f)
        self.mocap = Mocap(f)
        self.land = Land(f, self.gnss)
        self.landing_target = LandingTarget(f)
        self.all: tuple[Sensor, ...] = (
            self.gnss, self.baro, self.lidar, self.sonar, self.flow, self.vision, self.mocap,
            self.land, self.landing_target)
        self._horizontal: tuple[Sensor, ...] = (
            self.gnss, self.flow, self.vision, self.mocap, self.land, self.landing_target)
        self.takes: dict[type, Callable[[Any], Sensor]] = {
            GnssSample: lambda _: self.gnss,
            BaroSample: lambda _: self.baro,
            RangeSample: lambda sample: self.sonar if sample.ultrasound else self.lidar,
            FlowSample: lambda _: self.flow,
            VisionSample: lambda _: self._external(f),
            LandedSample: lambda _: self.land,
            AuxVelocitySample: lambda _: self.landing_target,
        }
        self.of_type: dict[type, tuple[Sensor, ...]] = {
            GnssSample: (self.gnss,), BaroSample: (self.baro,),
            RangeSample: (self.lidar, self.sonar), FlowSample: (self.flow,),
            VisionSample: (self.vision, self.mocap), LandedSample: (self.land,),
            AuxVelocitySample: (self.landing_target,)}

    def _external(self, f: Filter) -> ExternalPosition:
        return self.mocap if f.params.vision.kind == self.mocap.name else self.vision

    @property
    def aided(self) -> bool:
        """True while a sensor of horizontal position or velocity delivers."""
        return not all(sensor.timed_out for sensor in self._horizontal)

    def check_timeouts(self) -> None:
        """Let each sensor see whether it is still there."""
        for sensor in self.all:
            sensor.check_timeout()

    def step(self) -> None:
        """Let each sensor take what has come."""
        for sensor in self.all:
            sensor.step()

    def in_use(self) -> list[str]:
        """Return the names of the sensors that correct."""
        return [sensor.name for sensor in self.all if not sensor.timed_out]

    def faulty(self) -> list[str]:
        """Return the names of those in use that contradict the estimate."""
        return [sensor.name for sensor in self.all if sensor.faulty and not sensor.timed_out]
