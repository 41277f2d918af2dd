"""From lark's trees to statements."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from typing import Any

import lark

from ros_scenesense.knowledge.description import Quantity
from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.statements import (
    ActionsStatement,
    AttributesStatement,
    AxiomStatement,
    ConstStatement,
    Declaration,
    Expression,
    GoalStatement,
    HappenedStatement,
    InitiallyStatement,
    Label,
    MembersStatement,
    Name,
    Negative,
    ObservationStatement,
    Range,
    SortStatement,
    WrittenCondition,
    WrittenGoalCondition,
)
from ros_scenesense.knowledge.terms import (
    LARGEST_NUMBER,
    LONGEST_NAME,
    Arithmetic,
    Constant,
    Number,
    Place,
    Record,
    Term,
    Variable,
)

Node = Any
"""A tree or a token of lark; its types differ between the versions 0.12 and 1."""

DEEPEST = 60
"""Terms nested deeper than this are refused."""

_LETTERS = "XYZUVWABCDEFGHIJKLMNOPQRST"


def absolute(origin: Place, line: int, column: int) -> Place:
    """The place of a line and column, counted from 1 within a text that begins at `origin`."""
    shift = origin.column - 1 if line == 1 else 0
    return Place(origin.source, origin.line + line - 1, column + shift)


class Reader:
    """Turns the tree of one statement into a `Statement`, or of a goal into its conditions.

    Args:
        origin: Where the text of the statement begins.
        text: The text, for the names of anonymous variables: `_` gets a letter that is free.
        problems: Where to note what is wrong.
    """

    def __init__(self, origin: Place, text: str, problems: Problems) -> None:
        self._origin = origin
        self._problems = problems
        taken = set(re.findall(r"[A-Z]\w*", text))
        numbered = (f"{_LETTERS[n % 26]}{n // 26 or ''}" for n in itertools.count())
        self._free = (name for name in numbered if name not in taken)

    def read(self, tree: Node) -> Any:
        """The statement; for the rule `asked` a tuple of `WrittenGoalCondition`."""
        if tree.data == "asked":
            return self._goals(tree.children[0])
        return getattr(self, f"_{tree.data}")(*tree.children)

    def _sort(self, name: Node, above: Node | None, sum_: Node | None) -> SortStatement:
        parts: list[Name | tuple[Expression, ...] | Range] = []
        for part in sum_.children if sum_ is not None else ():
            if part.data == "subsort":
                parts.append(self._name(part.children[0]))
            elif part.data == "set":
                parts.append(self._terms(part.children[0]))
            else:
                low, high = (self._expression(each) for each in part.children)
                parts.append(Range(low, high, self._place(part)))
        return SortStatement(self._name(name), self._names(above), tuple(parts))

    def _members(self, name: Node, members: Node) -> MembersStatement:
        return MembersStatement(self._name(name), self._terms(members.children[0]))

    def _const(self, name: Node, value: Node) -> ConstStatement:
        return ConstStatement(self._name(name), self._expression(value))

    def _fluents(self, kind: Node, declared: Node) -> AttributesStatement:
        return AttributesStatement(
            AttributeKind(str(kind.children[0])), self._declarations(declared)
        )

    def _statics(self, declared: Node) -> AttributesStatement:
        return AttributesStatement(AttributeKind.STATIC, self._declarations(declared))

    def _actions(self, exogenous: Node, declared: Node) -> ActionsStatement:
        return ActionsStatement(exogenous is not None, self._declarations(declared))

    def _constraint(
        self, label: Node | None, head: Node, body: Node | None = None
    ) -> AxiomStatement:
        return self._axiom("constraint", label, (head,), None, body)

    def _causal_law(
        self,
        label: Node | None,
        action: Node,
        effects: Node,
        body: Node | None,
    ) -> AxiomStatement:
        return self._axiom("causal_law", label, effects.children, action, body)

    def _impossible(self, label: Node | None, actions: Node, body: Node | None) -> AxiomStatement:
        return self._axiom("impossible", label, actions.children, None, body)

    def _default(self, label: Node | None, head: Node, body: Node | None) -> AxiomStatement:
        return self._axiom("default", label, (head,), None, body)

    def _initial_default(self, label: Node | None, head: Node, body: Node | None) -> AxiomStatement:
        return self._axiom("initial_default", label, (head,), None, body)

    def _initially(self, literals: Node) -> InitiallyStatement:
        return InitiallyStatement(self._terms(literals))

    def _observation(self, fluent: Node, value: Node, step: Node) -> ObservationStatement:
        seen = str(value.children[0]) == "true"
        return ObservationStatement(self._expression(fluent), seen, self._expression(step))

    def _happened(self, action: Node, step: Node) -> HappenedStatement:
        return HappenedStatement(self._expression(action), self._expression(step))

    def _goal(self, name: Node, words: Node | None, goals: Node) -> GoalStatement:
        return GoalStatement(self._name(name), _unquoted(words), self._goals(goals))

    def _goals(self, goals: Node) -> tuple[WrittenGoalCondition, ...]:
        conditions = []
        for part in goals.children:
            word, literal = part.children
            quantity = Quantity.TRUE if word is None else Quantity(str(word.children[0]))
            conditions.append(WrittenGoalCondition(quantity, self._expression(literal)))
        return tuple(conditions)

    def _axiom(
        self,
        form: str,
        label: Node | None,
        heads: Sequence[Node],
        action: Node | None,
        body: Node | None,
    ) -> AxiomStatement:
        return AxiomStatement(
            form=form,
            label=None if label is None else self._label(*label.children),
            heads=tuple(self._expression(head) for head in heads),
            action=None if action is None else self._expression(action),
            conditions=tuple(
                self._condition(each) for each in (body.children if body is not None else ())
            ),
            place=self._origin,
        )

    def _label(self, name: Node, withheld: Node | None, words: Node | None) -> Label:
        return Label(self._name(name), withheld is not None, _unquoted(words))

    def _condition(self, tree: Node) -> WrittenCondition:
        negated, left, *comparison = tree.children
        operator, right = comparison if comparison[1:] else (None, None)
        return WrittenCondition(
            negated=negated is not None,
            left=self._expression(left),
            operator=None if operator is None else str(operator),
            right=None if right is None else self._expression(right),
            place=self._place(left),
        )

    def _declarations(self, declared: Node) -> tuple[Declaration, ...]:
        return tuple(
            Declaration(self._name(name), self._names(sorts))
            for name, sorts in (each.children for each in declared.children)
        )

    def _names(self, names: Node | None) -> tuple[Name, ...]:
        return tuple(self._name(each) for each in names.children) if names is not None else ()

    def _name(self, token: Node) -> Name:
        text, place = str(token), self._place(token)
        if len(text) > LONGEST_NAME:
            self._problems.add(
                place, f"found a name of {len(text)} letters, expected at most {LONGEST_NAME}"
            )
            text = text[:LONGEST_NAME]
        return Name(text, place)

    def _terms(self, terms: Node | None) -> tuple[Expression, ...]:
        return tuple(self._expression(each) for each in terms.children) if terms else ()

    def _expression(self, tree: Node, depth: int = 0) -> Expression:
        kind, place = tree.data, self._place(tree)
        if depth > DEEPEST:
            self._problems.add(place, f"terms are nested more than {DEEPEST} deep here")
            return Number(0, place)
        if kind in ("number", "negative_number"):
            number = self._number(str(tree.children[0]), place)
            return number if kind == "number" else Negative(number, place)
        if kind == "variable":
            return Variable(self._name(tree.children[0]).text, place)
        if kind == "anonymous":
            return Variable(next(self._free), place)
        if kind == "name":
            return Constant(self._name(tree.children[0]).text, place)
        if kind == "negative":
            return Negative(self._expression(tree.children[0], depth + 1), place)
        if kind == "applied":
            functor, arguments = tree.children
            terms = tuple(self._term(each, depth + 1) for each in arguments.children)
            return Record(self._name(functor).text, terms, place)
        operator = {"plus": "+", "minus": "-", "times": "*", "divided": "/"}[kind]
        left, right = (self._term(each, depth + 1) for each in tree.children)
        return Arithmetic(operator, left, right, place)

    def _term(self, tree: Node, depth: int) -> Term:
        """A term inside another, where a minus can only be that of a number."""
        expression = self._expression(tree, depth)
        return plain_term(expression) if isinstance(expression, Negative) else expression

    def _number(self, digits: str, place: Place) -> Number:
        # Python refuses to read numbers of thousands of digits.
        if len(digits) > 10 or int(digits) > LARGEST_NUMBER:
            self._problems.add(
                place, f"found the number {digits[:20]}, expected at most {LARGEST_NUMBER}"
            )
            return Number(0, place)
        return Number(int(digits), place)

    def _place(self, part: Node) -> Place:
        while isinstance(part, lark.Tree):
            if not part.children:  # `_`
                return self._origin
            part = part.children[0]
        return absolute(self._origin, part.line, part.column)


def plain_term(expression: Expression) -> Term:
    """The term that an expression is where no literal can stand."""
    if not isinstance(expression, Negative):
        return expression
    inner = plain_term(expression.term)
    if isinstance(inner, Number):
        return Number(-inner.value, expression.place)
    return Arithmetic("-", Number(0), inner, expression.place)


def _unquoted(words: Node | None) -> str:
    return "" if words is None else " ".join(str(words)[1:-1].split())
