"""Flow that returns after the position was held: it tells no place, and none is claimed."""

from __future__ import annotations

import numpy as np
import pytest

from ekf_fusion_ros.ekf2.ekf2 import Ekf2
from ekf_fusion_ros.params.ekf2 import AidingParams
from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.ekf2 import FlowParams
from ekf_fusion_ros.samples import ImuSample
from ekf_fusion_ros.simulation.barometer import Barometer
from ekf_fusion_ros.simulation.gnss import Gnss
from ekf_fusion_ros.simulation.ground_contact import GroundContact
from ekf_fusion_ros.simulation.imu import Imu
from ekf_fusion_ros.simulation.magnetometer import Magnetometer
from ekf_fusion_ros.simulation.optical_flow import OpticalFlow
from ekf_fusion_ros.simulation.range_finder import RangeFinder
from ekf_fusion_ros.simulation.scenario import ORIGIN
from ekf_fusion_ros.simulation.scenario import Scenario
from ekf_fusion_ros.simulation.scenario import field_at
from ekf_fusion_ros.simulation.trajectory import Flight

FLIGHT = Flight(duration=122.0, size=20.0, period=40.0, height=8.0, landing=15.0)
SILENCE = 14.0


def returned(silent_from, seed, doubt=True):
    """Return error and sigma of the position, m, at the rows after flow has returned."""
    sensors = {
        'imu': Imu(), 'magnetic_field': Magnetometer(earth_field=field_at(ORIGIN)),
        'pressure': Barometer(reference=ORIGIN.alt), 'landed': GroundContact(),
        'range': RangeFinder(),
        'flow': OpticalFlow(outages=((silent_from, silent_from + SILENCE),)),
        'fix': Gnss(origin=ORIGIN, pos_correlated=0.0, pos_noise=0.5, stamp_delay=0.11,
                    outages=((40.0, 200.0),))}
    scenario = Scenario(trajectory=FLIGHT, sensors=sensors, seed=seed)
    ekf = Ekf2(Ekf2Params(flow=FlowParams(enabled=True),
                          aiding=AidingParams(doubt_held_position=doubt)))
    rows, next_us = [], 0
    for arrival in scenario.arrivals():
        ekf.push(arrival.sample)
        if isinstance(arrival.sample, ImuSample) and ekf.update() and arrival.time_us >= next_us:
            next_us, nav = arrival.time_us + 100_000, ekf.nav_state()
            rows.append((1e-6 * (arrival.time_us - scenario.start_us), *nav.position[0:2],
                         *nav.pose_cov.diagonal()[0:2], ekf.filter.flags.opt_flow))
    time, *place, var_north, var_east, uses_flow = np.array(rows).T
    error = np.array(place).T - scenario.trajectory.motion(time).position[:, 0:2]
    # The origin lies where the first fix has put it.
    error -= error[(time > 38.0) & (time < 40.0)].mean(axis=0)
    back = (time > silent_from + SILENCE + 0.5) & (uses_flow > 0.0)
    return np.abs(error[back]).max(axis=1), np.sqrt(np.maximum(var_north, var_east)[back])


@pytest.mark.parametrize('silent_from', [75.0, 99.0])
def test_the_place_is_as_uncertain_as_it_has_become(silent_from):
    """In flight, and from the landing on: the vehicle went on while the filter held it."""
    for seed in (0, 1, 2):
        error, sigma = returned(silent_from, seed)
        assert len(error) > 20
        assert (error < 3.0 * sigma).all()
        assert sigma.max() < 40.0


def test_the_reference_claims_centimetres_after_the_landing():
    error, sigma = returned(99.0, 0, doubt=False)
    assert (error > 100.0 * sigma).any()
