"""Whether a transform may be published: nobody else may do so for the same child."""

from __future__ import annotations

from ekf_fusion_ros.estimator import HealthLevel
from ekf_fusion_ros.live.report import Report

FOREIGN_S = 5.0
"""Silence of the other publisher in s after which the transform is free again."""

OWN_KEPT = 1000
Key = tuple[int, float, float, float]


class TransformWatch:
    """Listens for others that publish a transform to the same child; times in s, steady.

    What the node publishes itself comes back on the topic and is known by stamp and translation.
    """

    def __init__(self, parent: str, child: str) -> None:
        self._parent = parent
        self._child = child
        self._own: dict[Key, None] = {}
        self._foreign: tuple[float, str] | None = None
        self._told = False
        self.count = 0
        self.trouble = ''

    def note_own(self, key: Key) -> None:
        """Note what is published now: stamp in ns and translation in m."""
        self._own[key] = None
        if len(self._own) > OWN_KEPT:
            del self._own[next(iter(self._own))]
        self.count += 1

    def hear(self, parent: str, key: Key, now: float) -> None:
        """Take a transform to the child from the topic."""
        if key not in self._own:
            self._foreign = now, parent.lstrip('/')

    def free(self, now: float) -> bool:
        """Return whether nobody else has published the transform lately."""
        return self._foreign is None or now - self._foreign[0] > FOREIGN_S

    def news(self, now: float) -> str:
        """Return a line for the log where another publisher has come or gone, else ''."""
        taken = not self.free(now)
        if taken == self._told:
            return ''
        self._told = taken
        return self.sentence(now)

    def sentence(self, now: float) -> str:
        """Say whether the transform is published, and why not."""
        name = f'{self._parent} -> {self._child}'
        if self._foreign is not None and not self.free(now):
            return (f'{name} is not published: another node publishes {self._foreign[1]} -> '
                    f'{self._child}; stop that, or set node.publish_tf to false')
        if self.trouble:
            return f'{name} is not published: {self.trouble}'
        return f'publishing {name}' if self.count else f'{name} waits for the first estimate'

    def report(self, now: float) -> Report:
        """Return the line for diagnostics."""
        fine = self.free(now) and not self.trouble
        level = HealthLevel.OK if fine else HealthLevel.WARN
        return Report('transforms', level, self.sentence(now), {'published': str(self.count)})
