"""A node around a small stage: topics, worker, health reports, and staying alive."""

import os
from dataclasses import dataclass
from functools import partial

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Float32

from ros_scenesense.errors import ParameterError, StateError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Feedback, FeedbackResult, Trust
from ros_scenesense.messages.health import Heartbeat
from ros_scenesense.messages.topics import QosClass
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.qos import profile_of
from ros_scenesense.parameters import parameter
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import Figure, Job, JobFailure, Timing


@dataclass(frozen=True)
class EchoConfiguration:
    greeting: str = parameter("hello", "first word of every answer")
    engine: str = parameter("good", "kind of engine", choices=("good", "broken", "none"))
    state_file: str = parameter("good", "kind of state file", choices=("good", "broken"))


class EchoEngine:
    def answer(self, text: str) -> str:
        return text.upper()


class BrokenEngine:
    def __init__(self):
        raise RuntimeError("no power")


class EchoStage:
    """Answers a feedback by what its reference asks for; `work` goes through the engine."""

    def __init__(self, configuration: EchoConfiguration) -> None:
        if configuration.state_file == "broken":
            raise StateError("echo.db is held by another process")
        self.configuration = configuration
        self.health = Health()
        self.closed = False
        self._jobs = []

    def engine(self):
        kinds = {"good": EchoEngine, "broken": BrokenEngine, "none": None}
        return kinds[self.configuration.engine]

    def start(self, now_ns):
        return [Trust(stamp=Stamp.of(now_ns), revision=1, qsr=1.0, msr=0.0, feedback_count=0)]

    def handle(self, item, now_ns):
        if item.reference == "crash":
            raise ZeroDivisionError("the stage divides by zero")
        if item.reference == "long":
            return [self._answer("x" * 1_000_000, now_ns)]
        if item.reference == "work":
            self._jobs.append(Job("key", "answer", (item.object,)))
            return []
        answer = self._answer(f"{self.configuration.greeting} {item.object}", now_ns)
        return [answer, Timing("echo/handle", 2.5), Figure("echo/mood", 0.75)]

    def tick(self, _now_ns):
        return []

    def jobs(self):
        jobs, self._jobs = self._jobs, []
        return jobs

    def finish(self, _job, result, now_ns):
        words = result.reason if isinstance(result, JobFailure) else result
        return [self._answer(words, now_ns)]

    def close(self):
        self.closed = True

    def _answer(self, words, now_ns):
        return FeedbackResult(stamp=Stamp.of(now_ns), id="1", outcome="accepted", reason=words)


def echo_node(**options) -> StageNode:
    return StageNode(
        "echo",
        EchoConfiguration,
        EchoStage,
        subscribes=(Feedback,),
        publishes=(FeedbackResult, Trust),
        **options,
    )


class Echo:
    """The node, and a probe that talks to it."""

    def __init__(self, room, **parameters):
        self.room = room
        self.node = room.add(echo_node, **parameters)
        self.probe = room.probe()
        self.answers = self.probe.collect(FeedbackResult)
        self.heartbeats = self.probe.collect(Heartbeat)
        self.diagnostics = self.probe.collect_raw(DiagnosticArray, "/diagnostics")
        publisher = self.probe.publisher(Feedback)
        assert room.wait_for(lambda: publisher.get_subscription_count() and self.heartbeats)

    def ask(self, what: str, about: str = "world") -> None:
        self.probe.say(Feedback(relation="above", object=about, reference=what))

    def answer_to(self, what: str, about: str = "world") -> str | None:
        before = len(self.answers)
        self.ask(what, about)
        self.room.wait_for(lambda: len(self.answers) > before)
        return self.answers[-1].reason if len(self.answers) > before else None

    def wait_for_count(self, counter: str, least: int = 1) -> bool:
        return self.room.wait_for(lambda: self.heartbeats[-1].counters.get(counter, 0) >= least)

    def wait_for_level(self, level: bytes) -> bool:
        return self.room.wait_for(
            lambda: self.diagnostics and self.diagnostics[-1].status[0].level == level
        )


def test_messages_parameters_and_timings_pass_through(ros_room):
    echo = Echo(ros_room, greeting="bonjour")
    timings = echo.probe.collect_raw(Float32, "timing/echo/handle")
    assert echo.answer_to("x", "monde") == "bonjour monde"
    # The timing's topic is opened by its first value; a listener of then gets the next.
    assert ros_room.wait_for(lambda: echo.ask("x") or timings)
    assert timings[0].data == pytest.approx(2.5)


def test_the_last_figure_is_kept_for_those_who_plot_later(ros_room):
    echo = Echo(ros_room)
    assert echo.answer_to("x")
    figures = echo.probe.collect_raw(Float32, "figures/echo/mood", profile_of(QosClass.STATE))
    assert ros_room.wait_for(lambda: figures)
    assert figures[0].data == pytest.approx(0.75)


def test_state_is_published_at_start_and_kept_for_late_comers(ros_room):
    echo = Echo(ros_room)
    trust = echo.probe.collect(Trust)
    assert ros_room.wait_for(lambda: trust)
    assert trust[0].revision == 1


def test_jobs_run_in_the_worker_and_come_back(ros_room):
    echo = Echo(ros_room)
    assert echo.answer_to("work", "quiet") == "QUIET"
    assert ros_room.wait_for(lambda: echo.heartbeats[-1].warm)


def test_a_node_without_engine_is_warm_at_once(ros_room):
    echo = Echo(ros_room, engine="none")
    assert echo.heartbeats[0].warm


def test_heartbeat_tells_process_and_readiness(ros_room):
    heartbeat = Echo(ros_room).heartbeats[-1]
    assert (heartbeat.node, heartbeat.process_id) == ("echo", os.getpid())
    assert heartbeat.ready


BAD_TEXTS = ["", "{", "[]", "null", "NaN", "{}" * 3, '{"schema": "feedback/99"}', "[" * 4000]


def test_bad_json_is_counted_and_reported_and_the_next_message_answered(ros_room):
    echo = Echo(ros_room)
    assert echo.wait_for_level(DiagnosticStatus.OK)
    for text in [*BAD_TEXTS, "x" * 10_000]:
        echo.probe.say_text(Feedback, text)
    assert echo.wait_for_count("bad_feedback", len(BAD_TEXTS) + 1)
    assert echo.wait_for_level(DiagnosticStatus.WARN)
    values = {pair.key: pair.value for pair in echo.diagnostics[-1].status[0].values}
    assert values["bad_feedback"] == str(len(BAD_TEXTS) + 1)
    assert "'feedback'" in values["last_problem"]
    assert echo.answer_to("x") == "hello world"


def test_an_exception_in_the_stage_is_counted_and_the_node_goes_on(ros_room, capfd):
    echo = Echo(ros_room)
    echo.ask("crash")
    echo.ask("crash")
    assert echo.wait_for_count("internal_error", 2)
    assert echo.answer_to("x") == "hello world"
    assert "divides by zero" in echo.node.health.last_problem
    assert capfd.readouterr().err.count("Traceback") == 1


def test_what_cannot_be_sent_is_a_problem(ros_room):
    echo = Echo(ros_room)
    echo.ask("long")
    assert echo.wait_for_count("not_sent")
    assert echo.answer_to("x") == "hello world"


def test_a_worker_that_does_not_start_is_an_error_in_the_diagnostics(ros_room):
    echo = Echo(ros_room, engine="broken")
    assert echo.wait_for_level(DiagnosticStatus.ERROR)
    assert "no power" in echo.diagnostics[-1].status[0].message
    assert "no power" in echo.answer_to("work")
    assert not echo.heartbeats[-1].warm


def test_wrong_parameters_and_state_leave_no_node_behind(ros_room):
    with pytest.raises(ParameterError, match="engine"):
        ros_room.add(echo_node, engine="steam")
    with pytest.raises(StateError, match=r"echo\.db"):
        ros_room.add(echo_node, state_file="broken")
    probe = ros_room.probe()
    assert "echo" not in probe.node.get_node_names()


def test_destroying_the_node_closes_the_stage(ros_room):
    node = ros_room.add(echo_node)
    closes = []
    node.stage.close = partial(closes.append, True)
    node.destroy_node()
    assert closes
    ros_room.executor.remove_node(node)
