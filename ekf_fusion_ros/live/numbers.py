"""Values as text, split so that a plot can draw each."""

from __future__ import annotations

from collections.abc import Mapping


def single_numbers(values: Mapping[str, str]) -> dict[str, str]:
    """Return the values that are numbers, those of a vector one by one as `name.0`, `name.1`."""
    singles: dict[str, str] = {}
    for name, text in values.items():
        words = text.split()
        if not words or not all(_is_number(word) for word in words):
            continue
        keys = [name] if len(words) == 1 else [f'{name}.{k}' for k in range(len(words))]
        singles.update(zip(keys, words, strict=True))
    return singles


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
