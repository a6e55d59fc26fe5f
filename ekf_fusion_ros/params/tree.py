"""The whole parameter tree and changes to it by dotted name."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence
import dataclasses
from dataclasses import dataclass
from dataclasses import field
import difflib
from typing import Any
from typing import get_args
from typing import get_origin
from typing import get_type_hints

from ekf_fusion_ros.params.ekf2 import Ekf2Params
from ekf_fusion_ros.params.health import HealthParams
from ekf_fusion_ros.params.lpe import LpeParams
from ekf_fusion_ros.params.messages import MessageParams
from ekf_fusion_ros.params.node import NodeParams
from ekf_fusion_ros.params.px4 import counterparts
from ekf_fusion_ros.params.receivers import ReceiversParams
from ekf_fusion_ros.params.session import SessionParams
from ekf_fusion_ros.params.spec import leaves
from ekf_fusion_ros.params.spec import param
from ekf_fusion_ros.params.spec import validate
from ekf_fusion_ros.params.two_topic import TwoTopicParams

ESTIMATORS = ('ekf2', 'lpe')
TRUE_WORDS = ('true', 'yes', 'on', '1')
FALSE_WORDS = ('false', 'no', 'off', '0')


@dataclass(frozen=True, slots=True, kw_only=True)
class Params:
    """Everything the node, the replay and the library can be told."""

    estimator: str = param(
        'ekf2', 'Which estimator runs: the 24 states of EKF2, or the 10 of PX4\'s local position '
        'estimator, which takes attitude as given.', choices=ESTIMATORS)
    ekf2: Ekf2Params = field(default_factory=Ekf2Params)
    lpe: LpeParams = field(default_factory=LpeParams)
    messages: MessageParams = field(default_factory=MessageParams)
    session: SessionParams = field(default_factory=SessionParams)
    receivers: ReceiversParams = field(default_factory=ReceiversParams)
    health: HealthParams = field(default_factory=HealthParams)
    two_topic: TwoTopicParams = field(default_factory=TwoTopicParams)
    node: NodeParams = field(default_factory=NodeParams)


def with_overrides(params: Params, overrides: Mapping[str, Any]) -> Params:
    """Return the tree with parameters replaced by dotted name.

    Values may be of the parameter's type or text that reads as one ('0.3', 'true', '1, 2, 3').
    Raises ValueError, naming the parameter, for unknown names (with the nearest known ones),
    wrong types and values out of range.
    """
    known = {name for name, _, _ in leaves(params)}
    for name in overrides:
        if name not in known:
            raise ValueError(unknown_name(name, known))
    changed: Params = _replaced(params, overrides, '')
    validate(changed)
    return changed


def unknown_name(name: str, known: set[str]) -> str:
    """Say that a parameter does not exist and which it may have meant."""
    if any(other.startswith(f'{name}.') for other in known):
        return f'{name} is a group of parameters: name one of them, as in {name}.<parameter>'
    ours = counterparts(name)
    if ours:
        return (f'unknown parameter {name}: that is the name of PX4, which a .params file may '
                f'hold; here it is {", ".join(ours)}')
    last = name.rsplit('.', 1)[-1]
    near = [other for other in sorted(known) if other.rsplit('.', 1)[-1] == last]
    near += difflib.get_close_matches(name, sorted(known), n=3)
    hint = ', '.join(dict.fromkeys(near[:4]))
    return f'unknown parameter {name}' + (f'; did you mean {hint}?' if hint else '')


def _replaced(group: Any, overrides: Mapping[str, Any], prefix: str) -> Any:
    changes: dict[str, Any] = {}
    hints = get_type_hints(type(group))
    for item in dataclasses.fields(group):
        name = prefix + item.name
        value = getattr(group, item.name)
        if dataclasses.is_dataclass(value):
            if any(key.startswith(f'{name}.') for key in overrides):
                changes[item.name] = _replaced(value, overrides, f'{name}.')
        elif name in overrides:
            changes[item.name] = converted(name, overrides[name], hints[item.name])
    return dataclasses.replace(group, **changes) if changes else group


def converted(name: str, value: Any, kind: Any) -> Any:
    """Return a value as the type of a parameter, or raise ValueError naming both."""
    try:
        if get_origin(kind) is tuple:
            return _tuple_of(value, get_args(kind))
        return _SCALARS[kind](value)
    except (TypeError, ValueError):
        raise ValueError(f'{name} = {value!r}: expected {_type_words(kind)}') from None


def _tuple_of(value: Any, kinds: tuple[Any, ...]) -> tuple[Any, ...]:
    if isinstance(value, str):
        text = value.strip('[]() ')
        value = [word.strip(' \'"') for word in text.split(',')] if text else []
    if not isinstance(value, Sequence):
        value = list(value)
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    if len(value) != len(kinds):
        raise ValueError
    return tuple(_SCALARS[kind](element) for kind, element in zip(kinds, value, strict=True))


def _bool(value: Any) -> bool:
    if isinstance(value, bool):
        return value
    if isinstance(value, str) and value.lower() in TRUE_WORDS + FALSE_WORDS:
        return value.lower() in TRUE_WORDS
    raise TypeError


def _int(value: Any) -> int:
    if isinstance(value, bool) or (isinstance(value, float) and not value.is_integer()):
        raise TypeError
    return int(value)


def _float(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _str(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


_SCALARS: dict[Any, Any] = {bool: _bool, int: _int, float: _float, str: _str}
_WORDS = {bool: 'true or false', int: 'an integer', float: 'a number', str: 'text'}


def _type_words(kind: Any) -> str:
    if get_origin(kind) is not tuple:
        return _WORDS[kind]
    kinds = get_args(kind)
    if kinds[-1] is Ellipsis:
        return f'a list, each entry {_WORDS[kinds[0]]}'
    return f'a list of {len(kinds)}, each {_WORDS[kinds[0]]}'
