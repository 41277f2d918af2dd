"""Reads what people write as YAML or JSON, and says what is wrong with a file that errs."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar, get_args

import msgspec
import yaml

from ros_scenesense.errors import SimulationError

Content = TypeVar("Content")


def read_data(file: Path, kind: type[Content]) -> Content:
    """The content of a file as a value of this type.

    Raises:
        SimulationError: If the file cannot be read, is no YAML, or says something that the type
            does not allow; the text names the file, the field and what is allowed.
    """
    try:
        return msgspec.convert(yaml.safe_load(file.read_text(encoding="utf-8")), kind)
    except (OSError, UnicodeError) as error:
        raise SimulationError(f"{file} cannot be read: {error}") from error
    except (yaml.YAMLError, RecursionError) as error:
        words = " ".join(str(error).split())
        raise SimulationError(f"{file} is no YAML: {words}") from error
    except msgspec.ValidationError as error:
        raise SimulationError(f"{file}: {_explained(str(error), kind)}") from error


def _explained(words: str, of: Any) -> str:
    """A validation error that ends with what is allowed."""
    _, _, path = words.rpartition(" - at ")
    kind = _type_at(path.strip("`") if " - at " in words else "$", of)
    if "unknown field" in words or "missing required field" in words:
        fields = getattr(kind, "__struct_fields__", ())
        return f"{words}; known fields are {', '.join(fields)}"
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return f"{words}; allowed are {', '.join(kind)}"
    return words


def _type_at(path: str, kind: Any) -> Any:
    """The declared type of the value at a path such as `$[0].mesh.scale`."""
    for part in path.removeprefix("$").replace("[", ".[").split(".")[1:]:
        kind = _without_none(kind)
        if part.startswith("["):
            kind = next(iter(get_args(kind)), None)
        else:
            fields = msgspec.structs.fields(kind) if hasattr(kind, "__struct_fields__") else ()
            kind = next((field.type for field in fields if field.encode_name == part), None)
    return _without_none(kind)


def _without_none(kind: Any) -> Any:
    """The type itself of an annotated or optional one."""
    if hasattr(kind, "__metadata__"):
        kind = kind.__origin__
    members = [member for member in get_args(kind) if member is not type(None)]
    if type(None) in get_args(kind) and len(members) == 1:
        return _without_none(members[0])
    return kind
