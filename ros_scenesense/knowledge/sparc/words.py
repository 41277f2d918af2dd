"""Words: what a program is cut into, statement by statement."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.terms import Place

SECTIONS = ("sorts", "predicates", "rules", "display")
"""The sections of a program, in their order; directives come before them."""

_WORDS = re.compile(
    r"""[ \t\r\f]*(?:
    (?P<BREAK>\n)
    |(?P<SIGN>:-|:\+|:~|\.\.|!=|<=|>=|==|[-+*/(){}\[\],;:|@=<>.])
    |(?P<NAME>[a-z][A-Za-z0-9_]*)
    |(?P<VARIABLE>[A-Z][A-Za-z0-9_]*)
    |(?P<NUMBER>[0-9]+)
    |(?P<FUNCTION>\#(?:count|sum|min|max)(?=[ \t\r\n]*\{))
    |(?P<OPTIMIZE>\#(?:minimize|maximize)(?=[ \t\r\n]*\{))
    |(?P<SORT>\#[ \t]*[a-z][A-Za-z0-9_]*)
    |(?P<ANONYMOUS>_(?![A-Za-z0-9_]))
    |(?P<FOREIGN>[^ \t\r\f%])
    |%[^\n]*|\Z)""",
    re.VERBOSE,
)
SIGNS = {
    ":-": "_IF", ":+": "_CR", ":~": "_WEAK", "..": "_TO", ":": "_COLON", ";": "_SEMICOLON",
    ",": "_COMMA", "|": "_BAR", "@": "_AT", "(": "_LPAR", ")": "_RPAR", "{": "_LBRACE",
    "}": "_RBRACE", "[": "_LBRACKET", "]": "_RBRACKET", "+": "PLUS", "-": "MINUS",
    "*": "TIMES", "/": "DIVIDED", "=": "EQUAL", ".": "STOP",
    **dict.fromkeys(("!=", "<", "<=", ">", ">=", "=="), "COMPARISON"),
}  # fmt: skip


class Word:
    """A word as lark's parser takes it, with its place; one of thousands, so without a dict."""

    __slots__ = ("column", "line", "source", "text", "type")

    # lark asks for these to place the end of a text.
    pos_in_stream = start_pos = end_pos = end_line = end_column = None

    def __init__(self, kind: str, text: str, source: str, line: int, column: int) -> None:
        self.type = kind
        self.text = text
        self.source = source
        self.line = line
        self.column = column

    @property
    def place(self) -> Place:
        """Where it stands."""
        return Place(self.source, self.line, self.column)


def statements(
    text: str, source: str, problems: Problems, ended: bool = True
) -> Iterator[tuple[list[Word], Place | None]]:
    """The words of each statement, and the place of its full stop; None if it has none."""
    words: list[Word] = []
    sound = True
    line, start = 1, 0
    for match in _WORDS.finditer(text):
        kind = match.lastgroup
        if kind is None:
            continue
        position = match.start(kind)
        if kind == "BREAK":
            line, start = line + 1, position + 1
            continue
        written = match.group(kind)
        if kind == "SIGN":
            kind = SIGNS[written]
            if kind == "STOP":
                if not words and sound:
                    problems.add(
                        Place(source, line, position - start + 1),
                        "found '.' without a statement before it",
                    )
                elif sound:
                    yield words, Place(source, line, position - start + 1)
                words, sound = [], True
                continue
        elif kind == "FOREIGN":
            if sound:
                problems.add(Place(source, line, position - start + 1), _foreign(written))
            sound = False
            continue
        elif kind == "SORT":
            written = "#" + written[1:].strip()
            kind = {"#const": "_CONST", "#maxint": "_MAXINT"}.get(written, kind)
        elif kind == "NAME" and written == "not":
            kind = "_NOT"
        words.append(Word(kind, written, source, line, position - start + 1))
        if kind == "_RBRACKET" and words[0].type == "_LBRACKET" and sound:
            yield words, None  # the weight of a weak constraint, which no full stop ends
            words = []
    if words and sound:
        # A last section without statements needs no full stop.
        if ended and not (len(words) == 1 and is_section(words)):
            begin = words[1] if is_section(words) else words[0]
            problems.add(begin.place, "this statement is not ended by a full stop, '.'")
        yield words, None


def is_section(words: list[Word]) -> bool:
    """Whether the words begin with the name of a section."""
    if words[0].type != "NAME" or words[0].text not in SECTIONS:
        return False
    return len(words) == 1 or words[1].type not in ("_LPAR", "_BAR", "_CR", "_COLON")


def _foreign(character: str) -> str:
    if character == '"':
        return "found '\"', expected no quotes: SPARC has no strings"
    kind = "" if character.isascii() else f" (U+{ord(character):04X})"
    return (
        f"found the character {character!r}{kind}; expected letters, digits and underscores of "
        "ASCII, and signs of the language"
    )
