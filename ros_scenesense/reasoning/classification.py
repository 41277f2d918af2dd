"""Classification of a scene: what the axioms conclude of each object and structure.

The program is parsed once; every scene gets a new solver, which is faster than keeping one with
externals: the relations of a scene stay facts, and grounding does most of the work.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace

import clingo

from ros_scenesense.messages.reasoning import (
    Belief,
    DerivedRelation,
    ObjectBelief,
    StructureBelief,
)
from ros_scenesense.reasoning.beliefs import belief, structure_belief
from ros_scenesense.reasoning.conflict import find_conflict
from ros_scenesense.reasoning.facts import PerceivedRelation, SceneFacts, SceneObject, cyclic_pairs
from ros_scenesense.reasoning.program import (
    DERIVED_RELATIONS,
    FLUENTS,
    Axiom,
    Messages,
    Program,
    add,
)
from ros_scenesense.reasoning.retraction import retract
from ros_scenesense.reasoning.solving import CAUTIOUS, Outcome, solve
from ros_scenesense.scene import DecisionStatus, Task, find_structures


@dataclass(frozen=True)
class Classification:
    """What reasoning concluded of a scene.

    Attributes:
        objects: One belief per object and task, in the order of the facts.
        structures: Maximal stacks along *on*; none where solving gave no answer set, since *on*
            is derived too.
        derived: Derived relations between two objects, sorted.
        retracted: Perceived relations that contradict the knowledge or each other and are not
            believed, in the order of the facts.
        conflict: Where no retraction restores consistency: which axioms and facts contradict each
            other, in words.
    """

    objects: tuple[ObjectBelief, ...]
    structures: tuple[StructureBelief, ...] = ()
    derived: tuple[DerivedRelation, ...] = ()
    retracted: tuple[PerceivedRelation, ...] = ()
    conflict: str = ""

    @classmethod
    def nothing(cls, objects: Iterable[SceneObject], status: DecisionStatus) -> Classification:
        """The same status, without a value, for every object."""
        none = Belief(status=status)
        return cls(
            tuple(ObjectBelief(name=each.name, stable=none, occluded=none) for each in objects)
        )


class ClassificationSession:
    """Classifies scenes by one program, to which axioms can be added.

    Args:
        program: The parsed program.
        time_limit_s: Limit for the search of one scene. Grounding cannot be interrupted: bound
            the number of objects too.
    """

    def __init__(self, program: Program, time_limit_s: float = 1.0) -> None:
        self.program = program
        self.time_limit_s = time_limit_s
        self._reader = _Reader()

    def classify(self, facts: SceneFacts, withheld: Collection[str] = ()) -> Classification:
        """Classifies a scene.

        Believed is what holds in all answer sets. Where there is none, or where objects stand on
        or in each other in a circle, something was perceived wrongly: CR rules withdraw the fewest
        perceived relations, the least trusted first, and believed is what holds whichever of
        several such explanations is right. Where that does not help either, every object is
        inconsistent.

        With the shipped program, withholding axioms that decide takes away exactly what only they
        conclude: what remains is decided as before, perhaps by default instead of strictly, or
        undecided.

        Args:
            facts: The scene.
            withheld: Ids of axioms that are switched off for this scene.

        Raises:
            ReasoningError: If the solver fails.
        """
        outcome, answer = self._answer(facts, withheld)
        if outcome is Outcome.NO_ANSWER_SET or cyclic_pairs(
            [*answer.supports(facts), *facts.contained()]
        ):
            return self._restored(facts, withheld)
        if outcome is Outcome.TIMED_OUT:
            return Classification.nothing(facts.objects, DecisionStatus.TIMED_OUT)
        return self._classification(facts, answer)

    def extend(self, axioms: Mapping[str, str]) -> None:
        """Adds axioms to the program from the next scene on: `Program.extended`.

        Raises:
            LanguageError: If one of them is refused; then none is added.
            ReasoningError: If the program was not translated from a domain.
        """
        self.program = self.program.extended(axioms)

    def remove(self, ids: Collection[str]) -> None:
        """Removes axioms from the program from the next scene on.

        Raises:
            ReasoningError: If the program was not translated from a domain.
        """
        self.program = self.program.without(ids)

    def _answer(self, facts: SceneFacts, withheld: Collection[str]) -> tuple[Outcome, _Answer]:
        selection = self.program.selection(frozenset(withheld))
        complete = facts.is_complete(selection)
        with Messages(self.program.source) as messages:
            control = clingo.Control(CAUTIOUS, logger=messages.take)
            add(selection.complete if complete else selection.open, control)
            control.add("base", [], facts.render(selection))
            control.ground()
            consequences = solve(control, self.time_limit_s)
            return consequences.outcome, self._reader.read(consequences.symbols)

    def _restored(self, facts: SceneFacts, withheld: Collection[str]) -> Classification:
        """The classification after consistency was restored."""
        selection = self.program.selection(frozenset(withheld))
        retraction = retract(facts, selection, self.program.source, self.time_limit_s)
        if retraction.outcome is Outcome.TIMED_OUT:
            return Classification.nothing(facts.objects, DecisionStatus.TIMED_OUT)
        if retraction.outcome is Outcome.NO_ANSWER_SET:
            nothing = Classification.nothing(facts.objects, DecisionStatus.INCONSISTENT)
            words = find_conflict(facts, selection, self.program.source)
            return replace(nothing, conflict=words)
        found = self._classification(facts, self._reader.read(retraction.believed))
        return replace(found, retracted=retraction.relations)

    def _classification(self, facts: SceneFacts, answer: _Answer) -> Classification:
        names = [each.name for each in facts.objects]
        beliefs = {
            task: {
                name: belief(
                    self._by(answer, (index, task, True)),
                    self._by(answer, (index, task, False)),
                    name,
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
        )

    def _by(self, answer: _Answer, literal: _Literal) -> list[Axiom] | None:
        ids = answer.literals.get(literal)
        return None if ids is None else [a for a in self.program.axioms if a.id in ids]


_Literal = tuple[int, Task, bool]
"""A fluent of an object, true or false."""


@dataclass(frozen=True)
class _Conclusion:
    """An atom pos(F, I), neg(F, I), or the same without the axiom."""

    literal: _Literal
    axiom: str | None


@dataclass(frozen=True)
class _Derived:
    """An atom of a derived relation between two objects of the scene."""

    relation: str
    object: int
    reference: int


@dataclass(frozen=True)
class _Answer:
    """What holds: literals with the axioms that conclude them, and derived relations."""

    literals: dict[_Literal, set[str]] = field(default_factory=dict)
    relations: list[_Derived] = field(default_factory=list)

    def supports(self, facts: SceneFacts) -> list[tuple[str, str]]:
        """Names of (upper, lower) for the relation *on*."""
        names = [each.name for each in facts.objects]
        return [(names[r.object], names[r.reference]) for r in self.relations if r.relation == "on"]


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
    """What an atom says of objects of the scene; None if it speaks of something else."""
    arguments = symbol.arguments
    if symbol.name in ("pos", "neg"):
        fluent = arguments[0]
        if fluent.name not in FLUENTS or not _about_objects(fluent, 1):
            return None
        literal = (fluent.arguments[0].number, FLUENTS[fluent.name], symbol.name == "pos")
        return _Conclusion(literal, arguments[1].name if len(arguments) == 2 else None)
    if symbol.name in DERIVED_RELATIONS and symbol.positive and _about_objects(symbol, 2):
        return _Derived(symbol.name, arguments[0].number, arguments[1].number)
    return None


def _about_objects(term: clingo.Symbol, count: int) -> bool:
    arguments = term.arguments
    return len(arguments) == count and all(
        each.type == clingo.SymbolType.Number for each in arguments
    )
