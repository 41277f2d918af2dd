"""Parameters declared once, as the fields of a frozen dataclass.

The same declaration gives the ROS parameter descriptors, the check of values from the command
line, and the documentation (`scenesense params`).
"""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from ros_scenesense.errors import ParameterError

Value = bool | int | float | str
Configuration = TypeVar("Configuration")


@dataclass(frozen=True)
class Parameter:
    """What is known about one parameter: type, default, meaning and allowed values.

    Attributes:
        name: Field name; the ROS parameter has the same.
        type: bool, int, float or str.
        default: Value when nobody sets it.
        description: One sentence with the unit.
        minimum: Smallest allowed number, or None.
        maximum: Largest allowed number, or None.
        choices: Allowed strings; empty when any is allowed.
    """

    name: str
    type: type[Value]
    default: Value
    description: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()

    @property
    def allowed(self) -> str:
        """The allowed values in words."""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        kind = {bool: "true or false", int: "an integer", float: "a number", str: "a string"}
        words = kind[self.type]
        if self.minimum is not None and self.maximum is not None:
            return f"{words} from {self.minimum:.12g} to {self.maximum:.12g}"
        if self.minimum is not None:
            return f"{words} of at least {self.minimum:.12g}"
        if self.maximum is not None:
            return f"{words} of at most {self.maximum:.12g}"
        return words

    def check(self, value: object) -> Value:
        """The value converted to the parameter's type.

        Integers are taken as floats (a params YAML says `5` for `5.0`), numbers and booleans
        also as text, as the command line gives them.

        Raises:
            ParameterError: If the value has another type or lies outside the allowed range.
        """
        converted = _convert(value, self.type)
        in_range = converted is not None
        if isinstance(converted, int | float) and self.type is not bool:
            in_range = (self.minimum is None or converted >= self.minimum) and (
                self.maximum is None or converted <= self.maximum
            )
        if self.choices and converted not in self.choices:
            in_range = False
        if converted is None or not in_range:
            raise ParameterError(
                f"parameter '{self.name}' is {_shown(value)}, must be {self.allowed}"
            )
        return converted


def parameter(
    default: Value,
    description: str,
    *,
    minimum: float | None = None,
    maximum: float | None = None,
    choices: tuple[str, ...] = (),
) -> Any:
    """A dataclass field that is a parameter; see `Parameter` for the arguments."""
    metadata = {
        "description": description,
        "minimum": minimum,
        "maximum": maximum,
        "choices": choices,
    }
    return dataclasses.field(default=default, metadata=metadata)


def parameters_of(configuration: type[Any]) -> list[Parameter]:
    """The parameters that a configuration dataclass declares, in order."""
    types = typing.get_type_hints(configuration)
    found = []
    for field in dataclasses.fields(configuration):
        if field.metadata:
            default = typing.cast(Value, field.default)
            found.append(Parameter(field.name, types[field.name], default, **field.metadata))
    return found


def build(configuration: type[Configuration], values: Mapping[str, object]) -> Configuration:
    """A configuration from the given values, defaults elsewhere.

    Raises:
        ParameterError: If a value is wrong or a name is not a parameter.
    """
    known = {parameter.name: parameter for parameter in parameters_of(configuration)}
    for name in values:
        if name not in known:
            raise ParameterError(
                f"parameter '{name}' is unknown, known are: {', '.join(sorted(known))}"
            )
    return configuration(**{name: known[name].check(value) for name, value in values.items()})


def _shown(value: object) -> str:
    try:
        text = repr(value)
    except Exception:  # e.g. an integer of more digits than Python prints
        return f"some {type(value).__name__}"
    return text if len(text) <= 80 else text[:77] + "..."


def _convert(value: object, target: type[Value]) -> Value | None:
    if target is bool:
        return _boolean(value)
    if isinstance(value, bool):
        return None
    if target is str:
        return value if isinstance(value, str) else None
    if not isinstance(value, int | float | str):
        return None
    try:
        number = int(value) if target is int else float(value)
        finite = math.isfinite(number)
    except (ValueError, OverflowError):
        return None
    if not finite or (isinstance(value, float) and number != value):
        return None
    return number


def _boolean(value: object) -> bool | None:
    if isinstance(value, str):
        return {"true": True, "false": False}.get(value.lower())
    return value if isinstance(value, bool) else None
