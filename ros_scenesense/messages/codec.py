"""Messages to JSON and back; refuses everything that is not exactly a message.

Refused with a `MessageError` that names the JSON path: NaN and infinities, unknown or missing
fields, wrong types or values, payloads over the topic's limit, and other schema versions.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from functools import cache
from typing import Any, TypeVar

import msgspec

from ros_scenesense.errors import MessageError
from ros_scenesense.messages.base import AnyMessage, HumanMessage
from ros_scenesense.messages.topics import TOPICS

AnyMessageT = TypeVar("AnyMessageT", bound=AnyMessage)


class _Envelope(msgspec.Struct):
    schema: str | None = None


def schema_of(message: type[AnyMessage]) -> str:
    """Name and version of a message type, e.g. `relations/1`."""
    return str(message.__struct_config__.tag)


def encode(message: AnyMessage) -> bytes:
    """The message as JSON.

    Raises:
        MessageError: If it is not a valid message, e.g. holds a NaN or is over the size limit.
    """
    kind = type(message)
    try:
        payload = msgspec.json.encode(message)
    except (TypeError, ValueError, RecursionError, msgspec.MsgspecError) as error:
        where = "$" if isinstance(error, RecursionError) else _unencodable(message)
        raise MessageError(f"{schema_of(kind)}: {error} - at `{where}`") from error
    # msgspec writes a number that JSON cannot hold as null, which an optional field would take.
    # Then what is read back differs; only then the slow search for the place is worth while.
    try:
        if decode(payload, kind) == message:
            return payload
    except MessageError:
        _check_numbers(message)
        raise
    _check_numbers(message)
    return payload


def decode(payload: bytes | str, kind: type[AnyMessageT]) -> AnyMessageT:
    """The message that a payload holds.

    Args:
        payload: JSON text as received, untrusted.
        kind: The message type of the topic it came on.

    Raises:
        MessageError: If the payload is not a message of this type and version.
    """
    expected = schema_of(kind)
    limit = TOPICS[kind].limit
    try:
        raw = payload.encode() if isinstance(payload, str) else payload
        if len(raw) > limit:
            raise MessageError(
                f"{expected}: payload of {len(raw)} bytes is over the limit of {limit} - at `$`"
            )
        envelope: _Envelope = _decoder(_Envelope).decode(raw)
        if envelope.schema is None and not issubclass(kind, HumanMessage):
            raise MessageError(f"{expected}: object missing required field `schema` - at `$`")
        if envelope.schema is not None and envelope.schema != expected:
            raise MessageError(_wrong_schema(envelope.schema, expected))
        message: AnyMessageT = _decoder(kind).decode(raw)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise MessageError(f"{expected}: {_located(str(error))}") from error
    return message


@cache
def _decoder(kind: Any) -> msgspec.json.Decoder[Any]:
    return msgspec.json.Decoder(kind)


def _wrong_schema(found: str, expected: str) -> str:
    name, _, version = expected.partition("/")
    found_name, _, found_version = found[:80].partition("/")
    if found_name == name and found_version.isdecimal() and int(found_version) != int(version):
        age = "newer" if int(found_version) > int(version) else "older"
        return (
            f"{expected}: version {found_version} is {age} than the supported {version}, run the "
            "same release of ros_scenesense on all hosts - at `$.schema`"
        )
    return f"{expected}: schema is {found[:80]!r}, expected '{expected}' - at `$.schema`"


def _located(words: str) -> str:
    """The decoder's words in one short line that ends with a path, `$` where it names none."""
    if len(words) > 300:  # an unknown field's name may be as long as the payload
        words = f"{words[:150]}...{words[-147:]}"
    words = "".join(character if character.isprintable() else "?" for character in words)
    return words if re.search(r" - at .*`\$[^`]*`$", words) else f"{words} - at `$`"


def _check_numbers(message: AnyMessage) -> None:
    for path, value in _leaves(message, "$"):
        if isinstance(value, float) and not math.isfinite(value):
            kind = schema_of(type(message))
            raise MessageError(f"{kind}: {value} is no number of JSON - at `{path}`")


def _unencodable(message: AnyMessage) -> str:
    for path, value in _leaves(message, "$"):
        try:
            msgspec.json.encode(value)
        except (TypeError, ValueError, msgspec.MsgspecError):
            return path
    return "$"


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """All values inside a message that hold no other values, with their JSON paths."""
    if isinstance(value, msgspec.Struct):
        for name in value.__struct_fields__:
            yield from _leaves(getattr(value, name), f"{path}.{name}")
    elif isinstance(value, dict):
        for key, member in value.items():
            yield from _leaves(member, f"{path}[{key!r}]")
    elif isinstance(value, list | tuple):
        for index, member in enumerate(value):
            yield from _leaves(member, f"{path}[{index}]")
    else:
        yield path, value
