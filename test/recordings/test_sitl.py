"""PX4 in simulation, v1.9, 62 s, against its truth and beside PX4's own EKF2.

The recording lacks 19 % of the IMU samples that PX4 had; leaving out as many again moves the
velocity error by -0.005 to +0.024 m/s, so nothing finer can be asked of it. Its compass was
simulated with a declination of 2.56 deg, where the field table of 2021 has 2.89.
"""

from __future__ import annotations

import numpy as np
import pytest
from recordings.scores import angles_between
from recordings.scores import at_times
from recordings.scores import rms

from ekf_fusion_ros.__main__ import main

NAME = 'px4_sitl_v19_position'
ATTITUDE = ('qw', 'qx', 'qy', 'qz')


@pytest.fixture(scope='module')
def errors(shared, tmp_path_factory):
    """RMS of attitude deg, velocity m/s, position about its mean m: ours, then PX4's."""
    folder = shared / 'data' / NAME
    if not folder.exists():
        pytest.skip(f'no {NAME} in the shared folder')
    output = tmp_path_factory.mktemp('sitl')
    assert main(['replay', str(folder / f'{NAME}_mcap'), '--output', str(output), '--no-bag',
                 '--set', 'ekf2.mag.declination_from_table=false',
                 '--set', 'ekf2.mag.declination_deg=2.5637']) == 0
    truth = np.genfromtxt(folder / 'reference' / 'groundtruth_enu_flu.csv', delimiter=',',
                          names=True)
    ours = np.genfromtxt(output / 'trajectory.csv', delimiter=',', names=True)
    px4 = np.genfromtxt(folder / 'reference' / 'px4_ekf2_local_enu_flu.csv', delimiter=',',
                        names=True)
    px4 = px4[px4['t_sec'] > ours['t'][0]]
    their_names = ('east', 'north', 'up'), ('v_east', 'v_north', 'v_up')
    return (compared(truth, ours, 't', (('x', 'y', 'z'), ('vx', 'vy', 'vz')),
                     ('qw', 'qx', 'qy', 'qz')),
            compared(truth, px4, 't_sec', their_names, ATTITUDE))


def compared(truth, track, time, names, attitude):
    inside = track[time] <= truth['t_sec'][-1]
    track = track[inside]
    position, velocity = (np.stack([track[n] for n in group], axis=1) for group in names)
    away = position - at_times(track[time], truth, ('east', 'north', 'up'))
    slip = velocity - at_times(track[time], truth, ('v_east', 'v_north', 'v_up'))
    angle = angles_between(track, time, attitude, truth)
    return (rms(angle), rms(np.linalg.norm(slip, axis=1)),
            rms(np.linalg.norm(away - away.mean(axis=0), axis=1)))


@pytest.mark.slow
def test_as_near_to_the_truth_as_the_lost_samples_let_it_be(errors):
    ours, px4 = errors
    assert ours[0] < px4[0] + 0.1
    assert ours[1] < px4[1] + 0.03
    assert ours[2] < px4[2] + 0.03
