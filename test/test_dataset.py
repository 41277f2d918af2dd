"""Datasets on disk: same bytes whatever happened, and every damage named and mended."""

import dataclasses
import errno
import hashlib
import multiprocessing
import os
import signal
from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest
from mesh_samples import write_cube

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError, ParameterError, SimulationError
from ros_scenesense.results import read_result
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.arrangements import Arrangement
from ros_scenesense.simulation.dataset.folder import DatasetFolder
from ros_scenesense.simulation.dataset.generation import generate, make_scenes
from ros_scenesense.simulation.dataset.images import DEPTH_UNIT_M
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, Metadata, describe
from ros_scenesense.simulation.dataset.plan import UNSTABLE_OF_20, Draw, wish_for
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.verification import verify
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.object_sources import objects_fingerprint

CONFIGURATION = SimulationConfiguration(width=64, height=64, shadows=False)
COUNT = 6


def small(count: int = COUNT, seed: int = 3) -> Metadata:
    return describe(CONFIGURATION, DatasetOptions(seed=seed, count=count))


def content(path: Path) -> dict[str, str]:
    return {
        str(file.relative_to(path)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(path.rglob("*"))
        if file.is_file()
    }


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dataset") / "finished"
    assert generate(path, small()) == COUNT
    return path


@pytest.fixture
def dataset(finished: Path, tmp_path: Path) -> Path:
    """A copy that a test may break."""
    path = tmp_path / "dataset"
    for file in finished.rglob("*"):
        if file.is_file():
            target = path / file.relative_to(finished)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(file.read_bytes())
    return path


def flip(path: Path, offset: int) -> None:
    broken = bytearray(path.read_bytes())
    broken[offset] ^= 0x01
    path.write_bytes(broken)


def test_a_finished_dataset_is_whole_and_stays_as_it_is(finished: Path) -> None:
    before = content(finished)
    assert len(before) == 3 + 3 * COUNT
    assert verify(finished) == []
    assert generate(finished, small()) == 0
    assert content(finished) == before


def test_workers_make_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    generate(tmp_path, small(), jobs=2)
    assert content(tmp_path) == content(finished)


def test_a_dataset_grows(finished: Path, tmp_path: Path) -> None:
    generate(tmp_path, small(count=2))
    assert generate(tmp_path, small()) == COUNT - 2
    assert content(tmp_path) == content(finished)


def _run_and_die(path: Path) -> None:
    def report(done: int, _count: int) -> None:
        if done == 3:
            os.kill(os.getpid(), signal.SIGKILL)

    generate(path, small(), report=report)


def test_a_killed_run_is_resumed_to_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    process = multiprocessing.get_context("spawn").Process(target=_run_and_die, args=(tmp_path,))
    process.start()
    process.join(timeout=60.0)
    assert process.exitcode == -signal.SIGKILL
    # A kill may also come while something is being written.
    folder = DatasetFolder(tmp_path)
    with folder.records.open("ab") as file:
        file.write(b'{"schema":"dataset_sc')
    folder.image("color", 3).with_name("000003.png.part").write_bytes(b"half")
    with pytest.raises(DatasetError, match=f"3 of {COUNT} scenes"):
        DatasetReader(tmp_path)
    assert "scene 4 to 5 not made yet" in " ".join(str(fault) for fault in verify(tmp_path))
    assert generate(tmp_path, small()) == COUNT - 3
    assert content(tmp_path) == content(finished)


def test_a_full_disk_is_one_error_and_the_run_is_resumable(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.parent.name == "depth" and path.name.startswith("000002"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(DatasetError, match=r"depth/000002.png.*No space left.*same command again"):
        generate(tmp_path, small())
    monkeypatch.undo()
    assert generate(tmp_path, small()) == COUNT - 2
    assert content(tmp_path) == content(finished)


@pytest.mark.parametrize("name", ["color/000004.png", "depth/000000.png", "instances/000005.png"])
def test_a_flipped_byte_of_an_image_is_found_and_mended(
    finished: Path, dataset: Path, name: str
) -> None:
    flip(dataset / name, -20)
    (fault,) = verify(dataset)
    assert str(fault) == f"{name}: is not as it was written"
    with pytest.raises(DatasetError, match=f"{name}' is damaged"):
        list(DatasetReader(dataset))
    assert generate(dataset, small()) == 1
    assert content(dataset) == content(finished)


@pytest.mark.parametrize("name", ["scenes.jsonl", "index.jsonl"])
@pytest.mark.parametrize("damage", [b"", b"{", b"\xff\xfe", b"[" * 5000, b'{"index": 1}'])
def test_a_damaged_line_is_named_and_mended(
    finished: Path, dataset: Path, name: str, damage: bytes
) -> None:
    lines = (dataset / name).read_bytes().split(b"\n")
    lines[1] = damage
    (dataset / name).write_bytes(b"\n".join(lines))
    (fault,) = verify(dataset)
    assert fault.file == f"{name} line 2"
    with pytest.raises(DatasetError, match=f"{name}' line 2 is damaged"):
        DatasetReader(dataset)[1]
    assert len(DatasetReader(dataset)[2].objects) > 0
    assert generate(dataset, small()) == 1
    assert content(dataset) == content(finished)


def test_a_changed_label_is_found(finished: Path, dataset: Path) -> None:
    records = dataset / "scenes.jsonl"
    text = records.read_bytes()
    records.write_bytes(text.replace(b'"stable":"true"', b'"stable":"false"', 1))
    (fault,) = verify(dataset)
    assert "scenes.jsonl scene" in str(fault)
    assert generate(dataset, small()) == 1
    assert content(dataset) == content(finished)


def test_a_missing_file_is_named_and_mended(finished: Path, dataset: Path) -> None:
    (dataset / "color/000002.png").unlink()
    assert [str(fault) for fault in verify(dataset)] == ["color/000002.png: is missing"]
    with pytest.raises(DatasetError, match=r"color/000002.png' cannot be read"):
        DatasetReader(dataset)[2]
    (dataset / "scenes.jsonl").unlink()
    assert len(verify(dataset)) > 1
    generate(dataset, small())
    assert content(dataset) == content(finished)


def test_damaged_metadata_can_be_replaced(finished: Path, dataset: Path) -> None:
    metadata = dataset / "metadata.json"
    metadata.write_bytes(metadata.read_bytes()[:100])
    for action in (verify, DatasetReader, lambda path: generate(path, small())):
        with pytest.raises(DatasetError, match=r"metadata.json' is damaged.*delete this file"):
            action(dataset)
    metadata.unlink()
    with pytest.raises(DatasetError, match="other options"):
        generate(dataset, small(seed=4))
    assert generate(dataset, small()) == 0
    assert content(dataset) == content(finished)


TIN = """
- name: tin
  shape: tin
  size: small
  surface: flat
  mass_kg: 0.2
  mesh: {file: tin.obj, parts: tin.obj}
"""


def test_a_resume_with_changed_objects_is_refused(tmp_path: Path) -> None:
    objects, path = tmp_path / "objects", tmp_path / "dataset"
    write_cube(objects / "tin.obj", 0.05)
    (objects / "tin.yaml").write_text(TIN)
    configuration = dataclasses.replace(CONFIGURATION, objects_dir=str(objects))

    def described() -> Metadata:
        return describe(configuration, DatasetOptions(count=1))

    first = described()
    generate(path, first)
    before = content(path)
    # A comment changes nothing, a mass or a mesh does.
    (objects / "tin.yaml").write_text("# mine\n" + TIN)
    assert generate(path, described()) == 0
    (objects / "tin.yaml").write_text(TIN.replace("0.2", "0.3"))
    with pytest.raises(DatasetError, match=r"is another dataset: its objects were others"):
        generate(path, described())
    (objects / "tin.yaml").write_text(TIN)
    write_cube(objects / "tin.obj", 0.06)
    with pytest.raises(DatasetError, match=r"its objects were others.*objects_dir"):
        generate(path, described())
    with pytest.raises(DatasetError, match="has other objects"):
        make_scenes(first, [0])
    assert content(path) == before
    # The same objects elsewhere are the same objects.
    moved = objects.rename(tmp_path / "moved")
    write_cube(moved / "tin.obj", 0.05)
    assert objects_fingerprint(str(moved)) == first.objects
    with pytest.raises(SimulationError, match="gone is not there"):
        describe(dataclasses.replace(CONFIGURATION, ycb_dir="gone"), DatasetOptions())


def test_folders_of_something_else_are_left_alone(dataset: Path, tmp_path: Path) -> None:
    before = content(dataset)
    with pytest.raises(DatasetError, match="seed is 3, not 4"):
        generate(dataset, small(seed=4))
    with pytest.raises(DatasetError, match=r"more than 2: a dataset\s+can only grow"):
        generate(dataset, small(count=2))
    other = msgspec.structs.replace(small(), versions={**small().versions, "pybullet": "0.1"})
    with pytest.raises(DatasetError, match=r"versions is .*'pybullet': '0.1'"):
        generate(dataset, other)
    assert content(dataset) == before
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "thesis.txt").write_text("no copy of this")
    with pytest.raises(DatasetError, match="no dataset"):
        generate(foreign, small())
    assert list(content(foreign)) == ["thesis.txt"]
    with pytest.raises(DatasetError, match="is not a dataset"):
        verify(foreign)
    with pytest.raises(DatasetError, match="cannot be made"):
        generate(foreign / "thesis.txt", small())


def test_two_runs_do_not_write_the_same_folder(tmp_path: Path) -> None:
    def second(done: int, _count: int) -> None:
        if done == 1:
            with pytest.raises(DatasetError, match="another run"):
                generate(tmp_path, small())

    generate(tmp_path, small(count=1), report=second)


def test_wrong_parameters_are_named() -> None:
    with pytest.raises(ParameterError, match="'width' is 3"):
        describe(SimulationConfiguration(width=3), DatasetOptions())
    with pytest.raises(ParameterError, match="'count' is 0"):
        small(count=0)
    with pytest.raises(ParameterError, match="'seed' is -1"):
        small(seed=-1)


def test_what_is_read_is_what_was_simulated(finished: Path) -> None:
    reader = DatasetReader(finished)
    engine = SimulationEngine(CONFIGURATION)
    for index in (0, 4):
        wish = wish_for(Draw.BALANCED, Arrangement.MIXED, 3, index)
        made, read = engine.scene(3, index, wish), reader[index]
        assert np.array_equal(read.frame.color, made.frame.color)
        assert np.array_equal(read.frame.instances, made.frame.instances)
        assert np.abs(read.frame.depth - made.frame.depth).max() <= 0.51 * DEPTH_UNIT_M
        assert read.frame.camera_pose == made.frame.camera_pose
        assert read.frame.intrinsics == made.frame.intrinsics
        assert read.frame.frame_id == made.frame.frame_id
        for field in dataclasses.fields(made):
            if field.name not in ("frame", "placed"):
                assert getattr(read, field.name) == getattr(made, field.name)
        assert [(p.piece, p.pose) for p in read.placed] == [(p.piece, p.pose) for p in made.placed]
    engine.close()


def test_the_reader_is_a_sequence(finished: Path) -> None:
    reader = DatasetReader(finished)
    assert len(reader) == COUNT
    assert reader[-1].objects == reader[COUNT - 1].objects
    assert [scene.arrangement for scene in reader[:3]] == ["towers", "spread", "intersection"]
    with pytest.raises(IndexError):
        reader[COUNT]
    assert [record.index for record in reader.records()] == list(range(COUNT))


def test_stacks_are_as_planned(finished: Path) -> None:
    for record in DatasetReader(finished).records():
        wish = wish_for(Draw.BALANCED, Arrangement.MIXED, 3, record.index)
        assert record.arrangement == wish.arrangement
        if wish.stacked is not None:
            stack = max(record.structure_labels, key=lambda label: len(label.members))
            assert len(stack.members) == wish.stacked
            assert stack.stable is (Truth.TRUE if wish.stable else Truth.FALSE)


@pytest.mark.parametrize("seed", [0, 7])
def test_the_plan_is_balanced(seed: int) -> None:
    wishes = [wish_for(Draw.BALANCED, Arrangement.MIXED, seed, index) for index in range(720)]
    for arrangement, stacks in ((Arrangement.TOWERS, 4), (Arrangement.INTERSECTION, 3)):
        mine = [wish for wish in wishes if wish.arrangement is arrangement]
        assert len(mine) == 240
        for stacked in range(2, 2 + stacks):
            stable = [wish.stable for wish in mine if wish.stacked == stacked]
            assert len(stable) == 240 // stacks
            assert stable.count(False) == len(stable) * UNSTABLE_OF_20[stacked] // 20
    alone = [wish_for(Draw.BALANCED, Arrangement.TOWERS, seed, index) for index in range(240)]
    assert alone == [wish for wish in wishes if wish.arrangement is Arrangement.TOWERS]


def command(*words: object) -> int:
    return cli.main(["dataset", *(str(word) for word in words)])


def test_the_commands(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "made"
    size = ("--width", 64, "--height", 64, "--shadows", "false")
    assert command("generate", path, "--count", 3, "--seed", 5, "--jobs", 1, *size) == 0
    assert "3 scenes, 3 of them made now" in capfd.readouterr().out
    assert command("verify", path) == 0
    assert command("stats", path, "--json", tmp_path / "stats.json") == 0
    assert "Axioms in physics" in capfd.readouterr().out
    result = read_result(tmp_path / "stats.json")
    assert result.seed == 5
    assert result.figures["scenes"] == 3.0
    assert 0.9 <= result.figures["label_agreement"] <= 1.0
    assert command("show", path, "--out", tmp_path / "sheet.png", "--scenes", 2) == 0
    sheet = cv2.imread(str(tmp_path / "sheet.png"))
    assert sheet.shape[1] == 2 * (64 + 6)
    flip(path / "color" / "000001.png", -20)
    assert command("verify", path) == 1
    assert "color/000001.png: is not as it was written" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["generate", "{path}", "--count", "none"], 2, "'count' is 'none'"),
        (["generate", "{path}", "--arrangement", "pile"], 2, "'arrangement' is 'pile'"),
        (["generate", "{path}", "--jobs", "0"], 2, "--jobs is 0"),
        (
            ["rebackground", "{finished}", "{path}", "--backgrounds", "2", "--jobs", "0"],
            2,
            "--jobs is 0",
        ),
        (["verify", "{path}"], 1, "is not a dataset"),
        (["stats", "{finished}", "--relabel", "-1"], 2, "--relabel is -1"),
        (["stats", "{finished}", "--json", "{path}/a.txt"], 2, "must be a file that ends in .json"),
        (["stats", "{path}"], 1, "is not a dataset"),
        (["show", "{finished}", "--out", "{path}/a.png", "--scenes", "0"], 2, "--scenes is 0"),
        (["show", "{finished}", "--out", "{path}/a.png", "--arrangement", "pile"], 2, "pile"),
        (["show", "{finished}", "--out", "/proc/a.png"], 1, "cannot be written"),
    ],
)
def test_wrong_words_are_one_line(
    words: list[str],
    code: int,
    said: str,
    finished: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    named = [word.format(path=tmp_path, finished=finished) for word in words]
    assert command(*named) == code
    error = capfd.readouterr().err
    assert said in error
    assert error.count("\n") == 1
