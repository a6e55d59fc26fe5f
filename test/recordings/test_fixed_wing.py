"""An aeroplane thrown by hand, whose compass the motor disturbs from the launch on.

The recorded attitude cannot judge: it is 25 deg RMS away from where the air comes from, which GNSS
velocity and airspeed alone tell (the wind is below 1 m/s).
"""

from __future__ import annotations

import numpy as np
import pytest
from recordings.scores import fixes
from recordings.scores import horizontal_errors
from recordings.scores import messages
from recordings.scores import rms
from scipy.optimize import least_squares

from ekf_fusion_ros.__main__ import main

NAME = 'inav_fixedwing_search_150s'
RECEIVER_LAG_S = 0.23
"""Of velocity, as the source of the recording states."""


@pytest.fixture(scope='module')
def recording(shared):
    folder = shared / 'data' / NAME / f'{NAME}_mcap'
    if not folder.exists():
        pytest.skip(f'no {folder.name} in the shared folder')
    return folder


@pytest.fixture(scope='module', params=['unspecified', 'fixed_wing'])
def replay(recording, request, tmp_path_factory):
    """The replay with airspeed, all else by default, of a vehicle of either kind."""
    output = tmp_path_factory.mktemp('fixed_wing')
    assert main(['replay', str(recording), '--output', str(output), '--no-bag', '--topic',
                 'airspeed=/airspeed', '--set', f'ekf2.aiding.vehicle={request.param}']) == 0
    return output


def headings_into_the_air(recording):
    """Return times and directions, ENU in rad, from which the air comes, by no attitude."""
    velocity = np.array([(m.time, m.twist.twist.linear.x, m.twist.twist.linear.y,
                          m.twist.twist.linear.z) for m in messages(recording, '/fix_velocity')])
    speed = np.array([(m.time, m.twist.twist.linear.x) for m in messages(recording, '/airspeed')])
    time = velocity[:, 0] - RECEIVER_LAG_S
    start = fixes(recording)[0, 0]
    flying = (time > start + 20.0) & (time < start + 143.0)
    time, east, north, up = time[flying], *velocity[flying, 1:4].T
    smooth = np.convolve(speed[:, 1], np.full(9, 1.0 / 9.0), 'same')
    airspeed = np.interp(time, speed[:, 0], smooth)

    def misfit(unknown):
        wind_east, wind_north, scale = unknown
        return np.sqrt((east - wind_east) ** 2 + (north - wind_north) ** 2
                       + up ** 2) - scale * airspeed

    fit = least_squares(misfit, (0.0, 0.0, 1.0), loss='soft_l1', f_scale=0.5)
    assert rms(fit.fun) < 1.0
    return time, np.arctan2(north - fit.x[1], east - fit.x[0])


def wrapped(angles):
    return (angles + np.pi) % (2.0 * np.pi) - np.pi


@pytest.mark.slow
def test_the_track_stays_with_the_fixes(recording, replay):
    _, distance, limit = horizontal_errors(recording, replay, 0.11, assumed_sigma=2.5)
    assert (distance < limit).all()
    assert rms(distance) < 1.5


@pytest.mark.slow
def test_the_nose_points_where_the_air_comes_from(recording, replay):
    time, into_air = headings_into_the_air(recording)
    track = np.genfromtxt(replay / 'trajectory.csv', delimiter=',', names=True)
    ours = np.interp(time, track['t'], np.unwrap(track['yaw']))
    error = np.degrees(wrapped(into_air - ours))
    assert rms(error) < 10.0
    assert rms(error[time > time[0] + 30.0]) < 7.0
