"""Experiment on what learned axioms are good for: hypothesis H4 of the paper, its second part.

Paper, experiment six. Axioms are learned from labelled scenes; in 40 other states, with five goals
each, the planner finds all plans with and without them, and chooses one. Every plan is judged by
executing it in the physics simulation. Added to the paper: whether reasoning decides more of other
scenes rightly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial

from ros_scenesense.errors import LearningError
from ros_scenesense.experiments.axioms_scenes import ExactScenes, domain, read_records
from ros_scenesense.experiments.options import Options, dataset_of
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.experiments.planning_accuracy import accuracies
from ros_scenesense.experiments.planning_knowledge import Knowledge, learn, truths
from ros_scenesense.experiments.planning_report import Findings, report_on
from ros_scenesense.experiments.planning_trials import Limits, Start, StateTrials, run_state
from ros_scenesense.resources import resource
from ros_scenesense.simulation.dataset.workers import run_by_workers


@dataclass(frozen=True)
class Plan:
    """How many scenes to learn from, to choose between versions, and to judge decisions by.

    Attributes:
        learning: Scenes to learn from.
        merging: Scenes that choose between versions of axioms.
        judging: Scenes on which reasoning is judged.
        states: States to plan in.
        limits: Of each state.
    """

    learning: int = 590
    merging: int = 10
    judging: int = 600
    states: int = 40
    limits: Limits = field(default_factory=Limits)

    @property
    def needed(self) -> int:
        """All labelled scenes."""
        return self.learning + self.merging + self.judging


QUICK = Plan(110, 10, 60, 3, Limits(plans=200, executed=4))


def conduct(options: Options, say: Callable[[str], None]) -> Outcome:
    """Runs the experiment.

    Raises:
        DatasetError: If the dataset is not there or has too few scenes, or a worker dies.
        LearningError: If what was learned leaves too few states with goals.
        SimulationError: If the scenes to plan in cannot be made.
    """
    plan = QUICK if options.quick else Plan()
    with dataset_of(options, plan.needed, say) as folder:
        records = read_records(folder, plan.needed)
    scenes = ExactScenes(domain()).read(records)
    count = plan.learning + plan.merging
    knowledge = learn(scenes, range(plan.learning), range(plan.learning, count), options.seed)
    judging = range(plan.needed - plan.judging, plan.needed)
    say(f"{len(knowledge.learned)} axioms learned from {count} scenes")
    decided = accuracies(knowledge, [records[number] for number in judging])
    say(f"reasoning judged on {plan.judging} scenes")
    states = _states(plan, knowledge, options, say)
    return report_on(
        Findings(
            options.command,
            options.seed,
            (plan.learning, plan.merging, plan.judging),
            plan.limits,
            knowledge,
            truths(knowledge, scenes, judging),
            decided,
            states,
        )
    )


def _states(
    plan: Plan, knowledge: Knowledge, options: Options, say: Callable[[str], None]
) -> list[StateTrials]:
    """As many states as are wanted; where there are no five goals, the next one is taken.

    Raises:
        LearningError: If there are not enough of them.
    """
    states: list[StateTrials] = []
    run = partial(run_state, knowledge=knowledge, limits=plan.limits)
    with closing(run_by_workers(run, _starts(options.seed, plan.states), options.jobs)) as results:
        for trials in filter(None, results):
            states.append(trials)
            if len(states) % 5 == 0:
                say(f"{len(states)} of {plan.states} states planned in")
            if len(states) == plan.states:
                return states
    raise LearningError(
        f"only {len(states)} of {plan.states} states have goals with plans by the learned axioms: "
        "learn from another dataset, or from one of another seed"
    )


def _starts(seed: int, wanted: int) -> Iterator[Start]:
    """The scene of the paper's example, then drawn ones, many more than are wanted."""
    yield Start(seed, 0, resource("config", "scenes/planning.yaml"))
    for index in range(_DRAWN * wanted):
        # Of another seed than the scenes that were learned from.
        yield Start(seed + 1_000_003, index)


# Two of three drawn scenes have fewer than five objects, or something in them is not steady.
_DRAWN = 25
