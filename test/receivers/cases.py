"""The receivers, windows of time and faults of the tests in flight."""

from __future__ import annotations

from receivers.flight import receiver

METRE = 1.0 / 111_200.0
BETTER = receiver(pos_noise=1.0, pos_correlated=0.5)
WORSE = receiver(pos_noise=1.6, pos_correlated=0.8)
QUIET = receiver(pos_noise=0.05, pos_correlated=0.0)
SETTLED, OFF, ON = 25.0, 50.0, 65.0
SEEDS = range(4)


def between(first, end, change):
    """Return what changes fixes inside a window and keeps the others."""
    return lambda t, fix: change(fix) if first <= t < end else fix


def dropped(_):
    return None


def biased(fix):
    return fix._replace(lat=fix.lat + 20.0 * METRE)
