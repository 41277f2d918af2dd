"""Why not: which rules could have derived an atom that is not in the answer set, and what fails.

For each rule whose head fits the atom, the longest part of its body that holds is looked for, from
left to right; the literal after it is the one that fails. The solver does the looking: a rule is
grounded once per beginning of its body, with the atoms of the answer set as facts.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import clingo
from clingo import ast

from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.explanation.rules import (
    LOCAL,
    Head,
    Rule,
    literal_term,
    unbound_as_local,
    variables_of,
)
from ros_scenesense.reasoning.explanation.support import GroundLiteral, Sign, ground

_TRIED = "tried__"
_MOST_ATTEMPTS = 3


@dataclass(frozen=True)
class Attempt:
    """A rule that could have derived the atom, and how far its body holds.

    Attributes:
        rule: Index of the rule.
        holds: The literals before the one that fails.
        fails: The literal that fails; variables that nothing before it binds are strings such as
            `_B`. None if the whole body holds: then the rule is a choice that was not made.
        because: Why it fails: the atoms under its `not` that hold, or why its own atom does not.
    """

    rule: int
    holds: tuple[GroundLiteral, ...]
    fails: GroundLiteral | None
    because: tuple[clingo.Symbol | Refutation, ...] = ()


@dataclass(frozen=True)
class Refutation:
    """Why an atom does not hold.

    Attributes:
        atom: The atom, with strings such as `_` or `_B` where any value would do, the same value
            for the same name.
        attempts: The rules that could have derived it; none if no rule can, as for what is only
            perceived or given.
        cut: Whether the attempts are left out, because they are told elsewhere or too deep.
    """

    atom: clingo.Symbol
    attempts: tuple[Attempt, ...] = ()
    cut: bool = False


class Refutations:
    """Finds out why atoms do not hold.

    Args:
        rules: The rules of the program.
        definitions: Constants that the rules use, `#const` statements.
        answer: The answer set, with the facts.
        depth: How many rules deep to look.
    """

    def __init__(
        self,
        rules: Iterable[Rule],
        definitions: Iterable[ast.AST],
        answer: Collection[clingo.Symbol],
        depth: int = 4,
    ) -> None:
        self._rules = tuple(rules)
        self._definitions = tuple(definitions)
        self._answer = tuple(answer)
        self._depth = depth

    def of(self, atom: clingo.Symbol) -> Refutation:
        """Why an atom, perhaps with the string `_` for any value, does not hold in this set."""
        return self._refute(atom, self._depth, set())

    def matches(self, pattern: clingo.Symbol) -> list[clingo.Symbol]:
        """The atoms of the answer set that a pattern such as `above(1,"_B")` fits, sorted."""
        return sorted(atom for atom in self._answer if _fits(pattern, atom, {}))

    def _refute(self, atom: clingo.Symbol, depth: int, told: set[clingo.Symbol]) -> Refutation:
        if depth == 0 or atom in told:
            return Refutation(atom, cut=True)
        told.add(atom)
        attempts: list[Attempt] = []
        for rule, holds, fails in self._furthest(atom):
            because = () if fails is None else self._because(fails, depth - 1, told)
            attempts.append(Attempt(rule, holds, fails, because))
        return Refutation(atom, tuple(attempts))

    def _because(
        self, fails: GroundLiteral, depth: int, told: set[clingo.Symbol]
    ) -> tuple[clingo.Symbol | Refutation, ...]:
        if fails.atom is None:
            return ()
        if fails.sign is Sign.FAILS:
            return tuple(self.matches(fails.atom)[:_MOST_ATTEMPTS])
        return (self._refute(fails.atom, depth, told),)

    def _furthest(
        self, atom: clingo.Symbol
    ) -> list[tuple[int, tuple[GroundLiteral, ...], GroundLiteral | None]]:
        """Per rule that could derive an atom, how far its body holds; the best instances only."""
        texts: dict[int, list[str]] = {}
        of_rule: list[int] = []
        for rule in self._rules:
            for head in rule.heads:
                lines = _beginnings_of(rule, head, atom, len(of_rule))
                if lines is not None:
                    texts[len(of_rule)] = lines
                    of_rule.append(rule.index)
        found: list[tuple[int, tuple[GroundLiteral, ...], GroundLiteral | None]] = []
        tried = self._tried(texts)
        for number, rule_index in enumerate(of_rule):
            lengths = tried.get(number)
            if lengths is None:
                continue
            literals = dict.fromkeys(
                (
                    tuple(map(GroundLiteral.of, holds.arguments)),
                    GroundLiteral.of(fails) if fails.arguments else None,
                )
                for holds, fails in sorted(lengths[max(lengths)])
            )
            best = list(literals)[:_MOST_ATTEMPTS]
            found.extend((rule_index, holds, fails) for holds, fails in best)
        return found

    def _tried(self, texts: Mapping[int, Sequence[str]]) -> dict[int, _Tried]:
        """What the rewritten rules write down: by their number, by length of the beginning."""
        lines = [line for each in texts.values() for line in each]
        if not lines:
            return {}
        try:
            found = ground("\n".join(lines), self._definitions, self._answer, _TRIED, 4)
        except ReasoningError:
            if len(texts) == 1:
                # An argument that cannot be computed backwards: what lacks cannot be told.
                return {}
            one_by_one = (self._tried({number: each}) for number, each in texts.items())
            return {number: tried for each in one_by_one for number, tried in each.items()}
        tried: dict[int, _Tried] = {}
        for number, length, holds, fails in found:
            lengths = tried.setdefault(number.number, {})
            lengths.setdefault(length.number, []).append((holds, fails))
        return tried


_Tried = dict[int, list[tuple[clingo.Symbol, clingo.Symbol]]]
"""By the length of a beginning: the literals of it, and the next one."""


def _beginnings_of(rule: Rule, head: Head, atom: clingo.Symbol, number: int) -> list[str] | None:
    """The rules for the beginnings of a body; None if the head is never the atom."""
    unified = _unified(head.atom.symbol, atom)
    if unified is None:
        return None
    bindings = [(term, value) for term, value in unified if not _is_local(value)]
    body = _ordered(bindings, [*rule.body, *head.conditions, *_equal(unified)])
    return list(_beginnings(bindings, body, number))


_Binding = tuple[ast.AST, clingo.Symbol]
"""A term of a head, and the value that it is to have."""


def _beginnings(
    bindings: Sequence[_Binding], body: Sequence[ast.AST], number: int
) -> Iterator[str]:
    """One rule per beginning of a body, that writes down the literals of it and the next one."""
    bound = _bound(bindings)
    conditions = [f"{term} = {value}" for term, value in bindings]
    holds = ""
    for length in range(len(body) + 1):
        rest = body[length:]
        fails = literal_term(unbound_as_local(rest[0], bound)) if rest else "()"
        tail = f" :- {'; '.join(conditions)}" if conditions else ""
        yield f"{_TRIED}({number},{length},({holds or ','}),{fails}){tail}."
        if rest:
            bound |= variables_of(rest[0])
            conditions.append(str(rest[0]))
            holds += f"{literal_term(rest[0])},"


def _ordered(bindings: Sequence[_Binding], body: Sequence[ast.AST]) -> list[ast.AST]:
    """The body in its order, except that a literal waits until its variables are bound."""
    bound = _bound(bindings)
    waiting, ordered = list(body), []
    while waiting:
        ready = next((each for each in waiting if _is_safe(each, bound)), waiting[0])
        waiting.remove(ready)
        ordered.append(ready)
        bound |= variables_of(ready)
    return ordered


def _bound(bindings: Sequence[_Binding]) -> set[str]:
    return {name for term, _ in bindings for name in variables_of(term)}


def _is_safe(literal: ast.AST, bound: set[str]) -> bool:
    """Whether a literal may come next; aggregates and the like come last."""
    if literal.ast_type != ast.ASTType.Literal:
        return False
    atom = literal.atom
    plain = bool(literal.sign == ast.Sign.NoSign)
    if atom.ast_type == ast.ASTType.SymbolicAtom:
        return plain or variables_of(literal) <= bound
    if atom.ast_type != ast.ASTType.Comparison:
        return bool(atom.ast_type == ast.ASTType.BooleanConstant)
    if variables_of(literal) <= bound:
        return True
    equal = [ast.ComparisonOperator.Equal]
    if not plain or [guard.comparison for guard in atom.guards] != equal:
        return False
    sides = (atom.term, atom.guards[0].term)
    return any(
        side.ast_type == ast.ASTType.Variable and variables_of(other) <= bound
        for side, other in (sides, sides[::-1])
    )


def _unified(head: ast.AST, atom: clingo.Symbol) -> list[_Binding] | None:
    """The values that terms of a head must have for it to be an atom; None if it never is."""
    if _is_local(atom):
        return [(head, atom)]
    if head.ast_type == ast.ASTType.UnaryOperation and atom.type == clingo.SymbolType.Function:
        if not atom.negative:
            return None
        return _unified(head.argument, clingo.Function(atom.name, atom.arguments))
    if head.ast_type == ast.ASTType.SymbolicTerm:
        return [] if head.symbol == atom else None
    if head.ast_type != ast.ASTType.Function:
        return [(head, atom)]
    fits = (
        atom.type == clingo.SymbolType.Function
        and atom.positive
        and atom.name == head.name
        and len(atom.arguments) == len(head.arguments)
    )
    if not fits:
        return None
    found: list[_Binding] = []
    for argument, value in zip(head.arguments, atom.arguments, strict=True):
        more = _unified(argument, value)
        if more is None:
            return None
        found += more
    return found


def _equal(unified: Sequence[_Binding]) -> list[ast.AST]:
    """Conditions that terms are equal, for which a pattern has the same name."""
    terms: defaultdict[str, list[ast.AST]] = defaultdict(list)
    for term, value in unified:
        if _is_local(value) and value.string != LOCAL:
            terms[value.string].append(term)
    pairs = [(first, other) for first, *others in terms.values() for other in others]
    nodes: list[ast.AST] = []
    for first, other in pairs:
        ast.parse_string(f":- {first} = {other}.", nodes.append)
    return [node.body[0] for node in nodes if node.ast_type == ast.ASTType.Rule]


def _is_local(symbol: clingo.Symbol) -> bool:
    return symbol.type == clingo.SymbolType.String and symbol.string.startswith(LOCAL)


def _fits(pattern: clingo.Symbol, atom: clingo.Symbol, values: dict[str, clingo.Symbol]) -> bool:
    """Whether a pattern is an atom, for values of its names that are kept in `values`."""
    if _is_local(pattern):
        return pattern.string == LOCAL or values.setdefault(pattern.string, atom) == atom
    function = clingo.SymbolType.Function
    if pattern.type != function or atom.type != function:
        return bool(pattern == atom)
    heads = [(each.name, each.positive, len(each.arguments)) for each in (pattern, atom)]
    return heads[0] == heads[1] and all(
        _fits(one, other, values)
        for one, other in zip(pattern.arguments, atom.arguments, strict=True)
    )
