"""Runs the graph for a story: what a person does with it, one thing after the other.

Goals are given on their topic, cycles and resets asked for by the services, and everything that
follows is waited for, as whoever works with the graph would do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from ros_scenesense.demo.domains import choose_domain
from ros_scenesense.demo.observer import Observer, Taker
from ros_scenesense.demo.record import RunRecord, SceneRecord
from ros_scenesense.demo.story import STORY_MESSAGES, Attempt, Story
from ros_scenesense.errors import LaunchError
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.messages.actions import Goal
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.qos import profile_of

_READY_S = 60.0
_SERVICE_S = 20.0
_SCENE_S = 60.0
_GOAL_S = 300.0
_CYCLE_S = 150.0

Overrides = Mapping[str, Mapping[str, object]]


@dataclass(frozen=True)
class SessionOptions:
    """Where and how a story is played.

    Attributes:
        folder: Run folder: state and logs are kept there.
        domain_id: ROS domain; None = each part of the story takes one that nobody uses.
        parameters_file: Params YAML; None = the shipped one.
        overrides: Values of the user per node and parameter, stronger than the story's own.
    """

    folder: Path
    domain_id: int | None
    parameters_file: Path | None
    overrides: Overrides


class Session:
    """The running graph, and a person who works with it.

    Args:
        graph: The graph.
        node: In it; says goals and calls services.
        story: What is seen.
    """

    def __init__(self, graph: Graph, node: Node, story: Story) -> None:
        self._graph = graph
        self._node = node
        self._story = story
        topic = TOPICS[Goal]
        self._goals = node.create_publisher(String, topic.name, profile_of(topic.qos))

    def scene(self) -> SceneRecord:
        """The newest scene, once it is decided and its image is here."""
        return self._scene_but("")

    def want(self, goal: str) -> Attempt:
        """Gives a goal; returns what was done for it once the last word is said."""
        ready = self._goals.get_subscription_count
        self._wait(lambda: ready() > 0, _SERVICE_S, "nobody listens to goals")
        before = len(self._story.attempts())
        self._goals.publish(String(data=encode(Goal(goal=goal)).decode()))

        def ended() -> bool:
            attempts = self._story.attempts()
            return len(attempts) > before and attempts[-1].end is not None

        self._wait(ended, _GOAL_S, f"goal {goal!r} was not pursued to its end")
        return self._story.attempts()[-1]

    def reset(self) -> SceneRecord:
        """Has the camera begin anew; returns the first scene."""
        old = self.scene().scene_id
        self._call("reset")
        return self._scene_but(old)

    def learned(self) -> None:
        """Waits until the learner has finished all cycles that it began, and the reasoner knows.

        Raises:
            LaunchError: If a cycle fails, or none is finished in time.
        """
        story = self._story
        over = "the axiom learner did not finish a cycle (topic job_progress)"
        self._wait(lambda: story.cycles_are_over or story.failed_cycle, _CYCLE_S, over)
        if story.failed_cycle is not None:
            raise LaunchError(f"nothing was learned: {story.failed_cycle}")
        words = "the reasoner has not put into force what was learned (topic knowledge)"
        self._wait(lambda: story.is_in_force, _SERVICE_S, words)

    def _scene_but(self, old: str) -> SceneRecord:
        """The newest scene, once it is another one than the old one."""
        run = self._story.run

        def newest() -> SceneRecord | None:
            shown = [each for each in run.scenes.values() if each.scene is not None]
            last = max(shown, key=lambda each: each.stamps_ns[0]) if shown else None
            if last is None or last.scene_id == old or not last.is_complete:
                return None
            return last if run.image(last, color=True) else None

        self._wait(newest, _SCENE_S, "no scene was decided")
        found = newest()
        assert found is not None
        return found

    def _call(self, service: str) -> None:
        client = self._node.create_client(Trigger, service)
        self._wait(client.service_is_ready, _SERVICE_S, f"there is no service {service}")
        answer = client.call_async(Trigger.Request())
        self._wait(answer.done, _SERVICE_S, f"service {service} gave no answer")
        self._node.destroy_client(client)

    def _wait(self, condition: Callable[[], object], timeout_s: float, words: str) -> None:
        if not self._graph.spin_until(lambda: bool(condition()), timeout_s):
            raise LaunchError(
                f"{words} within {timeout_s:g} s: see the logs in {self._graph.log_dir}"
            )


@contextmanager
def running(
    options: SessionOptions,
    name: str,
    overrides: Overrides,
    taker: Taker,
    report: Callable[[str], None],
    refresh: Callable[[], None] = lambda: None,
) -> Iterator[tuple[Graph, Node]]:
    """Runs the graph until the block ends.

    Args:
        options: Where and how.
        name: Of the part of the story: its logs get a folder of that name.
        overrides: What the story needs per node and parameter.
        taker: Takes what is seen.
        report: Takes what the launcher says.
        refresh: Called ten times a second.

    Raises:
        LaunchError: If the nodes cannot be started.
        ParameterError: If a parameter is wrong.
    """
    merged = {node: dict(values) for node, values in overrides.items()}
    for node, values in options.overrides.items():
        merged.setdefault(node, {}).update(values)
    domain = choose_domain(options.domain_id)
    report(f"starting the nodes in ROS domain {domain}")
    graph_options = GraphOptions(
        domain_id=domain,
        parameters_file=options.parameters_file,
        overrides=merged,
        state_dir=options.folder / "state",
        log_dir=options.folder / "logs" / name,
    )
    with Graph(graph_options, report=report) as graph:
        more: tuple[type[AnyMessage], ...] = STORY_MESSAGES
        observer = Observer(
            taker, refresh, more, namespace=graph.options.namespace, context=graph.context
        )
        graph.executor.add_node(observer.node)
        try:
            graph.wait_ready(timeout_s=_READY_S)
            yield graph, observer.node
        finally:
            graph.executor.remove_node(observer.node)
            observer.node.destroy_node()


def collect(
    options: SessionOptions,
    scenes: int,
    overrides: Overrides,
    report: Callable[[str], None],
    shown: Callable[[int], None],
) -> int:
    """Fills the pool of the axiom learner with labelled scenes; it learns nothing yet.

    Args:
        options: Where and how.
        scenes: How many scenes are shown.
        overrides: What else the nodes need.
        report: Takes what the launcher says.
        shown: Called with the number of scenes that are kept so far.

    Returns:
        How many the learner kept: those of which everything is known.

    Raises:
        LaunchError: If not all of them went through in time.
    """
    record = RunRecord(None)

    def counted(*names: str) -> int:
        node = record.nodes.get("axiom_learner")
        return 0 if node is None else sum(node.latest.counters.get(name, 0) for name in names)

    def taken() -> int:
        return counted("scenes_kept", "scenes_contradictory", "scenes_not_known_completely")

    mode = {"mode": "training", "scenes": scenes}
    camera = {**overrides.get("simulated_camera", {}), **mode}
    learner = {**overrides.get("axiom_learner", {}), "cycle_scenes": 0}
    merged = {**overrides, "simulated_camera": camera, "axiom_learner": learner}
    with running(
        options, "training", merged, record, report, lambda: shown(counted("scenes_kept"))
    ) as (graph, _):
        timeout_s = 60.0 + 5.0 * scenes
        if not graph.spin_until(lambda: taken() >= scenes, timeout_s):
            raise LaunchError(
                f"only {taken()} of {scenes} scenes reached the learner within {timeout_s:g} s: "
                f"see the logs in {graph.log_dir}"
            )
        shown(counted("scenes_kept"))
    return counted("scenes_kept")
