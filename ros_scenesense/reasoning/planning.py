"""Planning: which actions lead from a state to a goal (paper, helper axioms for planning).

The program of `knowledge.transition_program` grows step by step until the goal can hold; so the
first plans that are found are the shortest. What a plan is best by is one of three `Aim`s; all
plans that are equally good can be enumerated.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, cast

import clingo

from ros_scenesense.knowledge.description import Goal, Quantity, SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.transition_program import (
    PRIORITY_FEWEST,
    PRIORITY_TIE,
    PRIORITY_UNSURE,
    TransitionProgram,
)
from ros_scenesense.reasoning.atoms import atom_of, literal_of
from ros_scenesense.reasoning.patience import Patience
from ros_scenesense.reasoning.program import Messages


class Aim(StrEnum):
    """What a plan is best by.

    `SHORTEST`: length, then exceptions to defaults. `OPTIMAL`: exceptions, then length, over up to
    `slack` more steps than the shortest plan has. `HORIZON`: exceptions alone, among all plans that
    reach the goal for the first time within `horizon` steps, as in the paper's helper axioms.
    """

    SHORTEST = "shortest"
    OPTIMAL = "optimal"
    HORIZON = "horizon"


class PlanOutcome(StrEnum):
    """How planning ended.

    `REACHED`: the goal holds already. `NO_PLAN`: there is none up to the last step tried.
    `TIMED_OUT`: time ran out before a plan was found.
    """

    FOUND = "found"
    REACHED = "reached"
    NO_PLAN = "no_plan"
    TIMED_OUT = "timed_out"


@dataclass(frozen=True)
class PlanningTask:
    """Where to start, what to achieve, what to keep clear of.

    Attributes:
        description: The domain with the members of its sorts and the values of its statics.
        initial: What is true at first; inertial fluents that are not named are false.
        goal: To be achieved.
        avoided: Estimated literals, perhaps with variables, that no action may bring about; where
            only defaults conclude one, an exception excuses it.
        preferred: Groups of literals of which there are to be few among equally good plans, the
            first first; but before them as little as can be is to become unsure: what was surely
            not to be avoided, and is not any more.
        forbidden: Actions that cannot be the first, e.g. because they were refused.
        lenient: Whether actions may be done though something makes them impossible; plans that
            violate least are best, whatever else they are.
    """

    description: SystemDescription
    initial: tuple[Literal, ...]
    goal: Goal
    avoided: tuple[Literal, ...] = ()
    preferred: tuple[tuple[Literal, ...], ...] = ()
    forbidden: tuple[Atom, ...] = ()
    lenient: bool = False


@dataclass(frozen=True)
class PlanningLimits:
    """What to look for, and for how long.

    Attributes:
        aim: What a plan is best by.
        every: Whether to enumerate all plans that are equally good; else one is enough.
        horizon: Longest plans of the aim HORIZON.
        max_steps: Longest plans of the other aims.
        slack: How much longer than the shortest an optimal plan may be; twice as much where the
            goal asks for the fewest of something.
        max_plans: The enumeration ends here.
        time_limit_s: Searching ends here. Grounding cannot be interrupted.
    """

    aim: Aim = Aim.SHORTEST
    every: bool = False
    horizon: int = 8
    max_steps: int = 20
    slack: int = 4
    max_plans: int = 10_000
    time_limit_s: float = 10.0


@dataclass(frozen=True)
class FoundPlan:
    """A plan.

    Attributes:
        actions: In order.
        exceptions: What was avoided and only defaults conclude, with the step after which it holds.
        violations: Of a lenient task: what makes an action impossible, an axiom's id or `AVOIDED`,
            with the step after it.
        counted: How many instances of the goal's `fewest`, and of each group of preferred literals,
            hold at the end.
        unsure: How often what was surely not to be avoided is not sure any more, such as an object
            that is put where it may or may not stay; not counted within a horizon.
    """

    actions: tuple[Atom, ...]
    exceptions: tuple[tuple[Literal, int], ...] = ()
    violations: tuple[tuple[str, int], ...] = ()
    counted: tuple[int, ...] = (0, 0)
    unsure: int = 0


@dataclass(frozen=True)
class Planning:
    """The answer to a planning task.

    Attributes:
        outcome: How it ended.
        plans: Best first: by what the goal asks few of, length, what becomes unsure, what is
            preferred, their text. All have equally many exceptions.
        complete: Whether these are all the plans that were asked for.
        steps: The last step that was searched.
        seconds: CPU time it took.
    """

    outcome: PlanOutcome
    plans: tuple[FoundPlan, ...] = ()
    complete: bool = True
    steps: int = 0
    seconds: float = 0.0


def plan(task: PlanningTask, limits: PlanningLimits = PlanningLimits()) -> Planning:
    """Plans.

    Raises:
        ReasoningError: If the solver fails.
    """
    started = time.process_time()
    with Messages("planning program") as messages:
        search = _Search(task, limits, messages)
        outcome = search.run()
    plans = sorted(search.plans, key=_rank)
    return Planning(
        outcome,
        tuple(plans if limits.every else plans[:1]),
        search.complete,
        search.step,
        time.process_time() - started,
    )


def _rank(found: FoundPlan) -> tuple[int, int, int, list[int], str]:
    fewest, *preferred = found.counted
    text = ", ".join(map(str, found.actions))
    return fewest, len(found.actions), found.unsure, preferred, text


_Cost = tuple[int, int, int]
"""Violations, exceptions, and instances of what the goal asks few of."""

_NOTHING: _Cost = (0, 0, 0)


@dataclass(frozen=True)
class _Answer:
    plan: FoundPlan
    cost: _Cost


class _Search:
    """Grows the program step by step and keeps the best plans of all steps so far."""

    def __init__(self, task: PlanningTask, limits: PlanningLimits, messages: Messages) -> None:
        asked = [condition.literal for condition in task.goal.conditions]
        self._program = TransitionProgram(
            task.description,
            (*asked, *(each for group in task.preferred for each in group)),
            task.initial,
            task.avoided,
            lenient=task.lenient,
        )
        self._limits = limits
        self._lenient = task.lenient
        self._forbidding = bool(task.forbidden)
        self._improves = any(
            condition.quantity is Quantity.FEWEST for condition in task.goal.conditions
        )
        self._control = clingo.Control(logger=messages.take)
        self._patience = Patience(self._control, limits.time_limit_s)
        self._solving = cast(clingo.Configuration, self._control.configuration.solve)
        self._solving.models = limits.max_plans + 1 if limits.every else 1
        self._cost: _Cost | None = None
        self._shortest: int | None = None
        self._reader = _Reader(self._program, len(task.preferred))
        self.plans: list[FoundPlan] = []
        self.complete = True
        self.step = 0
        self._load(task)

    def run(self) -> PlanOutcome:
        """Searches; `plans` holds the best afterwards."""
        with self._patience:
            return self._run()

    def _run(self) -> PlanOutcome:
        self._grow(0)
        while self._solve() and not self._is_final() and self.step < self._last_step():
            self._grow(self.step + 1)
        if any(found.actions for found in self.plans):
            return PlanOutcome.FOUND
        if self.plans:
            return PlanOutcome.REACHED
        return PlanOutcome.NO_PLAN if self.complete else PlanOutcome.TIMED_OUT

    def _load(self, task: PlanningTask) -> None:
        program = self._program
        refused = [f":- {program.occurring(action, '1')}." for action in task.forbidden]
        parts = [
            program.text(),
            program.choice(),
            program.avoidance(),
            program.doubt(),
            program.novelty(),
            program.goal(task.goal, task.preferred),
            "#program first.",
            *refused,
            "#program base.",
            self._reader.shown(),
        ]
        self._control.add("base", [], "\n".join(parts))

    def _grow(self, step: int) -> None:
        """Grounds one more step; asks for the goal there instead of one step before."""
        query, horizon = self._program.helper("query"), self._limits.aim is Aim.HORIZON
        parts = ["state", "goal"]
        parts += ["step", "choice", "avoidance"] if step > 0 else []
        parts += ["doubt"] if step > 0 and not horizon else []
        # Plans within a horizon may be as roundabout as they like. Where an action is forbidden at
        # first, it makes a difference to be back.
        new = step > (2 if self._forbidding else 1) and not horizon
        parts += ["novelty"] if new else []
        parts += ["fewest"] if self._improves else []
        parts += [] if self._limits.every else ["tie"]
        number = [clingo.Number(step)]
        grounded = [(name, number) for name in parts]
        if step == 0:
            grounded.append(("base", []))
        else:
            before = [clingo.Number(step - 1)]
            self._control.release_external(clingo.Function(query, before))
            if horizon:
                grounded.append(("unreached", before))
        if step == 1:
            grounded.append(("first", []))
        self._control.ground(grounded)
        self._control.assign_external(clingo.Function(query, number), True)
        self.step = step

    def _solve(self) -> bool:
        """Looks for better plans of this length; False if time or patience has run out."""
        unmet = clingo.Function(self._program.helper("unmet"), [clingo.Number(self.step)])
        atom = self._control.symbolic_atoms[unmet]
        if atom is not None and atom.is_fact:
            # Grounding has shown already that the goal cannot hold here.
            self.complete &= not self._patience.is_over
            return self.complete
        self._solving.opt_mode = ",".join(["optN", *self._bound()])
        best: _Answer | None = None
        optimal: list[_Answer] = []
        with self._control.solve(yield_=True) as handle:
            for model in handle:
                # Models that only improve on the one before come first.
                best = self._reader.read(model)
                if model.optimality_proven:
                    optimal.append(best)
                    if len(optimal) + len(self.plans) > self._limits.max_plans:
                        optimal.pop()
                        self.complete = False
                        break
            self.complete &= not (handle.get().interrupted or self._patience.is_over)
        self._keep(optimal or ([best] if best is not None else []))
        return self.complete

    def _keep(self, answers: Sequence[_Answer]) -> None:
        """Takes plans of the newest length that are better than all before, or as good."""
        if not answers:
            return
        if self._shortest is None:
            self._shortest = self.step
        plans = [answer.plan for answer in answers]
        cost = answers[0].cost
        if self._cost is None or cost < self._cost:
            self._cost, self.plans = cost, plans
        elif cost == self._cost and self._limits.aim is Aim.HORIZON:
            self.plans.extend(plans)

    def _bound(self) -> Iterator[str]:
        """What plans of the next length may cost: less than the best so far, or as much.

        A bound is inclusive, and on the first priorities alone where it is shorter than they are.
        """
        if self._cost is None:
            return
        cost = list(self._cost)
        if self._limits.aim is not Aim.HORIZON:
            while cost[-1] == 0:
                cost.pop()
            cost[-1] -= 1
        yield from map(str, cost)

    def _is_final(self) -> bool:
        """Whether no longer plan can be better."""
        if self._cost is None:
            return False
        if self._limits.aim is Aim.HORIZON:
            return self._shortest == 0
        length_first = self._limits.aim is Aim.SHORTEST and not self._improves
        return (length_first and not self._lenient) or self._cost == _NOTHING

    def _last_step(self) -> int:
        if self._limits.aim is Aim.HORIZON:
            return self._limits.horizon
        if self._shortest is None:
            return self._limits.max_steps
        slack = self._limits.slack * (2 if self._improves else 1)
        return min(self._limits.max_steps, self._shortest + slack)


class _Reader:
    """Reads plans from models; thousands of plans are made of the same few atoms."""

    def __init__(self, program: TransitionProgram, groups: int) -> None:
        self._few = (PRIORITY_FEWEST, *(PRIORITY_TIE - number for number in range(groups)))
        self._names = {name: program.helper(name) for name in (*_SHOWN, "no")}
        self._kinds = {helper: name for name, helper in self._names.items()}
        self._known: dict[clingo.Symbol, tuple[str, int, Any]] = {}

    def shown(self) -> str:
        """What the models are to show."""
        lines = (f"#show {self._names[name]}/{arity}." for name, arity in _SHOWN.items())
        return "\n".join((*lines, *(f"#defined {self._names[n]}/{a}." for n, a in _SHOWN.items())))

    def read(self, model: clingo.Model) -> _Answer:
        """The plan of a model, and its cost."""
        found: dict[str, list[tuple[int, Any]]] = {name: [] for name in _SHOWN}
        for symbol in model.symbols(shown=True):
            known = self._known.get(symbol)
            if known is None:
                known = self._known[symbol] = self._meaning(symbol)
            kind, number, what = known
            found[kind].append((number, what))
        counted = [priority for priority, _ in found["counted"]]
        plan = FoundPlan(
            actions=tuple(action for _, action in sorted(found["occurs"], key=_number)),
            exceptions=tuple((each, step) for step, each in sorted(found["exception"], key=str)),
            violations=tuple((each, step) for step, each in sorted(found["violated"])),
            counted=tuple(map(counted.count, self._few)),
            unsure=counted.count(PRIORITY_UNSURE),
        )
        violations, exceptions, fewest = model.cost[:3]
        return _Answer(plan, (violations, exceptions, fewest))

    def _meaning(self, symbol: clingo.Symbol) -> tuple[str, int, Any]:
        """Kind, step or priority, and what the symbol is about."""
        kind, arguments = self._kinds[symbol.name], symbol.arguments
        if kind == "occurs":
            return kind, arguments[1].number, atom_of(arguments[0])
        if kind == "exception":
            return kind, arguments[1].number, literal_of(arguments[0], self._names["no"])
        if kind == "violated":
            return kind, arguments[1].number, arguments[0].string
        return kind, arguments[0].number, None


_SHOWN = {"occurs": 2, "exception": 2, "violated": 2, "counted": 3}


def _number(pair: tuple[int, Any]) -> int:
    return pair[0]
