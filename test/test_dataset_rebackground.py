"""Tests of datasets whose scenes are those of another one before other backgrounds."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError, ParameterError
from ros_scenesense.simulation.dataset.folder import DatasetFolder
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, Metadata, describe
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.dataset.rebackground import rebackground
from ros_scenesense.simulation.dataset.verification import verify
from ros_scenesense.simulation.engine import SimulationConfiguration

COUNT = 5
BACKGROUNDS = 4


def metadata(count: int = COUNT, backgrounds: int = 0) -> Metadata:
    configuration = SimulationConfiguration(
        width=64, height=64, shadows=False, backgrounds=backgrounds
    )
    return describe(configuration, DatasetOptions(seed=8, count=count))


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("source")
    generate(path, metadata())
    return path


@pytest.fixture(scope="module")
def changed(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("changed")
    assert rebackground(source, path, BACKGROUNDS) == COUNT
    return path


def files(path: Path) -> dict[str, bytes]:
    return {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*.*")}


def test_all_but_colors_and_background_is_that_of_the_source(source: Path, changed: Path) -> None:
    before, after = DatasetReader(source), DatasetReader(changed)
    for index in range(COUNT):
        old, new = before.record(index), after.record(index)
        assert 1 <= new.background <= BACKGROUNDS
        again = msgspec.structs.replace(new, background=old.background)
        assert msgspec.json.encode(again) == msgspec.json.encode(old)
        for kind in ("depth", "instances"):
            one, other = (DatasetFolder(path).image(kind, index) for path in (source, changed))
            assert one.read_bytes() == other.read_bytes()
        colors = [reader[index].frame.color for reader in (before, after)]
        instances = after[index].frame.instances
        assert instances is not None
        same = (colors[0] == colors[1]).all(axis=-1)
        assert same[instances > 0].all()
        assert np.mean(same[instances == 0]) < 0.2
    assert len({record.background for record in after.records()}) > 1


def test_the_source_and_the_backgrounds_are_known(source: Path, changed: Path) -> None:
    before, after = (DatasetFolder(path).read_metadata() for path in (source, changed))
    assert after.source == before.fingerprint()
    assert after.configuration.backgrounds == BACKGROUNDS
    assert before.source is msgspec.UNSET
    assert "source" not in DatasetFolder(source).metadata.read_text()


def test_what_the_simulation_would_have_shown(source: Path, tmp_path: Path) -> None:
    # Both draw one background of one.
    generate(tmp_path / "simulated", metadata(backgrounds=1))
    rebackground(source, tmp_path / "changed", 1)
    one, other = (files(tmp_path / name) for name in ("simulated", "changed"))
    images = [name for name in one if name.endswith(".png")]
    assert len(images) == 3 * COUNT
    assert all(one[name] == other[name] for name in [*images, "scenes.jsonl"])


def test_what_is_broken_is_made_again(source: Path, changed: Path, tmp_path: Path) -> None:
    rebackground(source, tmp_path, BACKGROUNDS)
    DatasetFolder(tmp_path).image("color", 2).write_bytes(b"no image")
    (fault,) = verify(tmp_path)
    assert fault.index == 2
    assert rebackground(source, tmp_path, BACKGROUNDS) == 1
    assert files(tmp_path) == files(changed)


def test_the_number_of_workers_changes_no_byte(source: Path, changed: Path, tmp_path: Path) -> None:
    assert rebackground(source, tmp_path, BACKGROUNDS, jobs=2) == COUNT
    files = sorted(path for path in changed.rglob("*") if path.is_file())
    assert len(files) == 3 + 3 * COUNT
    for file in files:
        assert (tmp_path / file.relative_to(changed)).read_bytes() == file.read_bytes()


def test_folders_of_something_else_are_left_alone(
    source: Path, changed: Path, tmp_path: Path
) -> None:
    before = files(changed)
    with pytest.raises(DatasetError, match="backgrounds is 4, not 3"):
        rebackground(source, changed, 3)
    with pytest.raises(DatasetError, match="source is"):
        generate(changed, metadata(backgrounds=BACKGROUNDS))
    with pytest.raises(DatasetError, match="source itself"):
        rebackground(changed, changed, BACKGROUNDS)
    with pytest.raises(DatasetError, match="is not a dataset"):
        rebackground(tmp_path, changed, BACKGROUNDS)
    with pytest.raises(ParameterError, match="'backgrounds' is 1001"):
        rebackground(source, tmp_path / "many", 1001)
    assert not (tmp_path / "many").exists()
    assert files(changed) == before


def test_a_damaged_source_is_named(tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    generate(copy, metadata(count=1))
    DatasetFolder(copy).image("depth", 0).write_bytes(b"no image")
    with pytest.raises(DatasetError, match=r"copy/depth/000000.png' is damaged"):
        rebackground(copy, tmp_path / "changed", BACKGROUNDS)


def test_the_command(source: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "changed"
    words = ["dataset", "rebackground", str(source), str(out), "--backgrounds"]
    assert cli.main([*words, "2"]) == 0
    assert "5 of them made now" in capfd.readouterr().out
    assert cli.main(["dataset", "verify", str(out)]) == 0
    assert cli.main([*words, "-1"]) == 2
    assert "'backgrounds' is -1" in capfd.readouterr().err
