"""Ranges and choices of one declaration."""

from __future__ import annotations

from dataclasses import dataclass
from dataclasses import field
import math
from typing import Any

import pytest

from ekf_fusion_ros.params.spec import ParamSpec
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.spec import param
from ekf_fusion_ros.params.spec import validate


@dataclass(frozen=True)
class Inner:
    rate: float = param(2.0, 'Rate.', unit='Hz', min=1, max=3)


@dataclass(frozen=True)
class Outer:
    name: str = param('a', 'Name.', choices=('a', 'b'))
    inner: Inner = field(default_factory=Inner)


def test_leaves_are_dotted_in_the_order_of_declaration() -> None:
    assert [(name, value) for name, value, _ in leaves(Outer())] == [
        ('name', 'a'), ('inner.rate', 2.0)]
    assert [name for name, _, _ in leaves(Outer(), 'top.')] == ['top.name', 'top.inner.rate']


@pytest.mark.parametrize('value', [1.0, 2.0, 3.0, (1.0, 3.0), True])
def test_bounds_are_part_of_the_range(value: Any) -> None:
    ParamSpec('Rate.', 'Hz', min=1, max=3).check('rate', value)


@pytest.mark.parametrize(
    ('value', 'words'),
    [
        (math.nextafter(1.0, 0.0), 'at least 1 Hz'),
        (math.nextafter(3.0, 4.0), 'at most 3 Hz'),
        ((2.0, 4.0), 'at most 3 Hz'),
        (math.nan, 'finite'),
        ((2.0, -math.inf), 'finite'),
    ],
)
def test_outside_the_range_is_refused_in_words(value: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ParamSpec('Rate.', 'Hz', min=1, max=3).check('rate', value)


def test_validate_names_the_parameter_in_the_tree() -> None:
    validate(Outer())
    with pytest.raises(ValueError, match=r'^inner\.rate = 9'):
        validate(Outer(inner=Inner(rate=9.0)))
    with pytest.raises(ValueError, match=r"^name = 'c': choose one of a, b"):
        validate(Outer(name='c'))
