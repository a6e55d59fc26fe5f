"""Parameters of navigation health: validity of the estimate, home position, take-off test."""

from __future__ import annotations

from dataclasses import dataclass

from ekf_fusion_ros.params.spec import param


@dataclass(frozen=True, slots=True, kw_only=True)
class HealthParams:
    """What PX4's commander judges an estimate by. Nothing here changes the estimate."""

    position_eph: float = param(
        5.0, 'Horizontal accuracy of a position that becomes valid; a valid one stays so up to '
        '2.5 times as much.', unit='m', min=0.1, max=1000, px4='COM_POS_FS_EPH')
    velocity_evh: float = param(
        1.0, 'Horizontal accuracy of a velocity that becomes valid; a valid one stays so up to '
        '2.5 times as much.', unit='m/s', min=0.1, max=100, px4='COM_VEL_FS_EVH')
    timeout: float = param(
        1.0, 'Age of an estimate above which it is not valid.', unit='s', min=0.1, max=100,
        px4='COM_POS_FS_DELAY')
    takeoff_probation: float = param(
        30.0, 'Probation that begins at take-off: the time for which a lost estimate must be good '
        'to be valid again. It falls by a second for each valid one, to 1 s.', unit='s', min=1,
        max=100, px4='COM_POS_FS_PROB')
    probation_gain: float = param(
        10.0, 'Seconds by which probation grows for each second without a good estimate, up to '
        '100 s; 0 or 1 suits fixed wings.', min=0, max=100, px4='COM_POS_FS_GAIN')
    home_eph: float = param(
        5.0, 'Largest horizontal accuracy of the position that becomes home.', unit='m', min=0.1,
        max=1000, px4='COM_HOME_H_T')
    home_epv: float = param(
        10.0, 'Largest vertical accuracy of the position that becomes home.', unit='m', min=0.1,
        max=1000, px4='COM_HOME_V_T')
    arm_without_gps: bool = param(
        True, 'Arming needs neither a valid global position nor home. Off, `navigation/ready` '
        'waits for both, and arming without them is told as an event.', px4='COM_ARM_WO_GPS')
    takeoff_test: bool = param(
        True, 'Test the navigation of a multirotor (ekf2.aiding.vehicle) after take-off: where '
        'its innovations fail for a second, position and velocity are invalid until it is '
        'disarmed. The circuit breaker of PX4 turns it off at its key, 201607.',
        px4='CBRK_VELPOSERR')
