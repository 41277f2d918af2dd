"""Frames for benchmarks that the simulated camera never shows: crowds, and stacks of one colour.

Nothing in them is labelled, so objects of one shape and colour may occur more than once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.scenes import KnownObject
from ros_scenesense.scene import Frame, Surface
from ros_scenesense.simulation.appearance import draw_appearance, dress
from ros_scenesense.simulation.arrangements import (
    Arrangement,
    Piece,
    draw_item,
    draw_layout,
    draw_offset,
)
from ros_scenesense.simulation.camera import Camera
from ros_scenesense.simulation.object_files import Color
from ros_scenesense.simulation.view import draw_light, frame_scene, renderer_intrinsics
from ros_scenesense.simulation.world import World

WIDTH, HEIGHT = 640, 480
_FIELD_OF_VIEW_DEG = 40.0
_PITCH_DEG = (20.0, 40.0)
_BACKGROUNDS = 8
_STACKED_SHARE = 0.3
_SPACING_M = 0.21
_JITTER_M = 0.02
_LEAST_SHARE = 150 / (WIDTH * HEIGHT)
_DRAWS = 200


@dataclass(frozen=True, eq=False)
class Picture:
    """A frame with its instance ids, and what they are.

    Attributes:
        frame: The images; instance ids 1 to n.
        objects: In the order of the ids.
    """

    frame: Frame
    objects: list[KnownObject]


class Studio:
    """Builds what is asked for and photographs it; one physics client, kept until `close`."""

    def __init__(self, width: int = WIDTH, height: int = HEIGHT) -> None:
        self._intrinsics: Intrinsics = renderer_intrinsics(width, height, _FIELD_OF_VIEW_DEG)
        self._world = World()
        self._camera = Camera(self._world, self._intrinsics, shadows=True)

    def crowd(self, count: int, rng: np.random.Generator) -> Picture:
        """So many objects, all in sight, a third of them on others."""
        return self._until_all_are_seen(lambda: self._draw_crowd(count, rng), rng)

    def stack_of_one_color(self, rng: np.random.Generator) -> Picture:
        """A tower of two to five objects of one colour, all in sight."""
        return self._until_all_are_seen(lambda: self._draw_stack(rng), rng)

    def close(self) -> None:
        """Ends the physics client."""
        self._world.close()

    def _until_all_are_seen(
        self, draw: Callable[[], list[Piece]], rng: np.random.Generator
    ) -> Picture:
        for _ in range(_DRAWS):
            picture = self._picture(draw(), rng)
            instances = picture.frame.instances
            assert instances is not None
            seen = np.bincount(instances.ravel(), minlength=len(picture.objects) + 1)
            if seen.min() >= _LEAST_SHARE * instances.size:
                return picture
        raise SimulationError(f"of {_DRAWS} pictures none shows all its objects")

    def _draw_stack(self, rng: np.random.Generator) -> list[Piece]:
        layout = draw_layout(self._world.catalogue, Arrangement.TOWERS, 0, 0.0, rng)
        color = list(Color)[int(rng.integers(len(Color)))]
        return [replace(piece, color=color) for piece in layout.pieces]

    def _draw_crowd(self, count: int, rng: np.random.Generator) -> list[Piece]:
        upper = int(_STACKED_SHARE * count)
        columns = math.ceil(math.sqrt(count - upper))
        pieces: list[Piece] = []
        for number in range(count - upper):
            row, column = divmod(number, columns)
            x, y = rng.normal(0.0, _JITTER_M, 2) + _SPACING_M * np.array([row, column])
            steady = number < upper
            surface = Surface.FLAT if steady else None
            pieces.append(self._piece(float(x), float(y), rng, surface))
        for number in range(upper):
            below = pieces[number]
            piece = self._piece(0.0, 0.0, rng)
            x, y = draw_offset(piece.item, below.item, rng)
            pieces.append(replace(piece, x_m=below.x_m + x, y_m=below.y_m + y, support=number))
        return pieces

    def _piece(
        self, x: float, y: float, rng: np.random.Generator, surface: Surface | None = None
    ) -> Piece:
        color = list(Color)[int(rng.integers(len(Color)))]
        item = draw_item(self._world.catalogue, color, rng, None, surface, surface is not None)
        return Piece(item, color, x, y, float(rng.uniform(-math.pi, math.pi)))

    def _picture(self, pieces: Sequence[Piece], rng: np.random.Generator) -> Picture:
        bodies = self._world.build(pieces)
        pitch_rad = math.radians(rng.uniform(*_PITCH_DEG))
        pose = frame_scene(self._world.corners(), self._intrinsics, pitch_rad, 0.0, 1.0)
        image = self._camera.picture(pose, draw_light(rng))
        instances = np.zeros(image.bodies.shape, dtype=np.uint16)
        names = [f"{piece.name}_{number}" for number, piece in enumerate(pieces, 1)]
        for number, body in enumerate(bodies, 1):
            instances[image.bodies == body.id] = number
        plain = Frame(
            stamp_ns=0,
            frame_id="camera_color_optical_frame",
            color=image.color,
            depth=image.depth,
            intrinsics=self._intrinsics,
            instances=instances,
            camera_pose=pose,
        )
        poses = {name: body.pose for name, body in zip(names, bodies, strict=True)}
        frame = dress(plain, poses, draw_appearance(names, True, _BACKGROUNDS, rng))
        objects = [
            KnownObject(
                instance=number,
                name=name,
                size=piece.item.size,
                surface=piece.item.surface,
                shape=piece.item.shape,
                color=str(piece.color),
            )
            for number, (name, piece) in enumerate(zip(names, pieces, strict=True), 1)
        ]
        return Picture(frame, objects)
