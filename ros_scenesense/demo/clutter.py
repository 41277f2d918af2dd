"""The robot tidies up: a messy table, the goal `reduce_clutter`, and physics as the judge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ros_scenesense.demo.record import SceneRecord
from ros_scenesense.demo.session import Session, SessionOptions, running
from ros_scenesense.demo.story import Chapter, Story
from ros_scenesense.errors import LaunchError
from ros_scenesense.messages.scenes import Labels
from ros_scenesense.resources import resource
from ros_scenesense.scene import Truth

GOAL = "reduce_clutter"


@dataclass(frozen=True)
class Tidiness:
    """What physics and pixels say of a scene.

    Attributes:
        objects: How many there are.
        occluded: Names of those that are hidden, at least in part.
        unstable: Names of those that would not stay.
        structures: Stacks, and objects that stand alone, from the table up.
        visible: Visible share of every object.
    """

    objects: int
    occluded: tuple[str, ...]
    unstable: tuple[str, ...]
    structures: tuple[tuple[str, ...], ...]
    visible: dict[str, float]

    @property
    def on_table(self) -> str:
        """What stands on the table, in words."""
        return "; ".join(
            f"a stack of {', '.join(each)}" if len(each) > 1 else each[0]
            for each in self.structures
        )

    @classmethod
    def of(cls, labels: Labels) -> Tidiness:
        """What the labels of a scene say."""
        return cls(
            objects=len(labels.objects),
            occluded=tuple(e.name for e in labels.objects if e.occluded is Truth.TRUE),
            unstable=tuple(e.name for e in labels.objects if e.stable is Truth.FALSE),
            structures=tuple(tuple(each.members) for each in labels.structures),
            visible={
                each.name: each.visible_fraction
                for each in labels.objects
                if each.visible_fraction is not None
            },
        )


def play(
    options: SessionOptions,
    story: Story,
    scene_file: str,
    seed: int,
    report: Callable[[str], None],
) -> tuple[SceneRecord, SceneRecord]:
    """Has the robot tidy up.

    Args:
        options: Where and how.
        story: Takes what is seen.
        scene_file: The messy table; empty = `config/scenes/clutter.yaml`.
        seed: Of where exactly the robot puts things.
        report: Takes what the launcher says.

    Returns:
        The scene before and the one afterwards.

    Raises:
        LaunchError: If the graph fails, or the goal is not reached.
    """
    path = Path(scene_file) if scene_file else resource("config", "scenes/clutter.yaml")
    overrides: dict[str, dict[str, object]] = {
        "simulated_camera": {"scene_files": str(path), "seed": seed},
    }
    with running(options, "clutter", overrides, story, report) as (graph, node):
        session = Session(graph, node, story)
        before = session.scene()
        words = "The robot is to tidy up: nothing hidden, nothing unstable, little on the table."
        story.tell(Chapter("The goal", words))
        attempt = session.want(GOAL)
        after = session.scene()
    if not attempt.is_reached:
        reason = attempt.end.reason if attempt.end is not None else ""
        raise LaunchError(f"the table was not tidied up: {reason}")
    return before, after
