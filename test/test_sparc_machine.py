"""The parser that runs lark's tables: whatever it is given, it makes the same of it as lark."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lark import Lark
from lark.exceptions import UnexpectedInput
from lark.lexer import Lexer

from ros_scenesense.knowledge.sparc.machine import Machine
from ros_scenesense.knowledge.sparc.words import Word

GRAMMAR = """
pair: sum _COMMA sum                  -> pair
    | sum [_COLON sums]               -> one
sums: sum (_COMMA sum)*               -> listed
?sum: product
    | sum PLUS product                -> added
?product: part
        | product TIMES part          -> added
?part: NAME                           -> name
     | _OPEN sum _CLOSE
     | _OPEN _CLOSE                   -> nothing
     | WORD
other: NAME+                          -> listed
%declare NAME WORD PLUS TIMES _COMMA _COLON _OPEN _CLOSE
"""
KINDS = ("NAME", "WORD", "PLUS", "TIMES", "_COMMA", "_COLON", "_OPEN", "_CLOSE")


class Given(Lexer):
    def __init__(self, configuration: Any) -> None:
        del configuration

    def lex(self, words: Any) -> Any:
        return iter(words)


class Reader:
    """Notes which rules were applied, and to what."""

    def __getattr__(self, name: str) -> Any:
        if name not in ("pair", "one", "listed", "added", "name", "nothing"):
            raise AttributeError(name)
        return lambda parts: (name, *parts)


LARK = Lark(
    GRAMMAR,
    parser="lalr",
    lexer=Given,
    start=["pair", "other"],
    maybe_placeholders=True,
    transformer=Reader(),  # type: ignore[arg-type]
)
MACHINE = Machine(LARK)


def of_lark(words: list[Word], start: str) -> Any:
    given_: Any = words
    try:
        return LARK.parse(given_, start=start)
    except UnexpectedInput:
        return UnexpectedInput


def of_machine(words: list[Word], start: str) -> Any:
    try:
        return MACHINE.parse(words, start)
    except UnexpectedInput:
        return UnexpectedInput


def numbered(kinds: list[str]) -> list[Word]:
    return [Word(kind, kind, "text", 1, number) for number, kind in enumerate(kinds)]


def written(text: str) -> list[Word]:
    signs = {",": "_COMMA", ":": "_COLON", "(": "_OPEN", ")": "_CLOSE", "+": "PLUS", "*": "TIMES"}
    kinds = [signs.get(sign, "WORD" if sign == "w" else "NAME") for sign in text]
    return numbered(kinds)


@given(st.lists(st.sampled_from(KINDS), max_size=7), st.sampled_from(["pair", "other"]))
def test_it_does_what_lark_does(kinds: list[str], start: str) -> None:
    words = numbered(kinds)
    assert of_machine(words, start) == of_lark(words, start)


@pytest.mark.parametrize(
    "text", ["a", "w", "(w)", "()", "a+b*c+w", "a,b", "a:b", "a:b,c,(d+e)", "(a)+((b))*()"]
)
def test_it_reads_what_fits(text: str) -> None:
    words = written(text)
    made = of_machine(words, "pair")
    assert made is not UnexpectedInput
    assert made == of_lark(words, "pair")


@pytest.mark.parametrize("text", ["", "+", "a+", "a,b,c", "(a", "a)", "a:"])
def test_what_does_not_fit_is_an_error_of_lark(text: str) -> None:
    assert of_machine(written(text), "pair") is UnexpectedInput


def test_each_start_has_its_own_end() -> None:
    words = written("abc")
    assert of_machine(words, "other") == ("listed", *words)
    assert of_machine(written("abc"), "pair") is UnexpectedInput
