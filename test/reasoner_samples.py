"""Small scenes as the reasoner gets them, and what it makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from ros_scenesense.geometry import Box, Pose
from ros_scenesense.messages.base import AnyMessage, Stamp
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.grounding import (
    Objects,
    PerceivedObject,
    Relation,
    Relations,
    SizeAttribute,
    SurfaceAttribute,
)
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.messages.scenes import (
    KnownObject,
    Labels,
    ObjectLabel,
    Scene,
    StructureLabel,
)
from ros_scenesense.parameters import build
from ros_scenesense.scene import (
    DecisionStatus,
    Distance,
    NamingFrame,
    Position,
    Size,
    Surface,
    Truth,
)
from ros_scenesense.stages.protocol import Outgoing
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage

T = TypeVar("T")

STAMP = Stamp.of(12_000_000_034)
BOX = Box(pose=Pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)), size=(0.1, 0.1, 0.1))
SECOND = 1_000_000_000


def stage(**values: object) -> ReasonerStage:
    return ReasonerStage(build(ReasonerConfiguration, values))


def scene(names: Sequence[str] = (), number: int = 1, **extra: object) -> Scene:
    known = [KnownObject(instance=i + 1, name=name) for i, name in enumerate(names)]
    return Scene(
        stamp=STAMP,
        scene_id=f"s-{number}",
        mode="testing",
        objects=known,
        **extra,  # type: ignore
    )


def perceived(
    name: str,
    located: bool = True,
    size: Size | None = None,
    surface: Surface | None = None,
) -> PerceivedObject:
    return PerceivedObject(
        instance=1,
        name=name,
        points=500 if located else 0,
        box=BOX if located else None,
        size=SizeAttribute(value=size, source="given") if size else None,
        surface=SurfaceAttribute(value=surface, source="measured") if surface else None,
    )


def objects(*each: PerceivedObject, number: int = 1) -> Objects:
    return Objects(stamp=STAMP, scene_id=f"s-{number}", frame_id="camera", objects=list(each))


def relation(
    one: str,
    other: str,
    position: Position = Position.ABOVE,
    distance: Distance = Distance.FAR,
    confidence: float = 0.9,
) -> Relation:
    return Relation(
        object=one,
        reference=other,
        position=position,
        position_confidence=confidence,
        position_source="qsr",
        distance=distance,
        distance_confidence=confidence,
        distance_source="qsr",
    )


def relations(
    *each: Relation, number: int = 1, frame: NamingFrame = NamingFrame.VIEWER
) -> Relations:
    return Relations(
        stamp=STAMP,
        scene_id=f"s-{number}",
        naming_frame=frame,
        relations=list(each),
        disagreements=0,
        trust_qsr=0.8,
        trust_msr=0.2,
        trust_revision=7,
    )


def labels(
    stable: dict[str, Truth],
    structures: dict[tuple[str, ...], Truth] | None = None,
    number: int = 1,
) -> Labels:
    return Labels(
        stamp=STAMP,
        scene_id=f"s-{number}",
        use="train",
        objects=[
            ObjectLabel(name=name, stable=truth, occluded=Truth.FALSE)
            for name, truth in stable.items()
        ],
        structures=[
            StructureLabel(members=list(members), stable=truth)
            for members, truth in (structures or {}).items()
        ],
    )


# A cube on a duck, and a can behind the duck.
TOWER = (
    scene(["duck", "cube", "can"]),
    objects(perceived("duck", surface=Surface.IRREGULAR), perceived("cube"), perceived("can")),
    relations(
        relation("duck", "cube", Position.BELOW, Distance.TOUCHING),
        relation("can", "duck", Position.BEHIND),
        relation("can", "cube", Position.LEFT),
    ),
)


def feed(reasoner: ReasonerStage, *items: AnyMessage) -> list[Outgoing]:
    outgoing = [message for item in items for message in reasoner.handle(item, 0)]
    for message in outgoing:
        if isinstance(message, AnyMessage):
            assert decode(encode(message), type(message)) == message
    return outgoing


def one(outgoing: Sequence[Outgoing], kind: type[T]) -> T:
    [found] = [message for message in outgoing if isinstance(message, kind)]
    return found


def status_of(beliefs: Beliefs) -> dict[str, tuple[DecisionStatus, DecisionStatus]]:
    return {each.name: (each.stable.status, each.occluded.status) for each in beliefs.objects}


def problems(reasoner: ReasonerStage) -> dict[str, str]:
    return dict(reasoner.health.take_problems())
