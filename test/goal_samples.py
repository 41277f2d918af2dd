"""A table with objects, and a reasoner's goal keeper that acts on it: no camera, no graph."""

from __future__ import annotations

from planning_samples import LEARNED, TRACE_1

from ros_scenesense.messages.actions import Action, ActionResult, Goal
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.reasoning.described_scenes import described_scene
from ros_scenesense.reasoning.situations import robot_domain
from ros_scenesense.stages.goal_ledger import GoalLedger
from ros_scenesense.stages.goals import GoalKeeper, GoalLimits
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.planning_engine import PlanningEngine
from ros_scenesense.stages.protocol import JobFailure, Timing
from ros_scenesense.stages.seen_scenes import SeenScene
from ros_scenesense.stages.state_file import IN_MEMORY

SECOND = 1_000_000_000
GOAL = Goal(goal="on(red_can, white_cube)")
LIMITS = GoalLimits(time_limit_s=20.0, max_steps=12, plans=3, patience_s=5.0)


class World:
    """A keeper, its worker, and a table with objects: what the camera and the robot would say."""

    def __init__(self, path=IN_MEMORY, withheld=LEARNED, limits=LIMITS):
        self.health = Health()
        self.ledger = GoalLedger(path, self.health)
        self.keeper = GoalKeeper(self.ledger, limits, self.health)
        self.withheld = frozenset(withheld)
        self.domain = robot_domain()
        self.objects = dict(TRACE_1["objects"])
        self.on = {"duck": "white_cube", "white_cube": "red_can", "red_can": "table"}
        self.slippery = set()
        self.hidden = set()
        self.number = 0
        self.episode = (None, 0)
        self.held = None

    def settle(self, outgoing):
        """What is published until nothing is left to work out; timings are left out."""
        published = list(outgoing)
        while jobs := self.keeper.jobs():
            for job in jobs:
                try:
                    result = getattr(PlanningEngine(), job.method)(*job.arguments)
                except Exception as error:
                    result = JobFailure(str(error))
                published += self.keeper.finish(job, result, 0)
        return [item for item in published if not isinstance(item, Timing)]

    def show(self):
        """The world as a new scene."""
        content = {
            "objects": {
                name: each
                for name, each in self.objects.items()
                if name != self.held and name not in self.hidden
            },
            "relations": [
                f"on({a}, {b})"
                for a, b in self.on.items()
                if b != "table" and not {a, b} & self.hidden
            ],
        }
        scene = Scene(
            stamp=Stamp.of(self.number),
            scene_id=f"s-{self.number:04d}",
            mode="testing",
            objects=[],
            episode_id=self.episode[0],
            step=self.episode[1],
            in_hand=self.held,
        )
        self.number += 1
        facts = described_scene(content, "world").facts
        seen = SeenScene(scene, facts, self.domain, self.withheld)
        return self.settle(self.keeper.take_scene(seen, 0))

    def want(self, goal=GOAL):
        return self.settle(self.keeper.take_goal(goal, 0))

    def do(self, action):
        """The robot does it; the answer, and the scene of its effect."""
        planned = action.action
        if planned.kind == "pickup":
            self.held = planned.object
            del self.on[planned.object]
        else:
            slips = planned.location in self.slippery
            self.on[planned.object] = "table" if slips else planned.location
            self.held = None
        self.episode = (action.episode_id, action.step + 1)
        return self.answer(action, "executed") + self.show()

    def answer(self, action, outcome, **more):
        result = ActionResult(
            stamp=action.stamp, scene_id=action.scene_id, id=action.id, outcome=outcome, **more
        )
        return self.settle(self.keeper.take_result(result, 0))

    def pursue(self, published):
        """Does what is asked for until nothing is; all that was published."""
        everything = list(published)
        while published and isinstance(published[-1], Action):
            published = self.do(published[-1])
            everything += published
        return everything


def started(**options):
    """A world whose first scene was seen, and what was published when the goal came."""
    world = World(**options)
    assert world.show() == []
    return world, world.want()
