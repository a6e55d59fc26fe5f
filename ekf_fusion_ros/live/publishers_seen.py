"""The publishers of an input topic, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PublisherSeen:
    """One publisher of a topic: 'reliable' or 'best-effort', and the type it announces."""

    reliability: str
    kind: str


def publishers_phrase(publishers: Sequence[PublisherSeen], wanted: str) -> str:
    """Return as '2 best-effort publishers'; names those of a type other than `wanted`."""
    fitting = Counter(one.reliability for one in publishers if one.kind == wanted)
    strange = Counter(one.kind for one in publishers if one.kind != wanted)
    words = [f'{count} {reliability}' for reliability, count in sorted(fitting.items())]
    count = sum(fitting.values())
    phrase = f'{" and ".join(words)} publisher{"s" if count > 1 else ""}' if count else ''
    others = ', '.join(
        f'{number} of type {kind} instead of {wanted}' for kind, number in strange.items())
    return ', '.join(part for part in (phrase, others) if part) or 'no publisher'
