"""std_msgs/Bool to LandedSample."""

from __future__ import annotations

from typing import Any

from ekf_fusion_ros.messages.fields import truth
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import LandedSample

NO_STAMP = 0


def decode_landed(message: Any, params: MessageParams) -> LandedSample:
    """Return a Bool as ground contact, with the kind of vehicle from the parameters.

    A Bool has no stamp: the sample carries 0, and who takes it decides when it acts. Raises
    Refused for anything but a truth value.
    """
    landed, vehicle = truth(message.data, 'data'), params.landed
    return LandedSample(NO_STAMP, landed, vehicle.fixed_wing, vehicle.fuse_sideslip)
