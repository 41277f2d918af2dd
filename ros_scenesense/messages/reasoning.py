"""Beliefs, verdicts, knowledge, and the questions that people may ask."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from ros_scenesense.messages.base import (
    Count,
    HumanMessage,
    Identifier,
    Message,
    Name,
    Part,
    Probability,
    SceneMessage,
    Text,
)
from ros_scenesense.scene import DecisionStatus, Task, Truth


class Belief(Part, frozen=True):
    """What reasoning decided about one literal.

    `value` is None unless the status is `strict` or `by_default`. `axioms` are the ids of the
    axioms that derived it (both sides' axioms when inconsistent). `why` is the short explanation:
    the first normal one of these axioms, else the first, and what it rests on.
    """

    status: DecisionStatus
    value: bool | None = None
    axioms: list[Name] = []
    why: Text = ""


class ObjectBelief(Part, frozen=True):
    """Beliefs about one object."""

    name: Name
    stable: Belief
    occluded: Belief


class StructureBelief(Part, frozen=True):
    """Belief about one structure, keyed by its sorted members."""

    members: list[Name]
    stable: Belief


class DerivedRelation(Part, frozen=True):
    """A relation that axioms derived from perceived ones, e.g. `on`."""

    relation: Name
    object: Name
    reference: Name


class RetractedRelation(Part, frozen=True):
    """A perceived relation that contradicts the knowledge or other relations: not believed."""

    relation: Name
    object: Name
    reference: Name
    confidence: Probability
    source: Text = ""


class Beliefs(SceneMessage, frozen=True, tag="beliefs/1"):
    """All decisions about a scene, once per scene, and the revisions they rest on.

    `retracted` are the fewest perceived relations, the least trusted first, without which the scene
    is consistent; where several explanations are equally good, those of all of them, and the
    decisions hold whichever is right. `conflict` says in words what contradicts each other where no
    retraction helps.
    """

    objects: list[ObjectBelief]
    structures: list[StructureBelief]
    derived: list[DerivedRelation]
    knowledge_revision: Name
    trust_revision: Count
    retracted: list[RetractedRelation] = []
    conflict: Text = ""


class Verdict(Part, frozen=True):
    """One belief held against its label.

    `verdict` is `undecided` where reasoning did not decide, `unjudged` where the label is
    ambiguous or missing. `subject` is one object, or the sorted members of a structure.
    """

    task: Task
    subject: list[Name]
    kind: Literal["object", "structure"]
    status: DecisionStatus
    value: bool | None
    label: Truth | None
    verdict: Literal["right", "wrong", "undecided", "unjudged"]


class Verdicts(SceneMessage, frozen=True, tag="verdicts/1"):
    """Right or wrong, for every object and structure of a labelled scene."""

    use: Literal["train", "evaluate"]
    verdicts: list[Verdict]


class KnownAxiom(Part, frozen=True):
    """An axiom in force: its text for people, its kind and where it comes from.

    `statement` is its text in the action language, without its id.
    """

    id: Name
    text: Text
    statement: Text
    kind: Literal["normal", "default"]
    origin: Literal["given", "learned"]


class Knowledge(Message, frozen=True, tag="knowledge/1"):
    """State: the active axioms. `revision` changes if and only if they do."""

    revision: Name
    axioms: list[KnownAxiom]


class Query(HumanMessage, frozen=True, tag="query/1"):
    """Why, or why not, does this literal hold (in this scene, else in the newest)?"""

    literal: Annotated[str, msgspec.Meta(min_length=1, max_length=4096)]
    why: Literal["why", "why_not"] = "why"
    scene_id: Identifier | None = None


class ExplanationStep(Part, frozen=True):
    """A node of an explanation in pre-order.

    `role` says what the node says of its literal: `concluded` by an axiom, `known` from a source,
    `assumed`, `absent`, `condition`, `holds`; or, where the explanation is why not, `missing`,
    `attempt` (an axiom that might have concluded it), `blocked`, `untrue`. `repeated` stands for
    reasons that were told before.
    """

    depth: Count
    literal: Text
    role: Name
    axiom: Name | None = None
    source: Name | None = None
    confidence: Probability | None = None
    words: Text = ""
    repeated: bool = False


class Explanation(Message, frozen=True, tag="explanation/1"):
    """The answer to a query, as a tree and in words.

    `holds` tells whether the literal holds, None if the query was refused; then `text` says why.
    Where `truncated`, the tree is longer than the steps.
    """

    id: Identifier
    scene_id: Identifier | None
    literal: Text
    outcome: Literal["explained", "refused"]
    holds: bool | None
    steps: list[ExplanationStep]
    text: Text
    truncated: bool = False
