"""What the report of the experiment on planning says in words."""

from __future__ import annotations

from collections.abc import Mapping

from ros_scenesense.experiments.planning_trials import Limits
from ros_scenesense.simulation.rehearsal import CAREFUL_M


def notes_on(
    limits: Limits, scenes: tuple[int, int, int], figures: Mapping[str, float]
) -> list[str]:
    """The notes below the title."""
    learning, merging, judging = scenes
    capped = figures["trials_at_limit_with"], figures["trials_at_limit_without"]
    return [
        f"Our learner made the axioms of the last table from {learning} labelled scenes, and "
        f"{merging} chose between versions; the six axioms s1 to o3 were missing. They went to the "
        "planner as text of the action language. The states to plan in are other scenes: five "
        "objects that all stay where they are, and the paper's box behind a white box and a duck. "
        f"For each, {limits.goals} goals are drawn that do not hold: an object is not occluded; "
        "nothing is; one or two objects do not stand on the table any more; one is on another. "
        "A goal is drawn anew if the simulator cannot bring it about in the most straightforward "
        "way (all that is in the way is put on the table first), if there is no plan with or "
        f"without the learned axioms, or if the best plan has more than {limits.longest} actions.",
        "*With*: all that was learned. *Without*: without what was learned about stability. "
        "Axioms about occlusion stay, for goals about occlusion are said in their words: if "
        f"nothing was learned at all, {figures['trials_without_plan_if_nothing_was_learned']:.0f} "
        f"of the {figures['trials']:.0f} trials have no plan.",
        "*All plans*: all that first reach the goal within as many actions as the best plan with "
        "the learned axioms has (fewest exceptions to defaults, then fewest actions), or within "
        "two more; of these, those with fewest exceptions. They are counted up to "
        f"{limits.plans} (reached in {capped[0]:.0f} trials with and {capped[1]:.0f} without the "
        f"learned axioms), and {limits.executed} of them, drawn at random, are executed. Time is "
        "CPU time until all are listed.",
        "*Incorrect*: executed in the physics simulation, an action is refused, something that is "
        "put down does not stay there, something else moves by more than 2 cm, or the goal does "
        "not hold in the end (not occluded: at least 97 % visible). *Optimal*: correct, and of as "
        "few actions as any plan of the trial that proved correct. *Sub-optimal*: the other "
        "correct ones. Shares are means of the shares of each trial, intervals and tests are over "
        "the states.",
        f"The hand puts things down within {CAREFUL_M * 100:.0f} cm of the middle of their "
        "support. A *careless* hand is as inexact as the world is built (4.3 cm), which no plan "
        "can help where the goal itself asks for a stack.",
        f"*Decisions*: objects of {judging} scenes that nothing was learned from, with exact "
        "relations. *Accuracy*: share that is decided rightly; what is left undecided is not.",
    ]
