"""Fixtures for tests over DDS."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

import pytest

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer


@pytest.fixture
def start_fuser(tmp_path: Path) -> Iterator[Callable[..., Fuser]]:
    """Start the node with parameters (`__` for a dot); it ends with the test."""
    pytest.importorskip('rclpy')
    from fuser_process import Fuser
    running: list[Fuser] = []

    def start(**parameters: Any) -> Fuser:
        parameters.setdefault('node__diagnostics_rate', 10.0)
        running.append(Fuser(tmp_path / f'fuser{len(running)}.log', **parameters))
        return running[-1]

    yield start
    for fuser in running:
        fuser.close()


@pytest.fixture
def peer() -> Iterator[Peer]:
    """A node in this process that talks to the fuser."""
    pytest.importorskip('rclpy')
    from fuser_process import Peer
    one = Peer()
    yield one
    one.close()
