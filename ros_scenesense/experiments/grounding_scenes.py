"""Scenes for the experiment on grounding: noisy partial clouds, and the exact relations of pairs.

Half of the scenes are of the arrangement `relations`, in which every preposition occurs, the others
are towers, spread objects and both together. A tilted camera sees them through the noise of a
Kinect. The truth is measured on meshes and contacts; it knows nothing of the camera's images.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Float, Pose, pose_of, transform_points
from ros_scenesense.grounding.frames import GRAVITY, NamingAxes, choose_axes
from ros_scenesense.perception.clouds import background_points, object_clouds
from ros_scenesense.perception.plane import find_plane
from ros_scenesense.scene import Distance, Frame, Position
from ros_scenesense.simulation.arrangements import Arrangement, draw_layout
from ros_scenesense.simulation.camera import Camera
from ros_scenesense.simulation.catalogue import load_catalogue
from ros_scenesense.simulation.noise import KINECT, PRESETS, noisy
from ros_scenesense.simulation.relations import exact_relations
from ros_scenesense.simulation.survey import Surveyor
from ros_scenesense.simulation.view import draw_light, frame_scene, renderer_intrinsics
from ros_scenesense.simulation.world import World

WIDTH, HEIGHT, FIELD_OF_VIEW_DEG = 640, 480, 43.0
PITCH_DEG = (25.0, 55.0)
YAW_DEG = 30.0
FARTHEST = 1.3
"""The camera stands at most this many times as far as it must to see everything."""

NEAREST_M = 0.5
"""Nothing is nearer to the camera: from 0.4 m on the Kinect reads nothing."""

POINTS_PER_OBJECT = 400
FEWEST_POINTS = 20
_TABLE_SAMPLE = 2000
_DRAWS = 200
_LEAST_PIXELS = 150


@dataclass(frozen=True)
class Truth:
    """What is true of an unordered pair of a scene: of object `first` by reference `second`.

    None where nobody said.
    """

    first: int
    second: int
    position: Position | None
    distance: Distance | None
    position_ambiguous: bool = False
    distance_ambiguous: bool = False


@dataclass(frozen=True, eq=False)
class ObservedScene:
    """What the camera saw of a scene, and what is true of it.

    Attributes:
        clouds: Points (N, 3) of every located object in the optical frame, metres.
        axes: The viewer's gravity-up axes, estimated from the table.
        truths: Of pairs of located objects, in the axes of people.
    """

    clouds: list[Float]
    axes: NamingAxes
    truths: list[Truth] = field(default_factory=list)


def observe(
    frame: Frame, instances: Sequence[int], rng: np.random.Generator
) -> tuple[ObservedScene, dict[int, int]]:
    """What a frame shows of its objects, without truths, and their indices by instance id.

    Objects with too few readings are left out.
    """
    assert frame.instances is not None
    points = frame.intrinsics.back_project(frame.depth)
    clouds = object_clouds(points, frame.instances, instances, POINTS_PER_OBJECT, rng)
    located = [index for index, one in enumerate(clouds) if one.readings >= FEWEST_POINTS]
    table = find_plane(background_points(points, frame.instances, _TABLE_SAMPLE, rng), rng)
    normal = None if table is None else table.normal
    axes, _ = choose_axes(GRAVITY, normal, frame.camera_pose)
    scene = ObservedScene([clouds[index].points for index in located], axes)
    return scene, {instances[index]: place for place, index in enumerate(located)}


class SceneMaker:
    """Simulates scenes; holds a physics client until `close`."""

    def __init__(self) -> None:
        self._catalogue = load_catalogue()
        self._world = World(self._catalogue)
        self._intrinsics = renderer_intrinsics(WIDTH, HEIGHT, FIELD_OF_VIEW_DEG)
        self._camera = Camera(self._world, self._intrinsics, shadows=False)
        self._surveyor = Surveyor(self._world)

    def scene(self, seed: int, index: int, turned_rad: float = 0.0) -> ObservedScene:
        """A scene; the same arguments always give the same.

        Args:
            seed: Of a series of scenes.
            index: Number in the series.
            turned_rad: The camera stands this much farther around the table, counter-clockwise,
                than where the people stand who name the relations.

        Raises:
            SimulationError: If no scene can be drawn of which the camera sees everything.
        """
        rng = np.random.default_rng([seed, index])
        for _ in range(_DRAWS):
            people_rad = math.radians(float(rng.uniform(-YAW_DEG, YAW_DEG)))
            arrangement = Arrangement.MIXED if index % 2 else Arrangement.RELATIONS
            layout = draw_layout(self._catalogue, arrangement, index // 2, people_rad, rng)
            self._world.build(layout.pieces, layout.pushed)
            pose = frame_scene(
                self._world.corners(),
                self._intrinsics,
                pitch_rad=math.radians(float(rng.uniform(*PITCH_DEG))),
                yaw_rad=people_rad + turned_rad,
                distance_factor=float(rng.uniform(1.0, FARTHEST)),
            )
            frame = self._photograph(self._backed(pose), rng)
            if frame is not None:
                return self._observed(frame, people_rad, rng)
        raise SimulationError(
            f"scene (seed {seed}, index {index}): in {_DRAWS} drawn ones something was hidden"
        )

    def close(self) -> None:
        """Ends the physics client."""
        self._world.close()

    def _backed(self, pose: Pose) -> Pose:
        """The pose, moved back until nothing is nearer than a Kinect may come."""
        matrix = pose.matrix()
        depths = transform_points(np.linalg.inv(matrix), self._world.corners())[:, 2]
        matrix[:3, 3] -= max(0.0, NEAREST_M - float(depths.min())) * matrix[:3, 2]
        return pose_of(matrix)

    def _photograph(self, pose: Pose, rng: np.random.Generator) -> Frame | None:
        """The noisy frame; None if an object is hidden."""
        picture = self._camera.picture(pose, draw_light(rng))
        instances = np.zeros(picture.bodies.shape, dtype=np.uint16)
        for number, body in enumerate(self._world.bodies, 1):
            seen = picture.bodies == body.id
            if np.count_nonzero(seen) < _LEAST_PIXELS:
                return None
            instances[seen] = number
        depth = noisy(picture.depth, self._intrinsics, PRESETS[KINECT], rng)
        return Frame(0, "camera", picture.color, depth, self._intrinsics, instances, pose)

    def _observed(self, frame: Frame, people_rad: float, rng: np.random.Generator) -> ObservedScene:
        names = [body.piece.name for body in self._world.bodies]
        scene, places = observe(frame, range(1, len(names) + 1), rng)
        exact = exact_relations(
            names, self._surveyor.solids(), self._surveyor.contacts(), _axes(people_rad)
        )
        for one in exact:
            pair = [places.get(names.index(name) + 1) for name in (one.object, one.reference)]
            if pair[0] is not None and pair[1] is not None:
                scene.truths.append(
                    Truth(
                        first=pair[0],
                        second=pair[1],
                        position=one.position,
                        distance=one.distance,
                        position_ambiguous=one.position_ambiguous,
                        distance_ambiguous=one.distance_ambiguous,
                    )
                )
        return scene


def _axes(yaw_rad: float) -> Float:
    """Right, away and up in the world of somebody who looks in a direction about up."""
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    return np.array([[sine, -cosine, 0.0], [cosine, sine, 0.0], [0.0, 0.0, 1.0]])
