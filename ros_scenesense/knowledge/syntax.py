"""From text to statements: full stops, lark's trees, and what is wrong with the syntax.

A text is cut at the full stops that end its statements, and each statement is parsed alone, so that
a mistake in one does not hide the mistakes in the others.
"""

from __future__ import annotations

import bisect
import difflib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from typing import Any

from lark import Lark
from lark.exceptions import UnexpectedCharacters, UnexpectedInput

from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.statements import Statement
from ros_scenesense.knowledge.terms import Place
from ros_scenesense.knowledge.trees import Node, Reader, absolute

_DECLARING = frozenset(
    ["sort", "const", "static", "inertial", "defined", "estimated", "action", "exogenous", "goal"]
)
# A statement of that many parts that cannot be read is none.
_MOST_RESUMED = 20
_PIECES = re.compile(r'"[^"\n]*"|%[^\n]*|\.\.|\.|"|\s+|[^\s".%]+')
_NAMES = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_SYMBOLS = frozenset("(){}<>=!+-*/,:_")


@dataclass(frozen=True)
class Syntax:
    """The statements of a text, and the names in those that could not be read.

    What such a statement would have declared is unknown; nothing is to be said about these names.
    """

    statements: tuple[Statement, ...]
    unread: frozenset[str]


def read(text: str, source: str, problems: Problems) -> Syntax:
    """Reads all statements of a text; what cannot be read is noted and left out."""
    statements: list[Statement] = []
    unread: set[str] = set()
    for chunk in _chunks(text, source, problems):
        for part, tree in _trees(chunk, "start", problems):
            if tree is None:
                unread.update(_NAMES.findall(part.text))
            else:
                statements.append(Reader(part.place, part.text, problems).read(tree))
    return Syntax(tuple(statements), frozenset(unread))


def read_alone(text: str, start: str, source: str, problems: Problems) -> Any:
    """Reads a text that is one part of a statement, such as a goal; a full stop may end it.

    Args:
        text: What was written.
        start: The rule of the grammar for it: `asked` for a goal.
        source: Where it comes from, for messages.
        problems: Where to note what is wrong.

    Returns:
        The part as `Reader` makes it, or None if it cannot be read.
    """
    chunks = list(_chunks(text, source, problems, ended=False))
    if len(chunks) > 1:
        problems.add(chunks[1].place, "found more text after the full stop, expected the end")
    if not chunks and not problems:
        problems.add(Place(source, 1, 1), "found nothing, expected a literal")
    if not chunks or problems:
        return None
    for part, tree in _trees(chunks[0], start, problems):
        return None if tree is None else Reader(part.place, part.text, problems).read(tree)
    return None


@dataclass(frozen=True)
class _Chunk:
    """The text of one statement, without its full stop, and the places where both are."""

    text: str
    place: Place
    end: Place

    def after(self, line: int, column: int) -> _Chunk:
        """The rest of the chunk from a line and column, counted from 1 within it."""
        lines = self.text.split("\n")
        rest = "\n".join([lines[line - 1][column - 1 :], *lines[line:]])
        return _Chunk(rest, absolute(self.place, line, column), self.end)


def _chunks(text: str, source: str, problems: Problems, ended: bool = True) -> Iterator[_Chunk]:
    starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def place(offset: int) -> Place:
        line = bisect.bisect_right(starts, offset)
        return Place(source, line, offset - starts[line - 1] + 1)

    begin: int | None = None
    sound = True
    end = 0
    for match in _PIECES.finditer(text):
        piece = match.group()
        if piece.isspace() or piece.startswith("%"):
            continue
        if piece == ".":
            if begin is None:
                problems.add(place(match.start()), "found '.' without a statement before it")
            elif sound:
                yield _Chunk(text[begin : match.start()], place(begin), place(match.start()))
            begin, sound = None, True
            continue
        if begin is None:
            begin = match.start()
        end = match.end()
        for offset, words in _foreign(piece):
            problems.add(place(match.start() + offset), words)
            sound = False
    if begin is not None:
        if ended:
            problems.add(place(begin), "this statement is not ended by a full stop, '.'")
        if sound:
            yield _Chunk(text[begin:end], place(begin), place(end))


def _foreign(piece: str) -> Iterator[tuple[int, str]]:
    """Characters that no statement has."""
    if piece == '"':
        yield 0, "the text in quotes is not closed on this line; expected '\"'"
    elif piece.startswith('"'):
        if any(ord(character) < 32 for character in piece):
            yield 0, "found a control character in the text in quotes; expected plain text"
    elif piece != "..":
        for offset, character in enumerate(piece):
            if not (character.isascii() and (character.isalnum() or character in _SYMBOLS)):
                kind = "" if character.isascii() else f" (U+{ord(character):04X})"
                words = f"found the character {character!r}{kind}; expected letters, digits and "
                yield offset, words + "underscores of ASCII, and signs of the language"
                return


def _trees(chunk: _Chunk, start: str, problems: Problems) -> Iterator[tuple[_Chunk, Node | None]]:
    """The tree of a chunk, or None and, if a line in it begins a new statement, what follows."""
    parser = _parser()
    rest: _Chunk | None = chunk
    resumed = 0
    while rest is not None and resumed <= _MOST_RESUMED:
        part, rest, resumed = rest, None, resumed + 1
        try:
            tree = parser.parse(part.text, start=start)
        except UnexpectedInput as error:
            place, words, line, column = _explained(error, part)
            before = part.text.split("\n")[line - 1][: column - 1] if line else ""
            if line > 1 and not before.strip():
                words += "; is a full stop missing before it?"
                rest = part.after(line, column)
            elif line and (begin := _next_declaration(part.text, line)):
                rest = part.after(begin, 1)
            problems.add(place, words)
            yield part, None
        else:
            yield part, tree


def _next_declaration(text: str, after: int) -> int | None:
    """The first line after one that begins with the keyword of a declaration."""
    for number, line in enumerate(text.split("\n")[after:], start=after + 1):
        if line.split(maxsplit=1)[:1] and line.split(maxsplit=1)[0] in _DECLARING:
            return number
    return None


def _explained(error: Any, chunk: _Chunk) -> tuple[Place, str, int, int]:
    """Place and words for an error of lark; line and column within the chunk, 0 at its end."""
    token = getattr(error, "token", None)
    if token is not None and token.type != "$END":
        found, expected = str(token), set(error.accepts or error.expected)
    elif isinstance(error, UnexpectedCharacters):
        found = chunk.text.split("\n")[error.line - 1][error.column - 1]
        expected = set(error.allowed or ())
    else:
        words = f"found the end of the statement, expected {_expected(error.accepts, '')}"
        return chunk.end, words, 0, 0
    words = f"found '{found[:60]}', expected {_expected(expected, found)}"
    return absolute(chunk.place, error.line, error.column), words, error.line, error.column


_WORDS = {
    "NAME": "a name",
    "VARIABLE": "a variable",
    "NUMBER": "a number",
    "STRING": "words in quotes",
    "COMPARISON": "a comparison",
    "$END": "'.'",
}


def _expected(terminals: set[str], found: str) -> str:
    names = set(terminals)
    texts = _terminal_texts()
    words = []
    if {"NORMALLY", "IMPOSSIBLE"} <= names:
        words.append("a statement")
        names -= {each for each in names if each in texts and texts[each].isalpha()}
        names -= {"NAME", "VARIABLE", "NUMBER", "MINUS", "UNDERSCORE", "LPAR"}
    if {"NAME", "VARIABLE", "NUMBER"} <= names:
        words.append("a term")
        names -= {"NAME", "VARIABLE", "NUMBER", "MINUS", "UNDERSCORE", "LPAR"}
    if {"PLUS", "MINUS", "STAR"} <= names:
        words.append("an operator")
        names -= {"PLUS", "MINUS", "STAR", "SLASH"}
    words += sorted(_WORDS[each] if each in _WORDS else f"'{texts[each]}'" for each in names)
    close = difflib.get_close_matches(found[:60], texts.values(), n=1, cutoff=0.8)
    hint = f"; did you mean '{close[0]}'?" if close and close[0] != found else ""
    return (" or ".join([", ".join(words[:-1]), words[-1]]) if words[1:] else words[0]) + hint


@lru_cache(maxsize=1)
def _parser() -> Lark:
    grammar = resources.files(__package__).joinpath("action_language.lark").read_text("ascii")
    return Lark(
        grammar,
        parser="lalr",
        start=["start", "asked"],
        maybe_placeholders=True,
    )


@lru_cache(maxsize=1)
def _terminal_texts() -> dict[str, str]:
    """The text of each terminal that has only one, such as `if`."""
    texts = {each.name: each.pattern.value for each in _parser().terminals}
    return {name: text.replace("\\", "") for name, text in texts.items()}
