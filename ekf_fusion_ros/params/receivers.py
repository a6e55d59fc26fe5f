"""Parameters of several receivers: how their fixes become one."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field

from ekf_fusion_ros.params.spec import param


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherReceiverParams:
    """A receiver beside that of `fix`; the place of its antenna is in `messages`."""

    delay_ms: float = param(
        110.0, 'Delay of this receiver against the IMU; that of `fix` is ekf2.gnss.delay_ms.',
        unit='ms', min=0, max=1000)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceiversParams:
    """Two or more receivers blended into one; without effect where there is only `fix`."""

    fix_2: FurtherReceiverParams = field(default_factory=FurtherReceiverParams)
    fix_3: FurtherReceiverParams = field(default_factory=FurtherReceiverParams)
    wait_ms: float = param(
        80.0, 'Time by inertial stamps that a fix waits for those of the other receivers; less '
        'where the fusion horizon could not take it any more.', unit='ms', min=0, max=1000)
    timeout: float = param(
        2.0, 'Silence after which a receiver is lost.', unit='s', min=0.2, max=60)
    offset_time: float = param(
        10.0, 'Time constant of the filtered offset of each receiver from the others.', unit='s',
        min=1, max=1000, px4='EKF2_GPS_TAU')
    handover_time: float = param(
        60.0, 'Time constant with which the blend goes over to the receivers that are there, '
        'after one was lost or gained.', unit='s', min=1, max=10000)
    gate: float = param(
        5.0, 'Deviation from the other receivers and the prediction above which a receiver is '
        'excluded.', unit='sigma', min=1, max=100)
    min_deviation: float = param(
        5.0, 'Deviation in position or height up to which none is excluded, however accurate it '
        'claims to be.', unit='m', min=0, max=1000)
    min_velocity_deviation: float = param(
        1.0, 'Deviation in velocity up to which none is excluded.', unit='m/s', min=0, max=100)
    readmission_time: float = param(
        5.0, 'Time for which an excluded receiver has to agree again.', unit='s', min=0, max=600)
    max_eph: float = param(
        10.0, 'Horizontal accuracy above which a receiver is left out while another is better.',
        unit='m', min=0.1, max=1000)
    max_epv: float = param(
        15.0, 'Vertical accuracy above which the height of a receiver is left out while another '
        'is better.', unit='m', min=0.1, max=1000)
    max_sacc: float = param(
        2.0, 'Speed accuracy above which the velocity of a receiver is left out while another '
        'is better.', unit='m/s', min=0.01, max=100)
