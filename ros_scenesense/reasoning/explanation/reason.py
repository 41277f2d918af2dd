"""An explanation as people and programs get it: a tree of reasons without any solver in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any


class Role(StrEnum):
    """What a reason says of its literal.

    - `concluded`: an axiom concludes it from the reasons below.
    - `known`: it was perceived, given or measured.
    - `assumed`: nothing forces it; it was chosen, as an action of a plan or an exception to a
      default is.
    - `absent`: a literal under `not` that indeed does not hold.
    - `condition`: a comparison or the like that is true.
    - `holds`: it holds; why is not told here.
    - `missing`: it does not hold; below are the axioms that could have concluded it.
    - `attempt`: an axiom that could have concluded it; below is how far its body holds.
    - `blocked`: a literal under `not` fails, since what is below holds.
    - `untrue`: a comparison or the like that is not true.
    """

    CONCLUDED = "concluded"
    KNOWN = "known"
    ASSUMED = "assumed"
    ABSENT = "absent"
    CONDITION = "condition"
    HOLDS = "holds"
    MISSING = "missing"
    ATTEMPT = "attempt"
    BLOCKED = "blocked"
    UNTRUE = "untrue"


@dataclass(frozen=True)
class Reason:
    """A node of an explanation.

    Attributes:
        literal: The literal, in the action language.
        role: What the node says of it.
        axiom: Id of the axiom concerned.
        words: The axiom in words, or what there is to say about the literal.
        source: Who said so: qsr, msr, human, given, measured.
        confidence: How sure the source was, from 0 to 1; None if it did not say.
        reasons: The reasons for this one.
        repeated: Whether the reasons are left out, because the tree tells them further up.
    """

    literal: str
    role: Role
    axiom: str | None = None
    words: str = ""
    source: str = ""
    confidence: float | None = None
    reasons: tuple[Reason, ...] = ()
    repeated: bool = False

    def walk(self, depth: int = 0) -> Iterator[tuple[int, Reason]]:
        """The nodes in pre-order, each with its depth."""
        yield depth, self
        for each in self.reasons:
            yield from each.walk(depth + 1)

    def as_json(self) -> dict[str, Any]:
        """The tree as plain values; what is empty is left out."""
        values = {
            "literal": self.literal,
            "role": str(self.role),
            "axiom": self.axiom,
            "words": self.words,
            "source": self.source,
            "confidence": self.confidence,
            "repeated": self.repeated,
            "reasons": [each.as_json() for each in self.reasons],
        }
        return {name: value for name, value in values.items() if value not in (None, "", [], False)}
