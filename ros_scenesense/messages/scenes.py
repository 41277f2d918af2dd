"""Scenes and their labels: what the camera says of a frame, and what physics says of the truth."""

from __future__ import annotations

from typing import Literal

from ros_scenesense.geometry import Pose
from ros_scenesense.messages.base import (
    Count,
    Identifier,
    InstanceId,
    Mode,
    Name,
    Part,
    Probability,
    Text,
)
from ros_scenesense.messages.base import SceneMessage as _SceneMessage
from ros_scenesense.scene import Size, Surface, Truth


class KnownObject(Part, frozen=True):
    """An object known by name, with the attributes that somebody gave; None = not given.

    `instance` is its value in the instance image.
    """

    instance: InstanceId
    name: Name
    size: Size | None = None
    surface: Surface | None = None
    shape: Name | None = None
    color: Name | None = None


class Scene(_SceneMessage, frozen=True, tag="scene/1"):
    """Announces a frame: `stamp` equals the stamp of its images exactly.

    `camera_pose` is the optical frame in the world (metres). In an episode (a goal is being
    pursued), `step` counts the actions done and `in_hand` names the held object.
    """

    mode: Mode
    objects: list[KnownObject]
    camera_pose: Pose | None = None
    episode_id: Identifier | None = None
    step: Count = 0
    in_hand: Name | None = None


class SceneLost(_SceneMessage, frozen=True, tag="scene_lost/1"):
    """The camera gave a scene up: it was shown `attempts` times and no estimate came."""

    attempts: Count
    reason: Text


class ObjectLabel(Part, frozen=True):
    """Truth about one object, by physics and by visible pixels.

    `visible_fraction` = visible pixels / pixels the object would have alone, with only what it
    carries: its load covers its top, which does not count as hiding it. None when the object
    would not be in the image even alone.
    """

    name: Name
    stable: Truth
    occluded: Truth
    visible_fraction: Probability | None = None


class StructureLabel(Part, frozen=True):
    """Truth about one structure, keyed by its sorted members."""

    members: list[Name]
    stable: Truth


class Labels(_SceneMessage, frozen=True, tag="labels/1"):
    """Ground truth of a scene; learning stages ignore `use: evaluate`."""

    use: Literal["train", "evaluate"]
    objects: list[ObjectLabel]
    structures: list[StructureLabel]
