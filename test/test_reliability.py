"""The trials of reliability: what they measure, how they judge, what they send."""

import contextlib
import json
import os
import sqlite3
import subprocess
import sys

import numpy as np
import pytest
from grounding_samples import groundings

from ros_scenesense.cli import soak as command
from ros_scenesense.cli.main import main
from ros_scenesense.errors import FrameError, ParameterError
from ros_scenesense.messages.attention import Example, Examples
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.codec import decode
from ros_scenesense.messages.grounding import (
    Feedback,
    FeedbackResult,
    MsrUpdate,
    Relations,
    Trust,
)
from ros_scenesense.messages.learning import Axioms, JobProgress
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.conversions import color_of, depth_of, instances_of, intrinsics_of
from ros_scenesense.parameters import build
from ros_scenesense.reliability.accounting import account_for
from ros_scenesense.reliability.companion import Account
from ros_scenesense.reliability.hostile_images import TOPICS_OF_IMAGES, bad_image, false_frames
from ros_scenesense.reliability.hostile_texts import (
    false_texts,
    invalid_texts,
    is_message,
    made_up_texts,
)
from ros_scenesense.reliability.invented import invented
from ros_scenesense.reliability.memory import Sample, growth, tree_mib
from ros_scenesense.reliability.outcome import Outcome, result_of
from ros_scenesense.reliability.soak import Soak, outcome_of, panels_of, read_samples
from ros_scenesense.results import Table, write_result
from ros_scenesense.scene import Task
from ros_scenesense.stages.attention import AttentionConfiguration, AttentionStage
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

MIB = 1024**2
STAGES = (
    (SimulatedCameraStage, SimulatedCameraConfiguration),
    (GroundingStage, GroundingConfiguration),
    (ReasonerStage, ReasonerConfiguration),
    (AttentionStage, AttentionConfiguration),
    (AxiomLearnerStage, AxiomLearnerConfiguration),
)


# --- Memory.


def samples(values, name="node"):
    return [Sample(float(number), {name: value}) for number, value in enumerate(values)]


def test_growth_leaves_out_the_warm_up_and_short_peaks():
    values = [50.0] * 10 + [100.0] * 35 + [400.0] + [100.0, 110.0, 110.0, 110.0, 400.0] * 3
    grown = growth(samples(values[:60]))["node"]
    assert (grown.warm_mib, grown.end_mib) == (100.0, pytest.approx(110.0, abs=10.0))
    assert growth(samples([100.0] * 50 + [105.0] * 10))["node"].percent == pytest.approx(5.0)


def test_too_few_samples_tell_nothing():
    with pytest.raises(ValueError, match="9 samples"):
        growth(samples([1.0] * 9))


def test_the_memory_of_a_process_is_that_of_its_children_too():
    alone = tree_mib(os.getpid())
    child = subprocess.Popen(
        [sys.executable, "-c", f"x = bytearray({64 * MIB}); print(1, flush=True); input()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    try:
        child.stdout.readline()
        assert tree_mib(os.getpid()) > alone + 64
    finally:
        child.communicate(b"\n")
    assert tree_mib(child.pid) == 0.0


# --- Results.


def test_trials_join_the_results_of_those_before(tmp_path):
    file = tmp_path / "reliability.json"
    table = Table(columns=["a"], rows=[[1]])
    first = result_of([Outcome({"kills": 5.0}, {"Kills": table})], "soak --kills 5", 0, file)
    write_result(first, file)
    second = result_of([Outcome({"fuzz_messages": 9.0})], "soak --fuzz 9", 0, file)
    assert second.figures == {"kills": 5.0, "fuzz_messages": 9.0}
    assert second.tables == {"Kills": table}
    assert second.command == "soak --kills 5 && soak --fuzz 9"
    write_result(second, file)
    again = result_of([Outcome({"kills": 6.0})], "soak --kills 5", 0, file)
    assert again.figures["kills"] == 6.0
    assert again.command == "soak --fuzz 9 && soak --kills 5"


def test_what_was_seen_of_a_soak_becomes_figures_and_lines(tmp_path):
    seen = samples([100.0] * 40 + [103.0] * 20)
    found = Soak(1.0, scenes=9, decided=8, waiting=0, restarts=1, learned={}, samples=seen)
    figures = outcome_of(found).figures
    assert (figures["soak_lost_scenes"], figures["soak_restarts"]) == (1, 1)
    assert figures["soak_growth_pct"] == 3.0
    absolute, relative = panels_of(seen)
    assert absolute.series[0].values == [sample.mib["node"] for sample in seen]
    assert relative.series[0].values[-1] == pytest.approx(3.0)
    file = tmp_path / "memory.csv"
    file.write_text("elapsed_s,node\n0.0,100.0\n1.0,101.5\n")
    assert read_samples(file) == [Sample(0.0, {"node": 100.0}), Sample(1.0, {"node": 101.5})]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "nothing to do"),
        (["--kills", "-1"], "'kills' is '-1'"),
        (["--minutes", "1", "--json", "x.txt"], "ends in .json"),
        (["--fuzz", "1", "--domain-id", "999"], "domain id is 999"),
    ],
)
def test_wrong_options_of_the_command_are_one_line(capsys, words, said):
    assert main(["soak", *words]) == 2
    assert said in capsys.readouterr().err


def test_the_command_that_is_written_down_is_the_one_that_was_given():
    values = {each.name: each.default for each in command._PARAMETERS}
    words = command._command({**values, "kills": 100, "fuzz": 10_000}, None)
    assert words == "scenesense soak --kills 100 --fuzz 10000"


# --- What is sent.


@pytest.fixture(scope="module")
def made_up():
    return made_up_texts(40, seed=0)


@pytest.mark.parametrize("kind", TOPICS, ids=lambda kind: kind.__name__)
def test_of_every_topic_there_are_invalid_and_false_messages(kind, made_up):
    rng = np.random.default_rng(0)
    real = [invented(kind, rng) for _ in range(3)]
    assert all(is_message(text, kind) for text in real)
    invalid = list(invalid_texts(kind, real, made_up, 20, seed=0))
    assert len(invalid) == 20
    assert not any(is_message(text, kind) for text in invalid)
    assert set(invalid[:10]) <= set(made_up)
    false = list(false_texts(kind, real, 5, seed=0))
    assert all(is_message(text, kind) for text in false)
    assert set(false) - set(real)
    assert list(false_texts(kind, real, 5, seed=0)) == false


@pytest.mark.parametrize("part", TOPICS_OF_IMAGES)
def test_bad_images_cannot_be_read(part):
    read = {
        "color": color_of,
        "depth": depth_of,
        "camera_info": intrinsics_of,
        "instances": instances_of,
        "segmentation": instances_of,
    }
    rng = np.random.default_rng(0)
    for _ in range(30):
        message = bad_image(part, rng)
        with pytest.raises(FrameError):
            read[part](message)


def test_false_frames_can_be_read():
    for scene, parts in false_frames(5, 10**9, np.random.default_rng(0)):
        assert {part.header.stamp.sec for part in parts.values()} == {scene.stamp.sec}
        assert instances_of(parts["instances"]).shape == depth_of(parts["depth"]).shape


# --- Accounts.


@pytest.fixture
def learned(tmp_path):
    """A state folder in which something was learned, and an account of what was heard of it."""
    account = Account(kept={kind: {} for kind in (Trust, MsrUpdate, Examples, Axioms, JobProgress)})
    for stage, configuration in STAGES:
        stage(build(configuration, {"state_dir": str(tmp_path)})).close()
    control = GroundingControlStage(
        build(GroundingControlConfiguration, {"state_dir": str(tmp_path)})
    )
    relation = next(
        each for each in control.handle(groundings("s-0000"), 1) if isinstance(each, Relations)
    ).relations[0]
    said = Feedback(
        id="word", relation=relation.position.value, object=relation.object, reference="b"
    )
    for item in control.handle(said, 2):
        if isinstance(item, FeedbackResult):
            account.answered[item.id] = item
        if isinstance(item, Trust):
            account.kept[Trust][1] = item
    control.close()
    account.shown["s-0000"] = None
    account.decided.add("s-0000")
    with in_file(tmp_path / "camera.db") as camera:
        camera.execute("INSERT INTO scene VALUES ('s', 0, 'settled')")
    with in_file(tmp_path / "attention.db") as attention:
        attention.execute("INSERT INTO judged VALUES ('s-0000')")
        attention.execute(
            "INSERT INTO example (scene_id, task, target, label, image, numbers) "
            "VALUES ('s-0000', 'stability', 'a', 1, '', '')"
        )
    example = Example(
        task=Task.STABILITY, target="a", label=True, objects=["a"], reason="undecided"
    )
    account.kept[Examples]["s-0000"] = Examples(
        stamp=Stamp.of(1), scene_id="s-0000", knowledge_revision="k", examples=[example]
    )
    return account, tmp_path


@contextlib.contextmanager
def in_file(path):
    with contextlib.closing(sqlite3.connect(path)) as connection, connection:
        yield connection


def verdict(account, folder):
    found = account_for(account, folder)
    lost = [words for item in found.items for words in item.lost]
    doubled = [words for item in found.items for words in item.doubled]
    return lost, doubled, found.corrupted


def test_an_account_in_order(learned):
    assert verdict(*learned) == ([], [], [])


@pytest.mark.parametrize(
    ("file", "statement", "said"),
    [
        ("camera.db", "UPDATE scene SET state = 'open'", "'open' in camera.db"),
        ("control.db", "DELETE FROM feedback", "feedback word is not in control.db"),
        ("control.db", "DELETE FROM trust", "trust of revision 1: control.db has 0"),
        ("attention.db", "DELETE FROM judged", "scene s-0000 was judged"),
        ("attention.db", "DELETE FROM example", "example s-0000 stability a"),
    ],
)
def test_what_is_missing_is_found(learned, file, statement, said):
    account, folder = learned
    with in_file(folder / file) as connection:
        connection.execute(statement)
    lost, _, corrupted = verdict(account, folder)
    assert any(said in words for words in lost), lost
    assert corrupted == []


def test_a_scene_that_nobody_decided_nor_reported_is_lost(learned):
    account, folder = learned
    account.decided.clear()
    assert verdict(account, folder)[0] == [
        "scene s-0000 has no decision and is not reported as lost"
    ]
    account.lost["s-0000"] = "no estimate came"
    assert verdict(account, folder)[0] == []


def test_histograms_are_learned_anew_from_what_was_heard(learned):
    account, folder = learned
    with in_file(folder / "control.db") as connection:
        messages = [row[0] for row in connection.execute("SELECT message FROM msr_update")]
    updates = [decode(message, MsrUpdate) for message in messages]
    assert updates
    stage = GroundingStage(build(GroundingConfiguration, {"state_dir": str(folder)}))
    for update in updates:
        account.kept[MsrUpdate][update.id] = update
        stage.handle(update, 1)
    stage.close()
    assert verdict(account, folder) == ([], [], [])
    late = json.loads(messages[0]) | {"id": len(updates) + 1}
    account.kept[MsrUpdate][late["id"]] = decode(json.dumps(late), MsrUpdate)
    assert verdict(account, folder)[0] == [f"update {late['id']} of the histograms is not applied"]


def test_damaged_files_and_networks_are_named(learned):
    account, folder = learned
    (folder / "networks").mkdir(exist_ok=True)
    (folder / "networks" / "network-1.pt").write_bytes(b"half of it")
    content = bytearray((folder / "learner.db").read_bytes())
    content[:16] = b"\0" * 16
    (folder / "learner.db.broken-1").write_bytes(content)
    corrupted = verdict(account, folder)[2]
    assert any("network-1.pt" in words for words in corrupted)
    assert "learner.db.broken-1 was set aside" in corrupted


def test_hypothesis_is_asked_for_where_it_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    with pytest.raises(ParameterError, match="hypothesis is not installed"):
        made_up_texts(1, seed=0)
