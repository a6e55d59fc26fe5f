"""The one way a message is turned away."""

from __future__ import annotations


class Refused(Exception):
    """A message that cannot be used.

    `reason` is a short stable key to count by, such as 'not_finite'; `detail` is a sentence for
    the log that says what was wrong with which field.
    """

    def __init__(self, reason: str, detail: str) -> None:
        """Keep the reason and the sentence."""
        super().__init__(f'{reason}: {detail}')
        self.reason = reason
        self.detail = detail
