"""What the robot does to the world: a hand that picks objects up and puts them down.

The hand is kinematic: it lifts straight up whatever it holds, carries it out of the way, and lowers
it upright until it touches something. Everything else is physics, also what happens once it lets
go. Source: the actions of the paper's Robot Assistant domain.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Intrinsics, Pose, transform_points
from ros_scenesense.simulation.arrangements import Piece, draw_offset
from ros_scenesense.simulation.contacts import bottom_up, supports
from ros_scenesense.simulation.stability import UNSTABLE_DISPLACEMENT_M
from ros_scenesense.simulation.world import Body, World

TABLE = "table"
"""The location that is no object."""

CLEARANCE_M = 0.02
"""Room that an object on the table has to every side."""


@dataclass(frozen=True)
class ActionOutcome:
    """What became of an action.

    Attributes:
        executed: False if a precondition was violated; then nothing has changed.
        reason: Which precondition; empty if it was executed.
        settled_on: After a putdown what the object stands on at last: a name or `table`.
        moved: Sorted names of the other objects that moved more than 2 cm.
    """

    executed: bool
    reason: str = ""
    settled_on: str | None = None
    moved: tuple[str, ...] = ()


@dataclass(frozen=True)
class View:
    """The camera in front of which the hand works.

    Attributes:
        pose: Of the optical frame in the world.
        intrinsics: Of its images.
    """

    pose: Pose
    intrinsics: Intrinsics

    def boxes(self, corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Image boxes of N things.

        Args:
            corners: (N, 8, 3) corners in the world, metres.

        Returns:
            (N, 4): left, top, right, bottom in pixels; NaN where something is behind the camera.
        """
        points = transform_points(np.linalg.inv(self.pose.matrix()), corners)
        points[points[..., 2] <= 0.0] = np.nan
        pixels = self.intrinsics.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
        return np.concatenate([pixels.min(axis=1), pixels.max(axis=1)], axis=1)

    def contains(self, boxes: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        """Which of N image boxes (N, 4) lie in the image, as (N,)."""
        far_corner = [self.intrinsics.width - 1, self.intrinsics.height - 1]
        inside = (boxes[:, :2] >= 0.0) & (boxes[:, 2:] <= far_corner)
        return np.asarray(inside.all(axis=1))


class Manipulation:
    """A hand in a world.

    Args:
        world: As built. The hand takes what it holds out of `world.bodies`.
        supports: Pairs (upper, lower) of names: what stands on what.
        view: The camera that must see what is put on the table.
        error_m: So far from the middle of its support, at most, it puts an object; None = as far
            as everything in the world is built.
    """

    def __init__(
        self,
        world: World,
        supports: Iterable[tuple[str, str]],
        view: View,
        error_m: float | None = None,
    ) -> None:
        self.world = world
        self.view = view
        self.error_m = error_m
        self.supports = list(supports)
        self.held: Piece | None = None

    def pickup(self, name: str) -> ActionOutcome:
        """Takes an object off what it stands on.

        Refused if the hand is full, the object is not there, or something stands on it.
        """
        if self.held is not None:
            return _refused(f"the hand holds {self.held.name}")
        if not self._knows(name):
            return self._unknown(name)
        load = self._load(name)
        if load:
            return _refused(f"{load} stands on {name}")
        self.world.renew()
        before = self._positions()
        del before[name]
        body = self._body(name)
        self._lift(body)
        self.held = body.piece
        self.world.remove(body)
        return ActionOutcome(True, moved=self._settle(before))

    def putdown(self, name: str, location: str, rng: np.random.Generator) -> ActionOutcome:
        """Puts the held object down and lets go.

        On an object it is put as near to the middle as the hand can, on the table where there is
        room and the camera sees it. Refused if the hand does not hold it, the location is not
        there, carries something or is the object itself, or the table has no room.

        Args:
            name: The held object.
            location: An object, or `table`.
            rng: Source of the offset and of the place on the table.
        """
        if self.held is None:
            return _refused("the hand is empty")
        if name != self.held.name:
            return _refused(f"the hand holds {self.held.name}, not {name}")
        if location == name:
            return _refused(f"{name} cannot be put on itself")
        self.world.renew()
        place = self._place(self.held, location, rng)
        if isinstance(place, ActionOutcome):
            return place
        x, y = place
        before = self._positions()
        self.world.put(replace(self.held, x_m=x, y_m=y, support=None))
        self.held = None
        moved = self._settle(before)
        return ActionOutcome(True, settled_on=self._support(name), moved=moved)

    def _place(
        self, piece: Piece, location: str, rng: np.random.Generator
    ) -> tuple[float, float] | ActionOutcome:
        if location == TABLE:
            free = self._free_place(piece, rng)
            return _refused(f"the table has no room for {piece.name}") if free is None else free
        if not self._knows(location):
            return self._unknown(location)
        load = self._load(location)
        if load:
            return _refused(f"{load} stands on {location}")
        target = self._body(location)
        x, y = draw_offset(piece.item, target.piece.item, rng, self.error_m)
        return target.pose.position[0] + x, target.pose.position[1] + y

    def _knows(self, name: str) -> bool:
        return any(body.piece.name == name for body in self.world.bodies)

    def _body(self, name: str) -> Body:
        return next(body for body in self.world.bodies if body.piece.name == name)

    def _unknown(self, name: str) -> ActionOutcome:
        names = ", ".join(sorted(body.piece.name for body in self.world.bodies))
        return _refused(f"{name} is not in the scene, which has: {names or 'nothing'}")

    def _load(self, name: str) -> str:
        """What stands on an object, in words; empty if nothing does."""
        return " and ".join(sorted(upper for upper, lower in self.supports if lower == name))

    def _support(self, name: str) -> str:
        lowers = sorted(lower for upper, lower in self.supports if upper == name)
        return lowers[0] if lowers else TABLE

    def _positions(self) -> dict[str, npt.NDArray[np.float64]]:
        positions = self.world.positions()
        return {
            body.piece.name: position
            for body, position in zip(self.world.bodies, positions, strict=True)
        }

    def _lift(self, body: Body) -> None:
        """Raises a body above all others while time runs for them."""
        top = max(corner[2] for corner in self.world.corners())
        for height in np.arange(_LIFT_M, top + _LIFT_M, _LIFT_M):
            self.world.move(body, [0.0, 0.0, height])
            self.world.step(1)

    def _settle(self, before: dict[str, npt.NDArray[np.float64]]) -> tuple[str, ...]:
        """Lets time run until all is at rest; returns who has moved."""
        previous = self.world.positions()
        for step in range(_CHECK_STEPS, _SETTLE_STEPS + 1, _CHECK_STEPS):
            self.world.step(_CHECK_STEPS)
            now = self.world.positions()
            if step >= _FIRST_REST_STEP and np.all(np.abs(now - previous) < _REST_M):
                break
            previous = now
        self.world.keep()
        self.supports = supports(self.world)
        self._sort()
        after = self._positions()
        return tuple(
            sorted(
                name
                for name, position in before.items()
                if np.linalg.norm(after[name] - position) > UNSTABLE_DISPLACEMENT_M
            )
        )

    def _sort(self) -> None:
        """Brings the bodies into the order of a layout: supports before what they carry."""
        bodies = self.world.bodies
        names = bottom_up([body.piece.name for body in bodies], self.supports)
        bodies.sort(key=lambda body: names.index(body.piece.name))
        below = {upper: names.index(lower) for upper, lower in reversed(self.supports)}
        bodies[:] = [
            replace(body, piece=replace(body.piece, support=below.get(body.piece.name)))
            for body in bodies
        ]

    def _free_place(self, piece: Piece, rng: np.random.Generator) -> tuple[float, float] | None:
        """Where nothing is near and the camera sees the object with least behind or before it.

        Of equally good places it takes the one nearest to the others.
        """
        obstacles = self.world.corners().reshape(-1, 8, 3)
        middle = obstacles[..., :2].mean(axis=(0, 1)) if len(obstacles) else np.zeros(2)
        places = middle + rng.uniform(-_REACH_M, _REACH_M, (_CANDIDATES, 2))
        boxes = self.view.boxes(_upright_boxes(piece, places))
        free = self.view.contains(boxes) & (_gaps(places, piece, obstacles) >= CLEARANCE_M)
        if not np.any(free):
            return None
        # Pixels first; a metre, which breaks ties, weighs as little as one of them.
        cost = _overlaps(boxes, self.view.boxes(obstacles))
        cost += np.linalg.norm(places - middle, axis=1)
        best = int(np.argmin(np.where(free, cost, math.inf)))
        return float(places[best, 0]), float(places[best, 1])


# The hand lifts by this much per step of 1/240 s: 1 m/s.
_LIFT_M = 0.004
_SETTLE_STEPS = 960
_CHECK_STEPS = 24
# What topples begins slowly.
_FIRST_REST_STEP = 72
# At rest: less than this in a tenth of a second, also for spheres that roll slowly.
_REST_M = 0.0002
_REACH_M = 0.45
_CANDIDATES = 600


def _refused(reason: str) -> ActionOutcome:
    return ActionOutcome(False, reason)


def _upright_boxes(piece: Piece, places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Corners (N, 8, 3) of the upright boxes about an object at N places (N, 2) on the table."""
    radius, height = piece.item.radius_m, piece.item.height_m
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 1)])
    local: npt.NDArray[np.float64] = signs * np.array([radius, radius, height])
    return np.pad(places, ((0, 0), (0, 1)))[:, None, :] + local


def _gaps(
    places: npt.NDArray[np.float64], piece: Piece, obstacles: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Distance (N,) from an object at each place (N, 2) to the nearest obstacle (M, 8, 3)."""
    low, high = obstacles[..., :2].min(axis=1), obstacles[..., :2].max(axis=1)
    points = places[:, None, :]
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    distances = np.linalg.norm(outside, axis=-1) - piece.item.radius_m
    return np.asarray(distances.min(axis=1, initial=math.inf))


def _overlaps(
    boxes: npt.NDArray[np.float64], others: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Pixels (N,) that each image box (N, 4) shares with the others (M, 4) together."""
    shared = np.minimum(boxes[:, None, 2:], others[:, 2:]) - np.maximum(
        boxes[:, None, :2], others[:, :2]
    )
    return np.asarray(np.prod(np.maximum(shared, 0.0), axis=-1).sum(axis=1))
