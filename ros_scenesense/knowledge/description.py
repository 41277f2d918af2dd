"""A domain: its system description, its goals, and the history of what was seen and done."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from ros_scenesense.knowledge.axioms import Axiom
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.terms import Place, Symbol


class Quantity(StrEnum):
    """How many instances of a literal a goal asks for; its variables range over their sorts.

    `TRUE`: the literal, which has no variables, is believed. `NO`: no instance is believed.
    `ALL`: every instance is. `FEWEST`: not a condition but a preference, as few as possible.
    """

    TRUE = "true"
    NO = "no"
    ALL = "all"
    FEWEST = "fewest"


@dataclass(frozen=True)
class GoalCondition:
    """One part of a goal, e.g. `no occluded(X)` or `-occluded(red_box)`."""

    quantity: Quantity
    literal: Literal

    def __str__(self) -> str:
        if self.quantity is Quantity.TRUE:
            return str(self.literal)
        return f"{self.quantity} {self.literal}"


@dataclass(frozen=True)
class Goal:
    """What a plan is to achieve; without a name if somebody asked for it just now."""

    conditions: tuple[GoalCondition, ...]
    name: str = ""
    words: str = ""
    place: Place | None = field(default=None, compare=False, repr=False)

    def __str__(self) -> str:
        return ", ".join(map(str, self.conditions))


@dataclass(frozen=True)
class SystemDescription:
    """Signature and axioms, the values of statics, and the goals that have a name.

    Attributes:
        signature: Sorts, statics, fluents, actions.
        axioms: In the order of the text. Axioms of one id are switched together.
        facts: Literals of statics that are known, without variables.
        goals: By name.
        source: Where it comes from, for messages.
    """

    signature: Signature
    axioms: tuple[Axiom, ...] = ()
    facts: tuple[Literal, ...] = ()
    goals: Mapping[str, Goal] = field(default_factory=dict)
    source: str = "domain"

    @property
    def ids(self) -> tuple[str, ...]:
        """The ids of the axioms, each once, in order."""
        return tuple(dict.fromkeys(axiom.id for axiom in self.axioms))

    def axioms_of(self, identifier: str) -> tuple[Axiom, ...]:
        """The axioms of an id; usually one."""
        return tuple(axiom for axiom in self.axioms if axiom.id == identifier)

    def without(self, ids: Collection[str]) -> SystemDescription:
        """The same description without the axioms of these ids."""
        return replace(self, axioms=tuple(each for each in self.axioms if each.id not in ids))

    def with_axioms(self, axioms: Iterable[Axiom]) -> SystemDescription:
        """The same description with more axioms, e.g. learned ones."""
        return replace(self, axioms=(*self.axioms, *axioms))

    def with_facts(self, facts: Iterable[Literal]) -> SystemDescription:
        """The same description with more values of statics."""
        return replace(self, facts=tuple(dict.fromkeys((*self.facts, *facts))))

    def with_members(self, sort: str, symbols: Iterable[Symbol]) -> SystemDescription:
        """The same description with more members of a sort, e.g. the objects of a scene."""
        return replace(self, signature=self.signature.with_members(sort, symbols))


@dataclass(frozen=True)
class Observation:
    """`obs(fluent, value, step)`: the fluent was seen to be true or false at a step."""

    fluent: Atom
    value: bool
    step: int

    def __str__(self) -> str:
        return f"obs({self.fluent}, {str(self.value).lower()}, {self.step})."


@dataclass(frozen=True)
class Happened:
    """`hpd(action, step)`: the action was executed at a step."""

    action: Atom
    step: int

    def __str__(self) -> str:
        return f"hpd({self.action}, {self.step})."


@dataclass(frozen=True)
class History:
    """What was seen and done; what held initially without doubt. All without variables."""

    observations: tuple[Observation, ...] = ()
    happened: tuple[Happened, ...] = ()
    initial: tuple[Literal, ...] = ()

    @property
    def last_step(self) -> int:
        """The step after the last action, or of the last observation: where the robot is now."""
        after = [each.step + 1 for each in self.happened]
        return max([0, *after, *(each.step for each in self.observations)])
