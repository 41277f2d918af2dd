"""The story of how the robot pursued goals: plans, actions, what came of them, what it learned.

Topics do not arrive in the order in which things happened. A plan is told after the action that it
reacts to, and the outcome of an action before all that follows from it. No ROS: the observer feeds
it, tests too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from ros_scenesense.demo.record import Image, RunRecord
from ros_scenesense.messages.actions import Plan, StateLiteral, Transition
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.learning import Axioms, JobProgress, LearnedAxiom
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.stages.outcomes import OBSERVED
from ros_scenesense.stages.protocol import Timing

STORY_MESSAGES = (Plan, Transition, JobProgress)
"""What a story needs besides what every report does."""


@dataclass(frozen=True)
class Chapter:
    """Words between two parts of the story: a title, and what is told of it."""

    title: str
    words: str = ""


@dataclass(frozen=True)
class Planned:
    """A plan, with the reason why it was made anew."""

    plan: Plan


@dataclass(frozen=True)
class Done:
    """An action and what came of it.

    Attributes:
        transition: What was observed.
        missed: What should have come of it and was not seen.
        seen: What was seen instead.
    """

    transition: Transition
    missed: tuple[str, ...]
    seen: tuple[str, ...]

    @property
    def is_expected(self) -> bool:
        """Whether it was executed and everything came as expected."""
        return self.transition.outcome == "executed" and not self.missed and not self.seen


@dataclass(frozen=True)
class Learned:
    """What a learning cycle has added."""

    cycle: int
    axioms: tuple[LearnedAxiom, ...]


@dataclass(frozen=True)
class Ended:
    """The last word on a goal."""

    plan: Plan


Entry = Chapter | Planned | Done | Learned | Ended


@dataclass
class Attempt:
    """One goal that was pursued.

    Attributes:
        goal: What was to hold.
        plans: All plans, the first one first.
        steps: What was done.
        end: The last word; None before it.
    """

    goal: str = ""
    plans: list[Plan] = field(default_factory=list)
    steps: list[Done] = field(default_factory=list)
    end: Plan | None = None

    @property
    def is_reached(self) -> bool:
        """Whether the goal was reached."""
        return self.end is not None and self.end.outcome == "reached"

    @property
    def surprises(self) -> list[Done]:
        """The actions of which something else came than was expected."""
        return [step for step in self.steps if not step.is_expected]


class Story:
    """Everything that was seen of a session with goals.

    Args:
        told: Called with every entry, in the order of the story.

    Attributes:
        run: The scenes, their images, and all else that every report shows.
        entries: What happened, in order.
        axioms: The learned axioms, as the learner said them last.
        cycle: Learning cycles so far.
    """

    def __init__(self, told: Callable[[Entry], None] = lambda _entry: None) -> None:
        self.run = RunRecord(None)
        self.entries: list[Entry] = []
        self.axioms: list[LearnedAxiom] = []
        self.cycle = 0
        self._cycles: dict[str, JobProgress] = {}
        self._learned_at_ns = 0
        self._told = told
        self._known: set[str] = set()
        self._waiting: list[Plan] = []
        self._steps: set[tuple[str, str]] = set()

    def take(self, item: AnyMessage | Image | Timing, now_ns: int) -> None:
        """Takes what was received."""
        match item:
            case Plan():
                self._waiting.append(item)
                self._tell_plans()
            case Transition():
                self._take_transition(item)
            case Axioms():
                self._take_axioms(item)
            case JobProgress(node="axiom_learner"):
                self._cycles[item.job_id] = item
            case _:
                self.run.take(item, now_ns)
                if self._waiting and isinstance(item, Scene):
                    self._tell_plans()

    def tell(self, entry: Entry) -> None:
        """Adds an entry."""
        self.entries.append(entry)
        self._told(entry)

    @property
    def failed_cycle(self) -> str | None:
        """Why a learning cycle failed; None if none did."""
        return next((each.text for each in self._cycles.values() if each.state == "failed"), None)

    @property
    def cycles_are_over(self) -> bool:
        """Whether the learner has finished all cycles that it began, and has said what it learned.

        The end of a cycle and its axioms are said on two topics, with one stamp.
        """
        ends = [each.stamp.nanoseconds for each in self._cycles.values() if each.state != "running"]
        return 0 < len(ends) == len(self._cycles) and max(ends) <= self._learned_at_ns

    @property
    def is_in_force(self) -> bool:
        """Whether the reasoner knows of the learned axioms exactly those that there are now."""
        known = self.run.knowledge
        learned = {each.id for each in known.axioms if each.origin == "learned"} if known else set()
        return learned == {each.id for each in self.axioms}

    def attempts(self) -> list[Attempt]:
        """The goals, in the order in which they were given."""
        return list(self._attempts())

    def _attempts(self) -> Iterator[Attempt]:
        attempts: dict[str, Attempt] = {}
        for entry in self.entries:
            match entry:
                case Planned(plan) | Ended(plan):
                    attempt = attempts.setdefault(plan.id, Attempt())
                    attempt.goal = plan.goal
                    if isinstance(entry, Ended):
                        attempt.end = plan
                    else:
                        attempt.plans.append(plan)
                case Done(transition):
                    attempts.setdefault(transition.episode_id, Attempt()).steps.append(entry)
        yield from attempts.values()

    def _take_transition(self, transition: Transition) -> None:
        key = (transition.episode_id, transition.id)
        if key in self._steps:
            return
        self._steps.add(key)
        # The plan that asked for it is older, though it may have come later.
        self._tell_plans(all_of=transition.episode_id, until=transition.scene_before)
        missed, seen = surprises(transition)
        self.tell(Done(transition, missed, seen))
        self._tell_plans()

    def _tell_plans(self, all_of: str | None = None, until: str | None = None) -> None:
        """Tells plans whose scenes have been told of."""
        waiting, self._waiting = self._waiting, []
        for plan in waiting:
            if self._is_next(plan) or (all_of == plan.id and until == plan.scene_id):
                self.tell(Planned(plan) if plan.outcome == "found" else Ended(plan))
            else:
                self._waiting.append(plan)

    def _is_next(self, plan: Plan) -> bool:
        scene = self.run.scenes.get(plan.scene_id)
        begun = any(isinstance(e, Planned) and e.plan.id == plan.id for e in self.entries)
        shown = {e.transition.scene_after for e in self.entries if isinstance(e, Done)}
        announced = None if scene is None else scene.scene
        fresh = announced is not None and announced.episode_id != plan.id
        return plan.scene_id in shown or not begun or fresh

    def _take_axioms(self, message: Axioms) -> None:
        self.axioms = message.axioms
        self._learned_at_ns = message.stamp.nanoseconds
        new = tuple(each for each in message.axioms if each.id not in self._known)
        self._known |= {each.id for each in message.axioms}
        if message.cycle > self.cycle:
            self.cycle = message.cycle
            self.tell(Learned(message.cycle, new))


def surprises(transition: Transition) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What should have come of an action and was not seen, and what was seen instead."""
    if transition.outcome == "refused":
        return (), ()
    expected, after = _observed(transition.expected), _observed(transition.after)
    located = {each.arguments[0] for each in transition.after if each.fluent == "on" and each.holds}
    missed = {
        words for words, fluent, first in expected - after if fluent != "on" or first in located
    }
    known = {each.arguments[0] for each in transition.expected if each.fluent == "on"}
    seen = {words for words, fluent, first in after - expected if fluent != "on" or first in known}
    return tuple(sorted(missed)), tuple(sorted(seen))


def _observed(literals: list[StateLiteral]) -> set[tuple[str, str, str]]:
    return {
        (f"{each.fluent}({', '.join(each.arguments)})", each.fluent, each.arguments[0])
        for each in literals
        if each.fluent in OBSERVED and each.holds
    }
