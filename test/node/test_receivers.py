"""Two receivers through the node: both heard, blended, told of in diagnostics."""

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


def test_a_second_receiver_joins(start_fuser: Callable[..., Fuser], peer: Peer) -> None:
    fuser = start_fuser({'node.use_fix_2': True})
    diagnostics: list[DiagnosticArray] = hear(peer, DiagnosticArray, '/diagnostics')
    peer.connect(fuser, {**TWO_TOPICS, 'fix_2': NavSatFix})
    for k in range(600):
        peer.publish('odom', odometry(0.1 * k))
        if k % 2 == 0:
            peer.publish('fix', fix(0.1 * k))
            peer.publish('fix_2', fix(0.1 * k))
        if k % 50 == 49:
            # a best-effort input keeps 200 messages: no faster than they are taken
            peer.until(lambda sent=k + 1: peer.count('odometry') >= sent, fuser)

    def blended() -> bool:
        told = {status.name: status.message for array in diagnostics[-1:]
                for status in array.status}
        return all(told.get(f'fuser: receiver {role}', '').startswith(
            'in the blend: position 50 %') for role in ('fix', 'fix_2'))

    peer.until(lambda: bool(peer.odometry) and blended(), fuser)
