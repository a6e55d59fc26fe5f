"""Everything the filter announces."""

from __future__ import annotations

from enum import Enum

from ekf_fusion_ros.estimator import Event


class EventKind(Enum):
    """What happened, as a sentence."""

    GPS_QUALITY_POOR = 'GNSS quality poor, stopped using it; another source aids'
    GPS_FUSION_TIMEOUT = 'GNSS rejected for too long, reset to it'
    GPS_DATA_STOPPED = 'GNSS data stopped'
    GPS_DATA_STOPPED_ALTERNATE = 'GNSS data stopped; another source aids'
    HEIGHT_RESET = 'reset height'
    NAVIGATION_STOPPED = 'no horizontal aiding, holding the last position'
    ACCEL_BIAS_RESET = 'inconsistent accelerometer bias, reset its covariance'
    BAD_YAW_COURSE_USED = 'bad yaw, aligned to the GNSS course'
    MAG_STOPPED = 'bad yaw again, stopped using the magnetometer'
    VISION_STOPPED = 'odometry stopped'
    EMERGENCY_YAW_RESET = 'yaw reset to the EKF-GSF estimate, stopped using the magnetometer'
    ORIGIN_SET = 'GNSS checks passed, origin set'
    VEL_RESET_GPS = 'reset velocity to GNSS'
    VEL_RESET_FLOW = 'reset velocity to optical flow'
    VEL_RESET_VISION = 'reset velocity to odometry'
    VEL_RESET_ZERO = 'reset velocity to zero'
    POS_RESET_LAST_KNOWN = 'reset position to the last known'
    POS_RESET_GPS = 'reset position to GNSS'
    POS_RESET_VISION = 'reset position to odometry'
    GPS_STARTED = 'started GNSS fusion'
    VISION_POS_STARTED = 'started odometry position fusion'
    VISION_VEL_STARTED = 'started odometry velocity fusion'
    VISION_YAW_STARTED = 'started odometry yaw fusion'
    YAW_ALIGNED_IMU_GPS = 'yaw aligned from inertial data and GNSS velocity'
    YAW_ALIGNED_MOTION = 'yaw aligned by matching odometry and GNSS displacements'
    INERTIAL_LAPSE = 'inertial data missing, attitude and motion doubted'
    POSE_SET = 'pose set on request'
    TILT_ALIGNED = 'tilt aligned'
    YAW_ALIGNED = 'yaw aligned'


class EventLog:
    """Events since they were last drained, and the kinds that ever occurred."""

    def __init__(self) -> None:
        """Start empty."""
        self.seen: set[EventKind] = set()
        self._waiting: list[Event] = []

    def add(self, time_us: int, kind: EventKind, detail: str = '') -> None:
        """Announce something at a time, with an optional detail."""
        self.seen.add(kind)
        self._waiting.append(Event(time_us, f'{kind.value}: {detail}' if detail else kind.value))

    def drain(self) -> list[Event]:
        """Return and forget the waiting events."""
        waiting, self._waiting = self._waiting, []
        return waiting
