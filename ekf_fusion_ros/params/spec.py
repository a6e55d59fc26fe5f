"""One declaration per parameter: default, unit, range, words and foreign names."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence
import dataclasses
from dataclasses import dataclass
import math
from typing import Any


@dataclass(frozen=True, slots=True)
class ParamSpec:
    """What is known of one parameter beside its value.

    `px4` is the PX4 parameter name, `ecl` the name in the ECL library's parameter struct;
    both are empty where no single foreign name has the same meaning. `live` parameters may be
    changed while the filter runs.
    """

    description: str
    unit: str = ''
    min: float | None = None
    max: float | None = None
    choices: tuple[str, ...] = ()
    px4: str = ''
    ecl: str = ''
    live: bool = False

    def check(self, name: str, value: Any) -> None:
        """Raise ValueError, naming the parameter, when a value is outside its domain."""
        if self.choices and value not in self.choices:
            raise ValueError(f'{name} = {value!r}: choose one of {", ".join(self.choices)}')
        if isinstance(value, (bool, str)):
            return
        for element in value if isinstance(value, tuple) else (value,):
            if not math.isfinite(element):
                raise ValueError(f'{name} = {value}: must be finite')
            if self.min is not None and element < self.min:
                raise ValueError(f'{name} = {value}: must be at least {self.min:g} {self.unit}')
            if self.max is not None and element > self.max:
                raise ValueError(f'{name} = {value}: must be at most {self.max:g} {self.unit}')


def param(
    default: Any,
    description: str,
    *,
    unit: str = '',
    min: float | None = None,
    max: float | None = None,
    choices: Sequence[str] = (),
    px4: str = '',
    ecl: str = '',
    live: bool = False,
) -> Any:
    """Declare a dataclass field that is a parameter."""
    spec = ParamSpec(description, unit, min, max, tuple(choices), px4, ecl, live)
    return dataclasses.field(default=default, metadata={'spec': spec})


def leaves(params: Any, prefix: str = '') -> Iterator[tuple[str, Any, ParamSpec]]:
    """Yield (dotted name, value, spec) of every parameter in a tree of dataclasses."""
    for field in dataclasses.fields(params):
        value = getattr(params, field.name)
        if dataclasses.is_dataclass(value):
            yield from leaves(value, f'{prefix}{field.name}.')
        else:
            yield prefix + field.name, value, field.metadata['spec']


def validate(params: Any) -> None:
    """Raise ValueError on the first parameter outside its domain."""
    for name, value, spec in leaves(params):
        spec.check(name, value)
