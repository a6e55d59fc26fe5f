"""What the filter had no use for is counted by reason, over restarts too."""

from __future__ import annotations

import numpy as np

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.samples import RangeSample
from ekf_fusion_ros.session import FusionSession

PERIOD_US = 4_000
WAITING_MAX = 16
"""More samples than the horizon can hold back at the rates of these tests."""


def run(session, start_us, range_interval_us, seconds=3):
    """Feed a vehicle at rest; return how many range samples were sent."""
    sent = 0
    for time_us in range(start_us, start_us + seconds * 1_000_000, PERIOD_US):
        session.push(ImuSample(
            time_us, np.zeros(3), np.array([0.0, 0.0, -9.80665 * 0.004]), 0.004, 0.004))
        if (time_us - start_us) % range_interval_us == 0:
            session.push(RangeSample(time_us, 1.0, 100))
            sent += 1
    return sent


def watched_session(monkeypatch):
    """Return a session and the list of range samples that reach the range finder's judgement."""
    session = FusionSession(Params(), ('imu', 'fix', 'range'))
    taken = []
    finder = type(session.estimator.control.range)
    judge = finder._judge

    def watched(self, sample):
        taken.append(sample.time_us)
        return judge(self, sample)

    monkeypatch.setattr(finder, '_judge', watched)
    return session, taken


def test_a_sensor_at_a_usual_rate_is_used_to_the_last_sample(monkeypatch):
    session, taken = watched_session(monkeypatch)
    sent = run(session, 1_000_000, 100_000)
    assert session.statistics()['range'].passed_over == {}
    assert sent - WAITING_MAX <= len(taken) <= sent


def test_every_sample_of_a_fast_sensor_is_used_or_counted(monkeypatch):
    session, taken = watched_session(monkeypatch)
    sent = run(session, 1_000_000, 8_000)
    passed_over = session.statistics()['range'].passed_over
    assert passed_over['too_close'] > 100
    assert sent - WAITING_MAX <= len(taken) + sum(passed_over.values()) <= sent
    assert session.statistics()['range'].accepted == sent


def test_the_counts_go_on_over_a_restart():
    session = FusionSession(Params(), ('imu', 'fix', 'range'))
    run(session, 20_000_000, 8_000)
    before = session.statistics()['range'].passed_over['too_close']
    session.reset()
    # What was held for its order is handed over at the restart, and may be counted then.
    assert 0 <= session.statistics()['range'].passed_over['too_close'] - before <= 2
    run(session, 30_000_000, 8_000)
    assert session.statistics()['range'].passed_over['too_close'] > before + 100


def test_samples_before_the_first_inertial_one_are_counted():
    ekf = Ekf2()
    ekf.push(RangeSample(1_000_000, 1.0))
    ekf.push(RangeSample(1_100_000, 1.0))
    assert ekf.passed_over()[RangeSample]['before_inertial'] == 2
