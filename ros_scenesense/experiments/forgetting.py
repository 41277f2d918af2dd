"""Experiment on forgetting, hypothesis H5 of the paper: wrong axioms are found and removed.

Paper, experiment five. Ten cycles, each with 50 new labelled scenes to learn from and 10 to choose
between versions; what is not learned again and not used fades. Added to the paper: given axioms
that are wrong or say too much, a world that changes after the fifth cycle, and one that changes
back again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ros_scenesense.attention.relevance import relevance
from ros_scenesense.experiments.axioms_scenes import (
    ExactScenes,
    Scenes,
    domain,
    read_records,
    withheld_ids,
)
from ros_scenesense.experiments.forgetting_report import ENDS, Life, Lives, report_on
from ros_scenesense.experiments.options import Options, dataset_of
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.evaluation import can_be_evaluated, holds
from ros_scenesense.learning.examples import Example
from ros_scenesense.learning.scoring import Judge
from ros_scenesense.reasoning.program import FLUENTS
from ros_scenesense.stages.axiom_keeper import changes_of_cycle
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.learning_engine import (
    Algorithm,
    LearningEngine,
    LearningOrder,
    Task,
    suspended,
)
from ros_scenesense.stages.state_file import IN_MEMORY

_GIVEN = """
given_wrong: occluded(A) if not behind(A, B), above(A, C).
given_overspecified: -occluded(A) if not behind(A, B), above(A, C), touching(A, C).
"""


@dataclass(frozen=True)
class Plan:
    """How many runs of how many cycles, scenes of a cycle, and scenes that judge at the end."""

    runs: int = 3
    cycles: int = 10
    scenes: int = 50
    merging: int = 10
    pool: int = 200
    judging: int = 600

    @property
    def needed(self) -> int:
        """All scenes."""
        return self.runs * self.cycles * (self.scenes + self.merging) + self.judging


QUICK = Plan(runs=1, cycles=3, scenes=10, merging=4, pool=30, judging=30)


@dataclass(frozen=True)
class Way:
    """One way to live through the cycles.

    Attributes:
        name: For figures and tables.
        algorithm: Of the learner.
        pooled: Whether cycles learn from the pool, or from their own scenes alone (the paper).
        default_purity: Threshold of defaults; None = none are learned.
        given: Whether two bad axioms are given in the beginning.
        changes: Whether the world changes in the middle: nothing falls off irregular surfaces.
        returns: Whether it changes for a third of the cycles only, and s2 is given.
        any_use: Whether any use reinforces (the paper), or only if it is right often enough.
    """

    name: str
    algorithm: Algorithm = "covering"
    pooled: bool = True
    default_purity: float | None = 0.70
    given: bool = False
    changes: bool = False
    returns: bool = False
    any_use: bool = False

    def has_changed(self, cycle: int, cycles: int) -> bool:
        """Whether a cycle, counted from 0, is in another world than the first one."""
        if self.returns:
            return cycles // 3 <= cycle < 2 * cycles // 3
        return self.changes and cycle >= cycles // 2


WAYS = (
    Way("normal", default_purity=None),
    Way("both"),
    Way("any_use", any_use=True),
    Way("paper_normal", "paper", pooled=False, default_purity=None, any_use=True),
    Way("paper_both", "paper", pooled=False, any_use=True),
    Way("bad_given", given=True),
    Way("changing", changes=True),
    Way("returning", returns=True),
)


def conduct(options: Options, say: Callable[[str], None]) -> Outcome:
    """Runs the experiment.

    Raises:
        DatasetError: If the dataset is not there or has too few scenes.
    """
    plan = QUICK if options.quick else Plan()
    with dataset_of(options, plan.needed, say) as folder:
        records = read_records(folder, plan.needed)
    description = domain()
    scenes = ExactScenes(description).read(records)
    say(f"{len(records)} scenes read")
    lives: list[Lives] = []
    for way in WAYS:
        for number in range(plan.runs):
            lives.append(_live(description, scenes, way, number, plan, options.seed))
        say(f"{way.name}: {plan.runs} runs of {plan.cycles} cycles")
    return report_on(lives, options.command, options.seed, plan.cycles)


def _live(
    description: SystemDescription, scenes: Scenes, way: Way, number: int, plan: Plan, seed: int
) -> Lives:
    """One run through all cycles."""
    reduced = description.without(withheld_ids(description))
    if way.returns:
        reduced = description.without(withheld_ids(description) - {"s2"})
    if way.given:
        reduced = parse(_GIVEN, "given", reduced).description
    store = LearnerStore(IN_MEMORY, Health(), plan.needed)
    strengths: list[dict[str, float]] = []
    size = plan.scenes + plan.merging
    first = number * plan.cycles * size
    pool: list[int] = []
    for cycle in range(plan.cycles):
        changed = way.has_changed(cycle, plan.cycles)
        own = range(first + cycle * size, first + (cycle + 1) * size)
        for index in own:
            _show(store, scenes, index, reduced, way, changed)
        inducing, judging = list(own)[: plan.scenes], list(own)[plan.scenes :]
        numbers = store.scenes()
        place = {index: numbers[index - first] for index in own}
        pool += [place[index] for index in inducing]
        used = pool[-plan.pool :] if way.pooled else [place[index] for index in inducing]
        numbered = _Numbers(used, [place[i] for i in judging], list(place.values()))
        order = _order(store, reduced, way, numbered, seed + cycle)
        report = LearningEngine().learn(order)
        taken = {axiom.id for axiom in reduced.axioms}
        store.finish_cycle(changes_of_cycle(report, store, taken), numbered.new)
        strengths.append({each.id: each.strength.value for each in store.axioms("active")})
    lives = _judged(description, scenes, way, plan, store, strengths)
    store.close()
    return replace(lives, number=number)


@dataclass(frozen=True)
class _Numbers:
    """Numbers of the scenes of a cycle in the store: to learn from, to judge by, all new ones."""

    inducing: list[int]
    judging: list[int]
    new: list[int]


def _show(
    store: LearnerStore,
    scenes: Scenes,
    index: int,
    given: SystemDescription,
    way: Way,
    changed: bool,
) -> None:
    """Puts a scene into the store, with what the axioms in force decide of it."""
    literals, used = [], []
    state = None
    in_force = _axioms_in_force(store, given)
    for fluent, several in scenes.items():
        for each in several[index]:
            label = each.label or (changed and fluent == "stable" and _on_irregular(each))
            state = each.state
            literals.append((fluent, each.target, label, each.reason))
            about = [a for a in in_force if a.head.atom.name == fluent]
            firing = [a for a in about if holds(a, each.state, each.target)]
            surely = [a for a in firing if a.kind == "normal"]
            deciding = surely or firing
            if way.any_use or len(deciding) == 1:
                used += [(a.id, way.any_use or a.head.positive == label) for a in deciding]
    if state is not None:
        store.add_scene(f"scene-{index}", state, literals, used)


def _on_irregular(example: Example) -> bool:
    return ("irregular_below", (example.target,)) in example.state.facts


def _axioms_in_force(
    store: LearnerStore, given: SystemDescription
) -> list[StateConstraint | Default]:
    refuted = set(store.refuted())
    description = given.without(refuted)
    for each in store.axioms("active"):
        description = parse(f"{each.id}: {each.text}", each.id, description).description
    return [
        axiom
        for axiom in description.axioms
        if isinstance(axiom, StateConstraint | Default)
        and axiom.head.atom.name in FLUENTS
        and can_be_evaluated(axiom)
    ]


def _order(
    store: LearnerStore,
    given: SystemDescription,
    way: Way,
    numbers: _Numbers,
    seed: int,
) -> LearningOrder:
    refuted = set(store.refuted())
    description = given.without(refuted)
    tasks = [
        Task(
            fluent,
            # Of what was known before anybody wrote something wrong.
            frozenset(
                relevance(given.without({"given_wrong", "given_overspecified"}), task).relations
            ),
            store.examples(fluent, numbers.inducing),
            store.examples(fluent, numbers.judging),
            frozenset(each.scene_id for each in store.examples(fluent, numbers.new)),
        )
        for fluent, task in FLUENTS.items()
    ]
    return LearningOrder(
        description=description,
        learned={each.id: each.text for each in store.axioms("active")},
        pinned=frozenset(),
        vetoed=(),
        tasks=tasks,
        suspended=suspended(given, refuted),
        algorithm=way.algorithm,
        default_purity=way.default_purity,
        seed=seed,
    )


def _judged(
    description: SystemDescription,
    scenes: Scenes,
    way: Way,
    plan: Plan,
    store: LearnerStore,
    strengths: Sequence[dict[str, float]],
) -> Lives:
    """Holds all axioms that ever were against scenes that nobody learned from."""
    reduced = description.without(withheld_ids(description))
    lives = []
    for fluent, several in scenes.items():
        examples = [each for scene in several[-plan.judging :] for each in scene]
        if way.has_changed(plan.cycles - 1, plan.cycles) and fluent == "stable":
            examples = [replace(e, label=e.label or _on_irregular(e)) for e in examples]
        judge = Judge(description, fluent, examples)
        for stored in store.axioms():
            axiom = parse(f"{stored.id}: {stored.text}", stored.id, reduced).description.axioms[-1]
            if not isinstance(axiom, StateConstraint | Default) or axiom.head.atom.name != fluent:
                continue
            (judged,) = judge.score([axiom]).judged
            lives.append(
                Life(
                    text=stored.text,
                    kind=stored.kind,
                    born=stored.born,
                    ended=next(
                        (
                            f"{event.what} in cycle {event.cycle}: "
                            + event.words.removeprefix("dropped: ")
                            for event in store.history(stored.id)
                            if event.what in ENDS
                        ),
                        None,
                    ),
                    strengths=tuple(each.get(stored.id) for each in strengths),
                    true=judged.true,
                    truth=judged.truth,
                    equals=judged.equals,
                )
            )
    restored = [event.axiom for event in store.history() if event.what == "restored"]
    return Lives(way.name, 0, tuple(lives), store.refuted(), tuple(restored))
