"""Runs a recording through a session into the sinks."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterable
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from dataclasses import field
from dataclasses import replace
from functools import cache
import gc
from itertools import chain
from itertools import islice
from itertools import takewhile
import sys
from threading import Timer
import time
from typing import Any
import zlib

from tqdm import tqdm

from ekf_fusion_ros.estimator import Event
from ekf_fusion_ros.fused_output import FusedOutput
from ekf_fusion_ros.inputs import ROLE_OF_SAMPLE
from ekf_fusion_ros.params import Params
from ekf_fusion_ros.replay.breaks import OutputGaps
from ekf_fusion_ros.replay.breaks import restart_warnings
from ekf_fusion_ros.replay.decoding import BatchDecoder
from ekf_fusion_ros.replay.fix_distance import FixDistance
from ekf_fusion_ros.replay.fused_bag import check_place
from ekf_fusion_ros.replay.options import ReplayOptions
from ekf_fusion_ros.replay.sinks import AlignmentSink
from ekf_fusion_ros.replay.sinks import BagSink
from ekf_fusion_ros.replay.sinks import StateSink
from ekf_fusion_ros.replay.sinks import TrajectorySink
from ekf_fusion_ros.replay.storage import Message
from ekf_fusion_ros.replay.storage import Recording
from ekf_fusion_ros.replay.storage import RecordingError
from ekf_fusion_ros.replay.summary import summarise
from ekf_fusion_ros.replay.topics import ALL_TYPES
from ekf_fusion_ros.replay.topics import Choice
from ekf_fusion_ros.replay.topics import choose
from ekf_fusion_ros.replay.withholding import Withholding
from ekf_fusion_ros.roles import SUPPORTED
from ekf_fusion_ros.roles import configure
from ekf_fusion_ros.samples import Sample
from ekf_fusion_ros.session import FusionSession
from ekf_fusion_ros.warm_up import warm_up

CSV_SUFFIXES = ('.csv', '.csv.gz')
# Reading, filtering and writing take turns: a processor repeats a task faster than it switches,
# and the messages of a topic that are decoded together share the cost of each numpy call.
BATCH = 2048
COMPILE_NOTICE_AFTER = 3.0
COMPILE_NOTICE = ('loading the numeric kernels; the first time compiles them, a minute or so, '
                  'and the result is cached')
Say = Callable[[str], None]


@dataclass(slots=True)
class Progress:
    """What a run has gone through, for the summary."""

    start_us: int = 0
    end_us: int = 0
    first_output_us: int | None = None
    rows: int = 0
    fix_distance: dict[str, Any] | None = None
    withheld_distance: dict[str, Any] | None = None
    events: list[Event] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    kernel_seconds: float = 0.0
    cpu_seconds: float = 0.0
    wall_seconds: float = 0.0


def replay(options: ReplayOptions, say: Say = print) -> dict[str, Any]:
    """Replay a recording, write the files of `options.output`, return the summary.

    `say` gets the choice of topics and what is worth knowing, a line at a time. Raises
    RecordingError where the recording cannot be used, ValueError for parameters that cannot
    work together and for an output that would replace what is no output.
    """
    check_paths(options)
    begin = time.process_time()
    make_kernels_ready()
    progress = Progress(kernel_seconds=time.process_time() - begin)
    if options.recording.name.endswith(CSV_SUFFIXES):
        return _replay_csv(options, progress, say)
    return _replay_bag(options, progress, say)


def check_paths(options: ReplayOptions) -> None:
    """Raise RecordingError without a recording, ValueError where the fused bag cannot go."""
    if not options.recording.exists():
        raise RecordingError(f'{options.recording}: does not exist')
    if options.write_bag:
        check_place(options.output, options.recording)


@cache
def make_kernels_ready() -> None:
    """Load or compile the kernels, once a process; say so where it takes long."""
    notice = Timer(COMPILE_NOTICE_AFTER, print, [COMPILE_NOTICE], {'file': sys.stderr})
    notice.daemon = True
    notice.start()
    try:
        warm_up(configure(Params(), SUPPORTED))
    finally:
        notice.cancel()
    # What is loaded by now stays; each full collection would walk all of numba again.
    gc.freeze()


def _replay_bag(options: ReplayOptions, progress: Progress, say: Say) -> dict[str, Any]:
    with Recording(options.recording, ALL_TYPES) as recording:
        choice = choose(recording.topics, options.topics, str(options.recording),
                        *_switches(options.params))
        told = list(recording.notes)
        for line in [*told, *choice.lines()]:
            say(line)
        params = _with_roles(options.params, choice)
        progress.start_us = recording.start_ns // 1000
        progress.end_us = recording.end_ns // 1000
        _check_start(options, progress)
        _check_withheld(options, choice, progress)
        run = _Run(replace(options, params=params), list(choice.topics), progress)
        run.drive(_bag_steps(run, recording, choice))
        progress.notes = recording.notes
        for note in recording.notes[len(told):]:
            say(note)
        return run.finish(choice, say)


def _replay_csv(options: ReplayOptions, progress: Progress, say: Say) -> dict[str, Any]:
    if options.topics:
        raise RecordingError(f'{options.recording}: a sensor CSV has no topics: leave --topic out')
    run = _Run(options, None, progress)
    run.drive(_csv_steps(run))
    for note in progress.notes:
        say(note)
    return run.finish(Choice(), say)


def _switches(params: Params) -> tuple[list[str], list[str]]:
    """Return the roles that parameters add, and those they drop, against the node's usual ones.

    The usual ones themselves say nothing, for they may be there by default.
    """
    usual, chosen = Params().node.roles, params.node.roles
    return ([role for role in chosen if role not in usual],
            [role for role in usual if role not in chosen])


def _with_roles(params: Params, choice: Choice) -> Params:
    """Tell the node's parameters, which name the output frames, what takes part."""
    return replace(params, node=replace(params.node, use_fix='fix' in choice.topics))


class _Run:
    """One session, its sinks and its clocks."""

    def __init__(
        self, options: ReplayOptions, roles: list[str] | None, progress: Progress,
    ) -> None:
        self.options = options
        self.progress = progress
        _make_folder(options)
        self._states = StateSink(options.output, options.params.estimator) \
            if options.log_states else None
        self.session = FusionSession(
            options.params, roles, on_update=self._states.write if self._states else None)
        self._track = TrajectorySink(options.output)
        self._alignment = AlignmentSink(options.output)
        self._bag = BagSink(options.output, options.params, local=self.session.local) \
            if options.write_bag else None
        self._rows: list[FusedOutput] = []
        self._gaps = OutputGaps(self.session.params.session.output_rate)
        self._fix_distance = FixDistance(self.session.params)
        self._prediction = FixDistance(self.session.params)
        self.withholding = Withholding(options.withhold, progress.start_us)

    def drive(self, steps: Iterable[list[FusedOutput]]) -> None:
        """Write what each step gives; the sinks are closed whatever happens."""
        cpu, wall = time.process_time(), time.perf_counter()
        with ExitStack() as stack:
            for sink in (self._track, self._alignment, self._bag, self._states):
                if sink is not None:
                    stack.callback(sink.close)
            stack.callback(self._flush)
            # The usual threshold walks the tuples of a batch several times while they wait.
            stack.callback(gc.set_threshold, *gc.get_threshold())
            gc.set_threshold(10 * BATCH)
            for outputs in steps:
                for output in outputs:
                    self._write(output)
            self.session.finish()
            self.progress.events = self.session.drain_events()
        self.progress.rows = self._track.rows
        self.progress.warnings = self._breaks()
        self.progress.fix_distance = self._fix_distance.as_dict()
        self.progress.withheld_distance = self._prediction.as_dict()
        self.progress.cpu_seconds = time.process_time() - cpu
        self.progress.wall_seconds = time.perf_counter() - wall

    def _breaks(self) -> list[str]:
        """Say how the run was interrupted."""
        start_us, end_us = self.progress.start_us, self.progress.end_us
        if self.options.end is not None:
            end_us = min(end_us, start_us + round(1e6 * self.options.end))
        session = self.session
        return [*restart_warnings(session.restarts, session.first_restart_us, start_us),
                *self._gaps.warnings(start_us, end_us)]

    def _write(self, output: FusedOutput) -> None:
        if self.progress.first_output_us is None:
            self.progress.first_output_us = output.time_us
        self._alignment.write(output, self.session)
        self._rows.append(output)
        if len(self._rows) >= BATCH:
            self._flush()

    def _flush(self) -> None:
        """Write the rows that have gathered."""
        rows, self._rows = self._rows, []
        self._gaps.note([row.time_us for row in rows])
        self._track.write([row.nav for row in rows])
        self._fix_distance.note(rows, [fix for row in rows for fix in row.fixes])
        self._prediction.note(rows, self.withholding.take_fixes())
        if self._bag is not None and rows:
            self._bag.write(rows)

    def finish(self, choice: Choice, say: Say) -> dict[str, Any]:
        """Write summary.json and say the gist of it."""
        summary, lines = summarise(self.options, self.session, choice, self.progress)
        for line in lines:
            say(line)
        return summary


def _check_start(options: ReplayOptions, progress: Progress) -> None:
    duration = (progress.end_us - progress.start_us) / 1e6
    if options.start > duration:
        raise ValueError(f'--start {options.start:g}: {options.recording} ends {duration:.1f} s '
                         'after its start')


def _check_withheld(options: ReplayOptions, choice: Choice, progress: Progress) -> None:
    duration = (progress.end_us - progress.start_us) / 1e6
    end = duration if options.end is None else min(options.end, duration)
    for role, windows in options.withhold.items():
        if role not in choice.topics:
            raise ValueError(f'--withhold {role}: no topic of {options.recording} has this role; '
                             f'in use are {", ".join(choice.topics)}')
        for first, last in windows:
            if first > end:
                raise ValueError(f'--withhold {role}={first:g}:{last:g}: the replay of '
                                 f'{options.recording} ends {end:.1f} s after its start')


def _make_folder(options: ReplayOptions) -> None:
    try:
        options.output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f'output {options.output}: cannot be made a folder ({error.strerror})') from None


def _bag_steps(
    run: _Run, recording: Recording, choice: Choice,
) -> Iterator[list[FusedOutput]]:
    """Hand the messages to the session, yielding the outputs that are due."""
    session, withholding, options = run.session, run.withholding, run.options
    decoder = BatchDecoder(choice.topics, session, withholding)
    total = sum(topic.count for topic in choice.topics.values())
    messages = _between(recording, recording.messages(decoder.names), options)
    for batch in _batches(messages, total, options.progress):
        for role, sample in decoder.decode(batch):
            outputs = session.take(role, sample)
            if outputs:
                yield outputs


def _between(
    recording: Recording, messages: Iterator[Message], options: ReplayOptions,
) -> Iterator[Message]:
    """Yield the messages from start to end of the options, by log time."""
    first_ns = recording.start_ns + round(1e9 * options.start)
    if options.start:
        messages = filter(lambda message: message[0] >= first_ns, messages)
    if options.end is None:
        return messages
    last_ns = recording.start_ns + round(1e9 * options.end)
    return takewhile(lambda message: message[0] < last_ns, messages)


def _csv_steps(run: _Run) -> Iterator[list[FusedOutput]]:
    """Hand the samples of a sensor CSV to the session, yielding the outputs that are due."""
    session, options, progress = run.session, run.options, run.progress
    batches = _batches(_samples(options, progress), None, options.progress)
    for sample in chain.from_iterable(batches):
        if not progress.start_us:
            progress.start_us = sample.time_us
            run.withholding = Withholding(options.withhold, sample.time_us)
        progress.end_us = sample.time_us
        elapsed = (sample.time_us - progress.start_us) * 1e-6
        if elapsed < options.start:
            continue
        if options.end is not None and elapsed >= options.end:
            break
        role = ROLE_OF_SAMPLE[type(sample)]
        if run.withholding.holds(role, sample.time_us):
            run.withholding.keep(sample)
            session.refuse(role, 'withheld')
            continue
        outputs = session.push(sample)
        if outputs:
            yield outputs


def _samples(options: ReplayOptions, progress: Progress) -> Iterator[Sample]:
    """Yield the samples of a sensor CSV, as far as it can be read."""
    from ekf_fusion_ros.replay.sensor_csv import read_sensor_csv
    vehicle = {name: str(value) for name, value in options.vehicle.items()}
    seen = False
    try:
        for sample in read_sensor_csv(options.recording, vehicle=vehicle):
            seen = True
            yield sample
    except (ValueError, EOFError, OSError, zlib.error) as error:
        if not seen:
            told = str(error).removeprefix(f'{options.recording.name}: ')
            raise RecordingError(f'{options.recording}: {told}') from error
        progress.notes.append(f'{options.recording.name} is damaged and replayed as far as it '
                              f'can be read ({error})')


def _batches(items: Iterator[Any], total: int | None, shown: bool) -> Iterator[list[Any]]:
    """Yield the items in batches, under a progress bar."""
    with tqdm(total=total, disable=None if shown else True, unit=' messages', leave=False) as bar:
        while batch := list(islice(items, BATCH)):
            yield batch
            bar.update(len(batch))
