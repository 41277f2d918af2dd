"""One learning cycle: induce axioms, then keep of all versions those that decide scenes best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from ros_scenesense.errors import LanguageError, LearningError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.bodies import Learned
from ros_scenesense.learning.confidence import lower_bound
from ros_scenesense.learning.covering_learner import CoveringLearner
from ros_scenesense.learning.evaluation import can_be_evaluated, holds
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.grouping import grouped, same_statement
from ros_scenesense.learning.paper_learner import PaperLearner
from ros_scenesense.learning.scoring import TRUE_FROM
from ros_scenesense.learning.trials import Trial
from ros_scenesense.reasoning.selection import Dropped, Version, select
from ros_scenesense.stages.law_learning import LawOrder, is_about_actions, learn_laws

AxiomData = StateConstraint | Default
Algorithm = Literal["covering", "paper"]

_FEWEST = 8
"""A given axiom is refuted by at least so many objects that it speaks of ..."""

_REFUTING_Z = 2.0
"""... and only if even the upper bound of its truth is below what is asked of learned ones."""


@dataclass(frozen=True)
class Task:
    """What there is to learn about one fluent.

    Attributes:
        fluent: Its name.
        relevant: Perceived relations that may bear on it; None = all.
        examples: To learn from.
        judging: Objects of whole scenes, by which versions are chosen.
    """

    fluent: str
    relevant: frozenset[str] | None
    examples: Sequence[Example]
    judging: Sequence[Example]


@dataclass(frozen=True)
class LearningOrder:
    """All that a cycle needs.

    Attributes:
        description: The domain with the given axioms that are in force.
        learned: The learned ones in force: statement by id.
        pinned: Ids of those that people want to stay.
        vetoed: Statements that people do not want.
        tasks: What to learn about.
        algorithm: `covering`, ours, or `paper`, Algorithm 1.
        purity: Threshold th1 of normal axioms.
        default_purity: The same of defaults; None = no defaults.
        slack: Estimated share of wrong relations.
        trees: Size of the ensemble.
        seed: Of everything random.
        trials: Attempts at actions, to learn about these.
    """

    description: SystemDescription
    learned: Mapping[str, str]
    pinned: frozenset[str]
    vetoed: Sequence[str]
    tasks: Sequence[Task]
    algorithm: Algorithm = "covering"
    purity: float = 0.95
    default_purity: float | None = 0.70
    slack: float = 0.0
    trees: int = 100
    seed: int = 0
    trials: Sequence[Trial] = ()


@dataclass(frozen=True)
class Found:
    """An axiom that was induced, and the id of the learned one that says the same, if any."""

    text: str
    kind: Literal["normal", "default"]
    purity: float
    support: float
    known: str | None


@dataclass(frozen=True)
class Loss:
    """A version that was not kept: its id, or the statement of a new one, and why in words."""

    axiom: str
    given: bool
    words: str


@dataclass
class LearningReport:
    """What a cycle found.

    Attributes:
        found: Induced axioms that are kept.
        lost: Versions that were dropped.
        refuted: Given axioms that the examples speak against, each with why.
        problems: What could not be learned, and why.
    """

    found: list[Found] = field(default_factory=list)
    lost: list[Loss] = field(default_factory=list)
    refuted: dict[str, str] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


class LearningEngine:
    """Learns; without memory of its own."""

    def learn(self, order: LearningOrder) -> LearningReport:
        """Runs one cycle.

        Raises:
            ReasoningError: If the solver fails.
        """
        report = LearningReport()
        self._learn_laws(order, report)
        for task in order.tasks:
            try:
                _Cycle(order, task, report).run()
            except LearningError as error:
                report.problems.append(f"nothing is learned about {task.fluent!r}: {error}")
        return report

    def _learn_laws(self, order: LearningOrder, report: LearningReport) -> None:
        laws = learn_laws(
            LawOrder(
                description=order.description,
                learned={n: text for n, text in order.learned.items() if is_about_actions(text)},
                pinned=order.pinned,
                vetoed=order.vetoed,
                trials=order.trials,
                purity=order.purity,
                trees=order.trees,
                seed=order.seed,
            )
        )
        report.problems += laws.problems
        for each, known in laws.found:
            axiom = each.axiom
            report.found.append(Found(str(axiom), axiom.kind, each.purity, each.support, known))
        for name, instead in laws.lost:
            words = f"dropped: {instead} tells as well what comes of the action"
            report.lost.append(Loss(name, False, words))


class _Cycle:
    """A cycle for one fluent."""

    def __init__(self, order: LearningOrder, task: Task, report: LearningReport) -> None:
        self._order, self._task, self._report = order, task, report
        self._signature = order.description.signature
        self._given = [
            axiom
            for axiom in order.description.axioms
            if isinstance(axiom, StateConstraint | Default)
            and axiom.head.atom.name == task.fluent
            and can_be_evaluated(axiom)
        ]
        read = (
            self._read(text, name)
            for name, text in order.learned.items()
            if not is_about_actions(text)
        )
        self._known = [axiom for axiom in read if axiom.head.atom.name == task.fluent]

    def run(self) -> None:
        induced = self._induced()
        new = {each.axiom.id: each for each in induced if not self._match(each.axiom)}
        kept = self._merged([each.axiom for each in new.values()])
        for each in induced:
            known = self._match(each.axiom)
            if known or each.axiom.id in kept:
                self._report.found.append(
                    Found(str(each.axiom), each.axiom.kind, each.purity, each.support, known)
                )
        in_force = [a for a in (*self._given, *self._known) if a.id in kept]
        in_force += [each.axiom for each in new.values() if each.axiom.id in kept]
        self._refute(in_force)

    def _induced(self) -> list[Learned]:
        """What is learned, without what people vetoed or what is given anyway."""
        order, task = self._order, self._task
        if order.algorithm == "paper":
            paper = PaperLearner(
                order.description,
                task.fluent,
                task.relevant,
                purity=order.purity,
                default_purity=order.default_purity,
                trees=order.trees,
                random_state=order.seed,
            )
            axioms = paper.fit(task.examples).axioms_
        else:
            covering = CoveringLearner(
                order.description,
                task.fluent,
                task.relevant,
                purity=order.purity,
                default_purity=order.default_purity,
                slack=order.slack,
                trees=order.trees,
                random_state=order.seed,
            )
            axioms = covering.fit(task.examples).axioms_
        vetoed = [self._read(e, "vetoed") for e in order.vetoed if not is_about_actions(e)]
        unwanted = [*vetoed, *self._given]
        return [
            replace(each, axiom=replace(each.axiom, id=f"new_{number}"))
            for number, each in enumerate(axioms)
            if not any(same_statement(each.axiom, other, self._signature) for other in unwanted)
        ]

    def _match(self, axiom: AxiomData) -> str | None:
        """Id of the learned axiom that says the same."""
        same = (e.id for e in self._known if same_statement(axiom, e, self._signature))
        return next(same, None)

    def _merged(self, new: Sequence[AxiomData]) -> frozenset[str]:
        """Ids of what is kept of all axioms, given, learned before, and new."""
        everything = [*self._given, *self._known, *new]
        by_id = {each.id: each for each in everything}
        given = {each.id for each in self._given}
        free = [each for each in everything if each.id not in self._order.pinned]
        groups = [
            group
            for group in grouped(free, self._signature)
            if any(each.id not in given for each in group)
        ]
        placed = {each.id for group in groups for each in group}
        contested = self._contested(new) - placed - self._order.pinned
        items = self._task.judging
        versions = {each.id: self._version(each, items, each.id in given) for each in everything}
        selected = select(
            [[versions[each.id] for each in group] for group in groups],
            [versions[name] for name in by_id if name not in placed | contested],
            [each.label for each in items],
            [versions[name] for name in by_id if name in contested],
        )
        for each in selected.dropped:
            name = each.id if not each.id.startswith("new_") else str(by_id[each.id])
            words = self._words(each, by_id)
            self._report.lost.append(Loss(name, each.id in given, words))
        return selected.kept

    def _contested(self, new: Sequence[AxiomData]) -> frozenset[str]:
        """New axioms and given ones that say the opposite of the same object, both for sure."""
        found: set[str] = set()
        strict = [each for each in self._given if each.kind == "normal"]
        items = [*self._task.examples, *self._task.judging]
        for one in (each for each in new if each.kind == "normal"):
            for other in strict:
                if one.head.positive != other.head.positive and any(
                    holds(one, e.state, e.target) and holds(other, e.state, e.target) for e in items
                ):
                    found |= {one.id, other.id}
        return frozenset(found)

    def _words(self, dropped: Dropped, by_id: Mapping[str, AxiomData]) -> str:
        items = self._task.judging
        scenes = list(dict.fromkeys(items[index].scene_id for index in dropped.wins))
        if dropped.instead is None:
            reason = "it contradicts others on labelled scenes"
        elif scenes:
            reason = f"{by_id[dropped.instead]} decides more of the labelled scenes rightly"
        else:
            reason = f"{by_id[dropped.instead]} decides as well, and is no less general"
        decided = f" (decided by {', '.join(scenes)})" if scenes else ""
        return f"dropped: {reason}{decided}"

    def _refute(self, in_force: Sequence[AxiomData]) -> None:
        """Finds given axioms that are true too seldom, whatever people wrote."""
        strict = [each for each in in_force if each.kind == "normal"]
        for axiom in self._given:
            if axiom not in in_force:
                continue
            spoken = [
                each
                for each in self._task.examples
                if holds(axiom, each.state, each.target)
                and (
                    axiom.kind == "normal"
                    or not any(holds(one, each.state, each.target) for one in strict)
                )
            ]
            misses = sum(each.label != axiom.head.positive for each in spoken)
            highest = 1.0 - lower_bound(misses, len(spoken), _REFUTING_Z)
            if len(spoken) >= _FEWEST and highest < TRUE_FROM[axiom.kind]:
                right = len(spoken) - misses
                self._report.refuted[axiom.id] = (
                    f"true of {right} of {len(spoken)} labelled objects only"
                )

    def _version(self, axiom: AxiomData, items: Sequence[Example], given: bool) -> Version:
        return Version(
            axiom.id,
            axiom.head.positive,
            axiom.kind == "normal",
            len(axiom.body),
            frozenset(
                index for index, each in enumerate(items) if holds(axiom, each.state, each.target)
            ),
            given,
        )

    def _read(self, text: str, name: str) -> AxiomData:
        description = self._order.description
        axiom = parse(f"{name}: {text}", f"axiom {name}", description).description.axioms[-1]
        if not isinstance(axiom, StateConstraint | Default) or not can_be_evaluated(axiom):
            raise LanguageError(f"axiom {name}: {text} is not about one object by a plain body")
        return axiom
