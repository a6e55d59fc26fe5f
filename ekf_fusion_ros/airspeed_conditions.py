"""Which airspeed is worth fusing: fast enough, and not that of a multirotor."""

from __future__ import annotations

from ekf_fusion_ros.messages.decode_airspeed import AirspeedReading
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.samples import AirspeedSample

BELOW_THRESHOLD = 'below_threshold'


def check_airspeed(airspeed: AirspeedReading | AirspeedSample, params: AidingParams) -> None:
    """Raise Refused for an airspeed that the conditions of `params` keep from the filter."""
    if not params.airspeed_conditions:
        return
    if params.vehicle == 'multirotor':
        raise Refused('rotary_wing', 'ekf2.aiding.vehicle is multirotor: airspeed is not used')
    threshold = params.airspeed_threshold
    if threshold <= 0.0:
        raise Refused('switched_off', 'ekf2.aiding.airspeed_threshold is 0: airspeed is not used')
    speed = (airspeed.speed if isinstance(airspeed, AirspeedReading)
             else airspeed.true_airspeed / airspeed.eas2tas)
    if speed <= threshold:
        raise Refused(BELOW_THRESHOLD, f'{speed:.1f} m/s is not above ekf2.aiding.'
                      f'airspeed_threshold, {threshold:g} m/s')
