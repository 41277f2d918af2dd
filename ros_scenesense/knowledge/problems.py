"""What is wrong with a text: all of it, each with its place, what was expected, a near name."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.terms import Place

MOST_PROBLEMS = 50
"""More are counted, not shown: nobody reads them."""

MOST_COUNTED = 1000
"""With so many, the text is something else."""

LONGEST_WORDS = 300
"""Longer words, such as whole nested terms, lose their middle."""


@dataclass(frozen=True, order=True)
class Problem:
    """One thing that is wrong, and where."""

    place: Place
    words: str

    def __str__(self) -> str:
        return f"{self.place}: {self.words}"


class Problems:
    """Collects what is wrong with a text, in order to report all of it at once."""

    def __init__(self) -> None:
        self._found: dict[Problem, None] = {}

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, place: Place | None, words: str) -> None:
        """Notes a problem; without a place if it is in something that was made, not written.

        Raises:
            LanguageError: If there are so many that it is not worth while to look for more.
        """
        if len(words) > LONGEST_WORDS:
            words = f"{words[: LONGEST_WORDS - 100]} … {words[-90:]}"
        self._found[Problem(place or Place("made by a program", 1, 1), words)] = None
        if len(self._found) >= MOST_COUNTED:
            self.check()

    def check(self) -> None:
        """Ends with what was found.

        Raises:
            LanguageError: If something was; one line per problem, in the order of the text.
        """
        if self._found:
            found = sorted(self._found, key=lambda each: (each.place.source, _order(each.place)))
            lines = [str(problem) for problem in found[:MOST_PROBLEMS]]
            if len(found) > MOST_PROBLEMS:
                lines.append(f"and {len(found) - MOST_PROBLEMS} more problems")
            raise LanguageError("\n".join(lines))


def nearest(name: str, known: Collection[str]) -> str:
    """`; did you mean ...?` with the known name that looks most like this one, or nothing."""
    # Very long names take difflib very long.
    close = difflib.get_close_matches(name[:60], known, n=1, cutoff=0.6)
    return f"; did you mean '{close[0]}'?" if close else ""


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names as a list for people, the first few of many."""
    names = [f"'{name}'" for name in names]
    more = [f"{len(names) - most} more"] if len(names) > most else []
    shown = [*names[:most], *more]
    return ", ".join(shown[:-1]) + " and " + shown[-1] if len(shown) > 1 else "".join(shown)


def _order(place: Place) -> tuple[int, int]:
    return place.line, place.column
