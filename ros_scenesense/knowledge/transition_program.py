"""Translation of a system description for planning and diagnosis: a program that grows by steps.

Unlike the readable translation this one is made for speed: it is grounded step by step, holds only
what bears on the question (*relevance*), and has no atom for what is false where an inertial fluent
is never needed as false on its own. `state(t)` says what holds in state t, `step(t)` how the action
that occurs at t leads to it; the other parts are what planners and diagnoses add. Source: the
helper axioms for planning and the translation of the paper, *Knowledge Representation and
Reasoning*.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    StateConstraint,
)
from ros_scenesense.knowledge.converses import Converses
from ros_scenesense.knowledge.description import Goal, GoalCondition, Quantity, SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Literal
from ros_scenesense.knowledge.prerequisites import prerequisites
from ros_scenesense.knowledge.relevance import Relevance, without_excuses
from ros_scenesense.knowledge.rendering import (
    atom_text,
    body_texts,
    condition_text,
    guard_text,
    rule_text,
    sort_texts,
)
from ros_scenesense.knowledge.signature import Action, AttributeKind
from ros_scenesense.knowledge.sorting import guards_of, local_variables
from ros_scenesense.knowledge.terms import Variable

PRIORITY_VIOLATIONS, PRIORITY_EXCEPTIONS = 5, 4
PRIORITY_FEWEST, PRIORITY_UNSURE, PRIORITY_TIE = 3, 2, 1
"""Priorities of what is minimised."""

AVOIDED = "avoided"
"""What `_violated` names where an action brings about what is to be avoided."""


class TransitionProgram:
    """The transition diagram of a domain as a program with parts.

    Args:
        description: With the members of all sorts and the values of its statics.
        asked: Literals that the question is about: of a goal, or observed.
        initial: What is true at first; inertial fluents that are not named are false.
        avoided: Estimated literals, perhaps with variables, that no action may bring about; where
            only defaults conclude one, an exception excuses it at a price. No default excuses it.
        lenient: Whether what makes an action impossible is only counted, `_violated(id, t)`, and as
            little of it as possible is violated; so it is seen what stands in the way of a goal.
        exogenous: Whether actions may occur that the robot does not do.

    Attributes:
        relevant: Names of the attributes that bear on the question.
        actions: The actions whose effects do; exogenous ones among them.
    """

    def __init__(
        self,
        description: SystemDescription,
        asked: Iterable[Literal],
        initial: Iterable[Literal] = (),
        avoided: Iterable[Literal] = (),
        lenient: bool = False,
        exogenous: bool = False,
    ) -> None:
        self._lenient = lenient
        asked, avoided = tuple(asked), tuple(avoided)
        self._converses = Converses(without_excuses(description, asked, avoided))
        self._description = self._converses.description
        self._signature = description.signature
        self._avoided = tuple(map(self._converses.literal, avoided))
        self._initial = tuple(map(self._converses.literal, initial))
        prefix = "_"
        names = (*self._signature.sorts, *self._signature.attributes, *self._signature.actions)
        while any(name.startswith(prefix) for name in names):
            prefix += "_"
        self._prefix = prefix
        questions = (*map(self._converses.literal, asked), *self._avoided)
        self._relevance = Relevance(self._description, questions, self._initial, exogenous)
        self.relevant = self._relevance.attributes
        self._axioms = tuple(filter(self._relevance.bears, self._description.axioms))
        acting = {law.action.name for law in self._laws()}
        self.actions = tuple(
            action for action in self._signature.actions.values() if action.name in acting
        )

    def helper(self, name: str) -> str:
        """A predicate of the program that no domain has, e.g. `_occurs`."""
        return self._prefix + name

    def text(self) -> str:
        """The parts `base`, `state(t)` and `step(t)`: facts, what holds, what actions change."""
        return "\n".join(
            [
                "#program base.",
                *sort_texts(self._signature),
                *self._statics(),
                *self._initially(),
                *self._initially_false(),
                *self._levels(),
                "#program state(t).",
                *self._constraints(),
                "#program step(t).",
                *self._effects(),
                *self._preconditions(),
                *self._inertia(),
            ]
        )

    def choice(self) -> str:
        """The part `choice(t)`: one action of the robot, of those that have what they need."""
        elements = "; ".join(
            self._acting(action, self.helper("occurs"))
            for action in self.actions
            if not action.exogenous
        )
        return f"#program choice(t).\n{{ {elements} }} = 1."

    def exogenous(self) -> str:
        """The part `exogenous(t)`: anything may happen without the robot, as little as possible."""
        happened, occurs = self.helper("happened"), self.helper("occurs")
        lines = ["#program exogenous(t).", f"#defined {happened}/2."]
        for action in self.actions:
            if action.exogenous:
                lines.append(f"{{ {self._acting(action, happened)} }}.")
        lines.append(f"{occurs}(A,t) :- {happened}(A,t).")
        lines.append(f"#minimize {{ 1,A,t : {happened}(A,t) }}.")
        return "\n".join(lines)

    def avoidance(self) -> str:
        """The part `avoidance(t)`: nothing avoided begins, unless a default has an exception.

        What holds already is no fault of the plan. An exception is counted when it begins; it
        excuses the action but makes no goal true.
        """
        exception = self.helper("exception")
        lines = ["#program avoidance(t)."]
        for literal in self._avoided:
            now, before = (self._believed(literal, time) for time in ("t", "t-1"))
            strict, strict_before = (
                self._timed(self._strict(literal), time) for time in ("t", "t-1")
            )
            lines.append(self._ruled_out(AVOIDED, [strict, f"not {strict_before}"]))
            lines.append(
                f"{exception}({self._reified(literal)},t) :- {now}, not {strict}, not {before}."
            )
        lines.append(f"#minimize {{ 1@{PRIORITY_EXCEPTIONS},F,t : {exception}(F,t) }}.")
        return "\n".join(lines)

    def doubt(self) -> str:
        """The part `doubt(t)`: counts what was surely not as it should not be, and no longer is."""
        lines = ["#program doubt(t)."]
        for literal in self._avoided:
            safe = self._strict(literal.complement)
            head = f"{self.helper('counted')}({PRIORITY_UNSURE},{self._reified(literal)},t)"
            lines.append(f"{head} :- {self._timed(safe, 't-1')}, not {self._timed(safe, 't')}.")
        return "\n".join(lines)

    def novelty(self) -> str:
        """The part `novelty(t)`, from 2 on: two actions never lead back to the same state."""
        new = self.helper("new")
        lines = ["#program novelty(t)."]
        for literal in self._inertial():
            now, before = (
                self._timed(atom_text(literal.atom), "t"),
                self._timed(atom_text(literal.atom), "t-2"),
            )
            lines.append(f"{new}(t) :- {now}, not {before}.")
            lines.append(f"{new}(t) :- {before}, not {now}.")
        lines.append(f":- not {new}(t).")
        return "\n".join(lines)

    def goal(self, goal: Goal, preferred: Iterable[Iterable[Literal]] = ()) -> str:
        """The parts `goal(t)` and `unreached(t)`.

        `goal(t)` demands the goal of state t if the external `_query(t)` is true, and counts what
        there are to be few of: `_counted(priority, literal)`. `unreached(t)` demands that the goal
        does not hold in state t.

        Args:
            goal: Without free variables in conditions of the kind TRUE.
            preferred: Groups of literals of which there are to be few among equally good plans; the
                priority of the first is `PRIORITY_TIE`, that of each other one less.
        """
        unmet, query, counted = map(self.helper, ("unmet", "query", "counted"))
        lines = ["#program goal(t).", f"#external {query}(t)."]
        few: list[tuple[int, Literal]] = []
        for condition in goal.conditions:
            condition = replace(condition, literal=self._converses.literal(condition.literal))
            if condition.quantity is Quantity.FEWEST:
                few.append((PRIORITY_FEWEST, condition.literal))
            else:
                lines.append(rule_text(f"{unmet}(t)", self._unmet(condition)))
        for number, group in enumerate(preferred):
            few.extend((PRIORITY_TIE - number, self._converses.literal(each)) for each in group)
        for priority, literal in few:
            counts = [self._believed(literal, "t"), f"{query}(t)", *self._guards(literal)]
            head = f"{counted}({priority},{self._reified(literal)},t)"
            lines.append(rule_text(head, counts))
        lines.append(f":- {query}(t), {unmet}(t).")
        for part, which in (
            ("fewest", f"P = {PRIORITY_FEWEST}"),
            ("tie", f"P < {PRIORITY_FEWEST}"),
        ):
            lines.append(f"#program {part}(t).")
            lines.append(f"#minimize {{ 1@P,L,t : {counted}(P,L,t), {which} }}.")
        lines.append(f"#defined {counted}/3.")
        lines.append("#program unreached(t).")
        lines.append(f":- not {unmet}(t).")
        return "\n".join(lines)

    def observed(self, literal: Literal, time: int) -> str:
        """The demand that a literal without variables holds, for the part `base`."""
        return f":- not {self._believed(self._converses.literal(literal), str(time))}."

    def occurring(self, action: Atom, time: str) -> str:
        """The text for "this action occurs and leads to the state of this time"."""
        return f"{self.helper('occurs')}({atom_text(action)},{time})"

    def _laws(self) -> Iterator[CausalLaw]:
        return (axiom for axiom in self._axioms if isinstance(axiom, CausalLaw))

    def _statics(self) -> Iterator[str]:
        for name in sorted(self.relevant):
            attribute = self._signature.attributes[name]
            if attribute.kind is AttributeKind.STATIC:
                yield f"#defined {name}/{len(attribute.arguments)}."
                yield f"#defined -{name}/{len(attribute.arguments)}."
            else:
                yield f"#defined {name}/{len(attribute.arguments) + 1}."
        for literal in self._description.facts:
            if literal.atom.name in self.relevant:
                yield f"{literal}."
        for axiom in self._axioms:
            if isinstance(axiom, StateConstraint) and self._is(axiom.head, AttributeKind.STATIC):
                yield rule_text(str(axiom.head), self._body(axiom, "0"))

    def _initially_false(self) -> Iterator[str]:
        for literal in self._inertial():
            if literal.atom.name in self._relevance.both_ways:
                text = atom_text(literal.atom)
                body = [f"not {self._timed(text, '0')}", *self._guards(literal)]
                yield rule_text(f"-{self._timed(text, '0')}", body)

    def _initially(self) -> Iterator[str]:
        for literal in self._initial:
            if literal.positive and literal.atom.name in self.relevant:
                yield f"{self._believed(literal, '0')}."

    def _levels(self) -> Iterator[str]:
        """What keeps the priorities of a plan's cost the same in every step."""
        never = self.helper("never")
        yield f"#external {never}."
        for priority in (PRIORITY_VIOLATIONS, PRIORITY_EXCEPTIONS, PRIORITY_FEWEST):
            yield f"#minimize {{ 1@{priority},{never} : {never} }}."

    def _constraints(self) -> Iterator[str]:
        for axiom in self._axioms:
            if not isinstance(axiom, StateConstraint | Default):
                continue
            head = axiom.head
            if self._is(head, AttributeKind.STATIC):
                continue
            body = self._body(axiom, "t")
            concluded = self._believed(head, "t")
            if self._is(head, AttributeKind.ESTIMATED):
                if isinstance(axiom, Default):
                    body.append(f"not {self._believed(head.complement, 't')}")
                else:
                    strict = self._timed(self._strict(head), "t")
                    yield rule_text(strict, body)
                    body = [strict]
            elif not head.positive:
                if self._is(head, AttributeKind.DEFINED):
                    body, concluded = [self._timed(atom_text(head.atom), "t"), *body], ""
                else:
                    concluded = f"-{self._timed(atom_text(head.atom), 't')}"
            yield rule_text(concluded, body)

    def _effects(self) -> Iterator[str]:
        for law in self._laws():
            sign = "" if law.effect.positive else "-"
            effect = self._timed(atom_text(law.effect.atom), "t")
            yield rule_text(f"{sign}{effect}", self._body(law, "t-1"))

    def _preconditions(self) -> Iterator[str]:
        for axiom in self._axioms:
            if isinstance(axiom, ExecutabilityCondition):
                occurs = [self.occurring(action, "t") for action in axiom.actions]
                yield self._ruled_out(axiom.id, [*occurs, *self._body(axiom, "t-1")])
        if self._lenient:
            violated = self.helper("violated")
            yield f"#minimize {{ 1@{PRIORITY_VIOLATIONS},I,t : {violated}(I,t) }}."

    def _ruled_out(self, identifier: str, body: list[str]) -> str:
        head = f'{self.helper("violated")}("{identifier}",t)' if self._lenient else ""
        return rule_text(head, body)

    def _inertia(self) -> Iterator[str]:
        for literal in self._inertial():
            text = atom_text(literal.atom)
            now, before = self._timed(text, "t"), self._timed(text, "t-1")
            yield f"{now} :- {before}, not -{now}."
            if literal.atom.name in self._relevance.both_ways:
                yield f"-{now} :- -{before}, not {now}."

    def _inertial(self) -> Iterator[Literal]:
        """Every relevant inertial fluent with variables as arguments."""
        for attribute in self._signature.attributes_of(AttributeKind.INERTIAL):
            if attribute.name in self._relevance.possible:
                count = len(attribute.arguments)
                yield Literal(Atom(attribute.name, tuple(Variable(f"X{i}") for i in range(count))))

    def _acting(self, action: Action, predicate: str) -> str:
        """Every instance of an action, as an element of a choice."""
        atom = Atom(action.name, tuple(Variable(f"X{i}") for i in range(len(action.arguments))))
        conditions = [*map(guard_text, guards_of([atom], [], self._signature))]
        if not self._lenient:
            needed = prerequisites(atom, self._axioms, self._signature)
            conditions += (self._believed(each, "t-1") for each in needed)
        acting = f"{predicate}({atom_text(atom)},t)"
        return f"{acting} : {', '.join(conditions)}" if conditions else acting

    def _unmet(self, condition: GoalCondition) -> list[str]:
        believed = self._believed(condition.literal, "t")
        if condition.quantity is Quantity.NO:
            return [believed, *self._guards(condition.literal)]
        return [f"not {believed}", *self._guards(condition.literal)]

    def _guards(self, literal: Literal) -> list[str]:
        return [guard_text(each) for each in guards_of([literal], [], self._signature)]

    def _body(self, axiom: Axiom, time: str) -> list[str]:
        def dialect(literal: Literal, text: str) -> str:
            if literal.atom.name in self._signature.actions:
                return f"{self.helper('occurs')}({text},t)"
            return self._text_of(literal, text, time)

        if isinstance(axiom, ExecutabilityCondition):
            # Its actions, which stand in the body, guard their variables.
            premises = [*(Belief(Literal(action)) for action in axiom.actions), *axiom.body]
            local = local_variables(axiom.actions, axiom.premises)
            texts = [condition_text(each, dialect, local, self._signature) for each in axiom.body]
            texts += map(guard_text, guards_of([], premises, self._signature))
        else:
            texts = body_texts(axiom, self._signature, dialect)
        return list(dict.fromkeys((*texts, *self._guards_of_absent(axiom))))

    def _guards_of_absent(self, axiom: Axiom) -> Iterator[str]:
        """What guards variables of literals that are said by the absence of their complement."""
        for condition in axiom.body:
            if isinstance(condition, Belief) and not condition.negated:
                literal = condition.literal
                if literal.atom.name in self._signature.attributes and self._believed(
                    literal, "t"
                ).startswith("not "):
                    yield from self._guards(literal)

    def _believed(self, literal: Literal, time: str) -> str:
        return self._text_of(literal, atom_text(literal.atom), time)

    def _text_of(self, literal: Literal, text: str, time: str) -> str:
        """The text for "this literal is believed" in the state of a time."""
        attribute = self._signature.attributes[literal.atom.name]
        if attribute.kind is AttributeKind.STATIC:
            return text if literal.positive else f"-{text}"
        if literal.positive:
            return self._timed(text, time)
        if attribute.kind is AttributeKind.ESTIMATED:
            return self._timed(self.helper(f"no_{text}"), time)
        if literal.atom.name in self._relevance.both_ways:
            return f"-{self._timed(text, time)}"
        return f"not {self._timed(text, time)}"

    def _strict(self, literal: Literal) -> str:
        sign = "" if literal.positive else "no_"
        return self.helper(f"strict_{sign}{atom_text(literal.atom)}")

    def _reified(self, literal: Literal) -> str:
        text = atom_text(literal.atom)
        return text if literal.positive else self.helper(f"no({text})")

    def _is(self, literal: Literal, kind: AttributeKind) -> bool:
        return self._signature.attributes[literal.atom.name].kind is kind

    @staticmethod
    def _timed(text: str, time: str) -> str:
        """An atom with the time as last argument."""
        return f"{text[:-1]},{time})" if text.endswith(")") else f"{text}({time})"
