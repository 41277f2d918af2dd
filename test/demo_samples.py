"""A small run made by hand, for the tests of the demo: no ROS, no simulation."""

import numpy as np

from ros_scenesense.demo.record import Image, RunRecord
from ros_scenesense.demo.summary import RunInfo
from ros_scenesense.geometry import Box, Pose
from ros_scenesense.messages.attention import (
    Estimate,
    Estimates,
    ObjectEstimate,
    Roi,
    Rois,
    StructureEstimate,
)
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, PerceivedObject, Relation, Relations
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.reasoning import (
    Belief,
    Beliefs,
    Knowledge,
    KnownAxiom,
    ObjectBelief,
    StructureBelief,
    Verdict,
    Verdicts,
)
from ros_scenesense.messages.scenes import (
    KnownObject,
    Labels,
    ObjectLabel,
    Scene,
    SceneLost,
    StructureLabel,
)
from ros_scenesense.scene import DecisionStatus, Distance, NamingFrame, Position, Task, Truth
from ros_scenesense.stages.protocol import Timing

SESSION = "s"
MS = 1_000_000
INFO = RunInfo(
    session=SESSION,
    started="2025-06-01 12:00:00 UTC",
    command="scenesense demo",
    seed=3,
    arrangement="mixed",
    domain_id=42,
    asked=3,
)
_BOX = Box(pose=Pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)), size=(0.1, 0.1, 0.1))

STRICT_STABLE = Belief(status=DecisionStatus.STRICT, value=True, axioms=["s1"])
STRICT_UNSTABLE = Belief(status=DecisionStatus.STRICT, value=False, axioms=["s2"])
DEFAULT_UNSTABLE = Belief(
    status=DecisionStatus.BY_DEFAULT, value=False, axioms=["s3"], why="s3: small_base(<b>)"
)
UNDECIDED = Belief(status=DecisionStatus.UNDECIDED)
NOBODY = Estimate(value=None, source="none")
NETWORK_VISIBLE = Estimate(value=False, source="network", probability=0.87)


def scene_id(number: int) -> str:
    return f"{SESSION}-{number:04d}"


def parts(number: int, names=("red_cube", "duck"), stable=None, label=Truth.TRUE) -> list:
    """All messages and images about a scene with a tower of two objects, in order.

    Reasoning decides about stability, the network whether the lower object is occluded, and nobody
    whether the upper one is.
    """
    stable = stable or [STRICT_STABLE, DEFAULT_UNSTABLE]
    about = {"stamp": Stamp.of(number + 1), "scene_id": scene_id(number)}
    lower, upper = names
    instances = np.zeros((24, 32), np.uint16)
    instances[12:20, 10:20], instances[4:12, 12:18] = 1, 2
    known = [KnownObject(instance=1 + i, name=name) for i, name in enumerate(names)]
    seen = [PerceivedObject(instance=1, name=lower, points=80, box=_BOX)]
    seen.append(PerceivedObject(instance=2, name=upper, points=0))
    pair = sorted(names)
    relation = Relation(
        object=upper,
        reference=lower,
        position=Position.ABOVE,
        position_confidence=1.0,
        position_source="qsr",
        distance=Distance.TOUCHING,
        distance_confidence=1.0,
        distance_source="qsr",
    )
    beliefs = [
        ObjectBelief(name=name, stable=belief, occluded=UNDECIDED)
        for name, belief in zip(names, stable, strict=True)
    ]
    structure = StructureBelief(members=pair, stable=DEFAULT_UNSTABLE)
    truths = [ObjectLabel(name=name, stable=label, occluded=Truth.FALSE) for name in names]
    verdicts = [
        verdict(Task.STABILITY, [name], belief, label)
        for name, belief in zip(names, stable, strict=True)
    ]
    verdicts += [verdict(Task.OCCLUSION, [name], UNDECIDED, Truth.FALSE) for name in names]
    verdicts.append(verdict(Task.STABILITY, pair, structure.stable, label, "structure"))
    final = [estimate(belief) for belief in stable]
    roi = Roi(
        task=Task.OCCLUSION,
        left=10,
        top=4,
        width=10,
        height=16,
        objects=list(names),
        targets=list(names),
        axioms=["o1"],
        relations=["behind"],
    )
    return [
        Scene(mode="testing", objects=known, **about),
        Image(number + 1, np.full((24, 32, 3), 90, np.uint8)),
        Labels(
            use="evaluate",
            objects=truths,
            structures=[StructureLabel(members=pair, stable=label)],
            **about,
        ),
        Objects(frame_id="camera", objects=seen, **about),
        Image(number + 1, instances),
        Relations(
            naming_frame=NamingFrame.VIEWER,
            relations=[relation],
            disagreements=0,
            trust_qsr=1.0,
            trust_msr=0.0,
            trust_revision=0,
            **about,
        ),
        Beliefs(
            objects=beliefs,
            structures=[structure],
            derived=[],
            knowledge_revision="k",
            trust_revision=0,
            **about,
        ),
        Verdicts(use="evaluate", verdicts=verdicts, **about),
        Rois(knowledge_revision="k", rois=[roi], **about),
        Estimates(
            objects=[
                ObjectEstimate(name=lower, stable=final[0], occluded=NETWORK_VISIBLE),
                ObjectEstimate(name=upper, stable=final[1], occluded=NOBODY),
            ],
            structures=[StructureEstimate(members=pair, stable=estimate(structure.stable))],
            knowledge_revision="k",
            trust_revision=0,
            **about,
        ),
    ]


def estimate(belief: Belief) -> Estimate:
    if belief.value is None:
        return NOBODY
    by_default = belief.status is DecisionStatus.BY_DEFAULT
    return Estimate(value=belief.value, source="default" if by_default else "reasoning")


def verdict(task, subject, belief, label, kind="object") -> Verdict:
    if belief.value is None:
        word = "undecided"
    elif label is Truth.AMBIGUOUS:
        word = "unjudged"
    else:
        word = "right" if belief.value == (label is Truth.TRUE) else "wrong"
    return Verdict(
        task=task,
        subject=subject,
        kind=kind,
        status=belief.status,
        value=belief.value,
        label=label,
        verdict=word,
    )


def lost(number: int, reason="no estimate came") -> SceneLost:
    return SceneLost(stamp=Stamp.of(1), scene_id=scene_id(number), attempts=4, reason=reason)


def knowledge(text="stable(A) if not above(A, B)") -> Knowledge:
    axioms = [
        KnownAxiom(
            id=id,
            text=text,
            statement="stable(A) if not above(A, B).",
            kind="default" if id == "s3" else "normal",
            origin="given",
        )
        for id in ("s1", "s2", "s3")
    ]
    return Knowledge(stamp=Stamp.of(1), revision="k", axioms=axioms)


def heartbeat(process_id=7, **counters) -> Heartbeat:
    return Heartbeat(
        stamp=Stamp.of(1),
        node="reasoner",
        process_id=process_id,
        ready=True,
        warm=True,
        counters=counters,
    )


def run(*scenes: list) -> RunRecord:
    """A record that took all parts of the given scenes, 5 ms after their stamps."""
    record = RunRecord(SESSION)
    for item in [knowledge(), heartbeat(scenes=1), Timing("reasoner/classify", 1.5)]:
        record.take(item, 0)
    for scene in scenes:
        for item in scene:
            stamp = item.stamp_ns if isinstance(item, Image) else item.stamp.nanoseconds
            record.take(item, stamp + 5 * MS)
    return record
