"""The true motion as a CSV file beside a recording."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from ekf_fusion_ros.frames import swap_attitude
from ekf_fusion_ros.geo.projection import LocalTangent
from ekf_fusion_ros.simulation.scenario import Scenario

HEADER = 't,lat,lon,alt,x,y,z,qx,qy,qz,qw,vx,vy,vz,wind_x,wind_y,ground'.split(',')


def write_truth(path: Path, scenario: Scenario, rate: float = 50.0) -> None:
    """Write the motion of the body origin at `rate` Hz.

    Columns: stamp s; deg, deg, m; ENU m about the origin; attitude FLU to ENU; ENU m/s; wind east
    and north m/s; height of the ground below m.
    """
    count = int(scenario.trajectory.duration * rate + 1e-6) + 1
    motion = scenario.trajectory.motion(np.arange(count) / rate)
    tangent = LocalTangent(scenario.origin.lat, scenario.origin.lon, scenario.origin.alt)
    attitude = motion.quaternion
    wind = scenario.trajectory.wind.velocity(motion.time)
    ground = -scenario.trajectory.terrain.down(motion.position[:, 0], motion.position[:, 1])
    with path.open('w', newline='', encoding='utf-8') as stream:
        rows = csv.writer(stream)
        rows.writerow(HEADER)
        for k in range(count):
            north, east, down = motion.position[k]
            lat, lon, alt = tangent.to_geodetic(east, north, -down)
            w, x, y, z = swap_attitude(attitude[k])
            vn, ve, vd = motion.velocity[k]
            t = scenario.start_us * 1e-6 + motion.time[k]
            rows.writerow(
                [f'{t:.6f}', f'{lat:.10f}', f'{lon:.10f}', f'{alt:.5f}']
                + [f'{v:.9g}' for v in (
                    east, north, -down, x, y, z, w, ve, vn, -vd, wind[k, 1], wind[k, 0],
                    ground[k])])
