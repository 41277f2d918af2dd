"""The statements of the action language (paper, *Action Language* and *Execution Trace*).

Every axiom has an id by which it is switched on and off, and its meaning in words where its author
gave them. `str` of an axiom is its statement in the action language, without id and words. A
statement with several effects (`a causes l1, l2 if ...`) gives several axioms of one id: they are
one piece of knowledge.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal as OneOf

from ros_scenesense.knowledge.literals import Atom, Belief, Condition, Literal
from ros_scenesense.knowledge.terms import Place

Kind = OneOf["normal", "default"]


@dataclass(frozen=True, kw_only=True)
class Axiom:
    """What all statements have in common.

    Attributes:
        id: Name by which it is switched and reported; letters, digits, underscores.
        body: Conditions, all of which must hold; empty for "always".
        words: What it says, for people; empty where nobody said it.
        withheld: Whether the robot does not know it from the start, but has to learn it.
        place: Where it was written.
    """

    id: str
    body: tuple[Condition, ...] = ()
    words: str = ""
    withheld: bool = False
    place: Place | None = field(default=None, compare=False, repr=False)

    @property
    def kind(self) -> Kind:
        """`default` if the axiom has exceptions, else `normal`."""
        return "normal"

    @property
    def premises(self) -> tuple[Condition, ...]:
        """The body and, for a causal law, the action that must occur."""
        return self.body

    @property
    def conclusions(self) -> tuple[Literal | Atom, ...]:
        """What stands in the head: one literal, or the actions of an executability condition."""
        raise NotImplementedError

    @property
    def _if(self) -> str:
        return f" if {', '.join(map(str, self.body))}" if self.body else ""


@dataclass(frozen=True, kw_only=True)
class StateConstraint(Axiom):
    """`head if body`: in every state in which the body holds, so does the head."""

    head: Literal

    @property
    def conclusions(self) -> tuple[Literal]:
        """The head."""
        return (self.head,)

    def __str__(self) -> str:
        return f"{self.head}{self._if}."


@dataclass(frozen=True, kw_only=True)
class CausalLaw(Axiom):
    """`action causes effect if body`: after the action the effect holds.

    The body is about the state in which the action occurs, the effect, an inertial literal, about
    the next one. Beside fluents and statics the body may speak of other actions of that step:
    `putdown(R, A, B) causes above(A, B) if not fall(A)`.
    """

    action: Atom
    effect: Literal

    @property
    def premises(self) -> tuple[Condition, ...]:
        """The action as first condition, then the body."""
        return (Belief(Literal(self.action)), *self.body)

    @property
    def conclusions(self) -> tuple[Literal]:
        """The effect."""
        return (self.effect,)

    def __str__(self) -> str:
        return f"{self.action} causes {self.effect}{self._if}."


@dataclass(frozen=True, kw_only=True)
class ExecutabilityCondition(Axiom):
    """`impossible a0, ..., ak if body`: the actions cannot occur together where the body holds."""

    actions: tuple[Atom, ...]

    @property
    def conclusions(self) -> tuple[Atom, ...]:
        """The actions."""
        return self.actions

    def __str__(self) -> str:
        return f"impossible {', '.join(map(str, self.actions))}{self._if}."


@dataclass(frozen=True, kw_only=True)
class Default(Axiom):
    """`normally head if body`: the head holds, unless its complement does.

    Its head is an estimated fluent. Its CR exception: where nothing else restores consistency, the
    complement may be believed although the body holds, at the price of one applied CR rule.
    """

    head: Literal

    @property
    def kind(self) -> Kind:
        """`default`."""
        return "default"

    @property
    def conclusions(self) -> tuple[Literal]:
        """The head."""
        return (self.head,)

    def __str__(self) -> str:
        return f"normally {self.head}{self._if}."


@dataclass(frozen=True, kw_only=True)
class InitialDefault(Axiom):
    """`initially normally head if body`: a default about the initial state, part of a history.

    Its head is an inertial or an estimated fluent; it has a CR exception like every default.
    """

    head: Literal

    @property
    def kind(self) -> Kind:
        """`default`."""
        return "default"

    @property
    def conclusions(self) -> tuple[Literal]:
        """The head."""
        return (self.head,)

    def __str__(self) -> str:
        return f"initially normally {self.head}{self._if}."
