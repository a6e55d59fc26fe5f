"""std_msgs/Bool as the state of arming."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ekf_fusion_ros.messages.decode_armed import decode_armed
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import MessageParams


@pytest.mark.parametrize('value', [True, False])
def test_truth_is_taken(value):
    sample = decode_armed(SimpleNamespace(data=value), MessageParams())
    assert (sample.time_us, sample.armed) == (0, value)


@pytest.mark.parametrize('value', [None, 'true', 2, float('nan')])
def test_anything_else_is_refused(value):
    with pytest.raises(Refused) as refused:
        decode_armed(SimpleNamespace(data=value), MessageParams())
    assert refused.value.reason == 'not_boolean'
