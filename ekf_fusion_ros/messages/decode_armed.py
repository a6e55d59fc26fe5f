"""std_msgs/Bool to ArmedSample."""

from __future__ import annotations

from typing import Any

from ekf_fusion_ros.messages.fields import truth
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.samples import ArmedSample

NO_STAMP = 0


def decode_armed(message: Any, params: MessageParams) -> ArmedSample:
    """Return a Bool as the state of arming; it has no stamp and acts when it comes.

    `params` is there for all decoders alike. Raises Refused for anything but a truth value.
    """
    del params
    return ArmedSample(NO_STAMP, truth(message.data, 'data'))
