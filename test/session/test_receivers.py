"""Messages of two receivers through the session: meaning, pairing, counts, order."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.params import Params
from ekf_fusion_ros.params import with_overrides
from ekf_fusion_ros.samples import GnssSample
from ekf_fusion_ros.session import FusionSession

START = 1000.0
ROLES = ('imu', 'fix', 'fix_velocity', 'fix_2', 'fix_velocity_2')


@pytest.fixture
def session(estimator):
    params = with_overrides(Params(), {'messages.fix_2.default_eph': 2.0})
    return FusionSession(params, ROLES, estimator=estimator)


def run(session, build, first, last):
    for step in range(round(100 * first), round(100 * last) + 1):
        session.handle('imu', build.imu(START + step / 100))


def send(session, build, t, order=ROLES[1:]):
    messages = {role: getattr(build, role.removesuffix('_2'))(START + t) for role in order}
    if 'fix_2' in messages:
        messages['fix_2'].position_covariance_type = 0
    for role in order:
        session.handle(role, messages[role])


@pytest.mark.parametrize('order', [ROLES[1:], ROLES[:0:-1]])
def test_fixes_of_one_time_become_one_of_every_part(build, estimator, session, order):
    run(session, build, 0.0, 1.0)
    send(session, build, 1.0, order)
    run(session, build, 1.01, 1.05)
    fix, = estimator.of(GnssSample)
    assert fix.time_us == round(1e6 * (START + 1.0))
    assert (fix.lat, fix.lon, fix.alt) == pytest.approx((47.0, 8.0, 500.0), abs=1e-9)
    # The accuracy of the better; 1 m and 2 m weigh 4 to 1.
    assert fix.eph == 1.0
    assert [status.weights[0] for status in session.receivers()] == pytest.approx([0.8, 0.2])
    np.testing.assert_allclose(fix.velocity, (2.0, 0.0, 0.0), atol=1e-9)
    session.finish()
    assert all(counts.accepted for counts in session.statistics().values())


def test_a_fix_does_not_wait_for_long(build, estimator, session):
    run(session, build, 0.0, 1.0)
    send(session, build, 1.0)
    run(session, build, 1.01, 1.2)
    send(session, build, 1.2, ROLES[1:3])
    run(session, build, 1.21, 1.27)
    assert len(estimator.of(GnssSample)) == 1
    run(session, build, 1.28, 1.3)
    assert len(estimator.of(GnssSample)) == 2


def test_order_of_arrival_does_not_matter(build, estimator):
    fed = []
    for order in (ROLES[1:], ROLES[:0:-1]):
        one = type(estimator)()
        session = FusionSession(Params(), ROLES, estimator=one)
        for k in range(5):
            run(session, build, 0.2 * k + 0.01, 0.2 * k + 0.2)
            send(session, build, 0.2 * k + 0.2, order)
        run(session, build, 1.01, 1.3)
        fed.append([(fix.time_us, fix.lat, *fix.velocity) for fix in one.of(GnssSample)])
    assert fed[0] == fed[1]
    assert len(fed[0]) == 5


def test_a_session_waits_for_a_fix_of_any_receiver(build, session):
    run(session, build, 0.0, 1.0)
    assert session.waiting_role == 'fix'
    send(session, build, 1.0, ('fix_2',))
    run(session, build, 1.01, 1.3)
    assert session.waiting_role == ''
