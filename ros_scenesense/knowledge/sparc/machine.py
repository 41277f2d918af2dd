"""Runs the tables that lark makes of a grammar, in a loop that is made for many small statements.

lark's own loop looks each rule up by what it says, and calls something for rules that only hand on
their part; for a program of SPARC that takes as long as all the rest. What the loop cannot go on
with is left to lark, which can say what it expected.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from lark import Lark

_END = "$END"

_Reduction = tuple[int, Callable[[list[Any]], Any] | None, str]
"""How many parts a rule takes, what makes one of them (None hands the only one on), its name."""


class Machine:
    """An LALR parser for words that are made already.

    Args:
        lark: The parser whose tables it runs, with a transformer.
    """

    def __init__(self, lark: Lark) -> None:
        self._lark = lark
        frontend: Any = getattr(lark, "parser")  # noqa: B009  lark does not declare it
        inner = frontend.parser.parser
        table = inner.parse_table
        self._starts: dict[str, int] = table.start_states
        self._ends: dict[str, int] = table.end_states
        reductions = {
            id(rule): _reduction(rule, inner.callbacks[rule])
            for actions in table.states.values()
            for _, rule in actions.values()
            if not isinstance(rule, int)
        }
        self._states: dict[int, dict[str, int | _Reduction]] = {
            state: {
                symbol: target if isinstance(target, int) else reductions[id(target)]
                for symbol, (_, target) in actions.items()
            }
            for state, actions in table.states.items()
        }

    def parse(self, words: Sequence[Any], start: str) -> Any:
        """What the words become.

        Args:
            words: They have a `type`, the name of a terminal.
            start: The rule that they are to fit.

        Raises:
            UnexpectedInput: If they do not fit; from lark.
        """
        states, end = self._states, self._ends[start]
        passed = [self._starts[start]]
        values: list[Any] = []
        row = states[passed[0]]
        for word in (*words, None):
            kind = _END if word is None else word.type
            while (step := row.get(kind)) is not None:
                if isinstance(step, int):
                    passed.append(step)
                    values.append(word)
                    row = states[step]
                    break
                size, made, name = step
                if made is None:
                    passed.pop()
                else:
                    parts = values[len(values) - size :]
                    del values[len(values) - size :], passed[len(passed) - size :]
                    values.append(made(parts))
                following: Any = states[passed[-1]][name]
                if word is None and following == end:
                    return values[-1]
                passed.append(following)
                row = states[following]
            else:
                break
        given: Any = words
        return self._lark.parse(given, start=start)


def _reduction(rule: Any, made: Callable[[list[Any]], Any]) -> _Reduction:
    symbols = rule.expansion
    kept = len(symbols) == 1 and not (symbols[0].is_term and symbols[0].filter_out)
    handed_on = kept and rule.options.expand1 and not rule.alias
    return len(symbols), None if handed_on else made, rule.origin.name
