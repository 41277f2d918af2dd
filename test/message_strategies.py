"""Hypothesis strategies for messages, made from what msgspec knows of their types."""

from functools import cache

import msgspec
from hypothesis import strategies as st
from msgspec import inspect

from ros_scenesense.geometry import Pose

# JSON cannot carry lone surrogates.
TEXT = st.characters(exclude_categories=["Cs"])
FINITE = st.floats(allow_nan=False, allow_infinity=False)

# Any value that JSON text can hold, also the numbers that only Python writes.
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.text(max_size=8), inner, max_size=4)
    ),
    max_leaves=8,
)


@cache
def messages(kind, floats=None):
    """Instances of a message type; `floats` says what stands in float fields instead."""
    return _of(inspect.type_info(kind), floats)


def _of(kind, floats):
    match kind:
        case inspect.StructType(cls=cls) if cls is Pose:
            number = FINITE if floats is None else floats
            return st.builds(Pose, st.tuples(number, number, number), unit_quaternions())
        case inspect.StructType():
            return st.builds(
                kind.cls, **{field.name: _of(field.type, floats) for field in kind.fields}
            )
        case inspect.FloatType():
            finite = st.floats(kind.ge, kind.le, allow_nan=False, allow_infinity=False)
            return finite if floats is None else floats
        case inspect.IntType():
            top = kind.le if kind.lt is None else kind.lt - 1
            return st.integers(kind.ge, top)
        case inspect.StrType():
            return st.text(TEXT, min_size=kind.min_length or 0, max_size=12)
        case inspect.BoolType():
            return st.booleans()
        case inspect.NoneType():
            return st.none()
        case inspect.LiteralType():
            return st.sampled_from(kind.values)
        case inspect.EnumType():
            return st.sampled_from(list(kind.cls))
        case inspect.UnionType():
            return st.one_of(*(_of(member, floats) for member in kind.types))
        case inspect.ListType():
            return st.lists(_of(kind.item_type, floats), max_size=3)
        case inspect.TupleType():
            return st.tuples(*(_of(item, floats) for item in kind.item_types))
        case inspect.DictType():
            keys, values = _of(kind.key_type, floats), _of(kind.value_type, floats)
            return st.dictionaries(keys, values, max_size=3)
    raise NotImplementedError(kind)


@st.composite
def unit_quaternions(draw):
    """Unit quaternions (x, y, z, w), half turns and whole turns among them."""
    parts = draw(st.tuples(*[st.one_of(st.integers(-1, 1), st.floats(-1, 1))] * 4))
    length = sum(part * part for part in parts) ** 0.5
    if length < 1e-3:
        return (0.0, 0.0, 0.0, 1.0)
    return tuple(part / length for part in parts)


@st.composite
def mutated(draw, kind):
    """A message as plain values, with one of them replaced, removed or added anywhere inside."""
    document = msgspec.to_builtins(draw(messages(kind)))
    places = list(_containers(document))
    container = draw(st.sampled_from(places))
    keys = list(container) if isinstance(container, dict) else list(range(len(container)))
    if not keys or draw(st.integers(0, 3)) == 0:
        extra = draw(JSON)
        if isinstance(container, dict):
            container[draw(st.text(max_size=8))] = extra
        else:
            container.append(extra)
        return document
    key = draw(st.sampled_from(keys))
    if draw(st.booleans()):
        del container[key]
    else:
        container[key] = draw(JSON)
    return document


def _containers(value):
    if isinstance(value, dict | list):
        yield value
        for member in value.values() if isinstance(value, dict) else value:
            yield from _containers(member)
