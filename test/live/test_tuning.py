"""Parameters that change while the node runs: asked first, then made and announced."""

from __future__ import annotations

from array import array

import pytest

from ekf_fusion_ros.live import tuning as module
from ekf_fusion_ros.live.steering import Steering
from ekf_fusion_ros.live.switches import Switches
from ekf_fusion_ros.live.tuning import Tuning
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.session import FusionSession

ROLES = ('odometry', 'fix')


class Bench:
    """A session and what tunes it."""

    def __init__(self) -> None:
        self.session = FusionSession(Params(), ROLES)
        self.switches = Switches(ROLES, 'odometry', enabled=True)
        steering = Steering(self.session, self.switches, 'map')
        self.tuning = Tuning(Params(), self.session, steering)

    def told(self) -> list[str]:
        return [event.text for event in self.session.drain_events()]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_changes_reach_the_session_and_are_told(bench: Bench) -> None:
    changes = {'ekf2.gnss.pos_gate': 4.0, 'messages.fix.min_eph': 0.5}
    assert bench.tuning.obstacle(changes) == ''
    bench.tuning.change(changes)
    assert bench.session.params.ekf2.gnss.pos_gate == 4.0
    assert bench.told() == [
        'parameters changed on request: ekf2.gnss.pos_gate = 4.0 (was 5.0), '
        'messages.fix.min_eph = 0.5 (was 0.01)']


def test_one_that_is_fixed_stops_all(bench: Bench) -> None:
    refusal = bench.tuning.obstacle({'ekf2.gnss.pos_gate': 4.0, 'session.horizon_ms': 100.0})
    assert refusal.startswith('session.horizon_ms = 200.0 cannot become 100.0')
    assert bench.session.params.ekf2.gnss.pos_gate == 5.0


def test_inputs_are_switched_also_where_the_parameter_says_so_already(bench: Bench) -> None:
    bench.switches.switch('fix', False)
    bench.tuning.change({'node.use_fix': True})
    assert bench.switches.is_on('fix')
    bench.tuning.change({'node.use_fix': False})
    assert not bench.switches.is_on('fix')
    assert bench.told() == [
        'fix is switched on on request', 'fix is switched off on request']
    assert 'is not subscribed to' in bench.tuning.obstacle({'node.use_range': True})


def test_a_whole_file_without_news_costs_nothing(
    bench: Bench, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, 'changed', None)
    for name, value, _ in leaves(Params()):
        if not name.startswith('node.use_'):
            given = array('d', value) if isinstance(value, tuple) else value
            assert bench.tuning.obstacle({name: given}) == ''
            bench.tuning.change({name: given})
    assert bench.told() == []
