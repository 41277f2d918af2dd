"""Messages of any type, invented from what msgspec knows of it: valid, and about nothing."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
from msgspec import inspect

from ros_scenesense.geometry import Pose
from ros_scenesense.messages.base import AnyMessage

_WORDS = ("red_can", "white_cube", "blue_bowl", "trial-0001", "trial-0002", "stable(red_can)", "x")
_LARGEST = 2**53 - 1
_LONGEST_LIST = 4


def invented(kind: type[AnyMessage], rng: np.random.Generator) -> str:
    """The text of a message of a type."""
    return msgspec.json.encode(_value(inspect.type_info(kind), rng)).decode()


def _value(kind: Any, rng: np.random.Generator) -> Any:
    match kind:
        case inspect.StructType(cls=cls) if cls is Pose:
            return Pose((0.1, 0.2, float(rng.normal())), (0.0, 0.0, 0.0, 1.0))
        case inspect.StructType():
            return kind.cls(**{field.name: _value(field.type, rng) for field in kind.fields})
        case inspect.FloatType():
            low = -10.0 if kind.ge is None else float(kind.ge)
            high = low + 20.0 if kind.le is None else float(kind.le)
            return float(rng.uniform(low, high)) or 0.5
        case inspect.IntType():
            high = (kind.le if kind.lt is None else kind.lt - 1) or _LARGEST
            return int(rng.integers(kind.ge or 0, min(high, 2 ** int(rng.integers(1, 54))) + 1))
        case inspect.StrType():
            return str(rng.choice(_WORDS))
        case inspect.BoolType():
            return bool(rng.integers(2))
        case inspect.NoneType():
            return None
        case inspect.LiteralType():
            return kind.values[int(rng.integers(len(kind.values)))]
        case inspect.EnumType():
            return list(kind.cls)[int(rng.integers(len(kind.cls)))]
        case inspect.UnionType():
            return _value(kind.types[int(rng.integers(len(kind.types)))], rng)
        case inspect.ListType():
            return [_value(kind.item_type, rng) for _ in range(rng.integers(_LONGEST_LIST))]
        case inspect.TupleType():
            return tuple(_value(item, rng) for item in kind.item_types)
        case inspect.DictType():
            return {
                _value(kind.key_type, rng): _value(kind.value_type, rng)
                for _ in range(rng.integers(_LONGEST_LIST))
            }
    raise TypeError(f"messages have no values of {kind}")
