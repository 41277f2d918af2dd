"""A state folder as a whole: what was learned when, exported, taken over, emptied, examined."""

import json
import shutil
import sqlite3
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from grounding_samples import feedback, groundings, record

from ros_scenesense.cli.main import main as command
from ros_scenesense.errors import StateError
from ros_scenesense.grounding.msr import MetricSettings
from ros_scenesense.messages.base import Stamp
from ros_scenesense.parameters import build
from ros_scenesense.stages.attention_store import AttentionStore, KnownNetwork
from ros_scenesense.stages.axiom_keeper import changes_of_cycle
from ros_scenesense.stages.goal_ledger import GoalLedger, OpenGoal
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.learning_engine import Found, LearningReport
from ros_scenesense.stages.network_training import NetworkTraining
from ros_scenesense.stages.scene_ledger import SceneLedger
from ros_scenesense.stages.state_archive import MANIFEST, export_state
from ros_scenesense.stages.state_catalogue import STATE_FILES
from ros_scenesense.stages.state_folder import (
    Condition,
    check_state,
    import_state,
    reset_state,
)
from ros_scenesense.stages.state_history import history

SECOND = 1_000_000_000
O1 = "-occluded(A) if not behind(A, B)."
NETWORK = f"network-{300 * SECOND}"
FILES = {"camera.db", "grounding.db", "control.db", "reasoner.db", "attention.db", "learner.db"}


def fill(folder: Path) -> None:
    """What nodes leave behind: feedback at 100 s, an axiom at 200 s, a network, a goal."""
    health = Health()
    ledger = SceneLedger(folder / "camera.db", health)
    ledger.record("s", 0, "settled")
    ledger.close()
    store = GroundingStore(folder / "grounding.db", health, 10, MetricSettings())
    store.record_scene(record())
    store.close()
    control = GroundingControlStage(
        build(GroundingControlConfiguration, {"state_dir": str(folder)})
    )
    control.handle(groundings(), 1)
    control.handle(feedback("left a b", "s-0"), 100 * SECOND)
    control.close()
    learner = LearnerStore(folder / "learner.db", health, 10)
    found = LearningReport([Found(O1, "normal", 1.0, 0.5, None)])
    learner.finish_cycle(changes_of_cycle(found, learner, ()), (), 200 * SECOND)
    learner.close()
    attention = AttentionStore(folder / "attention.db", health, 32)
    (folder / "networks").mkdir()
    weights = folder / "networks" / f"{NETWORK}.pt"
    weights.write_bytes(b"weights")
    attention.adopt(KnownNetwork(NETWORK, str(weights), 12, 0.25))
    attention.close()
    goals = GoalLedger(folder / "reasoner.db", health)
    goals.keep(OpenGoal("g", "on(a, b)", Stamp(400, 0)))
    goals.close_goal("g", "reached")
    goals.close()


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    folder = tmp_path_factory.mktemp("filled") / "state"
    fill(folder)
    return folder


@pytest.fixture
def state(filled, tmp_path):
    return shutil.copytree(filled, tmp_path / "state")


def words_of(folder: Path) -> list[tuple[int, str, str]]:
    return [(each.stamp_ns, each.node, each.words) for each in history(folder)]


def test_what_was_learned_is_told_in_order(state):
    told = words_of(state)
    assert [(at // SECOND, node) for at, node, _ in told] == [
        (100, "grounding_control"),
        (100, "grounding_control"),
        (200, "axiom_learner"),
        (300, "attention"),
        (400, "reasoner"),
    ]
    words = [each for _, _, each in told]
    assert words[0] == "was told left(a, b) of s-0"
    assert words[1].startswith("trust 1: ")
    assert words[2] == f"cycle 1: learned_1 learned: {O1}"
    assert words[3] == f"{NETWORK} adopted: 12 examples, loss 0.250 on what was held out"
    assert words[4] == "goal on(a, b): reached"


def test_an_export_is_taken_over_elsewhere_with_all_that_was_learned(tmp_path):
    state = tmp_path / "state"
    fill(state)
    archive = tmp_path / "state.zip"
    exported = export_state(state, archive)
    assert set(exported.files) == {*FILES, f"networks/{NETWORK}.pt"}
    other = tmp_path / "other"
    _, aside = import_state(archive, other)
    assert aside is None
    assert words_of(other) == words_of(state)
    shutil.rmtree(state)
    # The node finds its network though it lies elsewhere now.
    store = AttentionStore(other / "attention.db", Health(), 32)
    training = NetworkTraining(
        store, str(other), "none", Health(), side=32, iterations=1, device="cpu", seed=0
    )
    assert training.network.revision == NETWORK
    assert Path(training.network.file) == other / "networks" / f"{NETWORK}.pt"
    store.close()


def test_a_checkpoint_that_goes_while_it_is_exported_is_left_out(state, tmp_path, monkeypatch):
    for name in ("training-1-1.pt", "candidate.pt"):
        (state / "networks" / name).write_bytes(b"under way")
    copy = shutil.copyfile

    def copy_late(source: Path, target: Path) -> Path:
        if source.name == "training-1-1.pt":
            source.unlink()
        copied = copy(source, target)
        source.write_bytes(b"already another one")
        return copied

    monkeypatch.setattr(shutil, "copyfile", copy_late)
    exported = export_state(state, tmp_path / "state.zip")
    networks = {name for name in exported.files if name.startswith("networks/")}
    assert networks == {f"networks/{NETWORK}.pt", "networks/candidate.pt"}
    import_state(tmp_path / "state.zip", tmp_path / "other")
    assert (tmp_path / "other" / "networks" / "candidate.pt").read_bytes() == b"under way"


def test_an_export_is_made_while_nodes_write(state, tmp_path):
    learner = LearnerStore(state / "learner.db", Health(), 10)
    learner.finish_cycle(changes_of_cycle(LearningReport(), learner, ()), (), 500 * SECOND)
    writing = sqlite3.connect(state / "learner.db")
    writing.execute("BEGIN IMMEDIATE")
    writing.execute("DELETE FROM event")
    export_state(state, tmp_path / "state.zip")
    writing.rollback()
    writing.close()
    learner.close()
    import_state(tmp_path / "state.zip", tmp_path / "other")
    assert words_of(tmp_path / "other") == words_of(state)


def test_what_was_there_is_set_aside_and_can_be_taken_back(state, tmp_path):
    before = words_of(state)
    export_state(tmp_path / "nothing", tmp_path / "empty.zip")
    _, aside = import_state(tmp_path / "empty.zip", state)
    assert words_of(state) == []
    assert words_of(aside) == before
    assert (aside / "networks" / f"{NETWORK}.pt").is_file()
    assert [path.name for path in state.iterdir()] == [aside.name]


def test_nodes_begin_afresh_grounding_and_control_together(state):
    names, aside = reset_state(state, ["grounding"])
    assert names == ["grounding.db", "control.db"]
    assert sorted(path.name for path in aside.iterdir()) == ["control.db", "grounding.db"]
    names, aside = reset_state(state, ["attention"])
    assert sorted(path.name for path in aside.iterdir()) == ["attention.db", "networks"]
    reset_state(state)
    assert not any((state / name).exists() for name in STATE_FILES)
    assert reset_state(state) == ([], None)


HOLDER = """
import sys
from pathlib import Path
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.scene_ledger import SceneLedger
ledger = SceneLedger(Path(sys.argv[1]), Health())
print("held", flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("action", ["import", "reset"])
def test_nothing_is_touched_while_a_node_runs(state, tmp_path, action, capsys):
    archive = tmp_path / "state.zip"
    export_state(state, archive)
    before = words_of(state)
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(state / "camera.db")],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert holder.stdout.readline() == "held\n"
        found = {finding.file.name: finding.held for finding in check_state(state)}
        assert {name for name, held in found.items() if held} == {"camera.db"}
        words = [action, str(archive)] if action == "import" else [action]
        assert command(["state", *words, "--state", str(state)]) == 1
        assert "in use: node 'simulated_camera' runs with it" in capsys.readouterr().err
        assert words_of(state) == before
        assert not list(state.glob("set_aside*"))
    finally:
        holder.communicate("")
    assert command(["state", *words, "--state", str(state)]) == 0


def test_check_tells_what_is_wrong(state, capsys):
    words = ["state", "check", "--state", str(state)]
    before = {path: path.read_bytes() for path in state.glob("*.db")}
    assert command(words) == 0
    assert {path: path.read_bytes() for path in state.glob("*.db")} == before
    assert {finding.file.name for finding in check_state(state)} == set(STATE_FILES)
    (state / "camera.db").write_bytes(b"noise" * 1000)
    with sqlite3.connect(state / "reasoner.db") as connection:
        connection.execute("PRAGMA user_version=99")
    with sqlite3.connect(state / "control.db") as connection:
        connection.execute("UPDATE trust SET message = 'nonsense'")
    with sqlite3.connect(state / "learner.db") as connection:
        connection.execute("PRAGMA user_version=1")
    assert command(words) == 1
    conditions = {finding.file.name: finding.condition for finding in check_state(state)}
    assert conditions == {
        "camera.db": Condition.DAMAGED,
        "grounding_scenes.db": Condition.ABSENT,
        "grounding.db": Condition.SOUND,
        "control.db": Condition.DAMAGED,
        "reasoner.db": Condition.NEWER,
        "attention.db": Condition.SOUND,
        "learner.db": Condition.OLDER,
    }
    assert "newer    reasoner.db          version 99" in capsys.readouterr().out


def rewritten(archive: Path, change) -> Path:
    """A copy of an archive of which a member was changed."""
    target = archive.with_name("changed.zip")
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(target, "w") as new:
        members = {name: old.read(name) for name in old.namelist()}
        change(members)
        for name, content in members.items():
            new.writestr(name, content)
    return target


def of_newer_release(members):
    manifest = json.loads(members[MANIFEST])
    manifest["files"]["control.db"]["version"] = 99
    members[MANIFEST] = json.dumps(manifest)


def of_another_kind(members):
    members[MANIFEST] = members[MANIFEST].replace(b"state_export/1", b"state_export/2")


def outside(members):
    manifest = json.loads(members[MANIFEST])
    manifest["files"]["../evil.pt"] = manifest["files"].pop("camera.db")
    members["../evil.pt"] = members.pop("camera.db")
    members[MANIFEST] = json.dumps(manifest)


def flipped(members):
    members["control.db"] = members["control.db"][:-1] + b"!"


def cut(members):
    members["control.db"] = members["control.db"][:-100]


def longer(members):
    members["control.db"] += b"!"


def without_member(members):
    del members["control.db"]


def without_manifest(members):
    del members[MANIFEST]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (of_newer_release, "control.db has schema version 99"),
        (of_another_kind, "state_export/2"),
        (outside, "is no file of a state folder"),
        (flipped, "control.db is damaged"),
        (cut, "control.db is damaged"),
        (longer, "control.db is damaged"),
        (without_member, "control.db cannot be read"),
        (without_manifest, "is no state export"),
    ],
)
def test_an_archive_that_is_not_sound_changes_nothing(state, tmp_path, change, said):
    archive = tmp_path / "state.zip"
    export_state(state, archive)
    before = words_of(state)
    with pytest.raises(StateError) as refused:
        import_state(rewritten(archive, change), state)
    assert said in str(refused.value)
    assert words_of(state) == before
    assert {path.name for path in state.iterdir()} >= FILES
    assert not list(state.glob("set_aside*"))
    assert not (state / ".import").exists()
    assert not (tmp_path / "evil.pt").exists()


def test_a_file_that_is_no_archive_is_refused(state, tmp_path):
    noise = tmp_path / "noise.zip"
    noise.write_bytes(b"noise")
    for source in (noise, tmp_path / "nowhere.zip"):
        with pytest.raises(StateError, match="is no state export"):
            import_state(source, state)


def test_a_damaged_file_is_not_exported(state, tmp_path):
    (state / "camera.db").write_bytes(b"noise" * 1000)
    (tmp_path / "state.zip").write_bytes(b"of before")
    with pytest.raises(StateError, match=r"camera\.db"):
        export_state(state, tmp_path / "state.zip")
    assert (tmp_path / "state.zip").read_bytes() == b"of before"
    assert {path.name for path in tmp_path.iterdir()} == {"state", "state.zip"}


def test_the_command_shows_exports_and_takes_over(state, tmp_path, capsys):
    archive = tmp_path / "mine.zip"
    assert command(["state", "show", "--history", "2", "--state", str(state)]) == 0
    said = capsys.readouterr().out
    assert "1 axioms in force" in said
    assert "what was learned, 2 of 5:" in said
    assert "1970-01-01 00:06:40  reasoner: goal on(a, b): reached" in said
    assert "axiom_learner: cycle" not in said
    assert command(["state", "export", str(archive), "--state", str(state)]) == 0
    assert command(["state", "import", str(archive), "--state", str(tmp_path / "new")]) == 0
    capsys.readouterr()
    assert command(["state", "show", "--json", "--state", str(tmp_path / "new")]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert set(shown["files"]) == FILES
    assert len(shown["history"]) == 5


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["show", "--state", "/no/such/folder"], 1, "there is no state folder"),
        (["reset", "camera"], 2, "node 'camera' is unknown"),
        (["show", "--history", "-1"], 2, "--history is -1"),
    ],
)
def test_wrong_words_are_one_line(state, capsys, words, code, said):
    words = words if "--state" in words else [*words, "--state", str(state)]
    assert command(["state", *words]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
