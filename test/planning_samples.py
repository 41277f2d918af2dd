"""Scenes to plan in, and a plain reading of the robot's domain to hold plans against."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ros_scenesense.knowledge.literals import Atom
from ros_scenesense.reasoning.described_scenes import KnownScene, described_scene
from ros_scenesense.reasoning.planning import FoundPlan
from ros_scenesense.reasoning.situations import Situation, robot_domain

LEARNED = ("s1", "s2", "s3", "o1", "o2", "o3")

TRACE_1 = {
    "objects": {
        "duck": {"size": "medium", "surface": "irregular"},
        "white_cube": {"size": "medium", "surface": "flat"},
        "red_can": {"size": "medium", "surface": "flat"},
    },
    "relations": ["on(duck, white_cube)", "on(white_cube, red_can)"],
}
"""Where the paper's first execution trace begins."""


def scene(stacks: Sequence[Sequence[str]], small: str = "", irregular: str = "") -> KnownScene:
    """A scene of stacks, each told from its lowest object up; objects are single letters."""
    names = [name for stack in stacks for name in stack]
    objects = {
        name: {
            "size": "small" if name in small else "medium",
            "surface": "irregular" if name in irregular else "flat",
        }
        for name in names
    }
    on = [f"on({b}, {a})" for stack in stacks for a, b in pairwise(stack)]
    return described_scene({"objects": objects, "relations": on}, "test")


def situation(known: KnownScene, withheld: Sequence[str] = ()) -> Situation:
    return Situation(robot_domain(), known, withheld)


def words(found: FoundPlan) -> list[str]:
    """Its actions without the robot."""
    return [str(Atom(each.name, each.arguments[1:])) for each in found.actions]


@dataclass(frozen=True)
class World:
    """Stacks of single letters, what is held, and which objects are small or irregular."""

    stacks: frozenset[tuple[str, ...]]
    held: str = ""

    def successors(self, small: str, irregular: str) -> Iterator[tuple[str, World, int]]:
        """Every action: its words, where it leads, how many exceptions to defaults it takes."""
        for stack in self.stacks:
            rest = self.stacks - {stack}
            if not self.held:
                left = {stack[:-1]} if len(stack) > 1 else set()
                yield f"pickup({stack[-1]})", World(frozenset(rest | left), stack[-1]), 0
            elif not any(name in irregular for name in stack):
                default = len(stack) > 3 or any(name in small for name in stack)
                put = World(frozenset(rest | {(*stack, self.held)}))
                yield f"putdown({self.held}, {stack[-1]})", put, int(default)
        if self.held:
            put = World(self.stacks | {(self.held,)})
            yield f"putdown({self.held}, table)", put, 0

    def on(self, upper: str, lower: str) -> bool:
        return any(f"{lower}{upper}" in "".join(stack) for stack in self.stacks)


def shortest_plans(
    start: World, upper: str, lower: str, small: str, irregular: str, most: int
) -> tuple[int, set[tuple[str, ...]]]:
    """The shortest plans to have one object on another that have fewest exceptions; how many."""
    level: list[tuple[tuple[str, ...], World, int]] = [((), start, 0)]
    for _ in range(most + 1):
        reached = [(cost, plan) for plan, world, cost in level if world.on(upper, lower)]
        if reached:
            least = min(cost for cost, _ in reached)
            return least, {plan for cost, plan in reached if cost == least}
        level = [
            ((*plan, action), after, cost + more)
            for plan, world, cost in level
            for action, after, more in world.successors(small, irregular)
        ]
    return 0, set()
