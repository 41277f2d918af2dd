"""What a scene must be like: for datasets in which labels are balanced by rejection."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ros_scenesense.scene import Truth, find_structures
from ros_scenesense.simulation.arrangements import Arrangement, Layout
from ros_scenesense.simulation.stability import structure_stability

if TYPE_CHECKING:
    from ros_scenesense.simulation.statics import Statics


@dataclass(frozen=True)
class Wish:
    """What is asked of a scene; None asks nothing.

    Attributes:
        arrangement: How its objects are arranged.
        stacked: Number of objects in its largest structure.
        stable: Whether that structure is stable: an ambiguous one is refused either way.
    """

    arrangement: Arrangement | None = None
    stacked: int | None = None
    stable: bool | None = None

    def may_fit(self, layout: Layout, statics: Statics) -> bool:
        """Whether it is worth while to build a layout: what is certain before physics has spoken.

        Args:
            layout: What would be built.
            statics: What can be told of stacks.
        """
        if self.stacked is not None and self.stacked != len(largest(structures_of(layout))):
            return False
        if self.stable is None:
            return True
        members = largest(structures_of(layout))
        stack = [number for number, p in enumerate(layout.pieces) if p.name in members]
        pieces = [layout.pieces[number] for number in stack]
        is_chain = [piece.support for piece in pieces] == [None, *stack[:-1]]
        return not is_chain or statics.stands(pieces) is not (not self.stable)

    def may_come_true(self, layout: Layout, moved: Mapping[str, bool]) -> bool:
        """Whether the largest structure may yet be as asked, after a repetition of the test.

        Args:
            layout: What was built.
            moved: By name, whether the object moved in the repetition.
        """
        fell = any(moved[name] for name in largest(structures_of(layout)))
        return self.stable is None or self.stable is not fell

    def comes_true(self, layout: Layout, stable: Mapping[str, Truth]) -> bool:
        """Whether the largest structure is as asked.

        Args:
            layout: What was built.
            stable: Stability of every object by name.
        """
        if self.stable is None:
            return True
        asked = Truth.TRUE if self.stable else Truth.FALSE
        return structure_stability(largest(structures_of(layout)), stable) is asked


ANY = Wish()
"""Asks nothing."""


def structures_of(layout: Layout) -> list[tuple[str, ...]]:
    """The structures of a layout, sorted, each a sorted tuple of names."""
    return find_structures([piece.name for piece in layout.pieces], layout.supports())


def largest(structures: Iterable[tuple[str, ...]]) -> tuple[str, ...]:
    """The structure of most members; of several the first."""
    return max(structures, key=len)
