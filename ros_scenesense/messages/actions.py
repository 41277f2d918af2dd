"""Actions on the world, their outcome, and the goals and plans they come from."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from ros_scenesense.messages.base import (
    Count,
    HumanMessage,
    Identifier,
    Message,
    Name,
    Part,
    SceneMessage,
    Text,
)


class PlannedAction(Part, frozen=True):
    """`pickup(object)` or `putdown(object, location)`; location is an object or `table`."""

    kind: Literal["pickup", "putdown"]
    object: Name
    location: Name | None = None


class Action(SceneMessage, frozen=True, tag="action/1"):
    """Asks the robot to execute one step of a plan in the shown scene."""

    id: Identifier
    episode_id: Identifier
    step: Count
    action: PlannedAction


class ActionResult(SceneMessage, frozen=True, tag="action_result/1"):
    """Says that an action was executed or refused. Its effect is seen, not told.

    `shown` is the scene that was shown last if the action was about another one.
    """

    id: Identifier
    outcome: Literal["executed", "refused"]
    reason: Text = ""
    shown: Identifier | None = None


class Goal(HumanMessage, frozen=True, tag="goal/1"):
    """A goal in the domain's language, e.g. `on(red_can, white_cube)`."""

    goal: Annotated[str, msgspec.Meta(min_length=1, max_length=4096)]


class Plan(SceneMessage, frozen=True, tag="plan/1"):
    """The answer to a goal: the chosen plan, or why there is none.

    `found` may come several times, whenever it is planned anew; `reason` then says why. Every other
    outcome is the last word on the goal. `purposes` tells for each action what would fail without
    it, in the words of the domain.
    """

    id: Identifier
    goal: Text
    outcome: Literal["found", "reached", "no_plan", "refused", "timed_out", "failed"]
    actions: list[PlannedAction]
    reason: Text = ""
    purposes: list[Text] = []


class StateLiteral(Part, frozen=True):
    """A ground literal of a state, e.g. fluent `on`, arguments `[duck, red_can]`."""

    fluent: Name
    arguments: list[Name]
    holds: bool = True


class Transition(Message, frozen=True, tag="transition/1"):
    """State before, action, state after: what the learner learns action axioms from.

    `scene_before` and `scene_after` are the ids of the scenes in which the states were seen, the
    same one if the action was refused. `before` tells what is known of the objects, too.
    """

    id: Identifier
    episode_id: Identifier
    step: Count
    scene_before: Identifier
    scene_after: Identifier
    action: PlannedAction
    before: list[StateLiteral]
    after: list[StateLiteral]
    expected: list[StateLiteral]
    outcome: Literal["executed", "refused"] = "executed"
