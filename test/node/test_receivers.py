"""Three receivers through the node: all heard, blended, told of in diagnostics."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

rclpy = pytest.importorskip('rclpy')

from diagnostic_msgs.msg import DiagnosticArray
from node.test_company import hear
from node.test_fuser import TWO_TOPICS
from node.test_fuser import fix
from node.test_fuser import odometry
from sensor_msgs.msg import NavSatFix

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

pytestmark = pytest.mark.slow


def test_further_receivers_join(start_fuser: Callable[..., Fuser], peer: Peer) -> None:
    fuser = start_fuser({'node.use_fix_2': True, 'node.use_fix_3': True})
    diagnostics: list[DiagnosticArray] = hear(peer, DiagnosticArray, '/diagnostics')
    peer.connect(fuser, {**TWO_TOPICS, 'fix_2': NavSatFix, 'fix_3': NavSatFix})
    for k in range(600):
        peer.publish('odom', odometry(0.1 * k))
        if k % 2 == 0:
            for role in ('fix', 'fix_2', 'fix_3'):
                peer.publish(role, fix(0.1 * k))
        if k % 50 == 49:
            # a best-effort input keeps 200 messages: no faster than they are taken
            peer.until(lambda sent=k + 1: peer.count('odometry') >= sent, fuser)

    def blended() -> bool:
        told = {status.name: status.message for array in diagnostics[-1:]
                for status in array.status}
        return all(told.get(f'fuser: receiver {role}', '').startswith(
            'in the blend: position 33 %') for role in ('fix', 'fix_2', 'fix_3'))

    peer.until(lambda: bool(peer.odometry) and blended(), fuser)
