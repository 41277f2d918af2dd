"""The work of the grounding stage: from images to objects and the relations of every pair."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Pose, rotation_matrix
from ros_scenesense.grounding.frames import (
    CAMERA,
    GRAVITY,
    NamingAxes,
    choose_axes,
    yaw_to_robot,
)
from ros_scenesense.grounding.memory import GroundingMemory
from ros_scenesense.grounding.msr import MetricSettings
from ros_scenesense.grounding.qsr import IMPROVED, PYRAMIDS
from ros_scenesense.messages.grounding import Groundings, Objects, PerceivedObject
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.parameters import parameter
from ros_scenesense.perception.boxes import oriented_box
from ros_scenesense.perception.clouds import (
    ObjectCloud,
    background_points,
    frame_cloud,
    object_clouds,
)
from ros_scenesense.perception.depth_units import sparseness, unit_fault
from ros_scenesense.perception.plane import find_plane
from ros_scenesense.perception.points import points_of
from ros_scenesense.scene import Frame, NamingFrame
from ros_scenesense.stages.measuring import measured_attributes
from ros_scenesense.stages.pair_grounding import GroundedPairs, Learned, ground_scene
from ros_scenesense.stages.protocol import Cloud, Timing
from ros_scenesense.stages.scene_objects import Measured, objects_of, perceived
from ros_scenesense.stages.scene_records import SceneRecord

_TABLE_SAMPLE = 2000
TOPIC, SELF = "topic", "self"
AUTO, GIVEN, OWN = "auto", "given", "own"


@dataclass(frozen=True)
class GroundingConfiguration:
    """Parameters of the grounding node."""

    frame: str = parameter(
        GRAVITY,
        "axes that relations are named along: gravity-up of the viewer, or the tilted camera's own",
        choices=(CAMERA, GRAVITY),
    )
    naming_frame: str = parameter(
        NamingFrame.VIEWER.value,
        "whose left and right: the viewer's, in front = nearer the camera, or those of the robot, "
        "which stay when the camera moves; these need the camera pose, else people's words",
        choices=(NamingFrame.VIEWER.value, NamingFrame.ROBOT.value),
    )
    rule: str = parameter(
        IMPROVED,
        "rule of the qualitative grounding: the paper's pyramids, or gaps between boxes",
        choices=(IMPROVED, PYRAMIDS),
    )
    seed: int = parameter(0, "seed of all sampling; same seed, same relations", minimum=0)
    min_points: int = parameter(20, "depth readings that an object needs to be located", minimum=1)
    points_per_object: int = parameter(
        400, "points of an object that relations are computed from", minimum=20, maximum=10_000
    )
    # With more, the longest names would take `groundings` over the size limit of its topic.
    max_objects: int = parameter(
        40, "objects that a scene may have; one with more is refused", minimum=1, maximum=40
    )
    cloud_voxel_m: float = parameter(
        0.005, "metres between the points of the published cloud; 0 = every pixel", minimum=0.0
    )
    join_timeout_s: float = parameter(
        10.0, "seconds that a scene waits for its images, or images for their scene", minimum=0.1
    )
    job_deadline_s: float = parameter(10.0, "seconds that grounding a scene may take", minimum=0.1)
    feedback_weight: float = parameter(
        MetricSettings().human_weight,
        "what people say counts as much as so many relations named by the qualitative grounding",
        minimum=1.0,
        maximum=1000.0,
    )
    remembered_scenes: int = parameter(
        200, "scenes that feedback may still be about; as many as control has", minimum=1
    )
    scene_source: str = parameter(
        TOPIC,
        "who announces scenes: a camera on the topic scene, or grounding itself for a camera that "
        "announces none",
        choices=(TOPIC, SELF),
    )
    capture_rate_hz: float = parameter(
        0.0,
        "scenes per second that grounding announces itself; 0 = one for each call of the service "
        "grounding/capture",
        minimum=0.0,
        maximum=60.0,
    )
    instances: str = parameter(
        AUTO,
        "who tells objects apart: instance ids that somebody gives, or grounding's own "
        "segmentation; auto = own if grounding announces the scenes itself",
        choices=(AUTO, GIVEN, OWN),
    )
    session: str = parameter(
        "",
        "first part of the scene ids that grounding gives itself; a session that exists is "
        "continued, empty = a new one",
    )
    state_dir: str = parameter(
        "", "folder that grounding remembers in; empty = nothing is remembered"
    )

    @property
    def segments(self) -> bool:
        """Whether grounding tells the objects apart itself."""
        return self.instances == OWN or (self.instances == AUTO and self.scene_source == SELF)


class GroundingResult(NamedTuple):
    """What is known of a scene after grounding.

    Attributes:
        groundings: The relations of every directed pair of located objects.
        objects: All objects, located or not.
        instances: (H, W) uint16 instance ids that were used, 0 = background.
        timings: How long the steps took.
        problems: What was wrong, as (kind, words) for the stage's health.
        record: What is kept of the scene, to learn from; None if nothing is located.
    """

    groundings: Groundings
    objects: Objects
    instances: npt.NDArray[np.uint16]
    timings: list[Timing]
    problems: list[tuple[str, str]]
    record: SceneRecord | None = None


class GroundingEngine:
    """Grounds the relations of scenes and makes clouds; remembers nothing between two calls."""

    def __init__(self, configuration: GroundingConfiguration) -> None:
        # They take a second, which neither the first scene nor the node itself should pay.
        import scipy.spatial  # noqa: F401

        if configuration.segments:
            import ros_scenesense.perception.segmentation  # noqa: F401

        self.configuration = configuration

    def ground(self, frame: Frame, scene: Scene, learned: Learned | None = None) -> GroundingResult:
        """Locates the objects of a scene and grounds the relations between them.

        Args:
            frame: The images, with instance ids unless the configuration says to segment them.
            scene: Which objects they show. Instance ids that it does not name are objects too.
            learned: What is known of the prepositions; None = nothing yet.

        Raises:
            FrameError: If the frame lacks instance ids, shows no table to segment it by, or more
                objects than are allowed.
        """
        learned = learned or Learned(GroundingMemory())
        fault = _depth_fault(frame)
        if fault is not None:
            kind, words = fault
            problem = (kind, f"scene {scene.scene_id}: {words}, nothing is located")
            nothing = unlocated(frame, scene, self.configuration, learned)
            return nothing._replace(problems=[problem])
        watch = _Stopwatch()
        rng = np.random.default_rng(self.configuration.seed)
        points = points_of(frame.depth, frame.intrinsics)
        if self.configuration.segments:
            instances = _segmented(frame, scene, rng)
            watch.lap("segmentation")
        else:
            instances = instances_of(frame)
        known = objects_of(instances, scene)
        if len(known) > self.configuration.max_objects:
            raise FrameError(
                f"{len(known)} objects were found, the parameter max_objects is "
                f"{self.configuration.max_objects}"
            )
        ids = [one.instance for one in known]
        clouds = object_clouds(points, instances, ids, self.configuration.points_per_object, rng)
        watch.lap("clouds")
        plane = None
        if self.configuration.frame == GRAVITY:
            plane = find_plane(background_points(points, instances, _TABLE_SAMPLE, rng), rng)
        pose = scene.camera_pose or frame.camera_pose
        axes, wrong = choose_axes(
            self.configuration.frame, None if plane is None else plane.normal, pose
        )
        axes, yaw_rad, unknown = self._turned(axes, pose)
        watch.lap("naming_frame")
        located = {
            one.name: cloud.points
            for one, cloud in zip(known, clouds, strict=True)
            if cloud.readings >= self.configuration.min_points
        }
        grounded = ground_scene(located, axes, self.configuration.rule, learned.memory)
        groundings = Groundings(
            stamp=scene.stamp,
            scene_id=scene.scene_id,
            naming_frame=axes.turned(learned.memory.yaw_rad).name,
            pairs=grounded.pairs,
            viewpoint_yaw=yaw_rad + learned.memory.yaw_rad,
            applied_update=learned.applied,
        )
        measured = measured_attributes(frame, instances, known, clouds, axes)
        objects = _objects(frame, scene, _located(known, clouds, grounded, axes, measured))
        record = SceneRecord.of(scene.scene_id, grounded.names, grounded.histograms)
        watch.lap("relations")
        doubts = [one for one in (wrong, unknown) if one is not None and grounded.pairs]
        problems = [("naming_frame", f"scene {scene.scene_id}: {one}") for one in doubts]
        sparse = sparseness(frame.depth) if self.configuration.segments else None
        if sparse is not None:
            problems.append(("sparse_depth", f"scene {scene.scene_id}: {sparse}"))
        return GroundingResult(groundings, objects, instances, watch.read(), problems, record)

    def cloud(self, frame: Frame) -> Cloud:
        """The coloured points of a frame, for people to see."""
        points, colors = frame_cloud(frame, self.configuration.cloud_voxel_m)
        return Cloud(frame.stamp_ns, frame.frame_id, points, colors)

    def _turned(self, axes: NamingAxes, pose: Pose | None) -> tuple[NamingAxes, float, str | None]:
        """The axes of the naming frame, by how much they are turned, and what was wrong."""
        if self.configuration.naming_frame != NamingFrame.ROBOT or axes.name is NamingFrame.CAMERA:
            return axes, 0.0, None
        if pose is None:
            words = (
                "the camera pose is unknown: left and right are the viewer's, or as people's "
                "words tell; publish camera_pose in scene"
            )
            return axes, 0.0, words
        yaw_rad = yaw_to_robot(axes, pose)
        return replace(axes.turned(yaw_rad), name=NamingFrame.ROBOT), yaw_rad, None


def instances_of(frame: Frame) -> npt.NDArray[np.uint16]:
    """The instance image of a frame.

    Raises:
        FrameError: If it has none.
    """
    if frame.instances is None:
        raise FrameError(
            "there are no instance ids: publish them (16UC1, 0 = background) on camera/instances "
            "with the stamp of the other images"
        )
    return frame.instances


def _segmented(frame: Frame, scene: Scene, rng: np.random.Generator) -> npt.NDArray[np.uint16]:
    """Instance ids of the objects that are found on the table.

    Raises:
        FrameError: If there is no table to find them on.
    """
    from ros_scenesense.perception.segmentation import find_objects

    pose = scene.camera_pose or frame.camera_pose
    up = None if pose is None else rotation_matrix(pose.orientation)[2]
    found = find_objects(frame.color, frame.depth, frame.intrinsics, rng, up)
    if found.wrong is not None:
        raise FrameError(found.wrong)
    return found.instances


def unlocated(
    frame: Frame, scene: Scene, configuration: GroundingConfiguration, learned: Learned
) -> GroundingResult:
    """The result when nothing could be located: no relations, but every object is listed."""
    name = NamingFrame.CAMERA if configuration.frame == CAMERA else NamingFrame.VIEWER
    instances = np.zeros(frame.depth.shape, np.uint16)
    if not configuration.segments:
        instances = instances_of(frame)
    listed = [perceived(one) for one in objects_of(instances, scene)]
    groundings = Groundings(
        stamp=scene.stamp,
        scene_id=scene.scene_id,
        naming_frame=name,
        pairs=[],
        applied_update=learned.applied,
    )
    objects = _objects(frame, scene, listed)
    return GroundingResult(groundings, objects, instances, timings=[], problems=[])


def _depth_fault(frame: Frame) -> tuple[str, str] | None:
    """Why the depth image locates nothing, as (kind, words); None if it does."""
    if not (np.isfinite(frame.depth) & (frame.depth > 0.0)).any():
        return "empty_depth", (
            "no pixel of the depth image has a reading: check the depth camera and the encoding "
            "(32FC1 in metres or 16UC1 in millimetres)"
        )
    wrong_units = unit_fault(frame.depth)
    if wrong_units is not None:
        return "depth_units", f"{wrong_units}; 32FC1 must be metres, 16UC1 millimetres"
    return None


def _located(
    known: Sequence[KnownObject],
    clouds: Sequence[ObjectCloud],
    grounded: GroundedPairs,
    axes: NamingAxes,
    measured: Sequence[Measured],
) -> list[PerceivedObject]:
    extents = dict(zip(grounded.names, grounded.extents, strict=True))
    listed = []
    for one, cloud, found in zip(known, clouds, measured, strict=True):
        extent = extents.get(one.name)
        box = None if extent is None else oriented_box(extent.low, extent.high, axes.rows)
        listed.append(perceived(one, cloud.readings, box, found))
    return listed


def _objects(frame: Frame, scene: Scene, listed: list[PerceivedObject]) -> Objects:
    return Objects(
        stamp=scene.stamp, scene_id=scene.scene_id, frame_id=frame.frame_id, objects=listed
    )


class _Stopwatch:
    """Times the steps of a scene, one after the other."""

    def __init__(self) -> None:
        self._laps: list[Timing] = []
        self._since = time.perf_counter()

    def lap(self, step: str) -> None:
        now = time.perf_counter()
        self._laps.append(Timing(f"grounding/{step}", (now - self._since) * 1e3))
        self._since = now

    def read(self) -> list[Timing]:
        """The steps and their sum."""
        total = Timing("grounding/total", sum(lap.milliseconds for lap in self._laps))
        return [*self._laps, total]
