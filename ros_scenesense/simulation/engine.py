"""Simulated scenes: an RGB-D frame with the truth about stability and occlusion, by physics.

Source: the paper's section *Occlusion and Stability Estimation* of the experimental set-up. Bullet
is imported when the engine is built, in the worker process: configurations are read everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Pose
from ros_scenesense.messages.scenes import KnownObject, ObjectLabel, StructureLabel
from ros_scenesense.scene import Frame, Truth
from ros_scenesense.simulation.appearance import Appearance, draw_appearance, dress
from ros_scenesense.simulation.arrangements import Arrangement, Layout, Piece, draw_layout
from ros_scenesense.simulation.backgrounds import PLAIN
from ros_scenesense.simulation.configuration import SimulationConfiguration, check
from ros_scenesense.simulation.occlusion import Hiding, occlusion, visibilities
from ros_scenesense.simulation.relations import ExactRelation, exact_relations, naming_axes
from ros_scenesense.simulation.scene_files import SceneFile
from ros_scenesense.simulation.stability import (
    StandingTest,
    judged,
    repetitions,
    stability,
    structure_stability,
)
from ros_scenesense.simulation.view import (
    EVEN_LIGHT,
    Light,
    draw_light,
    frame_scene,
    renderer_intrinsics,
)
from ros_scenesense.simulation.wish import ANY, Wish, structures_of

if TYPE_CHECKING:
    from ros_scenesense.simulation.camera import Picture

__all__ = [
    "CAMERA_FRAME",
    "Draft",
    "PlacedObject",
    "Shot",
    "SimulatedScene",
    "SimulationConfiguration",
    "SimulationEngine",
]

CAMERA_FRAME = "camera_color_optical_frame"


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """Where an object was when the picture was taken.

    Attributes:
        piece: What it is.
        pose: Pose in the world; the origin is its centre of mass, its z axis points up.
    """

    piece: Piece
    pose: Pose


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """A scene with its truth.

    Attributes:
        frame: The images; stamp 0, instance ids 1 to n in the order of `objects`.
        objects: What is known of every object.
        object_labels: Truth about every object, in the order of `objects`.
        structure_labels: Truth about every structure, sorted by its members.
        arrangement: `towers`, `spread`, `intersection`, `relations`, or `written` by a person.
        supports: Pairs (upper, lower) of names: what stands on what.
        placed: Where every object is, in the order of `objects`.
        relations: True relations of every pair, in the viewer's naming frame.
        hidden: Who hides how much of whom.
        background: Number of the background.
    """

    frame: Frame
    objects: list[KnownObject]
    object_labels: list[ObjectLabel]
    structure_labels: list[StructureLabel]
    arrangement: str
    supports: list[tuple[str, str]]
    placed: list[PlacedObject]
    relations: list[ExactRelation] = field(default_factory=list)
    hidden: list[Hiding] = field(default_factory=list)
    background: int = PLAIN


class SimulationEngine:
    """Makes simulated scenes; one physics client, kept until `close`.

    Args:
        configuration: Parameters of all scenes.

    Raises:
        ParameterError: If a parameter is out of its range.
        SimulationError: If parameters contradict each other, a data file or mesh is missing or
            wrong, or Bullet cannot be started.
    """

    def __init__(self, configuration: SimulationConfiguration) -> None:
        from ros_scenesense.simulation.camera import Camera
        from ros_scenesense.simulation.catalogue import load_catalogue
        from ros_scenesense.simulation.statics import Statics
        from ros_scenesense.simulation.survey import Surveyor
        from ros_scenesense.simulation.world import World

        check(configuration)
        self._configuration = configuration
        self._intrinsics = renderer_intrinsics(
            configuration.width, configuration.height, configuration.field_of_view_deg
        )
        self._catalogue = load_catalogue(configuration.objects_dir, configuration.ycb_dir)
        self._world = World(self._catalogue)
        self._camera = Camera(self._world, self._intrinsics, configuration.shadows)
        self._surveyor = Surveyor(self._world)
        self._standing = StandingTest(self._world)
        self._statics = Statics(self._catalogue)

    def scene(self, seed: int, index: int, wish: Wish = ANY) -> SimulatedScene:
        """Makes one scene. The same (configuration, seed, index, wish) always gives the same scene.

        Scenes are drawn until one is as wished and the camera sees something of every object.

        Args:
            seed: Seed of a series of scenes.
            index: Number of the scene in the series.
            wish: What the scene must be like; its arrangement goes before the configuration's.

        Raises:
            SimulationError: If seed or index is negative, the engine was closed, or no scene is
                as wished.
        """
        if seed < 0 or index < 0:
            raise SimulationError(f"scene (seed {seed}, index {index}): both must be at least 0")
        if self._world.client < 0:
            raise SimulationError("this engine was closed: make a new one")
        built = 0
        for attempt in range(_DRAWS):
            draft = self._draw(seed, index, attempt, wish)
            if not wish.may_fit(draft.layout, self._statics):
                continue
            scene = self._attempt(seed, index, attempt, draft, wish)
            if scene is not None:
                return scene
            built += 1
            if built == _ATTEMPTS:
                break
        raise SimulationError(
            f"scene (seed {seed}, index {index}): of {built} that were built none {_asked(wish)}"
        )

    def written(self, file: SceneFile) -> SimulatedScene:
        """Makes the scene that a file describes, always the same.

        Raises:
            SimulationError: If the catalogue does not have its objects, or things do not stand as
                the file says; the text names the file.
        """
        from ros_scenesense.simulation.contacts import misplaced

        layout, camera = file.layout(self._catalogue), file.scene.camera
        draft = Draft(layout, math.radians(camera.yaw_deg))
        self._world.build(layout.pieces)
        wrong = misplaced(self._world, layout)
        if wrong:
            raise SimulationError(f"{file.path}: {wrong}")
        pose = self._framed(draft, camera.pitch_deg, camera.distance, 0.0)
        stable = stability(self._world, structures_of(layout), _rng(0, 0, "jitter"))
        self._world.reset()
        picture = self._camera.picture(pose, EVEN_LIGHT)
        looks = Appearance(background=file.scene.background)
        return self._scene(draft, Shot(pose, EVEN_LIGHT, looks, picture), stable)

    def close(self) -> None:
        """Ends the physics client."""
        self._world.close()

    def _attempt(
        self, seed: int, index: int, attempt: int, draft: Draft, wish: Wish
    ) -> SimulatedScene | None:
        """The scene of a draft; None if it is not as wished or something in it is not seen."""
        alone = self._moved_alone(draft.layout)
        self._world.build(draft.layout.pieces, draft.layout.pushed)
        pose, light = self._aim(draft, _rng(seed, index, "camera", attempt))
        # In a single stack nobody hides the others.
        if len(structures_of(draft.layout)) > 1 and not self._may_see_everything(pose):
            return None
        stable = self._label(draft, alone, wish, _rng(seed, index, "jitter", attempt))
        if stable is None:
            return None
        picture = self._camera.picture(pose, light)
        if not self._sees_everything(picture.bodies, _LEAST_SHARE * picture.bodies.size):
            return None
        appearance = draw_appearance(
            [piece.name for piece in draft.layout.pieces],
            self._configuration.textures,
            self._configuration.backgrounds,
            _rng(seed, index, "appearance", attempt),
        )
        return self._scene(draft, Shot(pose, light, appearance, picture), stable)

    def _draw(self, seed: int, index: int, attempt: int, wish: Wish) -> Draft:
        """What stands where, and from which side it is seen."""
        side = _rng(seed, index, "side", attempt).uniform(-1.0, 1.0)
        yaw = math.radians(self._configuration.yaw_deg) * side
        arrangement = wish.arrangement or Arrangement(self._configuration.arrangement)
        rng = _rng(seed, index, "layout", attempt)
        layout = draw_layout(self._catalogue, arrangement, index, yaw, rng, wish.stacked)
        return Draft(layout, yaw)

    def _moved_alone(self, layout: Layout) -> dict[str, bool]:
        """By name, whether what is a structure by itself moves; before the layout is built."""
        items = {piece.name: piece.item for piece in layout.pieces}
        return {
            members[0]: not self._standing.stays(items[members[0]])
            for members in structures_of(layout)
            if len(members) == 1
        }

    def _label(
        self, draft: Draft, alone: dict[str, bool], wish: Wish, rng: np.random.Generator
    ) -> dict[str, Truth] | None:
        """Stability of the bodies as built, which stand there again; None if not as wished."""
        moved: list[dict[str, bool]] = []
        stacks = [members for members in structures_of(draft.layout) if len(members) > 1]
        for tested in repetitions(self._world, stacks, rng):
            one = alone | tested
            if not wish.may_come_true(draft.layout, one):
                return None
            moved.append(one)
        self._world.reset()
        stable = judged(moved)
        return stable if wish.comes_true(draft.layout, stable) else None

    def _aim(self, draft: Draft, rng: np.random.Generator) -> tuple[Pose, Light]:
        """From where the world as built is photographed, and in which light."""
        configuration = self._configuration
        pitch_deg = rng.uniform(configuration.pitch_min_deg, configuration.pitch_max_deg)
        distance = rng.uniform(1.0, configuration.distance_max)
        roll_deg = configuration.roll_deg * rng.uniform(-1.0, 1.0)
        return self._framed(draft, pitch_deg, distance, roll_deg), draw_light(rng)

    def _framed(self, draft: Draft, pitch_deg: float, distance: float, roll_deg: float) -> Pose:
        """Where the camera must be to see the world as built."""
        return frame_scene(
            self._world.corners(),
            self._intrinsics,
            pitch_rad=math.radians(pitch_deg),
            yaw_rad=draft.yaw_rad,
            distance_factor=distance,
            roll_rad=math.radians(roll_deg),
        )

    def _may_see_everything(self, pose: Pose) -> bool:
        """A glance, much cheaper than the stability test and the picture that it may save."""
        glance = self._camera.bodies(pose, scale=_GLANCE_SCALE)
        return self._sees_everything(glance, 1.0)

    def _sees_everything(self, ids: npt.NDArray[np.int32], least_pixels: float) -> bool:
        return all(np.count_nonzero(ids == body.id) >= least_pixels for body in self._world.bodies)

    def _scene(self, draft: Draft, shot: Shot, stable: dict[str, Truth]) -> SimulatedScene:
        layout = draft.layout
        seen = visibilities(self._world, self._camera, shot.pose, layout, shot.picture)
        return SimulatedScene(
            frame=self._frame(shot),
            objects=[_known(number, piece) for number, piece in enumerate(layout.pieces, 1)],
            object_labels=[
                ObjectLabel(
                    name=piece.name,
                    stable=stable[piece.name],
                    occluded=occlusion(one.fraction),
                    visible_fraction=one.fraction,
                )
                for piece, one in zip(layout.pieces, seen, strict=True)
            ],
            structure_labels=[
                StructureLabel(members=list(members), stable=structure_stability(members, stable))
                for members in structures_of(layout)
            ],
            arrangement=str(layout.arrangement),
            supports=layout.supports(),
            placed=[PlacedObject(body.piece, body.pose) for body in self._world.bodies],
            relations=exact_relations(
                [piece.name for piece in layout.pieces],
                self._surveyor.solids(),
                self._surveyor.contacts(),
                naming_axes(shot.pose),
            ),
            hidden=[hiding for one in seen for hiding in one.hidden],
            background=shot.appearance.background,
        )

    def _frame(self, shot: Shot) -> Frame:
        instances = np.zeros(shot.picture.bodies.shape, dtype=np.uint16)
        for number, body in enumerate(self._world.bodies, 1):
            instances[shot.picture.bodies == body.id] = number
        frame = Frame(
            stamp_ns=0,
            frame_id=CAMERA_FRAME,
            color=shot.picture.color,
            depth=shot.picture.depth,
            intrinsics=self._intrinsics,
            instances=instances,
            camera_pose=shot.pose,
        )
        poses = {body.piece.name: body.pose for body in self._world.bodies}
        return dress(frame, poses, shot.appearance)


@dataclass(frozen=True, eq=False)
class Draft:
    """What is built, and from which side it is seen."""

    layout: Layout
    yaw_rad: float


@dataclass(frozen=True, eq=False)
class Shot:
    """A picture, rendered plain, how it was taken, and how the scene is to look."""

    pose: Pose
    light: Light
    appearance: Appearance
    picture: Picture


# An object of which less than this share of the image is seen is as good as not there.
_LEAST_SHARE = 0.0005
# The glance before the picture is so many times smaller in both directions.
_GLANCE_SCALE = 4
# Drawing costs little, building and physics much: a rare wish may take hundreds of attempts.
_DRAWS = 20000
_ATTEMPTS = 1000


def _rng(seed: int, index: int, purpose: str, attempt: int = 0) -> np.random.Generator:
    """A generator for each purpose: a change to one leaves what the others draw as it was."""
    return np.random.default_rng([seed, index, *purpose.encode(), attempt])


def _asked(wish: Wish) -> str:
    if wish == ANY:
        return "shows all objects to the camera: change pitch_min_deg and pitch_max_deg"
    return f"is as wished ({wish})"


def _known(number: int, piece: Piece) -> KnownObject:
    return KnownObject(
        instance=number,
        name=piece.name,
        size=piece.item.size,
        surface=piece.item.surface,
        shape=piece.item.shape,
        color=str(piece.color),
    )
