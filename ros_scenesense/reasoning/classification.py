"""Classification of a scene: what the axioms conclude of each object and structure.

The program is parsed once; every scene gets a new solver, which is faster than keeping one with
externals: the relations of a scene stay facts, and grounding does most of the work.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

import clingo

from ros_scenesense.messages.reasoning import (
    Belief,
    DerivedRelation,
    ObjectBelief,
    StructureBelief,
)
from ros_scenesense.reasoning.beliefs import belief, structure_belief
from ros_scenesense.reasoning.facts import SceneFacts, SceneObject, cyclic_pairs
from ros_scenesense.reasoning.program import FLUENTS, Axiom, Messages, Program
from ros_scenesense.reasoning.solving import CAUTIOUS, Outcome, solve
from ros_scenesense.scene import DecisionStatus, Task, find_structures

DERIVED_RELATIONS = ("on",)
"""Relations between two objects that programs define and show."""


@dataclass(frozen=True)
class Classification:
    """What reasoning concluded of a scene.

    Attributes:
        objects: One belief per object and task, in the order of the facts.
        structures: Maximal stacks along *on*; none where solving gave no answer set, since *on*
            is derived too.
        derived: Derived relations between two objects, sorted.
        ignored: Pairs whose relations were left out because they stand on each other in a circle.
    """

    objects: tuple[ObjectBelief, ...]
    structures: tuple[StructureBelief, ...] = ()
    derived: tuple[DerivedRelation, ...] = ()
    ignored: frozenset[frozenset[str]] = frozenset()

    @classmethod
    def nothing(cls, objects: Iterable[SceneObject], status: DecisionStatus) -> Classification:
        """The same status, without a value, for every object."""
        none = Belief(status=status)
        return cls(
            tuple(ObjectBelief(name=each.name, stable=none, occluded=none) for each in objects)
        )


class ClassificationSession:
    """Classifies scenes by one program.

    Args:
        program: The parsed program.
        time_limit_s: Limit for the search of one scene. Grounding cannot be interrupted: bound
            the number of objects too.
    """

    def __init__(self, program: Program, time_limit_s: float = 1.0) -> None:
        self.program = program
        self.time_limit_s = time_limit_s
        self._axioms = {axiom.id: axiom for axiom in program.axioms}
        self._reader = _Reader()

    def classify(self, facts: SceneFacts, withheld: Collection[str] = ()) -> Classification:
        """Classifies a scene.

        Believed is what holds in all answer sets. Where there is none, the knowledge and the
        scene contradict each other and every object is inconsistent. Objects that stand on each
        other in a circle have been perceived wrongly: the relations on the circle are left out.

        With the shipped program, withholding axioms takes away exactly what only they conclude:
        what remains is decided as before, perhaps by default instead of strictly, or undecided.

        Args:
            facts: The scene.
            withheld: Ids of axioms that are switched off for this scene.

        Raises:
            ReasoningError: If the solver fails.
        """
        outcome, answer = self._answer(facts, withheld)
        ignored = cyclic_pairs(answer.supports(facts))
        if ignored:
            facts = facts.without_pairs(ignored)
            outcome, answer = self._answer(facts, withheld)
        if outcome is Outcome.TIMED_OUT:
            return Classification.nothing(facts.objects, DecisionStatus.TIMED_OUT)
        if outcome is Outcome.NO_ANSWER_SET:
            return Classification.nothing(facts.objects, DecisionStatus.INCONSISTENT)
        return self._classification(facts, answer, frozenset(ignored))

    def _answer(self, facts: SceneFacts, withheld: Collection[str]) -> tuple[Outcome, _Answer]:
        enabled = [identifier for identifier in self._axioms if identifier not in withheld]
        with Messages(self.program.source) as messages:
            control = clingo.Control(CAUTIOUS, logger=messages.take)
            self.program.add_to(control)
            control.add("base", [], facts.render(enabled, self.program.used))
            control.ground()
            consequences = solve(control, self.time_limit_s)
            return consequences.outcome, self._reader.read(consequences.symbols)

    def _classification(
        self, facts: SceneFacts, answer: _Answer, ignored: frozenset[frozenset[str]]
    ) -> Classification:
        names = [each.name for each in facts.objects]
        beliefs = {
            task: {
                name: belief(
                    self._by(answer, _Literal(index, task, True)),
                    self._by(answer, _Literal(index, task, False)),
                )
                for index, name in enumerate(names)
            }
            for task in Task
        }
        stable, occluded = beliefs[Task.STABILITY], beliefs[Task.OCCLUSION]
        derived = [
            DerivedRelation(
                relation=each.relation, object=names[each.object], reference=names[each.reference]
            )
            for each in answer.relations
        ]
        return Classification(
            objects=tuple(
                ObjectBelief(name=name, stable=stable[name], occluded=occluded[name])
                for name in names
            ),
            structures=tuple(
                StructureBelief(members=list(members), stable=structure_belief(members, stable))
                for members in find_structures(names, answer.supports(facts))
            ),
            derived=tuple(sorted(derived, key=lambda r: (r.relation, r.object, r.reference))),
            ignored=ignored,
        )

    def _by(self, answer: _Answer, literal: _Literal) -> list[Axiom] | None:
        ids = answer.literals.get(literal)
        return None if ids is None else [a for a in self._axioms.values() if a.id in ids]


@dataclass(frozen=True)
class _Literal:
    """A fluent of an object, true or false."""

    object: int
    task: Task
    value: bool


@dataclass(frozen=True)
class _Conclusion:
    """An atom pos(F, I), neg(F, I), or the same without the axiom."""

    literal: _Literal
    axiom: str | None


@dataclass(frozen=True)
class _Derived:
    """An atom of a derived relation."""

    relation: str
    object: int
    reference: int


class _Reader:
    """The one place where atoms become values.

    Taking an atom apart costs several calls into clingo, and atoms of small integers come again
    with every scene, so what they mean is remembered.
    """

    def __init__(self) -> None:
        self._known: dict[clingo.Symbol, _Conclusion | _Derived | None] = {}

    def read(self, symbols: Iterable[clingo.Symbol]) -> _Answer:
        answer = _Answer()
        for symbol in symbols:
            if symbol not in self._known:
                self._known[symbol] = _meaning(symbol)
            meaning = self._known[symbol]
            if isinstance(meaning, _Conclusion):
                axioms = answer.literals.setdefault(meaning.literal, set())
                if meaning.axiom is not None:
                    axioms.add(meaning.axiom)
            elif meaning is not None:
                answer.relations.append(meaning)
        return answer


def _meaning(symbol: clingo.Symbol) -> _Conclusion | _Derived | None:
    arguments = symbol.arguments
    if symbol.name in ("pos", "neg"):
        fluent = arguments[0]
        if fluent.name not in FLUENTS or len(fluent.arguments) != 1:
            return None
        task, subject = FLUENTS[fluent.name], fluent.arguments[0].number
        literal = _Literal(subject, task, symbol.name == "pos")
        return _Conclusion(literal, arguments[1].name if len(arguments) == 2 else None)
    if symbol.name in DERIVED_RELATIONS:
        return _Derived(symbol.name, arguments[0].number, arguments[1].number)
    return None


@dataclass(frozen=True)
class _Answer:
    """What holds: literals with the axioms that conclude them, and derived relations."""

    literals: dict[_Literal, set[str]] = field(default_factory=dict)
    relations: list[_Derived] = field(default_factory=list)

    def supports(self, facts: SceneFacts) -> list[tuple[str, str]]:
        """Names of (upper, lower) for the relation *on*."""
        names = [each.name for each in facts.objects]
        return [(names[r.object], names[r.reference]) for r in self.relations if r.relation == "on"]
