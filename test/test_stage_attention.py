"""The attention stage: final decisions, examples once each, and networks that are trained."""

import itertools
import sqlite3
from contextlib import closing
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from ros_scenesense.attention.inputs import NUMBERS
from ros_scenesense.attention.queries import Query
from ros_scenesense.attention.training_set import joined
from ros_scenesense.errors import NetworkError
from ros_scenesense.messages.attention import Estimates, Examples, Rois
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.learning import JobProgress
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, KnownAxiom, Verdicts
from ros_scenesense.messages.scenes import Labels
from ros_scenesense.parameters import build
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.scene import Frame, Task
from ros_scenesense.stages.attention import SIDE, AttentionConfiguration, AttentionStage
from ros_scenesense.stages.attention_engine import AttentionEngine
from ros_scenesense.stages.attention_store import AttentionStore
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import JobFailure, Segmentation
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)
from ros_scenesense.stages.worker import InlineRunner

SECOND = 1_000_000_000
WITHHELD = "s1,s2,s3,o1,o2,o3"
ATTENTION = {"network": "none", "iterations": 30}


def stage_with(**values) -> AttentionStage:
    return AttentionStage(build(AttentionConfiguration, ATTENTION | values))


def run(scenes=4, mode="training", withheld=WITHHELD, **attention) -> tuple[list, AttentionStage]:
    """Everything that the stages publish of simulated scenes, and the attention stage."""
    stage = stage_with(**attention)
    camera = {
        "session": "s",
        "width": 160,
        "height": 120,
        "scenes": scenes,
        "mode": mode,
        "seed": 3,
    }
    pipeline = Pipeline(
        [
            SimulatedCameraStage(build(SimulatedCameraConfiguration, camera)),
            GroundingStage(GroundingConfiguration()),
            GroundingControlStage(GroundingControlConfiguration()),
            ReasonerStage(ReasonerConfiguration(withheld=withheld)),
            stage,
        ],
        itertools.count(1).__next__,
    )
    try:
        return list(pipeline.run()), stage
    finally:
        pipeline.close()


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    """What a run of scenes with labels published, and the state folder that it left behind."""
    state = tmp_path_factory.mktemp("state")
    return run(state_dir=str(state))[0], state


def of(kind, published):
    return [item for item in published if isinstance(item, kind)]


def undecided(published):
    return {
        (item.scene_id, each.name, task)
        for item in of(Beliefs, published)
        for each in item.objects
        for task, belief in ((Task.STABILITY, each.stable), (Task.OCCLUSION, each.occluded))
        if belief.value is None
    }


def test_what_is_undecided_is_looked_at(labelled):
    published, _ = labelled
    looked = {
        (item.scene_id, target, roi.task)
        for item in of(Rois, published)
        for roi in item.rois
        for target in roi.targets
    }
    assert looked
    assert looked == undecided(published)


def test_what_is_undecided_or_wrong_becomes_an_example_with_its_label(labelled):
    published, _ = labelled
    labels = {
        (item.scene_id, each.name): each for item in of(Labels, published) for each in item.objects
    }
    verdicts = {
        (item.scene_id, each.subject[0], each.task): each.verdict
        for item in of(Verdicts, published)
        for each in item.verdicts
        if each.kind == "object"
    }
    found = {}
    for item in of(Examples, published):
        for each in item.examples:
            label = labels[item.scene_id, each.target]
            truth = label.stable if each.task is Task.STABILITY else label.occluded
            assert each.label == (truth == "true")
            assert each.target in each.objects
            found[item.scene_id, each.target, each.task] = each.reason
    assert {verdicts[key] for key in found} <= {"undecided", "wrong"}
    assert all((reason == "wrong") == (verdicts[key] == "wrong") for key, reason in found.items())
    assert len(found) > 20


def test_examples_of_scenes_to_evaluate_are_not_learned():
    published, _ = run(scenes=1, mode="testing")
    assert of(Examples, published) == []
    assert of(Verdicts, published)


def test_a_scene_that_comes_again_after_a_restart_teaches_nothing_twice(labelled):
    before, state = labelled
    store = AttentionStore(state / "attention.db", Health(), SIDE)
    count = store.example_count
    assert count == sum(len(item.examples) for item in of(Examples, before))
    store.close()
    again, stage = run(state_dir=str(state))
    assert of(Examples, again) == []
    assert stage.health.counters["scenes_judged_before"] == 4


def test_of_many_examples_the_newest_are_kept_and_the_next_training_still_comes(tmp_path):
    teach(tmp_path, scenes=20)
    stage = stage_with(state_dir=str(tmp_path), pool_examples=10, train_every=5)
    store = AttentionStore(tmp_path / "attention.db", Health(), SIDE, kept_examples=10)
    query = Query(
        Task.STABILITY, "o", np.zeros((6, SIDE, SIDE), np.float32), np.zeros(4, np.float32), ()
    )
    for number in range(5):
        assert store.add(f"new-{number}", [], [(query, True)])
    assert (store.example_count, store.examples_ever) == (10, 45)
    assert stage._training.new_examples == 5
    store.close()
    stage.close()


# --- A restart: topics bring up to 200 old scenes again, but no images.

TOLD = (Beliefs, Objects, Relations, Verdicts)
SHOWN = (Frame, Segmentation)


def told(parts, kind, number):
    """A message of one scene as another scene would have it."""
    return msgspec.structs.replace(
        parts[kind], scene_id=f"s-{number:04d}", stamp=Stamp.of(SECOND + number)
    )


def shown(parts, number):
    return [replace(parts[kind], stamp_ns=SECOND + number) for kind in SHOWN]


def old_scenes(together, count=200):
    """In which order their messages come: scene by scene, or topic by topic."""
    if together:
        return [(kind, number) for number in range(count) for kind in TOLD]
    return [(kind, number) for kind in TOLD for number in range(count)]


@pytest.mark.parametrize("together", [True, False])
def test_old_scenes_do_not_push_out_the_one_that_is_shown(parts, together):
    stage = stage_with(network="shipped")
    published = []
    for image in shown(parts, 199):
        published += stage.handle(image, SECOND)
    for kind, number in old_scenes(together):
        published += stage.handle(told(parts, kind, number), SECOND)
    assert [job.key for job in stage.jobs()] == ["s-0199"]
    assert [each.scene_id for each in of(Examples, published)] == ["s-0199"]
    stage.close()


def test_what_was_decided_before_a_restart_is_decided_again_only_if_it_is_shown(parts, tmp_path):
    before = stage_with(state_dir=str(tmp_path))
    for kind, number in old_scenes(together=True, count=3):
        before.handle(told(parts, kind, number), 0)
    for image in shown(parts, 1):
        before.handle(image, 0)
    assert len(before.tick(11 * SECOND)) == 2
    before.close()

    again = stage_with(state_dir=str(tmp_path))
    published = []
    for kind, number in old_scenes(together=True, count=4):
        published += again.handle(told(parts, kind, number), 0)
    for image in shown(parts, 2):
        published += again.handle(image, 0)
    assert [each.scene_id for each in of(Estimates, published)] == ["s-0002"]
    assert [each.scene_id for each in again.tick(11 * SECOND)] == ["s-0003"]
    assert again.health.counters["scenes_decided_before"] == 2
    assert [kind for kind, _ in again.health.take_problems()] == ["scene_incomplete"]
    again.close()


def test_decisions_are_remembered_as_long_as_topics_bring_their_scenes_again(tmp_path):
    store = AttentionStore(tmp_path / "attention.db", Health(), SIDE)
    store.record_decisions(range(1500))
    store.record_decisions([1499, 7])
    assert store.decided() == {*range(502, 1500), 7}
    store.close()


# --- Training.


def teach(state, scenes=40, first=0):
    """Examples of bright stable and dark unstable objects, two of each scene."""
    store = AttentionStore(state / "attention.db", Health(), SIDE)
    rng = np.random.default_rng(0)
    for number in range(first, first + scenes):
        examples = []
        for bright in (0, 1):
            image = rng.random((6, SIDE, SIDE)).astype(np.float32) * 0.3 + 0.5 * bright
            query = Query(Task.STABILITY, f"o{bright}", image, np.zeros(NUMBERS, np.float32), ())
            examples.append((query, bool(bright)))
        assert store.add(f"t-{number}", [("s3", number > 9)], examples)
    store.close()


@pytest.mark.parametrize("version", [1, 2, 3])
def test_examples_of_an_older_release_are_left_but_their_scenes_are_known(tmp_path, version):
    teach(tmp_path, scenes=2)
    path = tmp_path / "attention.db"
    with closing(sqlite3.connect(path)) as old:
        if version < 3:
            old.execute("DROP TABLE decision")
        old.execute(f"PRAGMA user_version={version}")
    store = AttentionStore(path, Health(), SIDE)
    assert store.example_count == 0
    assert not store.add("t-0", [], [])
    assert store.conclusions() == {"s3": (0, 2)}
    store.close()


def test_sets_are_joined_and_a_scene_held_out_stays_so(tmp_path):
    sets = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        teach(tmp_path / name, scenes=10)
        store = AttentionStore(tmp_path / name / "attention.db", Health(), SIDE)
        sets.append(store.training_set().unpacked())
        store.close()
    training, held_out = joined(sets).parts()
    assert len(training) + len(held_out) == 40
    assert set(training.groups).isdisjoint(held_out.groups)


def test_an_engine_that_warms_up_with_a_broken_network_says_so_only_when_asked(tmp_path):
    broken = tmp_path / "broken.pt"
    broken.write_bytes(b"nothing")
    engine = AttentionEngine(str(broken))
    with pytest.raises(NetworkError, match="damaged"):
        engine.answer(str(broken), np.zeros((1, 6, SIDE, SIDE), "f4"), np.zeros((1, NUMBERS), "f4"))


def run_jobs(stage, now_ns=SECOND):
    """Runs all that the stage wants done, until it wants no more; returns what it publishes."""
    published = []
    runner = InlineRunner(
        stage.engine(), lambda job, result: published.extend(stage.finish(job, result, now_ns))
    )
    while jobs := stage.jobs():
        for job in jobs:
            runner.submit(job)
    runner.close()
    return published


def test_a_network_is_trained_piece_by_piece_adopted_and_found_again(tmp_path):
    teach(tmp_path)
    stage = stage_with(state_dir=str(tmp_path))
    revision, words = stage.train(7)
    assert (revision, words) == ("network-7", "network-7 is trained on 80 examples")
    assert stage.train(8) == (None, "network-7 is under way")
    progress = run_jobs(stage)
    assert all(isinstance(each, JobProgress) for each in progress)
    assert [each.state for each in progress] == ["running", "running", "done"]
    assert [each.progress for each in progress] == [0.0, pytest.approx(25 / 30), 1.0]
    assert "is used from now on" in progress[-1].text
    assert [path.name for path in (tmp_path / "networks").iterdir()] == ["network-7.pt"]
    stage.close()

    published, again = run(scenes=2, state_dir=str(tmp_path))
    estimates = of(Estimates, published)
    asked = undecided(published)
    mine = [item for item in estimates if item.network_revision == "network-7"]
    assert len(mine) == 2
    for item in mine:
        for each in item.objects:
            for task, said in ((Task.STABILITY, each.stable), (Task.OCCLUSION, each.occluded)):
                assert (said.source == "network") == ((item.scene_id, each.name, task) in asked)
                assert said.value is not None
    assert again.health.counters["literals_asked"] == len(asked)


def test_where_defaults_may_be_overruled_the_network_is_asked_about_them_too():
    published, stage = run(scenes=3, withheld="s1,o1", network="shipped", defaults="overrule")
    by_default = {
        (item.scene_id, each.name)
        for item in of(Beliefs, published)
        for each in item.objects
        if each.occluded.status == "by_default"
    }
    looked = {
        (item.scene_id, target)
        for item in of(Rois, published)
        for roi in item.rois
        if roi.task is Task.OCCLUSION
        for target in roi.targets
    }
    assert by_default
    assert by_default <= looked
    assert stage.health.counters["literals_asked"] > len(undecided(published))


def test_a_network_that_is_no_better_is_not_used(tmp_path):
    teach(tmp_path)
    stage = stage_with(state_dir=str(tmp_path), iterations=2)
    stage.train(1)
    run_jobs(stage)
    stage.train(2)  # the same again
    (*_, last) = run_jobs(stage)
    assert last.text.startswith("network-2 is no better and not used")
    assert [path.name for path in (tmp_path / "networks").iterdir()] == ["network-1.pt"]


def test_nothing_to_train_on_is_said(tmp_path):
    stage = stage_with(state_dir=str(tmp_path))
    assert stage.train(1) == (
        None,
        "there is nothing to train on: collect labelled examples first",
    )
    teach(tmp_path, scenes=1)
    assert "too few to train on some and hold out others" in stage.train(1)[1]


def test_a_training_that_dies_leaves_the_network_in_use(tmp_path):
    teach(tmp_path)
    stage = stage_with(state_dir=str(tmp_path))
    stage.train(1)
    (job,) = stage.jobs()
    (progress,) = stage.finish(job, JobFailure("the process was killed"), SECOND)
    assert progress.state == "failed"
    assert "what was used before stays: the process was killed" in progress.text
    assert stage.train(2)[0] == "network-2"


def test_of_a_training_that_was_killed_only_what_it_takes_to_go_on_is_kept(tmp_path):
    teach(tmp_path)
    stage = stage_with(state_dir=str(tmp_path))
    stage.train(1)
    run_jobs(stage)
    stage.train(2)
    engine = stage.engine()()
    engine.begin(*stage.jobs()[0].arguments)
    engine.advance()  # and here the node is killed
    stage.close()
    networks = tmp_path / "networks"
    for name in ("candidate.pt", ".candidate.pt.123", ".training-80-80.pt.7", "training-9-9.pt"):
        (networks / name).write_bytes(b"half of it")

    again = stage_with(state_dir=str(tmp_path))
    assert {path.name for path in networks.iterdir()} == {"network-1.pt", "training-80-80.pt"}
    again.train(3)
    first, *_, last = run_jobs(again)
    assert first.progress == pytest.approx(25 / 30)
    assert last.state == "done"

    (networks / "training-80-80.pt").write_bytes(b"of the examples so far")
    teach(tmp_path, scenes=1, first=40)
    again.train(4)
    assert {path.name for path in networks.iterdir()} == {"network-1.pt"}
    again.close()


def test_training_begins_by_itself_after_so_many_examples(tmp_path):
    published, _ = run(scenes=6, state_dir=str(tmp_path), train_every=20, iterations=2)
    assert [item.state for item in of(JobProgress, published)][-1] == "done"
    assert list((tmp_path / "networks").glob("network-*.pt"))


# --- What goes wrong.


@pytest.fixture
def parts(labelled):
    """The messages of one scene, by type."""
    published, _ = labelled
    beliefs = of(Beliefs, published)[0]
    stamp = beliefs.stamp.nanoseconds
    found = {Beliefs: beliefs}
    for kind in (Objects, Relations, Verdicts):
        found[kind] = next(x for x in of(kind, published) if x.scene_id == beliefs.scene_id)
    for kind in (Frame, Segmentation):
        found[kind] = next(x for x in of(kind, published) if x.stamp_ns == stamp)
    return found


def test_parts_come_in_any_order_and_repeats_count_once(parts):
    for order in (list(parts), list(reversed(parts))):
        stage = stage_with()
        published = []
        for kind in order + order:
            published += stage.handle(parts[kind], SECOND)
        assert len(of(Estimates, published)) == len(of(Rois, published)) == 1
        assert len(of(Examples, published)) == 1


def test_without_images_reasoning_alone_decides(parts):
    stage = stage_with(join_timeout_s=1.0)
    for kind in (Beliefs, Objects, Relations):
        assert stage.handle(parts[kind], 0) == []
    (estimates,) = stage.tick(2 * SECOND)
    assert isinstance(estimates, Estimates)
    assert estimates.scene_id == parts[Beliefs].scene_id
    ((kind, words),) = stage.health.take_problems()
    assert kind == "scene_incomplete"
    assert "no the camera's images and segmentation (from grounding) came" in words
    assert stage.tick(3 * SECOND) == []


def test_a_network_that_fails_leaves_what_it_was_asked_undecided(parts, tmp_path):
    teach(tmp_path)
    stage = stage_with(state_dir=str(tmp_path), iterations=1)
    stage.train(1)
    run_jobs(stage)
    for kind in (Beliefs, Objects, Relations, Frame, Segmentation):
        assert of(Estimates, stage.handle(parts[kind], SECOND)) == []
    (job,) = stage.jobs()
    (estimates,) = stage.finish(job, JobFailure("took too long", timed_out=True), SECOND)
    late = [each for each in estimates.objects if each.occluded.source == "timeout"]
    assert late
    assert estimates.network_revision is None
    assert [kind for kind, _ in stage.health.take_problems()] == ["network_failed"]


def test_objects_that_no_pixel_shows_are_not_asked_about(parts):
    stage = stage_with()
    blank = Segmentation(
        parts[Frame].stamp_ns, "camera", np.zeros_like(parts[Segmentation].instances)
    )
    published = []
    for item in (parts[Beliefs], parts[Objects], parts[Relations], parts[Frame], blank):
        published += stage.handle(item, SECOND)
    assert of(Rois, published)[0].rois == []
    assert len(of(Estimates, published)) == 1


def test_learned_axioms_in_knowledge_change_what_is_relevant(parts):
    stage = stage_with()
    axiom = KnownAxiom(
        id="l1",
        text="",
        statement="occluded(A) if behind(A, B).",
        kind="normal",
        origin="learned",
    )
    stage.handle(Knowledge(stamp=Stamp.of(0), revision="k1", axioms=[axiom]), SECOND)
    published = []
    for kind in (Beliefs, Objects, Relations, Frame, Segmentation):
        published += stage.handle(parts[kind], SECOND)
    occlusion = [roi for roi in of(Rois, published)[0].rois if roi.task is Task.OCCLUSION]
    assert occlusion
    assert {tuple(roi.relations) for roi in occlusion} == {("behind",)}
    assert {tuple(roi.axioms) for roi in occlusion} == {("l1",)}


def test_knowledge_that_cannot_be_read_is_refused():
    stage = stage_with()
    axiom = KnownAxiom(id="l1", text="", statement="nonsense(", kind="normal", origin="learned")
    stage.handle(Knowledge(stamp=Stamp.of(0), revision="k1", axioms=[axiom]), SECOND)
    ((kind, words),) = stage.health.take_problems()
    assert kind == "knowledge_refused"
    assert "axiom l1:1" in words
