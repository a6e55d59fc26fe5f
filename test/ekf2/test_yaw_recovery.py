"""When the EKF-GSF bank contradicts the yaw of the filter."""

from __future__ import annotations

import math

import pytest

from ekf_fusion_ros.ekf2.filter import Filter
from ekf_fusion_ros.ekf2.resets import Resets
from ekf_fusion_ros.ekf2.yaw_estimator import YawEstimator
from ekf_fusion_ros.ekf2.yaw_recovery import YawRecovery
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import GnssParams


class Bank(YawEstimator):
    """A bank that is sure of what it is told."""

    def __init__(self, yaw_deg, sigma_deg, running=True):
        super().__init__()
        self.models['running'] = self._running = running
        self._composite[:] = math.radians(yaw_deg), math.radians(sigma_deg) ** 2


def recovery(bank, *, own_sigma_deg=1.0, thorough=True):
    f = Filter(Ekf2Params(gnss=GnssParams(thorough_yaw_recovery=thorough)), 12)
    f.cov.add_yaw_variance(f.x[0:4], math.radians(own_sigma_deg) ** 2)
    return YawRecovery(f, Resets(f), bank)


@pytest.mark.parametrize(('yaw', 'sigma', 'contradicted'), [
    (24.0, 1.0, False), (26.0, 1.0, True), (-26.0, 1.0, True), (179.0, 5.0, True),
    (44.0, 14.9, False), (46.0, 14.9, True), (90.0, 15.1, False)])
def test_a_certain_bank_with_another_yaw_contradicts(yaw, sigma, contradicted):
    """Beyond 25 deg and three sigmas, where the bank is known to 15 deg."""
    assert recovery(Bank(yaw, sigma)).contradicted() is contradicted


def test_an_uncertain_yaw_is_not_contradicted():
    assert not recovery(Bank(50.0, 1.0), own_sigma_deg=20.0).contradicted()
    assert recovery(Bank(70.0, 1.0), own_sigma_deg=20.0).contradicted()


@pytest.mark.parametrize(('running', 'thorough'), [(False, True), (True, False)])
def test_a_bank_that_rests_or_is_not_asked_contradicts_nothing(running, thorough):
    asked = recovery(Bank(90.0, 1.0, running), thorough=thorough)
    assert not asked.contradicted()
