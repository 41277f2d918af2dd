"""The paper's first execution trace on the real graph (paper, *Execution Trace*, example 1).

The robot does not know that what stands on something irregular is unstable. It plans, is surprised,
explains what happened, learns, plans anew, and when it is given the same goal in the same scene
again, its plan is the better one. Nothing is put into its knowledge: before the goal is given it is
shown labelled scenes, from which it learns by its normal algorithm when it is surprised.
"""

from __future__ import annotations

from collections.abc import Callable

from ros_scenesense.demo.session import Session, SessionOptions, collect, running
from ros_scenesense.demo.story import Attempt, Chapter, Learned, Story
from ros_scenesense.errors import LaunchError
from ros_scenesense.resources import resource

GOAL = "on(red_cylinder, white_cube)"
WITHHELD = "s1,s2,s3,o1,o2,o3"


def play(
    options: SessionOptions,
    story: Story,
    scenes: int,
    seed: int,
    report: Callable[[str], None],
    shown: Callable[[int], None],
) -> None:
    """Plays the trace.

    Args:
        options: Where and how.
        story: Takes what is seen.
        scenes: Labelled scenes that the robot is shown before.
        seed: Of these scenes.
        report: Takes what the launcher says.
        shown: Called with the number of labelled scenes that are kept so far.

    Raises:
        LaunchError: If the graph fails, or the story goes otherwise than in the paper.
    """
    overrides: dict[str, dict[str, object]] = {
        "reasoner": {"withheld": WITHHELD},
        "attention": {"network": "none"},
        "simulated_camera": {"seed": seed},
    }
    story.tell(
        Chapter(
            "Labelled scenes",
            f"The robot is shown {scenes} scenes with their labels. Of what makes things stable or "
            f"hidden, axioms {WITHHELD} are missing in its knowledge, and it does not learn yet.",
        )
    )
    kept = collect(options, scenes, overrides, report, shown)
    story.tell(Chapter("", f"{kept} scenes are kept: those of which everything is known."))
    overrides["axiom_learner"] = {"cycle_scenes": 0}
    overrides["simulated_camera"] = {
        "scene_files": str(resource("config", "scenes/trace_1.yaml")),
        "seed": seed,
    }
    with running(options, "trace", overrides, story, report) as (graph, node):
        session = Session(graph, node, story)
        session.scene()
        story.tell(Chapter("The goal", "A duck stands on a white cube on a red can."))
        first = session.want(GOAL)
        session.learned()
        session.reset()
        words = "The scene is set up as before, and the robot is given the same goal again."
        story.tell(Chapter("The same goal again", words))
        second = session.want(GOAL)
    _check(story, first, second)


def _check(story: Story, first: Attempt, second: Attempt) -> None:
    """That the story went as in the paper."""
    learned = any(isinstance(each, Learned) and each.axioms for each in story.entries)
    for fine, words in (
        (first.is_reached, "the goal was not reached the first time"),
        (first.surprises, "the first plan met with no surprise"),
        (learned, "no axiom was learned from the surprise"),
        (second.is_reached, "the goal was not reached the second time"),
        (not second.surprises, "the second plan met with a surprise, too"),
        (
            [plan.actions for plan in first.plans[:1]] != [plan.actions for plan in second.plans],
            "the second plan was the first one",
        ),
    ):
        if not fine:
            raise LaunchError(f"the story went otherwise than in the paper: {words}")
