"""One learning cycle: drop what experience refutes, induce axioms, keep the best versions."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from ros_scenesense.errors import LanguageError, LearningError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.bodies import Learned
from ros_scenesense.learning.covering_learner import CoveringLearner
from ros_scenesense.learning.evaluation import can_be_evaluated, holds
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.grouping import grouped, is_special_case, same_statement
from ros_scenesense.learning.paper_learner import PaperLearner
from ros_scenesense.learning.scoring import TRUE_FROM
from ros_scenesense.learning.trials import Trial
from ros_scenesense.reasoning.selection import Dropped, Version, select
from ros_scenesense.stages.law_learning import LawOrder, is_about_actions, learn_laws
from ros_scenesense.stages.refutation import AxiomData, Evidence

Algorithm = Literal["covering", "paper"]


@dataclass(frozen=True)
class Task:
    """What there is to learn about one fluent.

    Attributes:
        fluent: Its name.
        relevant: Perceived relations that may bear on it; None = all.
        examples: To learn from.
        judging: Objects of whole scenes, by which versions are chosen.
        recent: Ids of the scenes of either kind that no cycle has seen before.
    """

    fluent: str
    relevant: frozenset[str] | None
    examples: Sequence[Example]
    judging: Sequence[Example]
    recent: frozenset[str] = frozenset()


@dataclass(frozen=True)
class LearningOrder:
    """All that a cycle needs.

    Attributes:
        description: The domain with the given axioms that are in force.
        learned: The learned ones in force: statement by id.
        pinned: Ids of those that people want to stay.
        vetoed: Statements that people do not want.
        tasks: What to learn about.
        suspended: Given axioms that experience put out of force.
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
    suspended: Sequence[AxiomData] = ()
    algorithm: Algorithm = "covering"
    purity: float = 0.95
    default_purity: float | None = 0.70
    slack: float = 0.0
    trees: int = 100
    seed: int = 0
    trials: Sequence[Trial] = ()


def suspended(description: SystemDescription, refuted: Collection[str]) -> list[AxiomData]:
    """The axioms of a domain, of the kind that is learned, that experience put out of force."""
    return [
        axiom
        for axiom in description.axioms
        if isinstance(axiom, StateConstraint | Default) and axiom.id in refuted
    ]


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
        refuted: Axioms, given or learned, that labelled objects speak against, each with why.
        restored: Given axioms that were out of force and hold again, each with why.
        changed: Fluents whose labels follow other laws in the newest scenes than before.
        problems: What could not be learned, and why.
    """

    found: list[Found] = field(default_factory=list)
    lost: list[Loss] = field(default_factory=list)
    refuted: dict[str, str] = field(default_factory=dict)
    restored: dict[str, str] = field(default_factory=dict)
    changed: list[str] = field(default_factory=list)
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
        self._examples = list(task.examples)
        self._refuted: list[AxiomData] = []

    def run(self) -> None:
        self._refute()
        self._restore()
        induced = self._induced()
        new = {each.axiom.id: each for each in induced if not self._match(each.axiom)}
        kept = self._merged([each.axiom for each in new.values()])
        for each in induced:
            known = self._match(each.axiom)
            if known or each.axiom.id in kept:
                self._report.found.append(
                    Found(str(each.axiom), each.axiom.kind, each.purity, each.support, known)
                )

    def _induced(self) -> list[Learned]:
        """What is learned, without what people vetoed, what is given, and what was just refuted."""
        order, task = self._order, self._task
        description = order.description.without({each.id for each in self._refuted})
        if order.algorithm == "paper":
            paper = PaperLearner(
                description,
                task.fluent,
                task.relevant,
                purity=order.purity,
                default_purity=order.default_purity,
                trees=order.trees,
                random_state=order.seed,
            )
            axioms = paper.fit(self._examples).axioms_
        else:
            covering = CoveringLearner(
                description,
                task.fluent,
                task.relevant,
                purity=order.purity,
                default_purity=order.default_purity,
                slack=order.slack,
                trees=order.trees,
                random_state=order.seed,
            )
            axioms = covering.fit(self._examples).axioms_
        vetoed = [self._read(e, "vetoed") for e in order.vetoed if not is_about_actions(e)]
        unwanted = [*vetoed, *self._given, *self._refuted]
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
        items = [*self._examples, *self._task.judging]
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
        elif len(by_id[dropped.instead].body) > len(by_id[dropped.id].body):
            reason = f"{by_id[dropped.instead]} decides as well, and is less often wrong"
        else:
            reason = f"{by_id[dropped.instead]} decides as well, and is no less general"
        decided = f" (decided by {', '.join(scenes)})" if scenes else ""
        return f"dropped: {reason}{decided}"

    def _refute(self) -> None:
        """Drops axioms that labelled objects speak against, unless a person pinned them.

        If one of them was true before, the world has changed, and scenes of before teach nothing.
        """
        free = [each for each in self._known if each.id not in self._order.pinned]
        refuted = self._evidence().against([*self._given, *free], self._strict())
        if any(each.changed for each in refuted):
            self._report.changed.append(self._task.fluent)
            self._examples = [e for e in self._examples if e.scene_id in self._task.recent]
        self._report.refuted.update({each.axiom.id: str(each) for each in refuted})
        self._refuted = [each.axiom for each in refuted]
        self._given = [each for each in self._given if each not in self._refuted]
        self._known = [each for each in self._known if each not in self._refuted]

    def _restore(self) -> None:
        """Puts given axioms back into force that labelled objects support again."""
        for axiom in self._order.suspended:
            if axiom.head.atom.name != self._task.fluent or not can_be_evaluated(axiom):
                continue
            words = self._evidence().in_favour(axiom, self._strict())
            same = [e for e in self._known if same_statement(axiom, e, self._signature)]
            others = (each for each in (*self._given, *self._known) if each not in same)
            # What says less than an axiom in force was put out of force because of that.
            if words is None or any(is_special_case(axiom, e, self._signature) for e in others):
                continue
            self._report.restored[axiom.id] = words
            self._given.append(axiom)
            for each in same:
                self._known.remove(each)
                self._report.lost.append(
                    Loss(each.id, False, f"dropped: {axiom.id}, which was given, says the same")
                )

    def _evidence(self) -> Evidence:
        items = [*self._examples, *self._task.judging]
        normal = self._order.purity - self._order.slack
        default = self._order.default_purity or TRUE_FROM["default"]
        return Evidence(items, self._task.recent, normal, default)

    def _strict(self) -> list[AxiomData]:
        return [each for each in (*self._given, *self._known) if each.kind == "normal"]

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
