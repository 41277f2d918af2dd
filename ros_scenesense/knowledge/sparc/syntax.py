"""From text to statements: words, sections, full stops, and what is wrong with the syntax.

A program is cut at its full stops, and each statement is parsed alone, so that a mistake in one
does not hide the mistakes in the others. Words are made here and not by lark, whose own lexer takes
more time than all the rest. Constants are replaced as soon as they are known.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from importlib import resources
from typing import Any

from lark import Lark
from lark.exceptions import UnexpectedInput, VisitError
from lark.lexer import Lexer

from ros_scenesense.knowledge.problems import Problems, nearest
from ros_scenesense.knowledge.sparc.machine import Machine
from ros_scenesense.knowledge.sparc.statements import Text
from ros_scenesense.knowledge.sparc.trees import MisplacedError, reader
from ros_scenesense.knowledge.sparc.words import SECTIONS, SIGNS, Word, is_section, statements
from ros_scenesense.knowledge.terms import LARGEST_NUMBER, LONGEST_NAME, Place

LARGEST = 2000
"""The largest number of a program that has no `#maxint`."""

_DEEPEST = 60
_LONGEST_ARITHMETIC = 100
_STARTS = {
    "": "directive",
    "sorts": "sort",
    "predicates": "predicate",
    "rules": "rule",
    "display": "display",
}
_JOINING = {"and": "_AND", "or": "_OR"}
_ARITHMETIC = {"PLUS", "MINUS", "TIMES", "DIVIDED"}


class _Given(Lexer):
    """Hands lark the words of a statement."""

    def __init__(self, configuration: Any) -> None:
        del configuration

    def lex(self, words: Any) -> Any:
        return iter(words)


@dataclass
class _Found:
    """What was read so far, by section."""

    statements: dict[str, list[Any]] = field(
        default_factory=lambda: {section: [] for section in _STARTS}
    )
    sections: list[str] = field(default_factory=list)
    constants: dict[str, int] = field(default_factory=dict)
    largest: int = LARGEST
    names: set[str] = field(default_factory=set)
    unread: set[str] = field(default_factory=set)


def read(text: str, source: str, given: dict[str, int], problems: Problems) -> Text:
    """Reads a program; what cannot be read is noted and left out.

    Args:
        text: The program.
        source: Its name, for messages.
        given: Values of constants that override those of the program.
        problems: Where to note what is wrong.
    """
    found = _Found()
    section = ""
    pending: list[Word] | None = None  # a weak constraint, whose weight may follow
    unknown = dict(given)
    for words, end in statements(text, source, problems):
        while words and is_section(words):
            section = words.pop(0).text
            _enter(section, found, words, source, problems, end)
        if pending is not None:
            weighed = bool(words) and words[0].type == "_LBRACKET"
            if weighed:
                closing = next((n for n, each in enumerate(words) if each.type == "_RBRACKET"), -1)
                pending += words[: closing + 1]
                words = words[closing + 1 :] if closing >= 0 else []
            _statement(pending, "rules", found, end, problems)
            pending = None
            if weighed and words and words[0].type == "NAME" and words[0].text in SECTIONS:
                section = words.pop(0).text
                _enter(section, found, words, source, problems, end)
            if weighed and not words:
                continue
        if not words:
            continue
        if words[0].type == "_WEAK" and section == "rules":
            pending = words
            continue
        _statement(words, section, found, end, problems)
        for name in list(unknown):
            if section == "" and name in found.constants:
                found.constants[name] = unknown.pop(name)
    if pending is not None:
        _statement(pending, "rules", found, None, problems)
    for name in unknown:
        problems.add(
            Place(source, 1, 1),
            f"there is no constant '{name}' to set{nearest(name, found.constants)}",
        )
    made = found.statements
    if not any(made.values()) and not problems:
        problems.add(Place(source, 1, 1), "found no statement; expected sorts, predicates, rules")
    return Text(
        tuple(made["sorts"]),
        tuple(made["predicates"]),
        tuple(made["rules"]),
        tuple(made["display"]) if "display" in found.sections else None,
        found.largest,
        found.constants,
        frozenset(found.names),
        frozenset(found.unread),
    )


def read_query(text: str, constants: dict[str, int], largest: int, problems: Problems) -> Any:
    """Reads one literal, which a full stop may end; None if it cannot be read."""
    found = _Found(constants=constants, largest=largest)
    written = list(statements(text, "query", problems, ended=False))
    if len(written) != 1 or not written[0][0]:
        if not problems:
            problems.add(Place("query", 1, 1), "expected one literal, such as 'p(X)' or '-p(a)'")
        return None
    words, end = written[0]
    return _parsed(_prepared(words, "rules", found, problems), "query", end, problems)


def _enter(
    section: str,
    found: _Found,
    words: list[Word],
    source: str,
    problems: Problems,
    end: Place | None,
) -> None:
    place = words[0].place if words else (end or Place(source, 1, 1))
    if section in found.sections:
        problems.add(place, f"section '{section}' begins a second time before this")
    elif found.sections and SECTIONS.index(found.sections[-1]) > SECTIONS.index(section):
        problems.add(
            place, f"section '{section}' stands after '{found.sections[-1]}', expected before it"
        )
    found.sections.append(section)


def _statement(
    words: list[Word], section: str, found: _Found, end: Place | None, problems: Problems
) -> None:
    found.names.update(each.text for each in words if each.type == "NAME")
    prepared = _prepared(words, section, found, problems)
    made = _parsed(prepared, _STARTS[section], end, problems)
    if made is None:
        found.unread.update(each.text.lstrip("#") for each in words if each.type in _NAMING)
    elif section == "":
        _directive(made, found, problems)
    elif isinstance(made, tuple):
        found.statements[section].extend(made)
    else:
        found.statements[section].append(made)


_NAMING = ("NAME", "SORT")


def _directive(made: tuple[Any, Any], found: _Found, problems: Problems) -> None:
    name, value = made
    if value.type != "NUMBER":
        problems.add(
            value.place,
            f"'{value.text}' is no constant; expected a number or a constant defined before"
            f"{nearest(value.text, found.constants)}",
        )
    elif name is None:
        found.largest = int(value.text)
    elif name.text in found.constants:
        problems.add(name.place, f"constant '{name.text}' is defined already")
    else:
        found.constants[name.text] = int(value.text)
    found.statements[""].append(made)


def _prepared(words: list[Word], section: str, found: _Found, problems: Problems) -> list[Word]:
    """The words with constants replaced, none if there are too many; numbers, lengths, depths."""
    largest = LARGEST_NUMBER if words[0].type == "_MAXINT" else found.largest
    prepared = words
    depth = run = 0
    readable = True
    for index, word in enumerate(words):
        kind = word.type
        if kind == "NAME":
            if len(word.text) > LONGEST_NAME:
                problems.add(
                    word.place,
                    f"found a name of {len(word.text)} letters, expected at most {LONGEST_NAME}",
                )
                word.text = word.text[:LONGEST_NAME]
            if section == "sorts" and word.text in _JOINING:
                prepared[index] = Word(
                    _JOINING[word.text], word.text, word.source, word.line, word.column
                )
            elif word.text in found.constants and section not in ("predicates", "display"):
                following = words[index + 1].type if index + 1 < len(words) else ""
                if following != "_LPAR" and words[index - 1].type != "_CONST":
                    value = str(found.constants[word.text])
                    prepared[index] = Word("NUMBER", value, word.source, word.line, word.column)
        elif kind == "NUMBER":
            # Python refuses to read numbers of thousands of digits.
            if len(word.text) > 10 or int(word.text) > largest:
                shown = word.text if len(word.text) <= 20 else word.text[:20] + "…"
                problems.add(
                    word.place,
                    f"found the number {shown}, expected at most {largest}"
                    + _mend(word.text, largest),
                )
                word.text = str(largest)
        elif kind in _ARITHMETIC and (kind != "PLUS" or section != "sorts"):
            run += 1
            if run == _LONGEST_ARITHMETIC:
                readable = False
                problems.add(
                    word.place,
                    f"found more than {_LONGEST_ARITHMETIC} operators on end, expected less",
                )
        elif kind in ("_LPAR", "_LBRACE"):
            depth += 1
            if depth == _DEEPEST:
                readable = False
                problems.add(word.place, f"terms are nested more than {_DEEPEST} deep here")
        elif kind in ("_RPAR", "_RBRACE"):
            depth -= 1
        elif kind == "_COMMA":
            run = 0
        elif kind == "VARIABLE" and len(word.text) > LONGEST_NAME:
            problems.add(word.place, f"this variable has more than {LONGEST_NAME} letters")
            word.text = word.text[:LONGEST_NAME]
    return prepared if readable else []


def _mend(number: str, largest: int) -> str:
    if largest == LARGEST_NUMBER or len(number) > 10 or int(number) > LARGEST_NUMBER:
        return ""
    return f" ('#maxint'); '#maxint = {int(number)}.' at the beginning allows it"


def _parsed(words: list[Word], start: str, end: Place | None, problems: Problems) -> Any:
    if not words:
        return None
    try:
        return _parser().parse(words, start)
    except MisplacedError as error:
        problems.add(error.place, str(error))
    except VisitError as error:
        if not isinstance(error.orig_exc, MisplacedError):
            raise
        problems.add(error.orig_exc.place, str(error.orig_exc))
    except UnexpectedInput as error:
        token: Any = getattr(error, "token", None)
        accepted = set(getattr(error, "accepts", None) or getattr(error, "expected", None) or ())
        if isinstance(token, Word):
            words_ = f"found '{token.text}', expected {_expected(accepted)}"
            if token.column == 1 or token is words[0]:
                words_ += "; is a full stop missing before it?" if token is not words[0] else ""
            problems.add(token.place, words_)
        else:
            place = end or words[-1].place
            problems.add(place, f"found the end of the statement, expected {_expected(accepted)}")
    return None


_READABLE = {
    "NAME": "a name",
    "VARIABLE": "a variable",
    "NUMBER": "a number",
    "ANONYMOUS": "'_'",
    "SORT": "a sort",
    "FUNCTION": "an aggregate",
    "OPTIMIZE": "'#minimize'",
    "COMPARISON": "a comparison",
    "$END": "'.'",
    "_CONST": "'#const'",
    "_MAXINT": "'#maxint'",
    "_NOT": "'not'",
    "_AND": "'and'",
    "_OR": "'or'",
    **{kind: f"'{sign}'" for sign, kind in SIGNS.items() if kind not in ("COMPARISON", "STOP")},
}
_TERM = {"NAME", "VARIABLE", "NUMBER", "ANONYMOUS"}


def _expected(kinds: set[str]) -> str:
    found = []
    if kinds >= _TERM:
        found.append("a term")
        kinds = kinds - _TERM - {"_LPAR"}
    if kinds >= _ARITHMETIC:
        found.append("an operator")
        kinds = kinds - _ARITHMETIC
    if "COMPARISON" in kinds:
        kinds = kinds - {"EQUAL"}
    found += sorted(_READABLE.get(each, each) for each in kinds)
    return " or ".join([", ".join(found[:-1]), found[-1]]) if found[1:] else "".join(found)


@lru_cache(maxsize=1)
def _parser() -> Machine:
    grammar = resources.files(__package__).joinpath("sparc.lark").read_text("ascii")
    lark = Lark(
        grammar,
        parser="lalr",
        lexer=_Given,
        start=[*_STARTS.values(), "query"],
        maybe_placeholders=True,
        transformer=reader(),
    )
    return Machine(lark)
