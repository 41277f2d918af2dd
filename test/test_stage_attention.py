"""The attention stage: final decisions, examples once each, and what a restart repeats."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from attention_samples import SECOND, of, run, run_jobs, stage_with, teach, undecided

from ros_scenesense.attention.queries import Query
from ros_scenesense.messages.attention import Estimates, Examples, Rois
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.grounding import Objects, Relations
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, KnownAxiom, Verdicts
from ros_scenesense.messages.scenes import Labels
from ros_scenesense.scene import Frame, Task
from ros_scenesense.stages.attention import SIDE
from ros_scenesense.stages.attention_store import AttentionStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import JobFailure, Segmentation


@pytest.fixture(scope="module")
def labelled(tmp_path_factory):
    """What a run of scenes with labels published, and the state folder that it left behind."""
    state = tmp_path_factory.mktemp("state")
    return run(state_dir=str(state))[0], state


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
    assert stage._training.new_examples == 45
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
