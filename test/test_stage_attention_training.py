"""How attention trains networks on its examples: adopted, rejected, interrupted, too few."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from attention_samples import SECOND, of, run, run_jobs, stage_with, teach, undecided

from ros_scenesense.attention.inputs import NUMBERS
from ros_scenesense.attention.training_set import joined
from ros_scenesense.errors import NetworkError
from ros_scenesense.messages.attention import Estimates, Rois
from ros_scenesense.messages.learning import JobProgress
from ros_scenesense.messages.reasoning import Beliefs
from ros_scenesense.scene import Task
from ros_scenesense.stages.attention import SIDE
from ros_scenesense.stages.attention_engine import AttentionEngine
from ros_scenesense.stages.attention_store import AttentionStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.protocol import JobFailure


@pytest.mark.parametrize("version", [1, 2, 3])
def test_examples_of_an_older_release_are_left_but_their_scenes_are_known(tmp_path, version):
    teach(tmp_path, scenes=2)
    path = tmp_path / "attention.db"
    with closing(sqlite3.connect(path)) as old:
        if version < 3:
            old.execute("DROP TABLE decision")
        old.execute("DROP TABLE trained")
        old.execute(f"PRAGMA user_version={version}")
    store = AttentionStore(path, Health(), SIDE)
    assert store.example_count == 0
    assert not store.add("t-0", [], [])
    assert store.conclusions() == {"s3": (0, 2)}
    store.close()


def test_examples_of_release_4_stay_and_count_as_trained_on(tmp_path):
    teach(tmp_path, scenes=2)
    path = tmp_path / "attention.db"
    with closing(sqlite3.connect(path)) as old:
        old.execute("DROP TABLE trained")
        old.execute("PRAGMA user_version=4")
    store = AttentionStore(path, Health(), SIDE)
    assert store.trained_on == store.example_count == 4
    store.close()


def test_examples_are_new_until_a_training_on_them_has_ended(tmp_path):
    teach(tmp_path)
    killed = stage_with(state_dir=str(tmp_path))
    killed.train(1)
    assert killed._training.new_examples == 0
    killed.close()
    again = stage_with(state_dir=str(tmp_path))
    assert again._training.new_examples == 80
    again.train(2)
    run_jobs(again)
    again.close()
    last = stage_with(state_dir=str(tmp_path))
    assert last._training.new_examples == 0
    last.close()


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
