"""Objects, spatial relations, trust and feedback."""

from __future__ import annotations

from typing import Literal

from ros_scenesense.geometry import Box
from ros_scenesense.messages.base import (
    Count,
    HumanMessage,
    Identifier,
    InstanceId,
    Message,
    Name,
    Part,
    Probability,
    SceneMessage,
    Text,
)
from ros_scenesense.scene import Distance, NamingFrame, Position, Size, Surface

AttributeSource = Literal["given", "measured"]
RelationName = Literal[
    "in", "above", "below", "front", "behind", "right", "left", "touching", "not_touching", "far"
]


class SizeAttribute(Part, frozen=True):
    """Size class and who said so; given beats measured."""

    value: Size
    source: AttributeSource


class SurfaceAttribute(Part, frozen=True):
    """Top surface and who said so."""

    value: Surface
    source: AttributeSource


class NameAttribute(Part, frozen=True):
    """A free-text attribute (shape, colour) and who said so."""

    value: Name
    source: AttributeSource


class PerceivedObject(Part, frozen=True):
    """An object of the scene. `box` is in the camera optical frame, None if it is not located.

    An object is located if enough of its points carry depth. Of one that is not, no relation is
    known, so nothing may be concluded from the absence of its relations. None = unknown.
    """

    instance: InstanceId
    name: Name
    points: Count
    box: Box | None = None
    size: SizeAttribute | None = None
    surface: SurfaceAttribute | None = None
    shape: NameAttribute | None = None
    color: NameAttribute | None = None


class Objects(SceneMessage, frozen=True, tag="objects/1"):
    """All objects of a scene with their attributes."""

    frame_id: Name
    objects: list[PerceivedObject]


class Grounding(Part, frozen=True):
    """What one model (QSR or MSR) says of one directed pair, with confidences from 0 to 1."""

    position: Position
    position_confidence: Probability
    distance: Distance
    distance_confidence: Probability


class PairGrounding(Part, frozen=True):
    """Both models about `object` with respect to `reference`; None = the model says nothing.

    `viewer_position`: what the QSR says along the viewer's axes, if the naming axes are turned.
    """

    object: Name
    reference: Name
    qsr: Grounding | None = None
    msr: Grounding | None = None
    viewer_position: Position | None = None


class Groundings(SceneMessage, frozen=True, tag="groundings/1"):
    """Every directed pair of located objects, named in `naming_frame`.

    `viewpoint_yaw`: by so many radians, about up, the naming axes are turned to the left of the
    viewer's; known from the camera pose, or estimated from what people said.
    `applied_update` is the id of the last `msr_update` that the histograms contain.
    """

    naming_frame: NamingFrame
    pairs: list[PairGrounding]
    viewpoint_yaw: float = 0.0
    applied_update: Count = 0


class MsrSample(Part, frozen=True):
    """Evidence for the histograms: this pair of this scene stands in this relation."""

    scene_id: Identifier
    object: Name
    reference: Name
    relation: RelationName
    source: Literal["qsr", "msr", "human"]


class MsrUpdate(Message, frozen=True, tag="msr_update/1"):
    """Evidence from control to grounding; re-sent with the same id until it is applied.

    Applied once, in the order of the ids; of those below `first_pending` none will come any more.
    `agreement_dropped`: people suddenly disagree with the groundings, as if the viewpoint had
    changed: what was learned before these samples may have to count little from now on.
    A human sample replaces the one of before about the same pair and kind of relation in a scene.
    """

    id: Count
    first_pending: Count
    samples: list[MsrSample]
    agreement_dropped: bool = False


RelationSource = Literal["qsr", "msr", "human"]


class Relation(Part, frozen=True):
    """One unordered pair: its position relation and its distance relation.

    Directed as `object` with respect to `reference`. `in` puts the contained object first, every
    other pair stands in the order of the objects' names; axioms infer the converse.
    `viewer_position`: where a viewer would say it is, if the naming frame is not the viewer's and
    the direction is one on the table; who hides whom depends on it.
    """

    object: Name
    reference: Name
    position: Position
    position_confidence: Probability
    position_source: RelationSource
    distance: Distance
    distance_confidence: Probability
    distance_source: RelationSource
    viewer_position: Position | None = None


class Relations(SceneMessage, frozen=True, tag="relations/1"):
    """The relations that the control node settled on, for the reasoner.

    `disagreements` counts pairs whose two directions named relations that are not converse.
    """

    naming_frame: NamingFrame
    relations: list[Relation]
    disagreements: Count
    trust_qsr: Probability
    trust_msr: Probability
    trust_revision: Count


class KindTrust(Part, frozen=True):
    """Trust in each grounding on one kind of relation."""

    kind: Literal["containment", "vertical", "horizontal", "distance"]
    qsr: Probability
    msr: Probability


class Trust(Message, frozen=True, tag="trust/1"):
    """Trust in each grounding = share of agreement with human feedback, from a prior.

    `viewpoint_changed`: the last feedback made it likely that agreement has dropped, as it does
    when the camera moves; what was found before then counts little.
    """

    revision: Count
    qsr: Probability
    msr: Probability
    feedback_count: Count
    viewpoint_changed: bool = False
    mode: Literal["switch", "arbiter"] = "arbiter"
    kinds: list[KindTrust] = []


class Feedback(HumanMessage, frozen=True, tag="feedback/1"):
    """A person names a relation: `object` is `relation` of `reference`.

    Without `scene_id` it is about the newest scene that has both objects.
    """

    relation: RelationName
    object: Name
    reference: Name
    scene_id: Identifier | None = None


class FeedbackResult(Message, frozen=True, tag="feedback_result/1"):
    """What became of a feedback, and why; `id` is the feedback's, or a hash of its content."""

    id: Identifier
    outcome: Literal["accepted", "refused", "duplicate"]
    reason: Text
    scene_id: Identifier | None = None
