"""From statements to axioms, facts, goals and a history."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.declarations import Declarations
from ros_scenesense.knowledge.description import (
    Goal,
    GoalCondition,
    Happened,
    History,
    Observation,
    SystemDescription,
)
from ros_scenesense.knowledge.literals import (
    Atom,
    Belief,
    Comparison,
    Condition,
    Literal,
    Membership,
    variables_of,
)
from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.signature import AttributeKind, Signature
from ros_scenesense.knowledge.statements import (
    AxiomStatement,
    Expression,
    GoalStatement,
    HappenedStatement,
    InitiallyStatement,
    Negative,
    ObservationStatement,
    Statement,
    WrittenCondition,
    WrittenGoalCondition,
)
from ros_scenesense.knowledge.terms import Constant, Number, Place, Record


@dataclass(frozen=True)
class Domain:
    """What a text describes: the system, and the history that stands in the same text."""

    description: SystemDescription
    history: History


class Builder:
    """Makes axioms, facts, goals and a history from statements.

    Args:
        signature: What the statements speak of.
        declarations: The values of constants.
        problems: Where to note what is wrong.
    """

    def __init__(
        self, signature: Signature, declarations: Declarations, problems: Problems
    ) -> None:
        self._signature = signature
        self._declarations = declarations
        self._problems = problems

    def domain(
        self, statements: Iterable[Statement], before: SystemDescription, source: str
    ) -> Domain:
        """Reads all statements but the declarations.

        Args:
            statements: What was written.
            before: What they go on from.
            source: Name of the text.
        """
        statements = tuple(statements)
        axioms: list[Axiom] = []
        facts: list[Literal] = []
        goals = dict(before.goals)
        observations: list[Observation] = []
        happened: list[Happened] = []
        initial: list[Literal] = []
        names = _AxiomNames(statements, before, self._problems)
        for statement in statements:
            match statement:
                case AxiomStatement():
                    fact = self._fact(statement)
                    if fact is not None:
                        facts.append(fact)
                    else:
                        axioms.extend(self._axioms(statement, names))
                case GoalStatement(name):
                    goal = Goal(
                        self.goal_conditions(statement.conditions),
                        name.text,
                        statement.words,
                        name.place,
                    )
                    if name.text in goals:
                        first = goals[name.text].place
                        self._problems.add(
                            name.place, f"goal '{name.text}' is defined already, at {first}"
                        )
                    goals.setdefault(name.text, goal)
                case InitiallyStatement(literals):
                    initial.extend(filter(None, map(self._literal, literals)))
                case ObservationStatement():
                    observations.extend(self._observations(statement))
                case HappenedStatement():
                    happened.extend(self._happened(statement))
        description = replace(
            before,
            signature=self._signature,
            axioms=(*before.axioms, *axioms),
            facts=tuple(dict.fromkeys((*before.facts, *facts))),
            goals=goals,
            source=before.source if before.axioms else source,
        )
        return Domain(description, History(tuple(observations), tuple(happened), tuple(initial)))

    def goal_conditions(self, written: Iterable[WrittenGoalCondition]) -> tuple[GoalCondition, ...]:
        """The conditions of a goal."""
        conditions = []
        for each in written:
            literal = self._literal(each.literal)
            if literal is not None:
                conditions.append(GoalCondition(each.quantity, literal))
        return tuple(conditions)

    def _fact(self, statement: AxiomStatement) -> Literal | None:
        """The value of a static, if the statement is one and has no name."""
        plain = statement.form == "constraint" and not statement.conditions
        if not plain or statement.label is not None:
            return None
        literal = self._literal(statement.heads[0], quietly=True)
        attribute = self._signature.attributes.get(literal.atom.name) if literal else None
        if literal is None or attribute is None or any(True for _ in variables_of(literal)):
            return None
        if attribute.kind is AttributeKind.INERTIAL:
            self._problems.add(
                statement.place,
                f"{literal} would hold in every state; expected 'initially {literal}.'",
            )
        return literal if attribute.kind is AttributeKind.STATIC else None

    def _axioms(self, statement: AxiomStatement, names: _AxiomNames) -> list[Axiom]:
        conditions: list[Condition | None] = [
            self._condition(each) for each in statement.conditions
        ]
        body: tuple[Condition, ...] | None = _whole(conditions)
        if statement.form == "impossible":
            actions = _whole([self._atom(head, "an action") for head in statement.heads])
            if body is None or actions is None:
                return []
            common = names.common(statement, f"impossible_{actions[0].name}")
            return [ExecutabilityCondition(actions=actions, body=body, **common)]
        heads = _whole([self._literal(head) for head in statement.heads])
        if statement.action is not None:
            action = self._atom(statement.action, "an action")
            if body is None or heads is None or action is None:
                return []
            common = names.common(statement, f"{action.name}_causes")
            return [CausalLaw(action=action, effect=head, body=body, **common) for head in heads]
        if body is None or heads is None:
            return []
        kind = {"default": Default, "initial_default": InitialDefault}.get(
            statement.form, StateConstraint
        )
        return [kind(head=heads[0], body=body, **names.common(statement, heads[0].atom.name))]

    def _condition(self, written: WrittenCondition) -> Condition | None:
        if written.operator is not None and written.right is not None:
            left, right = (self._declarations.term(each) for each in (written.left, written.right))
            if not written.negated:
                return Comparison(written.operator, left, right, written.place)
            words = f"{left} {written.operator} {right}"
            self._problems.add(
                written.place,
                f"found 'not' before the comparison {words}, expected the opposite operator",
            )
            return None
        literal = self._literal(written.left)
        if literal is None:
            return None
        atom = literal.atom
        if atom.name in self._signature.sorts and literal.positive and len(atom.arguments) == 1:
            return Membership(atom.name, atom.arguments[0], written.negated, written.place)
        return Belief(literal, written.negated)

    def _literal(self, expression: Expression, quietly: bool = False) -> Literal | None:
        positive = not isinstance(expression, Negative)
        inner = expression.term if isinstance(expression, Negative) else expression
        atom = self._atom(inner, "a literal", quietly)
        return None if atom is None else Literal(atom, positive)

    def _atom(self, expression: Expression, wanted: str, quietly: bool = False) -> Atom | None:
        if isinstance(expression, Constant):
            return Atom(expression.name, (), expression.place)
        if isinstance(expression, Record):
            arguments = tuple(map(self._declarations.term, expression.arguments))
            return Atom(expression.functor, arguments, expression.place)
        if not quietly:
            found = "two minus signs" if isinstance(expression, Negative) else str(expression)
            self._problems.add(expression.place, f"found {found}, expected {wanted}")
        return None

    def _observations(self, statement: ObservationStatement) -> list[Observation]:
        if isinstance(statement.fluent, Negative):
            self._problems.add(
                statement.fluent.place,
                "found a negated fluent, expected the fluent itself: that it was seen to be false "
                "is written obs(fluent, false, step)",
            )
            return []
        fluent, step = self._atom(statement.fluent, "a fluent"), self._step(statement.step)
        if fluent is None or step is None:
            return []
        return [Observation(fluent, statement.value, step)]

    def _happened(self, statement: HappenedStatement) -> list[Happened]:
        action, step = self._atom(statement.action, "an action"), self._step(statement.step)
        return [] if action is None or step is None else [Happened(action, step)]

    def _step(self, expression: Expression) -> int | None:
        symbol = self._declarations.symbol(expression)
        if symbol is None or isinstance(symbol, Number):
            return None if symbol is None else symbol.value
        self._problems.add(expression.place, f"found {symbol}, expected the number of a step")
        return None


class _AxiomNames:
    """Gives axioms their ids: the label, or the name of what they are about and a number."""

    def __init__(
        self, statements: Iterable[Statement], before: SystemDescription, problems: Problems
    ) -> None:
        self._places: dict[str, Place | None] = {each.id: each.place for each in before.axioms}
        self._numbers: Counter[str] = Counter()
        for statement in statements:
            if isinstance(statement, AxiomStatement) and statement.label is not None:
                name = statement.label.id
                if name.text in self._places:
                    first = self._places[name.text]
                    where = f" at {first}" if first else ""
                    problems.add(
                        name.place,
                        f"an axiom '{name.text}' stands{where} already; expected a new name",
                    )
                self._places[name.text] = name.place

    def common(self, statement: AxiomStatement, stem: str) -> dict[str, Any]:
        """What the axioms of a statement have in common: id, words, withheld, place."""
        label = statement.label
        if label is not None:
            identifier = label.id.text
        else:
            identifier = self._next(stem)
            self._places[identifier] = statement.place
        return {
            "id": identifier,
            "words": label.words if label is not None else "",
            "withheld": label is not None and label.withheld,
            "place": statement.place,
        }

    def _next(self, stem: str) -> str:
        while True:
            self._numbers[stem] += 1
            identifier = f"{stem}_{self._numbers[stem]}"
            if identifier not in self._places:
                return identifier


T = TypeVar("T")


def _whole(found: Sequence[T | None]) -> tuple[T, ...] | None:
    """All of them, or nothing if one is missing."""
    whole = tuple(each for each in found if each is not None)
    return whole if len(whole) == len(found) else None
