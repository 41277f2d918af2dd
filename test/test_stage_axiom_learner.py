"""The axiom learner in the chain: learns, strengthens, forgets, remembers, takes requests."""

from collections import Counter

import msgspec
import pytest
from axiom_learner_samples import O1, S2, chain, learner, order
from learning_samples import examples, scenes

from ros_scenesense.cli.main import main
from ros_scenesense.messages.grounding import Relations
from ros_scenesense.messages.learning import AxiomRequest, AxiomResult, Axioms, JobProgress
from ros_scenesense.messages.reasoning import Knowledge, Verdicts
from ros_scenesense.stages.axiom_keeper import changes_of_cycle
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.learning_engine import (
    Found,
    LearningEngine,
    LearningOrder,
    LearningReport,
    Task,
)
from ros_scenesense.stages.protocol import JobFailure
from ros_scenesense.stages.state_file import IN_MEMORY


def last(kind, published):
    return [each for each in published if isinstance(each, kind)][-1]


def request(stage, axiom, what, id=""):
    (result, *rest) = stage.handle(AxiomRequest(axiom=axiom, request=what, id=id), 5)
    assert isinstance(result, AxiomResult)
    return result, rest


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """What was published while two cycles ran, and the state folder that they left."""
    folder = tmp_path_factory.mktemp("state")
    stage = learner(state_dir=str(folder))
    published = chain(stage, scenes(60))
    stage.close()
    return published, folder


def test_axioms_are_learned_and_raise_what_reasoning_decides(learned):
    published, _ = learned
    axioms = last(Axioms, published)
    assert axioms.cycle == 2
    assert {O1, S2} <= {each.text for each in axioms.axioms}
    known = {each.text for each in last(Knowledge, published).axioms if each.origin == "learned"}
    assert len(known) == len(axioms.axioms)
    counts = {True: Counter(), False: Counter()}
    for number, each in enumerate(e for e in published if isinstance(e, Verdicts)):
        counts[number >= 40].update(one.verdict for one in each.verdicts if one.kind == "object")
    share = {late: count["undecided"] / count.total() for late, count in counts.items()}
    assert share[True] < 0.5 * share[False]
    done = [each.state for each in published if isinstance(each, JobProgress)]
    assert done == ["running", "done"] * 2


def test_what_is_learned_again_decays_more_slowly(learned):
    _, folder = learned
    store = LearnerStore(folder / "learner.db", Health(), 100)
    (axiom,) = [each for each in store.axioms("active") if each.text == O1]
    assert (axiom.strength.value, axiom.strength.decay) == (1.0, 0.5)
    assert [each.what for each in store.history(axiom.id)] == ["learned", "learned again"]
    store.close()


def test_it_goes_on_after_a_restart_and_takes_every_scene_once(learned):
    published, folder = learned
    stage = learner(state_dir=str(folder))
    (axioms, _figure) = stage.start(1)
    assert axioms.axioms == last(Axioms, published).axioms
    chain(stage, scenes(5))
    assert stage.health.counters["scenes_kept_before"] == 5
    chain(stage, scenes(3, seed=9, first=100))
    assert stage.health.counters["scenes_kept"] == 3
    stage.close()


def test_a_damaged_file_is_set_aside(tmp_path):
    (tmp_path / "learner.db").write_bytes(b"no database" * 100)
    stage = learner(state_dir=str(tmp_path))
    assert "learner.db.broken-1" in stage.health.last_problem
    stage.close()


def test_people_pin_veto_and_accept(learned, tmp_path):
    _, folder = learned
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    stage = learner(state_dir=str(tmp_path), cycle_scenes=0)
    names = {each.text: each.id for each in stage.start(1)[0].axioms}
    result, (axioms, _) = request(stage, names[O1], "pin", "one")
    assert result.outcome == "done"
    assert [each.pinned for each in axioms.axioms if each.id == names[O1]] == [True]
    again, rest = request(stage, names[O1], "veto", "one")
    assert (again.outcome, rest) == ("done", [])
    _, (axioms, _) = request(stage, names[S2], "veto")
    assert S2 not in {each.text for each in axioms.axioms}
    # What is vetoed is not learned again, however often scenes show it.
    stage.learn(7)
    (job,) = stage.jobs()
    published = stage.finish(job, LearningEngine().learn(*job.arguments), 8)
    assert S2 not in {each.text for each in last(Axioms, published).axioms}
    _, (axioms, _) = request(stage, names[S2], "accept")
    assert S2 in {each.text for each in axioms.axioms}
    refused, rest = request(stage, "nobody", "pin")
    assert (refused.outcome, rest) == ("refused", [])
    assert "nobody" in refused.reason
    stage.close()


def test_the_service_needs_scenes_and_runs_one_cycle_at_a_time():
    stage = learner(cycle_scenes=0)
    assert stage.learn(1)[0] is None
    chain(stage, scenes(10))
    name, words = stage.learn(2)
    assert name is not None
    assert "5 scenes" in words
    assert stage.learn(3) == (None, f"{name} is under way")
    (job,) = stage.jobs()
    (progress,) = stage.finish(job, JobFailure("out of memory"), 4)
    assert (progress.state, "out of memory" in progress.text) == ("failed", True)
    assert stage.learn(5)[0] is not None


def test_scenes_that_are_not_to_be_learned_from_are_not_kept():
    stage = learner()
    messages = list(scenes(1))
    evaluated = [
        msgspec.structs.replace(each, use="evaluate") if hasattr(each, "use") else each
        for each in messages
    ]
    chain(stage, evaluated)
    assert stage.health.counters["scenes_kept"] == 0
    # A relation is missing: nothing may be concluded from what was not seen.
    partial = [
        msgspec.structs.replace(each, relations=each.relations[1:])
        if isinstance(each, Relations)
        else each
        for each in scenes(1, first=7)
    ]
    chain(stage, partial)
    assert stage.health.counters["scenes_kept"] == 0
    assert stage.health.counters["scenes_not_known_completely"] == 1


def test_the_papers_second_trace_general_beats_over_specified():
    over = "over: -occluded(A) if not behind(A, B), above(A, C)."
    report = LearningEngine().learn(order(over))
    assert O1 in {each.text for each in report.found}
    (loss,) = [each for each in report.lost if each.axiom == "over"]
    assert loss.given
    assert "decided by scene-" in loss.words
    store = LearnerStore(IN_MEMORY, Health(), 10)
    store.finish_cycle(changes_of_cycle(report, store, {"over"}), ())
    assert store.refuted() == {"over": loss.words}
    assert ("refuted", loss.words) in [(each.what, each.words) for each in store.history("over")]


def test_a_given_axiom_that_experience_refutes_is_found():
    report = LearningEngine().learn(order("wrong: occluded(A) if not behind(A, B)."))
    assert "wrong" in report.refuted or "wrong" in {each.axiom for each in report.lost}
    assert O1 in {each.text for each in report.found}


def test_what_the_user_wrote_is_not_learned_again():
    report = LearningEngine().learn(order(f"mine: {O1}"))
    assert O1 not in {each.text for each in report.found}
    assert "mine" not in report.refuted


def test_algorithm_1_is_selectable():
    report = LearningEngine().learn(order(algorithm="paper"))
    assert O1 in {each.text for each in report.found}


def test_what_cannot_be_learned_is_told_and_the_rest_goes_on():
    good = order()
    (task,) = good.tasks
    alike = [each for each in task.examples if each.label]
    bad = Task("stable", None, alike, ())
    report = LearningEngine().learn(
        LearningOrder(good.description, {}, frozenset(), (), (bad, task), trees=20)
    )
    assert "'stable'" in report.problems[0]
    assert report.found


def test_an_axiom_that_is_not_reinforced_is_forgotten_but_a_pinned_one_is_not():
    store = LearnerStore(IN_MEMORY, Health(), 10)
    found = [Found(O1, "normal", 1.0, 0.5, None), Found(S2, "normal", 1.0, 0.1, None)]
    store.finish_cycle(changes_of_cycle(LearningReport(found), store, ()), ())
    stage_like = {each.text: each.id for each in store.axioms("active")}
    from ros_scenesense.stages.axiom_keeper import answer_to

    pin = AxiomRequest(axiom=stage_like[O1], request="pin")
    store.finish_request("pin", *answer_to(pin, store))
    for _ in range(3):
        store.finish_cycle(changes_of_cycle(LearningReport(), store, ()), ())
    assert [each.text for each in store.axioms("active")] == [O1]
    assert [each.what for each in store.history(stage_like[S2])] == [
        "learned",
        "faded",
        "faded",
        "forgotten",
    ]
    store.close()


def test_the_command_line_reads_and_changes_the_state_file(learned, tmp_path, capsys):
    _, folder = learned
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())

    def command(*words):
        code = main(["axioms", *words, "--state", str(tmp_path)])
        return code, capsys.readouterr()

    code, said = command("list")
    assert code == 0
    assert O1 in said.out
    assert "2 cycles" in said.out
    (name,) = [line.split()[0] for line in said.out.splitlines() if O1 in line]
    assert f"{name}: {O1}" in command("show", name)[1].out
    assert "learned again" in command("history", name)[1].out
    assert command("pin", name, "--offline")[0] == 0
    assert "pinned" in command("list")[1].out
    assert command("veto", name, "--offline")[0] == 0
    assert O1 not in command("list")[1].out
    assert O1 in command("list", "--all")[1].out
    assert command("pin", "nobody", "--offline")[0] == 3
    code, said = command("show", "nobody")
    assert (code, "nobody" in said.err) == (2, True)
    assert main(["axioms", "list", "--state", str(tmp_path / "empty")]) == 1


@pytest.mark.parametrize(("wrong", "strength"), [(0, 1.0), (1, 1.0), (2, 0.37)])
def test_use_strengthens_only_what_is_right_often_enough(wrong, strength):
    store = LearnerStore(IN_MEMORY, Health(), 10)
    found = [Found(O1, "normal", 1.0, 0.5, None)]
    store.finish_cycle(changes_of_cycle(LearningReport(found), store, ()), ())
    (axiom,) = store.axioms("active")
    (example, *_) = examples("occluded", 1)
    uses = [(axiom.id, number >= wrong) for number in range(20)]
    assert store.add_scene("s-1", example.state, [("occluded", 0, False, "right")], uses)
    store.finish_cycle(changes_of_cycle(LearningReport(), store, ()), ())
    (axiom,) = store.axioms("active")
    assert axiom.strength.value == pytest.approx(strength, abs=0.01)
    store.close()


def test_old_scenes_are_forgotten_but_recognised_also_when_fewer_are_to_be_kept(tmp_path):
    found = examples("occluded", 6)
    states = {each.scene_id: each.state for each in found}
    literals = [("occluded", 0, False, "undecided")]
    store = LearnerStore(tmp_path / "learner.db", Health(), 5)
    for name in list(states)[:5]:
        assert store.add_scene(name, states[name], literals, ())
    store.close()
    store = LearnerStore(tmp_path / "learner.db", Health(), 2)
    (*_, newest) = states
    assert store.add_scene(newest, states[newest], literals, ())
    assert store.scenes() == [5, 6]
    assert len(store.examples("occluded", store.scenes())) == 2
    assert not store.add_scene("scene-0", states["scene-0"], literals, ())
    store.close()
