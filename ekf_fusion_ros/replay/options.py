"""What a replay is asked to do."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field
from pathlib import Path

from ekf_fusion_ros.params import Params


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """One replay; see the command line for the meaning of each.

    `topics` maps roles to topic names ('' keeps a role out); `withhold` maps roles to windows
    in seconds; `vehicle` holds the flags of an ECL params.txt for a sensor CSV.
    """

    recording: Path
    output: Path
    params: Params = field(default_factory=Params)
    topics: Mapping[str, str] = field(default_factory=dict)
    start: float = 0.0
    end: float | None = None
    withhold: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)
    log_states: bool = False
    write_bag: bool = True
    progress: bool = False
    vehicle: Mapping[str, object] = field(default_factory=dict)
