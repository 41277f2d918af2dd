"""Trials of the experiment on planning: one state, its goals, all plans and the chosen one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from ros_scenesense.experiments.planning_goals import (
    Actions,
    GoalKind,
    Wanted,
    draw_goals,
    is_possible,
)
from ros_scenesense.experiments.planning_knowledge import Knowledge
from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.reasoning.planning import Aim, PlanningLimits, plan
from ros_scenesense.reasoning.situations import Situation
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.configuration import SimulationConfiguration
from ros_scenesense.simulation.engine import SimulatedScene
from ros_scenesense.simulation.rehearsal import Rehearsal
from ros_scenesense.simulation.scene_files import read_scenes
from ros_scenesense.simulation.wish import Wish
from ros_scenesense.stages.true_scenes import true_scene

Way = Literal["with", "without"]
WAYS: tuple[Way, Way] = ("with", "without")
PlanKind = Literal["optimal", "suboptimal", "incorrect"]
KINDS: tuple[PlanKind, ...] = ("optimal", "suboptimal", "incorrect")
SLACKS = (0, 2)
"""All plans are counted that are at most so much longer than the best one."""


@dataclass(frozen=True)
class Limits:
    """How much is done.

    Attributes:
        goals: Of each state.
        longest: Goals whose best plan has more actions are drawn anew.
        plans: All plans are counted up to this number.
        executed: So many of them are executed, drawn at random if there are more.
    """

    goals: int = 5
    longest: int = 6
    plans: int = 5000
    executed: int = 12


@dataclass(frozen=True)
class Judged:
    """Plans by what executing them has shown: how many of each kind."""

    optimal: int = 0
    suboptimal: int = 0
    incorrect: int = 0

    @property
    def total(self) -> int:
        """How many there are."""
        return self.optimal + self.suboptimal + self.incorrect

    def share(self, kind: PlanKind) -> float:
        """Share of one kind."""
        count = {
            "optimal": self.optimal,
            "suboptimal": self.suboptimal,
            "incorrect": self.incorrect,
        }[kind]
        return count / self.total if self.total else 0.0


@dataclass(frozen=True)
class AllPlans:
    """All plans of one way up to a length.

    Attributes:
        count: How many; at most as many as are counted.
        complete: Whether there are no more.
        seconds: CPU time to find them.
        judged: Those that were executed.
    """

    count: int
    complete: bool
    seconds: float
    judged: Judged


@dataclass(frozen=True)
class Trial:
    """One goal in one state.

    Attributes:
        kind: Of the goal.
        goal: In the language of the domain.
        length: Actions of the best plan with the learned axioms: fewest exceptions, then shortest.
        plans: All plans by way and slack.
        chosen: What became of the chosen plan by way, for a careful hand.
        careless: The same for a hand as careless as the one that built the scene.
        expressible: Whether there is a plan if all learned axioms are missing.
    """

    kind: GoalKind
    goal: str
    length: int
    plans: Mapping[tuple[Way, int], AllPlans]
    chosen: Mapping[Way, Judged]
    careless: Mapping[Way, Judged]
    expressible: bool


@dataclass(frozen=True)
class Candidate:
    """A goal that was drawn: whether the simulator can do it, and whether each way has a plan."""

    possible: bool
    planned: Mapping[Way, bool]


@dataclass(frozen=True)
class StateTrials:
    """All trials of a state, and all goals that were drawn for it."""

    index: int
    trials: tuple[Trial, ...]
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True)
class Start:
    """Where to look for a state: the number of a drawn scene, or the file of a written one."""

    seed: int
    index: int
    file: Path | None = None


def run_state(start: Start, knowledge: Knowledge, limits: Limits) -> StateTrials | None:
    """Runs the trials of a state.

    Returns:
        None if it is no state to begin in: something does not surely stay where it is, or it has
        too few goals.
    """
    with closing(Rehearsal(SimulationConfiguration(shadows=False))) as rehearsal:
        scene = _scene(rehearsal, start)
        if scene is None:
            return None
        return _Runner(rehearsal, scene, start, knowledge, limits).run()


def _scene(rehearsal: Rehearsal, start: Start) -> SimulatedScene | None:
    if start.file is not None:
        (file,) = read_scenes(start.file)
        scene = rehearsal.written(file)
    else:
        scene = rehearsal.scene(start.seed, start.index, Wish(stable=True))
    steady = all(each.stable is Truth.TRUE for each in scene.object_labels)
    cluttered = start.file is not None or len(scene.objects) >= _CLUTTERED
    return scene if steady and cluttered else None


class _Runner:
    """Draws goals for a state and runs a trial with each."""

    def __init__(
        self,
        rehearsal: Rehearsal,
        scene: SimulatedScene,
        start: Start,
        knowledge: Knowledge,
        limits: Limits,
    ) -> None:
        self._rehearsal, self._scene, self._start = rehearsal, scene, start
        self._limits = limits
        self._rng = np.random.default_rng([start.seed, start.index, *b"planning"])
        known = true_scene(scene)
        domain = knowledge.description
        self._situations: dict[Way, Situation] = {
            "with": Situation(domain, known),
            "without": Situation(domain, known, knowledge.about_stability),
        }
        self._ignorant = Situation(domain, known, knowledge.learned)

    def run(self) -> StateTrials | None:
        trials: list[Trial] = []
        candidates: list[Candidate] = []
        for wanted in draw_goals(self._scene, self._rng):
            possible = is_possible(wanted, self._scene, self._rehearsal)
            chosen = {way: self._chosen(each, wanted) for way, each in self._situations.items()}
            candidates.append(
                Candidate(possible, {way: bool(actions) for way, actions in chosen.items()})
            )
            length = len(chosen["with"])
            if possible and all(chosen.values()) and length <= self._limits.longest:
                trials.append(self._trial(wanted, chosen))
            if len(trials) == self._limits.goals:
                return StateTrials(self._start.index, tuple(trials), tuple(candidates))
        return None

    def _chosen(self, situation: Situation, wanted: Wanted) -> Actions:
        """The plan of fewest exceptions, then fewest actions; empty if there is none."""
        limits = PlanningLimits(
            Aim.OPTIMAL, max_steps=self._limits.longest + 4, time_limit_s=_PATIENCE_S
        )
        planning = plan(situation.task(situation.goal(wanted.text)), limits)
        return _actions(situation, planning.plans[0].actions) if planning.plans else ()

    def _trial(self, wanted: Wanted, chosen: Mapping[Way, Actions]) -> Trial:
        length = len(chosen["with"])
        found = {
            (way, slack): self._all(situation, wanted, length + slack)
            for slack in SLACKS
            for way, situation in self._situations.items()
        }
        executed = {key: self._some(plans) for key, (plans, _, _) in found.items()}
        everything = {each for several in (*executed.values(), chosen.values()) for each in several}
        lengths = {each: len(each) for each in everything if self._reaches(wanted, each)}
        least = min(lengths.values(), default=0)
        judge = partial(_judged, lengths, least)
        return Trial(
            wanted.kind,
            wanted.text,
            length,
            {
                key: AllPlans(len(plans), complete, seconds, judge(executed[key]))
                for key, (plans, complete, seconds) in found.items()
            },
            {way: judge([actions]) for way, actions in chosen.items()},
            self._carelessly(wanted, chosen, least),
            bool(self._chosen(self._ignorant, wanted)),
        )

    def _all(
        self, situation: Situation, wanted: Wanted, horizon: int
    ) -> tuple[list[Actions], bool, float]:
        """All plans within a horizon, whether these are all, and the CPU time."""
        limits = PlanningLimits(
            Aim.HORIZON,
            every=True,
            horizon=horizon,
            max_plans=self._limits.plans,
            time_limit_s=_PATIENCE_S,
        )
        planning = plan(situation.task(situation.goal(wanted.text)), limits)
        # Where defaults contradict each other, one plan may lead to several answer sets.
        plans = dict.fromkeys(_actions(situation, each.actions) for each in planning.plans)
        return list(plans), planning.complete, planning.seconds

    def _some(self, plans: Sequence[Actions]) -> list[Actions]:
        order = self._rng.permutation(len(plans))[: self._limits.executed]
        return [plans[int(index)] for index in order]

    def _carelessly(
        self, wanted: Wanted, chosen: Mapping[Way, Actions], least: int
    ) -> dict[Way, Judged]:
        lengths = {
            each: len(each) for each in chosen.values() if self._reaches(wanted, each, False)
        }
        return {way: _judged(lengths, least, [actions]) for way, actions in chosen.items()}

    def _reaches(self, wanted: Wanted, actions: Actions, careful: bool = True) -> bool:
        return wanted.reached(self._rehearsal.attempt(actions, wanted.looks, careful))


# So many objects clutter a table; a drawn scene has no more.
_CLUTTERED = 5
# Plans are counted up to a number, not for a time: then the machine makes no difference.
_PATIENCE_S = 600.0


def _actions(situation: Situation, atoms: Sequence[Atom]) -> Actions:
    return tuple(map(situation.planned, atoms))


def _judged(lengths: Mapping[Actions, int], least: int, plans: Sequence[Actions]) -> Judged:
    """How many are correct with the least number of actions, correct but longer, or neither."""
    correct = [lengths[each] for each in plans if each in lengths]
    optimal = sum(length <= least for length in correct)
    return Judged(optimal, len(correct) - optimal, len(plans) - len(correct))
