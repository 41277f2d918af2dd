"""What the axiom learner makes of the outcomes of actions, and what the planner makes of that."""

import sqlite3

import msgspec
import pytest
from goal_samples import World, started

from ros_scenesense.messages.actions import Goal, Plan, PlannedAction, StateLiteral, Transition
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import AxiomRequest, Axioms, JobProgress, LearnedAxiom
from ros_scenesense.parameters import build
from ros_scenesense.reasoning.program import Program
from ros_scenesense.reasoning.situations import robot_domain
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.knowledge import KnowledgeInForce
from ros_scenesense.stages.learner_store import VERSION, LearnerStore
from ros_scenesense.stages.learning_engine import LearningEngine
from ros_scenesense.stages.outcomes import Outcome

IRREGULAR = "impossible putdown(R, A, B) if obj_surface(B, irregular)."


def learner(**values):
    settings = {"cycle_scenes": 0, "trees": 20, "learn_when_surprised": False} | values
    return AxiomLearnerStage(build(AxiomLearnerConfiguration, settings))


@pytest.fixture(scope="module")
def transitions():
    """What came of the actions of trace 1, the fourth of which fails."""
    world, published = started()
    world.slippery = {"duck"}
    everything = world.pursue(published)
    return [each for each in everything if isinstance(each, Transition)]


def run(stage):
    """One cycle; what is published."""
    name, words = stage.learn(5)
    assert name is not None, words
    (job,) = stage.jobs()
    return stage.finish(job, LearningEngine().learn(*job.arguments), 6)


def test_an_attempt_tells_the_state_before_and_whether_it_failed(transitions):
    trials = [Outcome(each, robot_domain()).trial() for each in transitions]
    assert [each.action for each in trials] == ["pickup", "putdown"] * 3
    assert [each.failed for each in trials] == [False] * 3 + [True] + [False] * 2
    failed = trials[3]
    duck = failed.state.names.index("duck")
    assert failed.arguments == ("rob1", failed.state.names.index("white_cube"), duck)
    assert ("obj_surface", (duck, "irregular")) in failed.state.facts
    assert ("on", failed.arguments[1:]) in failed.expected - failed.after
    # The can, which stands aside, is only told of as far as it bears on what the robot does.
    can = failed.state.names.index("red_can")
    assert ("right", (can, duck)) in failed.state.facts
    assert ("obj_size", (can, "medium")) not in failed.state.facts


def test_what_did_not_stay_is_an_example_of_what_is_unstable(transitions):
    stage = learner()
    for each in transitions:
        stage.handle(each, 1)
    assert stage.health.counters["outcomes_kept"] == 6
    assert stage.health.counters["examples_of_outcomes"] == 1
    store = stage._store
    (example,) = store.examples("stable", store.scenes())
    assert (example.label, example.reason) == (False, "unexpected_outcome")
    cube, duck = (example.state.names.index(each) for each in ("white_cube", "duck"))
    assert example.target == cube
    assert {("on", (cube, duck)), ("irregular_below", (cube,))} <= example.state.facts
    stage.close()


def test_what_falls_later_is_an_example_too(transitions):
    """The cube stays on the duck for a while, and falls while the can is picked up."""
    put, pick = transitions[3:5]
    table = StateLiteral(fluent="on", arguments=["white_cube", "table"])
    later = msgspec.structs.replace(
        pick,
        before=[*put.expected, *(e for e in pick.before if e.fluent.startswith("obj_"))],
        expected=[
            *(e for e in put.expected if "red_can" not in e.arguments),
            StateLiteral(fluent="in_hand", arguments=["rob1", "red_can"]),
        ],
        after=[e for e in pick.after if "white_cube" not in e.arguments] + [table],
    )
    facts, fallen = Outcome(later, robot_domain()).unstable()
    assert ([each.name for each in facts.objects], fallen) == (
        ["duck", "white_cube"],
        ["white_cube"],
    )


def test_what_is_thought_to_be_in_the_hand_still_has_not_fallen(transitions):
    """The robot does not know that its hand is empty when it has put something down."""
    held = StateLiteral(fluent="in_hand", arguments=["rob1", "white_cube"])
    full = msgspec.structs.replace(transitions[3], expected=[*transitions[3].expected, held])
    assert Outcome(full, robot_domain()).unstable() is None
    stayed = msgspec.structs.replace(transitions[5], expected=[*transitions[5].after, held])
    assert Outcome(stayed, robot_domain()).is_unexpected
    assert not Outcome(transitions[5], robot_domain()).is_unexpected


def test_a_touch_that_was_overlooked_is_no_fall(transitions):
    failed = transitions[3]
    above = StateLiteral(fluent="above", arguments=["white_cube", "duck"])
    overlooked = msgspec.structs.replace(failed, after=[*failed.after, above])
    assert Outcome(overlooked, robot_domain()).unstable() is None
    assert Outcome(failed, robot_domain()).unstable() is not None


def test_of_a_state_that_is_not_known_completely_nothing_is_learned(transitions):
    stage = learner()
    failed = transitions[3]
    unknown = [e for e in failed.before if e.fluent != "obj_surface"]
    stage.handle(msgspec.structs.replace(failed, before=unknown), 1)
    assert stage.health.counters["outcomes_not_known_completely"] == 1
    assert stage.health.counters["examples_of_outcomes"] == 0
    stage.close()


@pytest.mark.parametrize(
    "literal",
    [
        StateLiteral(fluent="flies", arguments=["duck"]),
        StateLiteral(fluent="on", arguments=["duck"]),
        StateLiteral(fluent="tower_height", arguments=["duck", "ninety"]),
    ],
)
def test_what_the_domain_does_not_have_is_ignored(transitions, literal):
    stage = learner()
    wrong = msgspec.structs.replace(transitions[3], before=[*transitions[3].before, literal])
    assert stage.handle(wrong, 1) == []
    assert stage.health.counters["transition_ignored"] == 1
    assert stage.health.counters["outcomes_kept"] == 0
    stage.close()


def test_every_outcome_is_taken_once_also_after_a_restart(transitions, tmp_path):
    for _ in range(2):
        stage = learner(state_dir=str(tmp_path))
        for each in [*transitions, *transitions]:
            stage.handle(each, 1)
        assert len(stage._store.trials.all()) == 6
        assert len(stage._store.scenes()) == 1
        stage.close()
    assert stage.health.counters["transitions_repeated"] == 12


def test_a_state_file_of_before_is_migrated(tmp_path):
    path = tmp_path / "learner.db"
    LearnerStore(path, Health(), 10).close()
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TABLE trial")
        connection.execute("ALTER TABLE event DROP COLUMN stamp_ns")
        connection.execute("PRAGMA user_version=1")
    store = LearnerStore(path, Health(), 10)
    assert store.trials.all() == []
    store.close()
    with sqlite3.connect(path) as connection:
        assert connection.execute("PRAGMA user_version").fetchone()[0] == VERSION


def test_a_surprise_begins_a_cycle(transitions):
    stage = learner(learn_when_surprised=True)
    published = [stage.handle(each, 1) for each in transitions]
    assert [len(each) for each in published] == [0, 0, 0, 1, 0, 0]
    (progress,) = published[3]
    assert isinstance(progress, JobProgress)
    assert len(stage.jobs()) == 1
    stage.close()


def failing(transitions, times):
    """The actions of trace 1 so many times, each in episodes of their own."""
    for number in range(times):
        for each in transitions:
            yield msgspec.structs.replace(
                each, episode_id=f"e-{number}", scene_before=f"{number}-{each.scene_before}"
            )


def test_from_failures_a_condition_is_learned_and_the_planner_heeds_it(transitions):
    stage = learner()
    for each in failing(transitions, 8):
        stage.handle(each, 1)
    axioms = next(each for each in run(stage) if isinstance(each, Axioms))
    laws = [each for each in axioms.axioms if each.text.startswith("impossible")]
    assert [(each.text, each.kind, each.purity) for each in laws] == [(IRREGULAR, "normal", 1.0)]
    again = next(each for each in run(stage) if isinstance(each, Axioms))
    assert [each.id for each in again.axioms] == [each.id for each in axioms.axioms]
    veto = AxiomRequest(axiom=laws[0].id, request="veto")
    (_, vetoed, _) = stage.handle(veto, 9)
    assert IRREGULAR not in {each.text for each in vetoed.axioms}
    last = next(each for each in run(stage) if isinstance(each, Axioms))
    assert IRREGULAR not in {each.text for each in last.axioms}
    stage.close()

    knowledge = KnowledgeInForce(Program.shipped(), "s1,s2,s3,o1,o2,o3")
    before = knowledge.revision
    assert knowledge.apply(axioms) == []
    assert knowledge.revision != before
    assert IRREGULAR in {e.statement for e in knowledge.message(1).axioms if e.origin == "learned"}
    world = World()
    world.domain = knowledge.program.description
    world.show()
    plan = next(each for each in world.want() if isinstance(each, Plan))
    assert PlannedAction(kind="putdown", object="white_cube", location="table") in plan.actions


def test_laws_of_actions_can_be_withheld_and_learned_from_refusals():
    world = World(withheld=("s2", "pickup_under"))
    stage = learner()
    for number in range(12):
        world.episode, world.held = (None, 0), None
        world.on = dict.fromkeys(("duck", "white_cube", "red_can"), "table")
        if number % 2:
            world.on = {"duck": "white_cube", "white_cube": "red_can", "red_can": "table"}
        world.show()
        published = world.want(Goal(goal="in_hand(rob1, red_can)", id=f"g-{number}"))
        while published and not isinstance(published[-1], Plan):
            action = published[-1]
            name = action.action.object
            if action.action.kind == "pickup" and name in world.on.values():
                published = world.answer(action, "refused", reason="something stands on it")
            else:
                published = world.do(action)
            for each in published:
                stage.handle(each, 1)
    axioms = next(each for each in run(stage) if isinstance(each, Axioms))
    assert {"impossible pickup(R, A) if above(B, A)."} & {each.text for each in axioms.axioms}
    stage.close()


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("impossible pickup(R, A) if obj_size(A, large).", False),
        ("pickup(R, A) causes touching(A, A) if obj_size(A, small).", False),
        ("impossible fly(R).", True),
        ("pickup(R, A) causes stable(A).", True),
        ("initially normally stable(A).", True),
    ],
)
def test_learned_laws_are_checked_like_any_text(text, refused):
    knowledge = KnowledgeInForce(Program.shipped(), "")
    law = LearnedAxiom(
        id="learned_1", text=text, kind="normal", strength=1.0, support=0.5, purity=1.0, age=0
    )
    message = Axioms(stamp=Stamp.of(1), revision=1, cycle=1, axioms=[law])
    assert bool(knowledge.apply(message)) == refused
