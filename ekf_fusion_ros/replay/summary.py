"""summary.json: what was used, fused, refused and why."""

from __future__ import annotations

from importlib import metadata
import json
import math
import platform
from typing import TYPE_CHECKING
from typing import Any

from ekf_fusion_ros.ekf2.events import EventKind
from ekf_fusion_ros.estimator import AidStatus
from ekf_fusion_ros.health.home import Home
from ekf_fusion_ros.health.status import NavigationStatus
from ekf_fusion_ros.messages.encode_home import encode_home
from ekf_fusion_ros.receivers.bank import ReceiverStatus
from ekf_fusion_ros.receivers.reading import KINDS
from ekf_fusion_ros.replay.options import ReplayOptions
from ekf_fusion_ros.replay.topics import Choice
from ekf_fusion_ros.session import FusionSession

if TYPE_CHECKING:
    from ekf_fusion_ros.replay.runner import Progress

SECOND_US = 1e6
FIXES_LOST = EventKind.GPS_FUSION_TIMEOUT.value
PACKAGES = ('ekf_fusion_ros', 'numpy', 'numba', 'rosbags')


def summarise(
    options: ReplayOptions, session: FusionSession, choice: Choice, progress: Progress,
) -> tuple[dict[str, Any], list[str]]:
    """Write summary.json; return its content and its gist in lines."""
    summary = _content(options, session, choice, progress)
    text = json.dumps(summary, indent=2, allow_nan=False)
    (options.output / 'summary.json').write_text(text + '\n', encoding='utf-8')
    return summary, _gist(summary)


def _content(
    options: ReplayOptions, session: FusionSession, choice: Choice, progress: Progress,
) -> dict[str, Any]:
    origin = session.origin
    duration = (progress.end_us - progress.start_us) / SECOND_US
    replayed = _replayed(options, duration)
    return {
        'recording': str(options.recording),
        'start': progress.start_us / SECOND_US,
        'duration': duration,
        'replayed': replayed,
        'frame': 'local' if session.local else 'map',
        'origin': None if origin is None else {
            'lat': origin.lat, 'lon': origin.lon, 'alt': origin.alt},
        'home': _home(session.navigation.home),
        'navigation': _navigation(session.navigation),
        'topics': _topics(session, choice),
        'aid_sources': {aid.name: _aid(aid) for aid in session.aid_statuses()},
        'events': [{'time': event.time_us / SECOND_US, 'text': event.text}
                   for event in progress.events],
        'receivers': {one.name: _receiver(one) for one in session.receivers()},
        'resets': dict(session.resets()),
        'alignment': {name: time_us / SECOND_US for name, time_us in session.milestones.items()},
        'first_output': _seconds(progress.first_output_us),
        'rows': progress.rows,
        'fix_distance': progress.fix_distance,
        'withheld_distance': progress.withheld_distance,
        'health': session.health().text,
        'warnings': [*session.warnings(), *progress.warnings],
        'notes': progress.notes,
        'cpu_seconds': progress.cpu_seconds,
        'kernel_loading_cpu_seconds': progress.kernel_seconds,
        'real_time_factor': replayed / max(progress.wall_seconds, 1e-9),
        'versions': _versions(),
    }


def _replayed(options: ReplayOptions, duration: float) -> float:
    """Return how much of the recording, in s, lies between start and end of the options."""
    end = duration if options.end is None else min(options.end, duration)
    return max(end - options.start, 0.0)


def _home(home: Home | None) -> dict[str, Any] | None:
    """Return home on the globe and in the frame of the rows (ENU, rad), as far as known."""
    if home is None:
        return None
    local = encode_home(home)
    numbers = dict(zip('xyz', local.position, strict=True)) | {'yaw': local.yaw}
    return {
        'time': home.time_us / SECOND_US, 'lat': home.lat, 'lon': home.lon, 'alt': home.alt,
        'manual': home.manual,
        **{name: number if math.isfinite(number) else None for name, number in numbers.items()}}


def _navigation(status: NavigationStatus) -> dict[str, Any]:
    return {
        'global_position_valid': status.global_position_valid,
        'local_position_valid': status.local_position_valid,
        'local_velocity_valid': status.local_velocity_valid,
        'takeoff_test': status.takeoff_test.value,
        'ready': status.ready,
        'home_text': status.home_text,
    }


def _topics(session: FusionSession, choice: Choice) -> dict[str, Any]:
    """Return the counts by topic; a sensor CSV has roles for topics."""
    topics = {}
    for role, statistics in session.statistics().items():
        chosen = choice.topics.get(role)
        name = role if chosen is None else chosen.name
        about = {'role': role} | ({} if chosen is None else {'type': chosen.type})
        topics[name] = about | statistics.as_dict() | {
            'first_refusals': {reason: detail for reason, detail in statistics.details.items()
                               if detail}}
    return topics


def _receiver(status: ReceiverStatus) -> dict[str, Any]:
    """Return what became of one of several receivers, at the end of the recording."""
    return {
        'live': status.live,
        'weights': dict(zip(KINDS, status.weights, strict=True)),
        'offset': dict(zip(('north', 'east', 'down'), status.offset, strict=True)),
        'obstacles': dict(status.obstacles),
    }


def _aid(aid: AidStatus) -> dict[str, Any]:
    seen = aid.fused > 0
    return {
        'fused': aid.fused,
        'rejected': aid.rejected,
        'first': _seconds(aid.first_fused_us if seen else None),
        'last': _seconds(aid.last_fused_us if seen else None),
        'starts': aid.starts,
        'stops': aid.stops,
    }


def _seconds(time_us: int | None) -> float | None:
    return None if time_us is None else time_us / SECOND_US


def _versions() -> dict[str, str]:
    versions = {'python': platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return versions


def _gist(summary: dict[str, Any]) -> list[str]:
    origin = summary['origin']
    lines = [] if origin is None else [
        f'origin: {origin["lat"]:.7f}, {origin["lon"]:.7f}, {origin["alt"]:.2f} m']
    if summary['frame'] == 'map':
        lines.append(summary['navigation']['home_text'])
    if summary['first_output'] is None:
        lines.append('no output: ' + _missing(summary))
    else:
        after = summary['first_output'] - summary['start']
        lines.append(f'{summary["rows"]} rows in frame {summary["frame"]}, the first '
                     f'{after:.1f} s after the start')
    lines += [f'warning: {warning}' for warning in summary['warnings']]
    lost = [event for event in summary['events'] if event['text'] == FIXES_LOST]
    if lost:
        often = 'once' if len(lost) == 1 else f'{len(lost)} times'
        lines.append(f'warning: {FIXES_LOST}, {often}: fixes and the other topics contradict '
                     'each other')
    for which in ('fix', 'withheld'):
        distance = summary[f'{which}_distance']
        if distance is not None:
            lines.append(f'{"used" if which == "fix" else which} fixes: track passes by '
                         f'{distance["rms"]:.2f} m RMS, at most {distance["largest"]:.2f} m, '
                         f'{distance["over_limit"]} of {distance["count"]} beyond 3 sigma + 2 m')
    for name, topic in summary['topics'].items():
        reasons = ', '.join(f'{n} {reason}' for reason, n in topic['refused'].items())
        passed_over = ', '.join(f'{n} {reason}' for reason, n in topic['passed_over'].items())
        lines.append(f'{name}: {topic["received"]} received, {topic["accepted"]} accepted'
                     + (f', refused: {reasons}' if reasons else '')
                     + (f', passed over: {passed_over}' if passed_over else ''))
        lines += [f'{name}: {reason}, the first: {detail}'
                  for reason, detail in topic['first_refusals'].items()]
    for name, aid in summary['aid_sources'].items():
        if aid['fused'] or aid['rejected']:
            lines.append(f'{name}: {aid["fused"]} fused, {aid["rejected"]} rejected')
    speed = summary['real_time_factor']
    if math.isfinite(speed):
        lines.append(f'{summary["replayed"]:.1f} s in {summary["cpu_seconds"]:.1f} s of CPU, '
                     f'{speed:.0f} times real time' + _loading(summary))
    return lines


def _loading(summary: dict[str, Any]) -> str:
    seconds = summary['kernel_loading_cpu_seconds']
    return f'; before it {seconds:.1f} s to load the kernels' if seconds >= 0.05 else ''


def _missing(summary: dict[str, Any]) -> str:
    if summary['frame'] == 'local':
        return 'the filter never started'
    if summary['origin'] is None:
        return f'the origin was never set ({summary["health"]})'
    return f'the yaw was never aligned ({summary["health"]})'
