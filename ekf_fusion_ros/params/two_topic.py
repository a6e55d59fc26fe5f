"""Parameters of the two-topic mode: odometry as inertial input, heading found from motion."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometryImuParams:
    """Odometry turned into inertial increments."""

    period_ms: float = param(
        10.0, 'Longest interval of the increments.', unit='ms', min=1, max=100)
    velocity_noise: float = param(
        0.1, 'Smallest noise of a velocity of the odometry that is believed.', unit='m/s',
        min=0.001, max=10)
    smoothing: float = param(
        0.3, 'Time constant that smooths velocity taken from positions.', unit='s', min=0,
        max=10)
    max_acceleration: float = param(
        30.0, 'Largest believable acceleration; what exceeds it is a jump of the odometry.',
        unit='m/s^2', min=1, max=1000)
    max_rate: float = param(
        10.0, 'Largest believable angular rate; what exceeds it is a jump of the odometry.',
        unit='rad/s', min=0.1, max=100)
    jump_distance: float = param(
        0.5, 'Smallest step of the position, beyond what the speed explains, that is a jump.',
        unit='m', min=0.01, max=100)
    jump_speed: float = param(
        0.5, 'Change of velocity between messages that noise explains at any rate.', unit='m/s',
        min=0, max=100)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionHeadingParams:
    """Heading of the odometry frame from the displacements of odometry and fixes."""

    interval: float = param(
        1.0, 'Fixes inside this time are averaged to one point.', unit='s', min=0.05, max=10)
    window_time: float = param(
        18.0, 'Time span of the fit; longer while its path is short or its sigma is '
        'large.', unit='s', min=2,
        max=600)
    window_path: float = param(
        18.0, 'Path that the fit spans at least, if the longest time allows.', unit='m', min=1,
        max=1000)
    window_time_max: float = param(
        90.0, 'Longest time span of the fit.', unit='s', min=5, max=600)
    fix_noise: float = param(
        0.5, 'Smallest accuracy of a fix that is believed.', unit='m', min=0.01, max=100)
    fix_drift_factor: float = param(
        1.5, 'Errors of fixes that last, against the accuracy they claim.', min=0, max=10)
    fix_drift_time: float = param(
        30.0, 'Correlation time of the lasting errors of fixes.', unit='s', min=1, max=1000)
    odometry_yaw_drift: float = param(
        0.005, 'Random walk of the yaw of the odometry.', unit='rad/sqrt(s)', min=0, max=1)
    odometry_scale_error: float = param(
        0.1, 'Relative error of the distance that the odometry measures.', min=0, max=1)
    announce_sigma: float = param(
        0.2, 'Heading sigma below which the heading is announced.', unit='rad', min=0.01, max=1)
    refine_sigma: float = param(
        0.0785, 'Heading sigma below which the heading is announced a second time.', unit='rad',
        min=0, max=1)
    watch_gate: float = param(
        5.0, 'Contradiction between the fit and the heading in use that makes the fit win.',
        unit='sigma', min=2, max=100)
    watch_angle: float = param(
        0.35, 'Smallest contradiction that makes the fit win.', unit='rad', min=0.01, max=3.1)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftParams:
    """Drift of the odometry, measured against fixes."""

    learn: bool = param(
        True, 'Take the odometry to drift no more than it was seen to, where that is less than '
        '`ekf2.aiding.position_drift`.')
    path: float = param(
        50.0, 'Path over which odometry and fixes are compared.', unit='m', min=5, max=10000)
    factor: float = param(
        3.0, 'Drift that is assumed, against the one that was seen: scale and heading err for '
        'longer than a random walk.', min=1, max=100)
    hold: float = param(
        15.0, 'Age from which a fix counts: one that is wrong for a shorter time does not make '
        'the odometry look worse while it lasts.', unit='s', min=0, max=600)


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoTopicParams:
    """What odometry and fixes tell about each other."""

    odometry: OdometryImuParams = field(default_factory=OdometryImuParams)
    heading: MotionHeadingParams = field(default_factory=MotionHeadingParams)
    drift: DriftParams = field(default_factory=DriftParams)
