"""Parameters of the ROS node: what it listens to, how often it works, what it publishes."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import fields

from ekf_fusion_ros.params.spec import param

TWIST_TYPES = ('twist_with_covariance', 'twist')
HEADING_TYPES = ('pose_with_covariance', 'pose', 'imu')
SWITCH = 'use_'


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeParams:
    """The node `fuser`. Topics are renamed by remapping, not by parameters."""

    use_odometry: bool = param(True, 'Subscribe to `odom` (nav_msgs/Odometry).', live=True)
    use_fix: bool = param(True, 'Subscribe to `fix` (sensor_msgs/NavSatFix).', live=True)
    use_imu: bool = param(False, 'Subscribe to `imu` (sensor_msgs/Imu).', live=True)
    use_fix_velocity: bool = param(
        False, 'Subscribe to `fix_velocity` (velocity of the receiver, ENU).', live=True)
    fix_velocity_type: str = param(
        'twist_with_covariance', 'Message of `fix_velocity`: TwistWithCovarianceStamped or '
        'TwistStamped.', choices=TWIST_TYPES)
    use_magnetic_field: bool = param(
        False, 'Subscribe to `mag` (sensor_msgs/MagneticField).', live=True)
    use_pressure: bool = param(
        False, 'Subscribe to `pressure` (sensor_msgs/FluidPressure).', live=True)
    use_range: bool = param(
        False, 'Subscribe to `range` (sensor_msgs/Range, downwards).', live=True)
    use_flow: bool = param(
        False, 'Subscribe to `flow` (optical flow as geometry_msgs/Vector3Stamped: x, y rates in '
        'rad/s, z quality 0..1).', live=True)
    use_airspeed: bool = param(False, 'Subscribe to `airspeed` (linear.x of a twist).', live=True)
    airspeed_type: str = param(
        'twist_with_covariance', 'Message of `airspeed`: TwistWithCovarianceStamped or '
        'TwistStamped.', choices=TWIST_TYPES)
    use_landed: bool = param(False, 'Subscribe to `landed` (std_msgs/Bool).', live=True)
    use_armed: bool = param(False, 'Subscribe to `armed` (std_msgs/Bool).', live=True)
    use_gps_heading: bool = param(
        False, 'Subscribe to `gps_heading` (heading of a receiver with two antennas).', live=True)
    gps_heading_type: str = param(
        'pose_with_covariance', 'Message of `gps_heading`: PoseWithCovarianceStamped, '
        'PoseStamped or Imu.', choices=HEADING_TYPES)
    use_fix_2: bool = param(
        False, 'Subscribe to `fix_2`, a second receiver: both are blended.', live=True)
    use_fix_velocity_2: bool = param(
        False, 'Subscribe to `fix_velocity_2`, the velocity of the second receiver.', live=True)
    fix_velocity_2_type: str = param(
        'twist_with_covariance', 'Message of `fix_velocity_2`: TwistWithCovarianceStamped or '
        'TwistStamped.', choices=TWIST_TYPES)
    use_fix_3: bool = param(
        False, 'Subscribe to `fix_3`, a third receiver: all are blended.', live=True)
    use_fix_velocity_3: bool = param(
        False, 'Subscribe to `fix_velocity_3`, the velocity of the third receiver.', live=True)
    fix_velocity_3_type: str = param(
        'twist_with_covariance', 'Message of `fix_velocity_3`: TwistWithCovarianceStamped or '
        'TwistStamped.', choices=TWIST_TYPES)
    use_aux_velocity: bool = param(
        False, 'Subscribe to `aux_velocity` (velocity against a target at rest, ENU).', live=True)
    aux_velocity_type: str = param(
        'twist_with_covariance', 'Message of `aux_velocity`: TwistWithCovarianceStamped or '
        'TwistStamped.', choices=TWIST_TYPES)
    core_rate: float = param(
        100.0, 'Rate of the timer that runs the filter on the queued messages.', unit='Hz',
        min=1, max=1000)
    queue_limit: int = param(
        5000, 'Messages that may wait for the filter; more are dropped and counted.', min=10,
        max=1000000)
    publish_every_update: bool = param(
        False, 'Publish one row a filter update instead of `session.output_rate`.')
    publish_acceleration: bool = param(
        False, 'Publish `accel/filtered`: acceleration in the body, gravity removed.')
    estimator_rate: float = param(
        0.0, 'Rate of `~/estimator`: states, variances, innovations, test ratios and resets as '
        'numbers by name; 0 = not published.', unit='Hz', min=0, max=100)
    disabled_at_startup: bool = param(
        False, 'Keep all messages from the filter until `enable` or `~/set_enabled` is called.')
    diagnostics_rate: float = param(
        1.0, 'Rate of /diagnostics.', unit='Hz', min=0.1, max=10)
    world_frame: str = param(
        'auto', 'Frame of the published odometry: auto is `map_frame` with a fix and '
        '`odom_frame` without; any other word is the name of the frame.')
    map_frame: str = param('map', 'Name of the frame that is fixed to the earth.')
    odom_frame: str = param('odom', 'Name of the frame of the odometry.')
    base_link_frame: str = param('base_link', 'Name of the body frame of the outputs.')
    mounting_from_tf: bool = param(
        True, 'Take the mounting of a sensor from /tf_static (`base_link_frame` to the frame of '
        'its messages) where the parameters leave it at zero; needs tf2_msgs.')
    publish_tf: bool = param(
        False, 'Publish TF: `odom_frame` to `base_link_frame` where world_frame is the '
        'odom_frame, else `map_frame` to `odom_frame` against the odometry.')
    transform_time_offset: float = param(
        0.0, 'Added to the stamps of TF.', unit='s', min=-10, max=10)

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the topics the node listens to."""
        switches = [field.name for field in fields(self) if field.name.startswith(SWITCH)]
        return tuple(name.removeprefix(SWITCH) for name in switches if getattr(self, name))

    @property
    def output_frame(self) -> str:
        """Name of the frame in which the node publishes."""
        if self.world_frame != 'auto':
            return self.world_frame
        return self.map_frame if self.use_fix else self.odom_frame
