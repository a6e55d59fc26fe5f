"""Truth trajectories, analytic in time: NED position, FRD attitude, SI."""

from __future__ import annotations

from abc import ABC
from abc import abstractmethod
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.simulation import series
from ekf_fusion_ros.simulation.series import Series
from ekf_fusion_ros.simulation.surroundings import Terrain
from ekf_fusion_ros.simulation.surroundings import Wind

Array = NDArray[np.float64]
GRAVITY = 9.80665
# Four derivatives of position give two of attitude, hence angular acceleration at a lever arm.
_ORDER = 4


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """True motion of the body origin at N instants.

    time (N,) s from the start; position, velocity, acceleration (N, 3) NED; rotation (N, 3, 3)
    body FRD to NED; rate, rate_derivative (N, 3) body rad/s, rad/s^2.
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    rotation: Array
    rate: Array
    rate_derivative: Array

    @property
    def quaternion(self) -> Array:
        """Attitude (N, 4) w, x, y, z body to NED."""
        return quaternion_from_matrix(self.rotation)

    @property
    def yaw(self) -> Array:
        """Yaw (N,) rad, clockwise from north."""
        return np.arctan2(self.rotation[:, 1, 0], self.rotation[:, 0, 0])

    def to_body(self, vectors: Array) -> Array:
        """Turn earth vectors (N, 3) or (3,) into the body frame."""
        rows = np.broadcast_to(vectors, self.position.shape)
        return np.einsum('nji,nj->ni', self.rotation, rows)

    def to_earth(self, vectors: Array) -> Array:
        """Turn body vectors (N, 3) or (3,) into the earth frame."""
        rows = np.broadcast_to(vectors, self.position.shape)
        return np.einsum('nij,nj->ni', self.rotation, rows)

    def at_point(self, lever_arm: Array) -> Motion:
        """Return the motion of a point fixed in the body at lever_arm (3,) FRD."""
        swing = np.cross(self.rate, lever_arm)
        pull = np.cross(self.rate_derivative, lever_arm) + np.cross(self.rate, swing)
        return Motion(
            self.time, self.position + self.to_earth(lever_arm),
            self.velocity + self.to_earth(swing), self.acceleration + self.to_earth(pull),
            self.rotation, self.rate, self.rate_derivative)

    @property
    def specific_force(self) -> Array:
        """What an accelerometer at the origin feels (N, 3), body FRD, m/s^2."""
        return self.to_body(self.acceleration - np.array([0.0, 0.0, GRAVITY]))


@dataclass(frozen=True, kw_only=True)
class Trajectory(ABC):
    """A motion given by position and forward direction as analytic functions of time.

    The wind and the ground are what sensors of air and distance meet on the way.
    """

    duration: float
    wind: Wind = Wind()
    terrain: Terrain = Terrain()

    @abstractmethod
    def position(self, t: Series) -> list[Series]:
        """Return position north, east, down in m."""

    @abstractmethod
    def forward(self, t: Series) -> tuple[Series, Series]:
        """Return cosine and sine of the heading."""

    def down_axis(self, acceleration: list[Series]) -> list[Series]:
        """Return the body z axis: a multirotor's thrust carries its weight and acceleration."""
        pull = [-acceleration[0], -acceleration[1], GRAVITY - acceleration[2]]
        return series.unit(pull)

    def motion(self, instants: Array) -> Motion:
        """Return the exact motion at instants (N,), s from the start."""
        instants = np.asarray(instants, dtype=float)
        t = Series.time(instants, _ORDER)
        position = self.position(t)
        velocity = [p.derivative() for p in position]
        acceleration = [v.derivative() for v in velocity]
        cos, sin = self.forward(t)
        down = self.down_axis(acceleration)
        right = series.unit(series.cross(down, [cos, sin, 0.0 * cos]))
        ahead = series.cross(right, down)
        rate = _body_rate(ahead, right, down)
        return Motion(
            instants, _values(position), _values(velocity), _values(acceleration),
            np.stack([_values(ahead), _values(right), _values(down)], axis=2),
            _values(rate), _values([w.derivative() for w in rate]))


@dataclass(frozen=True, kw_only=True)
class Hover(Trajectory):
    """Rest at one place."""

    place: tuple[float, float, float] = (0.0, 0.0, -5.0)
    heading: float = 0.0

    def position(self, t: Series) -> list[Series]:
        return [0.0 * t + coordinate for coordinate in self.place]

    def forward(self, t: Series) -> tuple[Series, Series]:
        return 0.0 * t + math.cos(self.heading), 0.0 * t + math.sin(self.heading)


@dataclass(frozen=True, kw_only=True)
class Circle(Trajectory):
    """A horizontal circle flown nose first, from rest after `start` s to `speed` in `blend` s."""

    radius: float = 20.0
    speed: float = 5.0
    height: float = 10.0
    start: float = 5.0
    blend: float = 6.0

    def position(self, t: Series) -> list[Series]:
        sin, cos = series.sin_cos(self._angle(t))
        return [self.radius * sin, self.radius * (1.0 - cos), 0.0 * t - self.height]

    def forward(self, t: Series) -> tuple[Series, Series]:
        sin, cos = series.sin_cos(self._angle(t))
        return cos, sin

    def _angle(self, t: Series) -> Series:
        return _travel(t, ((self.start, self.speed / self.radius),), self.blend)


@dataclass(frozen=True, kw_only=True)
class Loiter(Circle):
    """An aeroplane that circles in air which carries it along: it never flies sideways.

    `speed` is true airspeed. It starts at rest on the ground; from `start` + `blend` on the nose
    points where the air comes from, as long as the wind has no gusts.
    """

    radius: float = 120.0
    speed: float = 18.0
    height: float = 60.0
    climb_time: float = 30.0

    def position(self, t: Series) -> list[Series]:
        north, east, _ = super().position(t)
        down = -self.height * series.step((t - self.start) / self.climb_time)
        carried = _travel(t, ((self.start, 1.0),), self.blend)
        wind = self.wind.mean
        return [north + wind[0] * carried, east + wind[1] * carried, down]


@dataclass(frozen=True, kw_only=True)
class FigureOfEight(Trajectory):
    """A lying eight flown nose first: north size sin(a), east size/2 sin(2a) of phase a.

    From rest after `start` s; one round takes `period` s. `turn` rad rotates it on the map and
    `climb` m lets the height oscillate once a round.
    """

    size: float = 40.0
    period: float = 60.0
    height: float = 10.0
    start: float = 5.0
    blend: float = 8.0
    turn: float = 0.0
    climb: float = 0.0

    def position(self, t: Series) -> list[Series]:
        sin, cos = series.sin_cos(self._phase(t))
        north, east = self._turned(self.size * sin, self.size * (sin * cos))
        return [north, east, 0.0 * t - self.height - self.climb * (sin * sin)]

    def forward(self, t: Series) -> tuple[Series, Series]:
        sin, cos = series.sin_cos(self._phase(t))
        ahead = series.unit([cos, cos * cos - sin * sin, 0.0 * cos])
        return self._turned(ahead[0], ahead[1])

    def _turned(self, north: Series, east: Series) -> tuple[Series, Series]:
        c, s = math.cos(self.turn), math.sin(self.turn)
        return c * north - s * east, s * north + c * east

    def _phase(self, t: Series) -> Series:
        return _travel(t, ((self.start, math.tau / self.period),), self.blend)


@dataclass(frozen=True, kw_only=True)
class Drive(FigureOfEight):
    """A ground vehicle: level, no side slip, along an eight, with stops (start, end) in s."""

    height: float = 0.0
    stops: tuple[tuple[float, float], ...] = ()

    def down_axis(self, acceleration: list[Series]) -> list[Series]:
        level = 0.0 * acceleration[0]
        return [level, level, level + 1.0]

    def _phase(self, t: Series) -> Series:
        rate = math.tau / self.period
        changes = [(self.start, rate)]
        for begin, end in self.stops:
            changes += [(begin, -rate), (end, rate)]
        return _travel(t, tuple(changes), self.blend)


@dataclass(frozen=True, kw_only=True)
class Flight(FigureOfEight):
    """Rest, climb, eights that start at `start`, brake, land at the end.

    The climb begins at `takeoff`; braking begins `landing` s before the end.
    """

    takeoff: float = 12.0
    climb_time: float = 10.0
    landing: float = 35.0
    start: float = 24.0

    def position(self, t: Series) -> list[Series]:
        north, east, down = super().position(t)
        up = series.step((t - self.takeoff) / self.climb_time)
        down_again = series.step((t - self._touch_down + 15.0) / 15.0)
        return [north, east, down * (up - down_again)]

    @property
    def _touch_down(self) -> float:
        return self.duration - 8.0

    def _phase(self, t: Series) -> Series:
        rate = math.tau / self.period
        stop = self.duration - self.landing
        return _travel(t, ((self.start, rate), (stop, -rate)), self.blend)


def quaternion_from_matrix(rotation: Array) -> Array:
    """Return w, x, y, z (N, 4), w >= 0, of rotation matrices (N, 3, 3)."""
    r = rotation
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    # Columns of 4 q q^T; the one with the largest diagonal is the best conditioned.
    k = np.empty((len(r), 4, 4))
    k[:, 0, 0] = 1.0 + trace
    for i in range(3):
        k[:, i + 1, i + 1] = 1.0 - trace + 2.0 * r[:, i, i]
        a, b = (i + 1) % 3, (i + 2) % 3
        k[:, 0, i + 1] = k[:, i + 1, 0] = r[:, b, a] - r[:, a, b]
        k[:, a + 1, b + 1] = k[:, b + 1, a + 1] = r[:, a, b] + r[:, b, a]
    best = np.argmax(np.einsum('nii->ni', k), axis=1)
    q = k[np.arange(len(r)), best]
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    return np.where(q[:, :1] < 0.0, -q, q)


def _travel(t: Series, changes: tuple[tuple[float, float], ...], blend: float) -> Series:
    """Integrate a rate that changes by (time, change), each over `blend` s."""
    way = 0.0 * t
    for begin, change in changes:
        way = way + change * blend * series.ramp((t - begin) / blend)
    return way


def _body_rate(ahead: list[Series], right: list[Series], down: list[Series]) -> list[Series]:
    """Return the rates that R^T dR/dt holds, with R = [ahead right down]."""
    def moved(axis: list[Series]) -> list[Series]:
        return [component.derivative() for component in axis]

    return [
        series.dot(down, moved(right)),
        series.dot(ahead, moved(down)),
        series.dot(right, moved(ahead)),
    ]


def _values(vector: list[Series]) -> Array:
    return np.stack([component.value for component in vector], axis=1)
