"""Ground contact as a Bool."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ekf_fusion_ros.messages.decode_landed import decode_landed
from ekf_fusion_ros.messages.refusal import Refused
from ekf_fusion_ros.params.messages import LandedMessageParams
from ekf_fusion_ros.params.messages import MessageParams


@pytest.mark.parametrize('landed', [True, False])
def test_contact_and_kind_of_vehicle(landed):
    message = SimpleNamespace(data=landed)
    plain = decode_landed(message, MessageParams())
    assert (plain.landed, plain.fixed_wing, plain.fuse_beta) == (landed, False, False)
    wings = LandedMessageParams(fixed_wing=True, fuse_sideslip=True)
    plane = decode_landed(message, MessageParams(landed=wings))
    assert (plane.landed, plane.fixed_wing, plane.fuse_beta) == (landed, True, True)


@pytest.mark.parametrize('value', [None, 'yes', 2, float('nan')])
def test_anything_else_is_refused(value):
    with pytest.raises(Refused) as refused:
        decode_landed(SimpleNamespace(data=value), MessageParams())
    assert refused.value.reason == 'not_boolean'
