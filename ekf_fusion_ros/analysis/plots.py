"""Pictures, drawn without a display."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ekf_fusion_ros.analysis.comparison import Comparison
from ekf_fusion_ros.analysis.comparison import Window
from ekf_fusion_ros.analysis.errors import Alignment
from ekf_fusion_ros.analysis.errors import Track
from ekf_fusion_ros.analysis.errors import horizontal
from ekf_fusion_ros.analysis.errors import inside

Array = NDArray[np.float64]
TRUTH, FUSED, ODOMETRY, GPS = '#222222', '#d62728', '#1f77b4', '#9aa5ae'
OUTAGE = '#f6d7a7'


def draw_comparison(path: Path, flight: Comparison, title: str) -> None:
    """Write a PNG: the map, the outage close up, and the errors over time with 3 sigma.

    Raises ModuleNotFoundError where matplotlib is missing.
    """
    # Figure with its own canvas: no global backend is touched.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(15.0, 9.0), layout='constrained')
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 2, width_ratios=[1.0, 1.25])
    _map(figure.add_subplot(grid[:2, 0]), flight)
    _close_up(figure.add_subplot(grid[2, 0]), flight)
    _distances(figure.add_subplot(grid[0, 1]), flight)
    _bounds(figure.add_subplot(grid[1, 1]), flight, 0, 'east')
    _bounds(figure.add_subplot(grid[2, 1]), flight, 1, 'north')
    figure.suptitle(title)
    figure.savefig(path, dpi=110)


def _map(axes: Any, flight: Comparison) -> None:
    _line(axes, flight.fixes, 'GPS fixes', GPS, linestyle='', marker='.', markersize=2.0)
    _line(axes, flight.aligned_odometry(), 'odometry alone, fitted', ODOMETRY, linewidth=1.2)
    lost = flight.truth.where(inside(flight.truth.time, (flight.outage,)))
    _line(axes, lost, 'GPS outage', OUTAGE, linewidth=10.0, solid_capstyle='butt', zorder=1)
    _line(axes, flight.truth, 'truth', TRUTH, linewidth=2.2)
    _line(axes, flight.fused, 'fused', FUSED, linewidth=1.1)
    axes.set_aspect('equal', adjustable='datalim')
    axes.set_title('seen from above')
    axes.set_xlabel('east (m)')
    axes.set_ylabel('north (m)')
    axes.legend(loc='best', fontsize=8)
    axes.grid(alpha=0.3)


def _close_up(axes: Any, flight: Comparison) -> None:
    begin, end = flight.outage
    shown = (begin - 15.0, end + 15.0)
    ends = flight.truth.at(np.array(shown))
    chord = ends[1] - ends[0]
    # From left to right, whatever the direction of flight.
    turned = Alignment(-math.atan2(chord[1], chord[0]), np.zeros(3))

    def cut(track: Track, window: Window = shown) -> Track:
        part = track.where(inside(track.time, (window,)))
        return Track(part.time, turned.apply(part.position - ends[0]))

    _line(axes, cut(flight.truth, flight.outage), '', OUTAGE, linewidth=14.0,
          solid_capstyle='butt', zorder=1)
    _line(axes, cut(flight.fixes), '', GPS, linestyle='', marker='.', markersize=4.0)
    _line(axes, cut(flight.aligned_odometry()), '', ODOMETRY, linewidth=1.4)
    _line(axes, cut(flight.truth), '', TRUTH, linewidth=2.4)
    _line(axes, cut(flight.fused), '', FUSED, linewidth=1.3)
    axes.set_aspect('equal', adjustable='datalim')
    axes.set_title(f'the outage, {begin:.0f} to {end:.0f} s, flown from left to right')
    axes.set_xlabel('along (m)')
    axes.set_ylabel('across (m)')
    axes.grid(alpha=0.3)


def _distances(axes: Any, flight: Comparison) -> None:
    gps = flight.errors(flight.fixes)
    odometry = flight.errors(flight.aligned_odometry())
    fused = flight.errors(flight.fused)
    axes.plot(gps.time, horizontal(gps.position), '.', color=GPS, markersize=2.0, label='GPS')
    axes.plot(odometry.time, horizontal(odometry.position), color=ODOMETRY, linewidth=1.2,
              label='odometry alone, fitted')
    axes.plot(fused.time, horizontal(fused.position), color=FUSED, linewidth=1.2, label='fused')
    axes.set_title('horizontal error')
    axes.set_ylabel('m')
    axes.set_ylim(bottom=0.0)
    _finish(axes, flight)
    axes.legend(loc='upper left', fontsize=8)


def _bounds(axes: Any, flight: Comparison, axis: int, name: str) -> None:
    fused = flight.errors(flight.fused)
    sigma = flight.fused_sigma[:, axis]
    axes.fill_between(fused.time, -3.0 * sigma, 3.0 * sigma, color=FUSED, alpha=0.12, linewidth=0,
                      label='3 sigma of the filter')
    axes.plot(fused.time, fused.position[:, axis], color=FUSED, linewidth=1.0, label='fused')
    # The outage would dwarf the rest: its bounds leave the picture.
    errors = np.abs(fused.position[:, axis])
    limit = 1.3 * max(3.0 * np.quantile(sigma, 0.9), errors.max())
    axes.set_ylim(-limit, limit)
    axes.set_title(f'fused error {name}')
    axes.set_ylabel('m')
    _finish(axes, flight)
    axes.legend(loc='upper left', fontsize=8)


def _finish(axes: Any, flight: Comparison) -> None:
    axes.axvspan(*flight.outage, color=OUTAGE, alpha=0.6, linewidth=0, zorder=0)
    axes.set_xlim(flight.start, float(flight.truth.time[-1]))
    axes.set_xlabel('time (s)')
    axes.grid(alpha=0.3)


def _line(axes: Any, track: Track, label: str, color: str, **style: Any) -> None:
    east, north = track.position[:, 0], track.position[:, 1]
    axes.plot(east, north, color=color, label=label or None, **style)
