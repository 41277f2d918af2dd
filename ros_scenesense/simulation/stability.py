"""Stability labels: time runs, and who has moved was not stable.

Judged structure by structure: for the test the structures stand far apart, so that a bystander
that would be hit by somebody else's fall keeps its own label. Repeated with small displacements;
where the repetitions disagree, the label is ambiguous. What stands upright on the table and carries
nothing behaves the same wherever it stands and is displaced to: it is tested once for its kind.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ros_scenesense.scene import Truth, structure_truth
from ros_scenesense.simulation.arrangements import Piece

if TYPE_CHECKING:
    from ros_scenesense.simulation.catalogue import CatalogueItem
    from ros_scenesense.simulation.world import World

UNSTABLE_DISPLACEMENT_M = 0.02
JITTER_M = 0.0015
REPETITIONS = 3


def stability(
    world: World, structures: Sequence[tuple[str, ...]], rng: np.random.Generator
) -> dict[str, Truth]:
    """Stability of every body of the world; leaves the bodies displaced.

    Args:
        world: The world as built.
        structures: Names of the members of each structure.
        rng: Source of the displacements.

    Returns:
        By name: TRUE if the centre of mass of the object stays within 2 cm for two seconds in
        every repetition, FALSE if in none, else AMBIGUOUS. The first repetition is as built, in
        the others each object is displaced horizontally by 1.5 mm in a random direction.
    """
    return judged(list(repetitions(world, structures, rng)))


def repetitions(
    world: World, structures: Sequence[tuple[str, ...]], rng: np.random.Generator
) -> Iterator[dict[str, bool]]:
    """Runs the repetitions of the test of `stability`, each when it is asked for.

    Args:
        world: The world as built.
        structures: Names of the members of each structure that is tested; the other bodies are
            out of the way.
        rng: Source of the displacements.

    Yields:
        By name, whether the body moved in this repetition.
    """
    number = {name: i for i, members in enumerate(structures) for name in members}
    tested = np.array([body.piece.name in number for body in world.bodies], dtype=np.bool_)
    apart = _apart(world, number)
    for repetition in range(REPETITIONS):
        angles = rng.uniform(-np.pi, np.pi, len(world.bodies))
        jitter = JITTER_M * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
        moved = _moved(world, apart + (jitter if repetition else 0.0), tested)
        names = (body.piece.name for body in world.bodies)
        yield {
            name: bool(one) for name, one, there in zip(names, moved, tested, strict=True) if there
        }


class StandingTest:
    """Which kinds of objects stay where they are put on the table, with nothing on them.

    Args:
        world: Where kinds are tested that were not seen before.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._stays: dict[CatalogueItem, bool] = {}

    def stays(self, item: CatalogueItem) -> bool:
        """Whether an object of this kind stays; the bodies of the world may be gone afterwards."""
        if item not in self._stays:
            self._world.build([Piece(item, item.colors[0], 0.0, 0.0, 0.0)])
            self._stays[item] = not _moved(self._world, np.zeros((1, 3)), np.array([True]))[0]
            self._world.clear()
        return self._stays[item]


def judged(moved: Sequence[Mapping[str, bool]]) -> dict[str, Truth]:
    """Stability by name, from who moved in each repetition."""
    return {name: _truth([one[name] for one in moved]) for name in moved[0]}


def structure_stability(members: Iterable[str], stable: Mapping[str, Truth]) -> Truth:
    """Label of a structure: unstable if a member surely is, stable only if all surely are."""
    known = {Truth.TRUE: True, Truth.FALSE: False}
    truth = structure_truth(members, {name: known.get(value) for name, value in stable.items()})
    return Truth.AMBIGUOUS if truth is None else Truth.TRUE if truth else Truth.FALSE


_APART_M = 2.0
_ASIDE_M = -100.0
_STEPS = 480
_CHECK_STEPS = 12
# From here on a body that stands still is taken to stay; one that has moved this far has fallen.
_FIRST_REST_STEP = 72
_REST_SPEED_M_S = 0.004
_FALLEN_M = 0.06


def _apart(world: World, number: Mapping[str, int]) -> npt.NDArray[np.float64]:
    """Shift (N, 3) of every body that puts the numbered structures side by side, far apart.

    What is of none of them falls freely, far below.
    """
    shifts = np.zeros((len(world.bodies), 3))
    for shift, body in zip(shifts, world.bodies, strict=True):
        place = number.get(body.piece.name)
        shift[1:] = (0.0, _ASIDE_M) if place is None else (_APART_M * place, 0.0)
    return shifts


def _moved(
    world: World, shifts: npt.NDArray[np.float64], tested: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Whether each body moves when it starts at rest where it was built plus its shift.

    Time runs until all bodies that are tested have come to rest or fallen.
    """
    if not tested.any():
        return np.zeros(len(world.bodies), dtype=np.bool_)
    for body, shift in zip(world.bodies, shifts, strict=True):
        world.move(body, shift)
    start = previous = world.positions()
    for step in range(_CHECK_STEPS, _STEPS + 1, _CHECK_STEPS):
        world.step(_CHECK_STEPS)
        now = world.positions()
        displacement = np.linalg.norm(now - start, axis=1)
        speed = np.linalg.norm(now - previous, axis=1) * 240.0 / _CHECK_STEPS
        at_rest = (speed < _REST_SPEED_M_S) & (step >= _FIRST_REST_STEP)
        if np.all(at_rest | (displacement > _FALLEN_M) | ~tested):
            break
        previous = now
    moved: npt.NDArray[np.bool_] = displacement > UNSTABLE_DISPLACEMENT_M
    return moved


def _truth(moved: Sequence[bool]) -> Truth:
    if all(moved):
        return Truth.FALSE
    return Truth.AMBIGUOUS if any(moved) else Truth.TRUE
