"""The demo's flight: visual-inertial odometry that drifts, GPS that is noisy and goes away."""

from __future__ import annotations

import math

import numpy as np

from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import ROLES
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.sensor import Sensor
from ekf_fusion_ros.simulation.trajectory import Flight
from ekf_fusion_ros.simulation.vision import Vision

DURATION = 600.0
OUTAGE = (480.0, 510.0)
# A receiver whose driver stamps a fix when it has read it.
FIX_DELAY = 0.11

# One sentence for each source, printed with the results.
DESCRIPTION = f"""\
flight    {DURATION:.0f} s: climb, figures of eight of 600 m at 3 to 7 m/s, landing
odometry  30 Hz; yaw drifts 0.5 deg/sqrt(min) and 0.8 deg/min, scale is 1 % off
GPS       5 Hz, no velocity; 1.5 m white noise and 0.4 m over 30 s (x 1.5 in height), \
gone from {OUTAGE[0]:.0f} to {OUTAGE[1]:.0f} s"""


def showcase(seed: int) -> Scenario:
    """Return the flight of a seed: map direction, odometry heading and all errors are drawn."""
    rng = np.random.default_rng([seed, len(ROLES)])
    trajectory = Flight(
        duration=DURATION, size=300.0, period=400.0, height=30.0, climb=5.0,
        turn=float(rng.uniform(-math.pi, math.pi)))
    vision = Vision(
        heading=float(rng.uniform(-math.pi, math.pi)),
        scale=0.01 * _sign(rng),
        yaw_walk=math.radians(0.5) / math.sqrt(60.0),
        yaw_rate_bias=math.radians(0.8) / 60.0 * _sign(rng))
    gnss = Gnss(
        origin=ORIGIN, pos_noise=1.5, pos_correlated=0.4, correlation_time=30.0,
        stamp_delay=FIX_DELAY, has_velocity=False, outages=(OUTAGE,))
    sensors: dict[str, Sensor] = {'odometry': vision, 'fix': gnss}
    return Scenario(trajectory=trajectory, sensors=sensors, seed=seed)


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0
