"""What a person can say of a pair of objects, in one form whichever way it was put."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

from ros_scenesense.messages.grounding import Feedback, RelationName
from ros_scenesense.scene import Distance, Position

Kind = Literal["position", "distance"]


@dataclass(frozen=True)
class Statement:
    """`object` is `relation` of `reference`.

    Written as in `Relation`: in the order of the names, but the contained object of `in` first.
    """

    object: str
    reference: str
    relation: Position | Distance

    @classmethod
    def of(cls, feedback: Feedback) -> Statement:
        """What a feedback says, turned if need be."""
        relation = relation_named(feedback.relation)
        names = feedback.object, feedback.reference
        if names[0] > names[1]:
            if isinstance(relation, Distance):
                return cls(names[1], names[0], relation)
            if relation.converse is not None:
                return cls(names[1], names[0], relation.converse)
        return cls(*names, relation)

    @property
    def kind(self) -> Kind:
        """Whether it is about the position or about the distance: a pair has one of each."""
        return "position" if isinstance(self.relation, Position) else "distance"

    @property
    def pair(self) -> tuple[str, str]:
        """The two names in order."""
        return min(self.object, self.reference), max(self.object, self.reference)

    def __str__(self) -> str:
        return f"{self.relation}({self.object}, {self.reference})"


def name_of(relation: Position | Distance) -> RelationName:
    """The name of a relation in messages."""
    return cast(RelationName, relation.value)


def relation_named(name: RelationName) -> Position | Distance:
    """The position or distance relation of a name."""
    return Position(name) if name in set(Position) else Distance(name)
