"""Fixtures for tests over DDS."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from collections.abc import Mapping
from pathlib import Path
import sys
from typing import TYPE_CHECKING
from typing import Any

import pytest

if TYPE_CHECKING:
    from fuser_process import Fuser
    from fuser_process import Peer

# Test modules are not on the path under the import mode in use; the helper must be.
sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def start_fuser(tmp_path: Path) -> Iterator[Callable[..., Fuser]]:
    """Start the node with parameters and remappings by name; it ends with the test."""
    pytest.importorskip('rclpy')
    from fuser_process import Fuser
    running: list[Fuser] = []

    def start(
        parameters: Mapping[str, Any] | None = None, remappings: Mapping[str, str] | None = None,
    ) -> Fuser:
        log = tmp_path / f'fuser{len(running)}.log'
        chosen = {'node.diagnostics_rate': 10.0, **(parameters or {})}
        running.append(Fuser(log, chosen, remappings or {}))
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
