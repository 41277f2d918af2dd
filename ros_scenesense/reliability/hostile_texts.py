"""What no node should take for a message, and messages that are well formed and false."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import msgspec
import numpy as np

from ros_scenesense.errors import MessageError, ParameterError
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.topics import TOPICS

_HOSTILE_LEAVES: tuple[Any, ...] = (
    None,
    True,
    -1,
    2**63,
    10**40,
    1e308,
    float("nan"),
    float("-inf"),
    "",
    "x" * 5000,
    "\x00",
    "a :- b. #include <x>",
    [],
    {},
    [[[[[[]]]]]],
    {"schema": "scene/1"},
)
_FALSE_WORDS = ("nobody", "nowhere-0007", "a", "ß", "#const", "stable", "learned_1", "trial-0001")
_FALSE_NUMBERS = (0, 1, 7, 2**31 - 1, 2**53 - 1)
_LONGEST_LIST = 40
_ATTEMPTS = 200


def is_message(text: str, kind: type[AnyMessage]) -> bool:
    """Whether a text is a message of a type."""
    try:
        decode(text, kind)
    except MessageError:
        return False
    return True


def made_up_texts(count: int, seed: int) -> list[str]:
    """Texts that hypothesis thinks of: JSON values of all kinds, and any characters.

    Raises:
        ParameterError: If hypothesis is not installed.
    """
    try:
        import hypothesis
        from hypothesis import strategies as st
    except ImportError as error:
        raise ParameterError(
            "hypothesis is not installed, which makes hostile messages up: "
            "pip install 'ros_scenesense[test]'"
        ) from error
    values = st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
        lambda inner: (
            st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=9), inner, max_size=5)
        ),
        max_leaves=12,
    )
    found: list[str] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(values.map(json.dumps) | st.text(max_size=200))
    def collect(text: str) -> None:
        # What a ROS string cannot carry is no message of a hostile publisher either.
        found.append(text.encode(errors="replace").decode().replace("\x00", "\\u0000"))

    collect()
    return found


def invalid_texts(
    kind: type[AnyMessage], real: Sequence[str], made_up: Sequence[str], count: int, seed: int
) -> Iterator[str]:
    """Texts that are no message of a type: some made up, the others real ones with a fault.

    Args:
        kind: The type.
        real: Texts of messages, at least one.
        made_up: Other texts; up to one half are of these.
        count: How many.
        seed: Of everything random.
    """
    rng = np.random.default_rng([seed, *TOPICS[kind].name.encode()])
    others = [text for text in made_up if not is_message(text, kind)][: count // 2]
    yield from others
    for _ in range(count - len(others)):
        yield _first(lambda: _broken(_pick(real, rng), kind, rng), kind, valid=False)


def false_texts(
    kind: type[AnyMessage], real: Sequence[str], count: int, seed: int
) -> Iterator[str]:
    """Messages of a type that are well formed and say what is not so.

    Args:
        kind: The type.
        real: Texts of messages, at least one.
        count: How many.
        seed: Of everything random.
    """
    rng = np.random.default_rng([seed, *TOPICS[kind].name.encode(), 1])
    for _ in range(count):
        yield _first(lambda: _falsified(_pick(real, rng), rng), kind, valid=True)


def _first(make: Callable[[], str], kind: type[AnyMessage], *, valid: bool) -> str:
    for _ in range(_ATTEMPTS):
        text = make()
        if is_message(text, kind) == valid:
            return text
    raise ParameterError(f"no {'valid' if valid else 'invalid'} message of {TOPICS[kind].name}")


def _broken(text: str, kind: type[AnyMessage], rng: np.random.Generator) -> str:
    """A real message with one fault."""
    value = json.loads(text)
    match rng.integers(7):
        case 0:
            return text[: rng.integers(len(text))]
        case 1:
            raw = bytearray(text.encode())
            for _ in range(rng.integers(1, 6)):
                raw[rng.integers(len(raw))] = rng.integers(1, 256)
            return raw.decode(errors="replace")
        case 2:
            value["schema"] = _pick(["", "scene/1", f"{TOPICS[kind].name}/99", "bogus"], rng)
        case 3:
            value[_pick(["extra", "__class__", "schema2"], rng)] = _pick(_HOSTILE_LEAVES, rng)
        case 4:
            value.pop(_pick(list(value), rng), None)
        case 5 if rng.random() < 0.1:
            value["padding"] = "x" * TOPICS[kind].limit
        case _:
            _replace_somewhere(value, rng, lambda _old: _pick(_HOSTILE_LEAVES, rng))
    return json.dumps(value)


def _falsified(text: str, rng: np.random.Generator) -> str:
    """A real message in which some values are others, and lists longer, shorter or mixed."""
    value = msgspec.json.decode(text)
    for _ in range(rng.integers(1, 6)):
        _replace_somewhere(value, rng, lambda old: _false_leaf(old, rng))
    for values in _lists(value):
        match rng.integers(4):
            case 0:
                rng.shuffle(values)
            case 1 if values and len(values) < _LONGEST_LIST:
                values.extend(values[: rng.integers(1, len(values) + 1)])
            case 2 if values:
                del values[rng.integers(len(values))]
    return json.dumps(value)


def _false_leaf(old: Any, rng: np.random.Generator) -> Any:
    if isinstance(old, bool):
        return not old
    if isinstance(old, int):
        return _pick(_FALSE_NUMBERS, rng)
    if isinstance(old, float):
        return _pick((0.0, 1.0, -old, old / 2, 1e9), rng)
    if isinstance(old, str) and rng.random() < 0.5:
        return old[::-1] or "x"
    return _pick(_FALSE_WORDS, rng) if isinstance(old, str) else old


def _replace_somewhere(
    value: Any, rng: np.random.Generator, replacement: Callable[[Any], Any]
) -> None:
    """Replaces one leaf of a JSON value, wherever it stands; the schema stays."""
    places = [place for place in _leaves(value) if place[1] != "schema"]
    if places:
        holder, key = places[rng.integers(len(places))]
        holder[key] = replacement(holder[key])


def _leaves(value: Any) -> Iterator[tuple[Any, Any]]:
    keys = value if isinstance(value, dict) else range(len(value))
    for key in keys:
        if isinstance(value[key], dict | list) and value[key]:
            yield from _leaves(value[key])
        else:
            yield value, key


def _lists(value: Any) -> Iterator[list[Any]]:
    if isinstance(value, list):
        yield value
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from _lists(inner)


def _pick(values: Sequence[Any], rng: np.random.Generator) -> Any:
    return values[int(rng.integers(len(values)))]
