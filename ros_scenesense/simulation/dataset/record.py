"""What a dataset says of a scene besides its images, as one line of JSON."""

from __future__ import annotations

import msgspec

from ros_scenesense.geometry import Intrinsics, Pose
from ros_scenesense.messages.scenes import KnownObject, ObjectLabel, StructureLabel
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.dataset.images import Images
from ros_scenesense.simulation.engine import PlacedObject, SimulatedScene
from ros_scenesense.simulation.occlusion import Hiding
from ros_scenesense.simulation.relations import ExactRelation


class SceneRecord(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="schema",
    tag="dataset_scene/1",
):
    """A scene without its images; the fields are those of `SimulatedScene` and its frame.

    `objects`, `object_labels` and `placed` are in the same order, which is that of the instance
    ids 1 to n. `supports` holds pairs (upper, lower), `relations` are named by the viewer.
    """

    index: int
    arrangement: str
    objects: list[KnownObject]
    object_labels: list[ObjectLabel]
    structure_labels: list[StructureLabel]
    supports: list[tuple[str, str]]
    placed: list[PlacedObject]
    relations: list[ExactRelation]
    hidden: list[Hiding]
    background: int
    frame_id: str
    camera_pose: Pose
    intrinsics: Intrinsics


def record_of(index: int, scene: SimulatedScene) -> SceneRecord:
    """The record of a simulated scene.

    Raises:
        ValueError: If the frame does not say where the camera was.
    """
    if scene.frame.camera_pose is None:
        raise ValueError(f"scene {index} has no camera pose")
    return SceneRecord(
        index=index,
        arrangement=scene.arrangement,
        objects=scene.objects,
        object_labels=scene.object_labels,
        structure_labels=scene.structure_labels,
        supports=scene.supports,
        placed=scene.placed,
        relations=scene.relations,
        hidden=scene.hidden,
        background=scene.background,
        frame_id=scene.frame.frame_id,
        camera_pose=scene.frame.camera_pose,
        intrinsics=scene.frame.intrinsics,
    )


def scene_of(record: SceneRecord, images: Images) -> SimulatedScene:
    """The scene that a record and its images are of.

    Raises:
        FrameError: If the images are not of the size that the record says.
    """
    return SimulatedScene(
        frame=Frame(
            stamp_ns=0,
            frame_id=record.frame_id,
            color=images.color,
            depth=images.depth,
            intrinsics=record.intrinsics,
            instances=images.instances,
            camera_pose=record.camera_pose,
        ),
        objects=record.objects,
        object_labels=record.object_labels,
        structure_labels=record.structure_labels,
        arrangement=record.arrangement,
        supports=record.supports,
        placed=record.placed,
        relations=record.relations,
        hidden=record.hidden,
        background=record.background,
    )
