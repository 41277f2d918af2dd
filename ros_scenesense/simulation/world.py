"""The physics world: a table, the bodies of one scene, and what happens when time runs.

One Bullet client lives as long as the world; shapes are cached, bodies removed after each scene.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pybullet

from ros_scenesense.errors import SimulationError
from ros_scenesense.geometry import Pose, Quaternion, rotation_matrix
from ros_scenesense.simulation.arrangements import Piece
from ros_scenesense.simulation.catalogue import Catalogue, CatalogueItem, load_catalogue
from ros_scenesense.simulation.object_files import Color, SphereSpec
from ros_scenesense.simulation.painting import paint, read_texture
from ros_scenesense.simulation.shapes import (
    create_collision_shape,
    create_visual_shape,
    load_texture,
)

COLORS = {
    Color.RED: (0.80, 0.12, 0.10),
    Color.GREEN: (0.10, 0.60, 0.16),
    Color.BLUE: (0.12, 0.22, 0.80),
    Color.YELLOW: (0.90, 0.78, 0.10),
    Color.WHITE: (0.90, 0.90, 0.90),
}


@dataclass(frozen=True)
class Body:
    """An object in the world.

    Attributes:
        id: Bullet's id of the body.
        piece: What it is.
        pose: Where it was put; the origin is its centre of mass, z is up in its own frame.
    """

    id: int
    piece: Piece
    pose: Pose


class World:
    """A table whose top is the plane z = 0 of the world frame, and the bodies on it.

    Args:
        catalogue: Where the forms of its bodies are; None = the shipped one.

    Raises:
        SimulationError: If Bullet cannot be started.
    """

    def __init__(self, catalogue: Catalogue | None = None) -> None:
        self.catalogue = catalogue or load_catalogue()
        self.client = pybullet.connect(pybullet.DIRECT)
        if self.client < 0:
            raise SimulationError("no physics client is left: close engines that are not used")
        self.bodies: list[Body] = []
        self._collisions: dict[CatalogueItem, int] = {}
        # Visual shape, and texture or -1.
        self._visuals: dict[tuple[CatalogueItem, Color], tuple[int, int]] = {}
        # Bullet orders contacts by the history of the world unless it is told to sort them.
        pybullet.setPhysicsEngineParameter(
            deterministicOverlappingPairs=1, physicsClientId=self.client
        )
        pybullet.setGravity(0.0, 0.0, -9.81, physicsClientId=self.client)
        self._table = self._make_table()

    def build(self, pieces: Sequence[Piece], pushed: Sequence[tuple[int, int]] = ()) -> list[Body]:
        """Replaces the bodies by these; each is lowered until it touches what is below.

        Args:
            pieces: What stands where.
            pushed: Pairs (one, other) of indices: the first, which carries nothing, is then
                pushed towards the other until it touches something.
        """
        self.clear()
        for piece in pieces:
            self.put(piece)
        for one, other in pushed:
            self.bodies[one] = self._push(self.bodies[one], self.bodies[other])
        return self.bodies

    def restore(self, bodies: Iterable[tuple[Piece, Pose]]) -> None:
        """Replaces the bodies by these, exactly where they once were."""
        self.clear()
        self.bodies = [Body(self._make(piece, pose), piece, pose) for piece, pose in bodies]

    def put(self, piece: Piece) -> Body:
        """Adds a body; it is lowered from above everything until it touches what is below."""
        body = self._put(piece)
        self.bodies.append(body)
        return body

    def remove(self, body: Body) -> None:
        """Takes a body away."""
        self.bodies.remove(body)
        pybullet.removeBody(body.id, physicsClientId=self.client)

    def keep(self) -> None:
        """From now on every body was built where it is now, e.g. after time ran."""
        for index, body in enumerate(self.bodies):
            position, orientation = pybullet.getBasePositionAndOrientation(
                body.id, physicsClientId=self.client
            )
            piece = replace(body.piece, x_m=position[0], y_m=position[1])
            self.bodies[index] = Body(body.id, piece, Pose(position, orientation))

    def renew(self) -> None:
        """Makes every body anew where it was built: Bullet forgets what happened to it before."""
        bodies = self.bodies
        self.clear()
        self.bodies = [replace(body, id=self._make(body.piece, body.pose)) for body in bodies]

    def clear(self) -> None:
        """Removes all bodies."""
        for body in self.bodies:
            pybullet.removeBody(body.id, physicsClientId=self.client)
        self.bodies = []

    def move(self, body: Body, shift: npt.ArrayLike) -> None:
        """Puts a body, at rest, where it was built plus a shift (3,) in metres."""
        pybullet.resetBasePositionAndOrientation(
            body.id,
            np.asarray(body.pose.position) + np.asarray(shift),
            body.pose.orientation,
            physicsClientId=self.client,
        )

    def show_only(self, names: Collection[str]) -> None:
        """Puts these bodies where they were built, and everything else out of sight."""
        for body in self.bodies:
            self.move(body, np.zeros(3) if body.piece.name in names else _OUT_OF_SIGHT)

    def reset(self) -> None:
        """Puts everything where it was built, at rest."""
        for body in self.bodies:
            self.move(body, np.zeros(3))

    def corners(self) -> npt.NDArray[np.float64]:
        """Corners (8 N, 3) of the upright boxes about the N bodies as they stand, metres."""
        boxes = [pybullet.getAABB(body.id, physicsClientId=self.client) for body in self.bodies]
        return np.array(
            [
                [box[i][0], box[j][1], box[k][2]]
                for box in boxes
                for i, j, k in itertools.product((0, 1), repeat=3)
            ]
        )

    def convex_parts(self) -> Iterator[npt.NDArray[np.float64]]:
        """Corners (V, 3) of every convex part of every body as it stands, metres."""
        for body in self.bodies:
            position, orientation = pybullet.getBasePositionAndOrientation(
                body.id, physicsClientId=self.client
            )
            rotation = rotation_matrix(orientation)
            for part in self.catalogue.form(body.piece.item).convex_parts:
                yield part @ rotation.T + position

    def positions(self) -> npt.NDArray[np.float64]:
        """Centres of mass of all bodies, (N, 3) metres."""
        return np.array(
            [
                pybullet.getBasePositionAndOrientation(body.id, physicsClientId=self.client)[0]
                for body in self.bodies
            ]
        )

    def step(self, count: int) -> None:
        """Lets time run, in steps of 1/240 s."""
        for _ in range(count):
            pybullet.stepSimulation(physicsClientId=self.client)

    def close(self) -> None:
        """Ends the client; the world cannot be used afterwards."""
        if self.client >= 0:
            pybullet.disconnect(physicsClientId=self.client)
            self.client = -1

    def _make_table(self) -> int:
        # What carries is wider than the table that one sees: room for structures apart.
        collision = pybullet.createCollisionShape(
            pybullet.GEOM_BOX,
            halfExtents=[_GROUND_M, _GROUND_M, _GROUND_THICKNESS_M / 2.0],
            physicsClientId=self.client,
        )
        # The camera adds the table itself. Without a shape for the eye Bullet would show the one
        # that collides: a small box, deep below everything.
        visual = pybullet.createVisualShape(
            pybullet.GEOM_BOX,
            halfExtents=[0.001, 0.001, 0.001],
            visualFramePosition=_OUT_OF_SIGHT,
            physicsClientId=self.client,
        )
        place = [0.0, 0.0, -_GROUND_THICKNESS_M / 2.0]
        table = pybullet.createMultiBody(0.0, collision, visual, place, physicsClientId=self.client)
        pybullet.changeDynamics(table, -1, lateralFriction=1.0, physicsClientId=self.client)
        return int(table)

    def _put(self, piece: Piece) -> Body:
        # Above everything that is there; then lowered.
        top = sum(body.piece.item.height_m for body in self.bodies) + piece.item.height_m
        orientation = pybullet.getQuaternionFromEuler([0.0, 0.0, piece.yaw_rad])
        body_id = self._make(piece, Pose((piece.x_m, piece.y_m, top), orientation))
        z = self._lower(body_id, piece, top, orientation)
        return Body(body_id, piece, Pose((piece.x_m, piece.y_m, z), orientation))

    def _make(self, piece: Piece, pose: Pose) -> int:
        """Bullet's id of a new body."""
        form = self.catalogue.form(piece.item)
        visual, texture = self._visual(piece.item, piece.color)
        body_id = int(
            pybullet.createMultiBody(
                piece.item.mass_kg,
                self._collision(piece.item),
                visual,
                pose.position,
                pose.orientation,
                physicsClientId=self.client,
            )
        )
        if texture >= 0:
            pybullet.changeVisualShape(
                body_id, -1, textureUniqueId=texture, physicsClientId=self.client
            )
        dynamics: dict[str, object] = {"lateralFriction": 0.8}
        if isinstance(form.primitive, SphereSpec):
            # Enough to keep a sphere where it was put, too little to hold up what is put on it.
            dynamics["rollingFriction"] = 0.0003
        if form.inertia is not None:
            dynamics["localInertiaDiagonal"] = (piece.item.mass_kg * form.inertia).tolist()
        pybullet.changeDynamics(body_id, -1, **dynamics, physicsClientId=self.client)
        return body_id

    def _lower(self, body: int, piece: Piece, z: float, orientation: Quaternion) -> float:
        """Conservative advancement: down by the distance to the nearest thing until it touches.

        A body may always sink by its distance, so it never enters another, however irregular.
        """
        others = [self._table, *(other.id for other in self.bodies if _may_meet(piece, other))]
        for _ in range(_LOWERING_STEPS):
            gap = min(self._gap(body, other) for other in others)
            if gap < _CONTACT_GAP_M:
                break
            z -= gap
            pybullet.resetBasePositionAndOrientation(
                body, [piece.x_m, piece.y_m, z], orientation, physicsClientId=self.client
            )
        return z

    def _push(self, body: Body, goal: Body) -> Body:
        """Conservative advancement along the table."""
        others = [other.id for other in self.bodies if other is not body]
        start = np.array(body.pose.position)
        way = (np.array(goal.pose.position) - start) * [1.0, 1.0, 0.0]
        place, way = start, way / np.linalg.norm(way)
        for _ in range(_LOWERING_STEPS):
            gap = min(self._gap(body.id, other) for other in others)
            if gap < _CONTACT_GAP_M:
                break
            place = place + gap * way
            pybullet.resetBasePositionAndOrientation(
                body.id, place, body.pose.orientation, physicsClientId=self.client
            )
        x, y, z = (float(value) for value in place)
        pose = Pose((x, y, z), body.pose.orientation)
        return Body(body.id, replace(body.piece, x_m=x, y_m=y), pose)

    def _gap(self, body: int, other: int) -> float:
        points = pybullet.getClosestPoints(body, other, 10.0, physicsClientId=self.client)
        return min((float(point[8]) for point in points), default=math.inf)

    def _collision(self, item: CatalogueItem) -> int:
        """Id of the collision shape, made once."""
        if item not in self._collisions:
            form = self.catalogue.form(item)
            self._collisions[item] = create_collision_shape(form, self.client)
        return self._collisions[item]

    def _visual(self, item: CatalogueItem, color: Color) -> tuple[int, int]:
        """Ids of the visual shape and of its texture (-1 = none), each made once."""
        if (item, color) not in self._visuals:
            looks = self.catalogue.looks(item)
            texture, rgb = -1, COLORS[color]
            if looks.texture is not None:
                texture, rgb = load_texture(read_texture(looks.texture), self.client), _UNTINTED
            elif looks.marks or any(looks.plain):
                image = paint(rgb, looks.marks, looks.plain)
                texture, rgb = load_texture(image, self.client), _UNTINTED
            shape = create_visual_shape(self.catalogue.form(item), [*rgb, 1.0], self.client)
            self._visuals[item, color] = (shape, texture)
        return self._visuals[item, color]


def _may_meet(piece: Piece, other: Body) -> bool:
    """Whether something that is lowered may touch a body: their upright cylinders overlap."""
    x, y, _ = other.pose.position
    reach = piece.item.radius_m + other.piece.item.radius_m
    return math.hypot(piece.x_m - x, piece.y_m - y) < reach + _CONTACT_GAP_M


_UNTINTED = (1.0, 1.0, 1.0)
_GROUND_M = 20.0
_GROUND_THICKNESS_M = 0.1
_OUT_OF_SIGHT = np.array([0.0, 0.0, -50.0])
_CONTACT_GAP_M = 0.0002
_LOWERING_STEPS = 60
