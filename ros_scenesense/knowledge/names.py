"""Names from outside as constants, and back. Text from messages never becomes program text."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.terms import Constant, check_name


class Names:
    """A constant for every name: the name itself where it is one, else `object_1`, `object_2`, ...

    Args:
        names: Whatever objects are called in messages; repeated names are one.
        taken: Names that mean something already, such as the constants of the domain.
    """

    def __init__(self, names: Iterable[str], taken: Collection[str] = ()) -> None:
        distinct = list(dict.fromkeys(names))
        plain = [name for name in distinct if name not in taken and _is_constant(name)]
        used = {*plain, *taken}
        self._constants = {name: Constant(name) for name in plain}
        number = 0
        for name in distinct:
            if name not in self._constants:
                number += 1
                while f"object_{number}" in used:
                    number += 1
                self._constants[name] = Constant(f"object_{number}")
        self._names = {constant: name for name, constant in self._constants.items()}

    @property
    def constants(self) -> tuple[Constant, ...]:
        """All constants."""
        return tuple(self._names)

    def constant(self, name: str) -> Constant:
        """The constant of a name.

        Raises:
            KeyError: If the name was not among those given.
        """
        return self._constants[name]

    def name(self, constant: Constant) -> str:
        """The name behind a constant.

        Raises:
            KeyError: If it is none of these constants.
        """
        return self._names[constant]


def _is_constant(name: str) -> bool:
    try:
        check_name(name)
    except LanguageError:
        return False
    return True
