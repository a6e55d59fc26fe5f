"""Loads or compiles the kernels beside the node, which meanwhile answers and reports."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread

from ekf_fusion_ros.kernels.compile import COMPILED
from ekf_fusion_ros.params.tree import Params
from ekf_fusion_ros.warm_up import warm_up


class Preparation:
    """Warms up in a thread of its own; ends early once `stopped` says so."""

    def __init__(self, params: Params, stopped: Callable[[], bool]) -> None:
        self._params = params
        self._stopped = stopped
        self.error: Exception | None = None
        self._thread = Thread(target=self._run, name='preparation')
        if COMPILED:
            self._thread.start()

    @property
    def done(self) -> bool:
        """True once the kernels are ready, or could not be made so."""
        return not self._thread.is_alive()

    def join(self) -> None:
        """Wait for the end."""
        if COMPILED:
            self._thread.join()

    def _run(self) -> None:
        try:
            warm_up(self._params, self._stopped)
        except Exception as error:  # the filter may still do with what really comes
            self.error = error
