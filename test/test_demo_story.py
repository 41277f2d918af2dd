"""Stories of goals: their order, how they are told, their report, and one played for real."""

import json
import os
import subprocess
import sys
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from demo_samples import scene_id
from rich.console import Console

from ros_scenesense.cli import main as cli
from ros_scenesense.demo import told, trace
from ros_scenesense.demo.clutter import Tidiness
from ros_scenesense.demo.narrator import Narrator
from ros_scenesense.demo.record import Image
from ros_scenesense.demo.session import Session
from ros_scenesense.demo.story import Chapter, Done, Ended, Learned, Planned, Story
from ros_scenesense.demo.story_report import StoryEnd, render_story, write_story
from ros_scenesense.errors import LaunchError
from ros_scenesense.messages.actions import Plan, PlannedAction, StateLiteral, Transition
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import Axioms, JobProgress, LearnedAxiom
from ros_scenesense.messages.reasoning import Knowledge, KnownAxiom
from ros_scenesense.messages.scenes import Labels, ObjectLabel, Scene, StructureLabel
from ros_scenesense.scene import Truth

GOAL = "on(cube, <b>duck</b>)"
PICKUP = PlannedAction(kind="pickup", object="cube")
PUTDOWN = PlannedAction(kind="putdown", object="cube", location="duck")
FELL = "after putdown(cube, duck) on(cube, duck) was expected but on(cube, table) was seen"
AXIOM = LearnedAxiom(
    id="learned_1",
    text="-stable(A) if irregular_below(A).",
    kind="normal",
    strength=1.0,
    support=0.1,
    purity=0.98,
    age=0,
)


def literals(*words):
    return [StateLiteral(fluent=w.split()[0], arguments=w.split()[1:]) for w in words]


def scene(number, step=0, goal="g"):
    return Scene(
        stamp=Stamp.of(number + 1),
        scene_id=scene_id(number),
        mode="testing",
        objects=[],
        episode_id=goal if step else None,
        step=step,
    )


def labels(number, occluded=(), unstable=(), stacks=(("cube",), ("duck",))):
    return Labels(
        stamp=Stamp.of(number + 1),
        scene_id=scene_id(number),
        use="evaluate",
        objects=[
            ObjectLabel(
                name=name,
                stable=Truth.FALSE if name in unstable else Truth.TRUE,
                occluded=Truth.TRUE if name in occluded else Truth.FALSE,
                visible_fraction=0.5 if name in occluded else 1.0,
            )
            for name in ("cube", "duck")
        ],
        structures=[StructureLabel(members=list(each), stable=Truth.TRUE) for each in stacks],
    )


def plan(number, *actions, outcome="found", reason="", goal="g"):
    return Plan(
        stamp=Stamp.of(number + 1),
        scene_id=scene_id(number),
        id=goal,
        goal=GOAL,
        outcome=outcome,
        actions=list(actions),
        reason=reason,
    )


def transition(number, action, before, expected, after, outcome="executed", goal="g"):
    return Transition(
        stamp=Stamp.of(number + 1),
        id=f"a{number}",
        episode_id=goal,
        step=number,
        scene_before=scene_id(number),
        scene_after=scene_id(number if outcome == "refused" else number + 1),
        action=action,
        before=literals(*before),
        expected=literals(*expected),
        after=literals(*after),
        outcome=outcome,
    )


APART = ("on cube table", "on duck table")
HELD = ("in_hand rob1 cube", "on duck table")
PICKED = transition(0, PICKUP, APART, HELD, HELD)
SLIPPED = transition(1, PUTDOWN, HELD, ("on cube duck", "on duck table"), APART)
MESSAGES = [
    scene(0),
    plan(0, PICKUP, PUTDOWN),
    scene(1, 1),
    PICKED,
    scene(2, 2),
    SLIPPED,
    plan(2, PICKUP, PUTDOWN, reason=FELL),
    Axioms(stamp=Stamp.of(5), revision=1, cycle=1, axioms=[AXIOM]),
    plan(2, outcome="no_plan", reason="there is no plan"),
]
KINDS = [Planned, Done, Done, Planned, Learned, Ended]


def taken(messages, told=lambda _entry: None):
    story = Story(told)
    for number, message in enumerate(messages):
        story.take(message, number)
    return story


def printed(messages):
    console = Console(file=StringIO(), width=100)
    taken(messages, Narrator(console).tell)
    return console.file.getvalue()


def test_entries_are_told_in_the_order_in_which_things_happened():
    assert [type(each) for each in taken(MESSAGES).entries] == KINDS
    # As topics may bring it: the second plan before the outcome that it reacts to.
    early = [*MESSAGES[:3], MESSAGES[6], *MESSAGES[3:6], *MESSAGES[7:]]
    assert taken(early).entries == taken(MESSAGES).entries
    # The first plan after the outcome of its first action: an outcome waits for nothing.
    late = [MESSAGES[0], *MESSAGES[2:4], MESSAGES[1], *MESSAGES[4:]]
    assert sorted(map(str, taken(late).entries)) == sorted(map(str, taken(MESSAGES).entries))


def test_an_outcome_is_told_once():
    again = [*MESSAGES[:4], PICKED, *MESSAGES[4:]]
    assert taken(again).entries == taken(MESSAGES).entries


def test_an_attempt_has_its_plans_its_steps_and_its_surprises():
    (attempt,) = taken(MESSAGES).attempts()
    assert (attempt.goal, len(attempt.plans), len(attempt.steps)) == (GOAL, 2, 2)
    assert not attempt.is_reached
    (surprise,) = attempt.surprises
    assert (surprise.missed, surprise.seen) == (("on(cube, duck)",), ("on(cube, table)",))


def test_what_is_not_seen_any_more_is_no_surprise():
    hidden = transition(1, PUTDOWN, HELD, ("on cube duck", "on duck table"), ("on duck table",))
    (done,) = taken([scene(0), plan(0, PICKUP), hidden]).entries[1:]
    assert done.is_expected


def test_a_refused_action_is_no_expected_one():
    refused = transition(0, PICKUP, APART, HELD, APART, outcome="refused")
    story = taken([scene(0), plan(0, PICKUP), refused, plan(0, PUTDOWN, reason="was refused")])
    assert [type(each) for each in story.entries] == [Planned, Done, Planned]
    assert not story.entries[1].is_expected


def test_the_story_is_told_in_plain_words():
    text = printed(MESSAGES)
    assert text.count("goal on(cube, <b>duck</b>)") == 1
    assert "plan, 2 actions:" in text
    assert "✓ pickup(cube)" in text
    assert "✗ putdown(cube, duck)  not as expected" in text
    assert "learning cycle 1, learned:" in text
    assert "-stable(A) if irregular_below(A).  true of 98%" in text
    assert "no plan: there is no plan" in text


def cycle(number, state, at=5, text=""):
    return JobProgress(
        stamp=Stamp.of(at),
        job_id=f"cycle-{number}",
        node="axiom_learner",
        state=state,
        progress=0.5,
        text=text,
    )


def knowledge(*learned):
    given = KnownAxiom(id="s1", text="", statement="", kind="normal", origin="given")
    known = [
        KnownAxiom(id=each, text="", statement="", kind="normal", origin="learned")
        for each in learned
    ]
    return Knowledge(stamp=Stamp.of(9), revision="r", axioms=[given, *known])


LEARNED = MESSAGES[7]


class Graph:
    """Brings one message with every look at a condition, and then nothing more."""

    log_dir = Path("logs")

    def __init__(self, story, messages):
        self.story, self.messages = story, list(messages)

    def spin_until(self, condition, timeout_s):
        assert timeout_s > 0
        while not condition():
            if not self.messages:
                return False
            self.story.take(self.messages.pop(0), 0)
        return True


def session_of(story, messages):
    node = SimpleNamespace(create_publisher=lambda *_: None)
    return Session(Graph(story, messages), node, story)


def test_the_goal_is_given_again_only_when_what_was_learned_is_in_force():
    first = [cycle(1, "running"), cycle(1, "done"), LEARNED, knowledge("learned_1")]
    for needed in (first, [knowledge(), *first], [first[0], LEARNED, first[1], first[3]]):
        story = Story()
        session = session_of(story, [*needed, cycle(2, "running")])
        session.learned()
        assert session._graph.messages == [cycle(2, "running")]
        assert [each.cycle for each in story.entries if isinstance(each, Learned)] == [1]


@pytest.mark.parametrize(
    ("messages", "words"),
    [
        ([], "the axiom learner did not finish a cycle"),
        ([cycle(1, "done"), cycle(2, "running"), LEARNED], "did not finish a cycle .* 150 s"),
        ([cycle(1, "done")], "did not finish a cycle"),
        ([cycle(1, "failed", text="cycle-1 failed: no memory")], "cycle-1 failed: no memory"),
        ([cycle(1, "done"), LEARNED], "the reasoner has not put into force .* 20 s"),
        (
            [cycle(1, "done"), LEARNED, knowledge("learned_7")],
            "the reasoner has not put into force",
        ),
    ],
)
def test_a_cycle_that_does_not_come_ends_the_story_with_the_reason(messages, words):
    with pytest.raises(LaunchError, match=words):
        session_of(Story(), messages).learned()


def end(**values):
    known = {"what": "trace", "command": "c", "started": "s", "seconds": 7.0}
    return StoryEnd(**(known | values))


def test_the_report_shows_the_story_and_escapes_names():
    story = taken([Image(3, np.full((24, 32, 3), 90, np.uint8)), *MESSAGES])
    story.tell(Chapter("The end", "<i>at last</i>"))
    page = render_story(story, end())
    assert "<b>duck</b>" not in page
    assert "&lt;i&gt;at last&lt;/i&gt;" in page
    assert page.count("<figure") == 2
    assert page.count('<figure class="step unexpected"') == 1
    # The picture after the last action, which is also where the second plan starts.
    assert page.count("data:image/png;base64,") == 2
    assert FELL in page
    assert "-stable(A) if irregular_below(A)." in page


def test_plans_before_and_after_learning_stand_side_by_side():
    table = PlannedAction(kind="putdown", object="cube", location="table")
    better = [scene(9), plan(9, PICKUP, table, goal="h"), plan(9, outcome="reached", goal="h")]
    page = render_story(taken([*MESSAGES, *better]), end())
    assert page.count('class="differs"') == 2
    assert 'class="differs">putdown(cube, duck)' in page
    assert 'class="differs">putdown(cube, table)' in page


def test_before_and_after_are_held_against_physics(tmp_path):
    story = taken([*MESSAGES, labels(0, ["duck"], ["cube"]), labels(2, stacks=[("cube", "duck")])])
    scenes = story.run.scenes[scene_id(0)], story.run.scenes[scene_id(2)]
    over = end(what="clutter", scenes=scenes)
    page = render_story(story, over)
    for value in ("1 → 0", "2 → 1"):
        assert f'<div class="value">{value}</div>' in page
    write_story(story, over, tmp_path / "story.json")
    content = json.loads((tmp_path / "story.json").read_text())
    assert [each["occluded"] for each in content["physics"]] == [["duck"], []]
    assert content["goals"][0]["actions"][1]["missed"] == ["on(cube, duck)"]
    assert content["learned"][0]["text"] == AXIOM.text
    assert Tidiness.of(scenes[1].labels).on_table == "a stack of cube, duck"


def test_a_trace_that_goes_otherwise_is_no_success():
    story = taken(MESSAGES)
    (attempt,) = story.attempts()
    with pytest.raises(LaunchError, match="the goal was not reached the first time"):
        trace._check(story, attempt, attempt)


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [(LaunchError("the nodes are broken"), 1, "broken"), (KeyboardInterrupt(), 130, "stopped")],
)
def test_whatever_ends_a_story_the_report_is_written(tmp_path, monkeypatch, error, code, words):
    def play(*_arguments):
        raise error

    monkeypatch.setattr(told.clutter, "play", play)
    console = Console(file=StringIO(), width=100)
    options = told.StoryOptions(out=str(tmp_path), domain_id=3)
    assert told.tell("clutter", options, console) == code
    assert words in (tmp_path / "report.html").read_text()
    assert words in json.loads((tmp_path / "story.json").read_text())["error"]
    assert words in console.file.getvalue()


@pytest.mark.parametrize(
    "words",
    [
        ["demo", "trace", "--arrangement", "towers"],
        ["demo", "--scene", "x.yaml"],
        ["demo", "trace", "--scenes", "1"],
    ],
)
def test_an_option_that_is_not_for_a_story_is_refused(words, capsys):
    assert cli.main(words) == 2
    assert words[-2].lstrip("-") in capsys.readouterr().err


SCENE = """
objects:
  - {object: large_cube, color: white, x_m: 0.0}
  - {object: medium_cube, color: blue, x_m: 0.14, y_m: 0.01}
camera: {distance: 1.9}
"""


def test_a_table_is_tidied_up_by_the_real_graph(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE)
    command = [sys.executable, "-m", "ros_scenesense.cli.main", "demo", "clutter"]
    command += ["--scene", str(file), "--out", str(tmp_path), "-p", "attention.network=none"]
    environment = {**os.environ, "TERM": "dumb", "OMP_NUM_THREADS": "1", "PYTHONUTF8": "1"}
    environment.pop("ROS_DOMAIN_ID", None)
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    content = json.loads((tmp_path / "story.json").read_text())
    assert content["goals"][0]["outcome"] == "reached"
    before, after = content["physics"]
    assert before["occluded"] == ["blue_cube"]
    assert (after["occluded"], after["unstable"], len(after["structures"])) == ([], [], 1)
    report = Path(tmp_path / "report.html").read_text()
    assert report.count("<svg") == 2
    assert done.stdout.count("  ✓ ") == len(content["goals"][0]["actions"])
