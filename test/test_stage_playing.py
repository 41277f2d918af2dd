"""The camera and the command line show the scenes of a dataset, and say what is wrong with one."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from camera_samples import camera, estimates, shown_ids

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError
from ros_scenesense.messages.actions import Action, ActionResult, PlannedAction
from ros_scenesense.messages.scenes import Scene, SceneLost
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
from ros_scenesense.simulation.dataset.reader import DatasetReader
from ros_scenesense.simulation.engine import SimulationConfiguration

COUNT = 3


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dataset")
    configuration = SimulationConfiguration(width=96, height=72)
    generate(path, describe(configuration, DatasetOptions(seed=1, count=COUNT)))
    return path


def play(path: Path, **values: object) -> list:
    """All that a camera publishes whose scenes are settled as soon as they are shown."""
    pipeline = Pipeline([camera(dataset=str(path), **values)])
    published = []
    for item in pipeline.run():
        published.append(item)
        if isinstance(item, Scene):
            pipeline.put(estimates(item.scene_id))
    pipeline.close()
    return published


def test_a_dataset_is_shown_scene_by_scene_to_its_end(dataset: Path) -> None:
    published = play(dataset)
    assert shown_ids(published) == ["s-0000", "s-0001", "s-0002"]
    frames = [item for item in published if isinstance(item, Frame)]
    for frame, recorded in zip(frames, DatasetReader(dataset), strict=True):
        assert np.array_equal(frame.color, recorded.frame.color)
        assert np.array_equal(frame.instances, recorded.frame.instances)


def test_a_noisy_camera_shows_the_same_scenes_with_the_same_readings_again(dataset: Path) -> None:
    first, again = (
        [item for item in play(dataset, noise="kinect") if isinstance(item, Frame)]
        for _ in range(2)
    )
    for frame, other, recorded in zip(first, again, DatasetReader(dataset), strict=True):
        assert np.array_equal(frame.depth, other.depth)
        assert not np.array_equal(frame.depth, recorded.frame.depth)
        assert np.array_equal(frame.instances, recorded.frame.instances)


def test_fewer_scenes_may_be_asked_for(dataset: Path) -> None:
    assert shown_ids(play(dataset, scenes=2)) == ["s-0000", "s-0001"]


def test_no_scene_can_be_asked_for_beyond_the_end(dataset: Path) -> None:
    stage = camera(dataset=str(dataset), in_flight=8)
    assert len(stage.jobs()) == COUNT
    stage.next_scene(0)
    assert stage.jobs() == []


def test_nobody_can_act_in_a_dataset(dataset: Path) -> None:
    stage = camera(dataset=str(dataset))
    pickup = PlannedAction(kind="pickup", object="red_cube")
    scene = next(item for item in play(dataset) if isinstance(item, Scene))
    (answer,) = stage.handle(
        Action(
            stamp=scene.stamp,
            scene_id=scene.scene_id,
            id="1",
            episode_id="e",
            step=0,
            action=pickup,
        ),
        0,
    )
    assert isinstance(answer, ActionResult)
    assert answer.outcome == "refused"
    assert "dataset" in answer.reason


def test_a_folder_that_is_no_dataset_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=str(tmp_path)):
        camera(dataset=str(tmp_path))


def test_a_damaged_scene_is_lost_with_its_file_named_and_the_others_shown(
    dataset: Path, tmp_path: Path
) -> None:
    for file in dataset.rglob("*"):
        if file.is_file():
            target = tmp_path / file.relative_to(dataset)
            target.parent.mkdir(exist_ok=True)
            target.write_bytes(file.read_bytes())
    broken = tmp_path / "color" / "000001.png"
    broken.write_bytes(broken.read_bytes()[:-20])
    published = play(tmp_path, attempts=1)
    assert shown_ids(published) == ["s-0000", "s-0002"]
    (lost,) = (item for item in published if isinstance(item, SceneLost))
    assert "000001.png" in lost.reason


def test_scene_show_draws_a_recorded_scene_and_lists_it(
    dataset: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / "scene.png"
    assert cli.main(["scene", "show", str(dataset), "--index", "1", "--out", str(out)]) == 0
    picture = cv2.imread(str(out))
    assert picture is not None
    assert picture.shape == (10 * 72, 10 * 96, 3)
    said = capsys.readouterr().out
    scene = DatasetReader(dataset)[1]
    for known in scene.objects:
        assert known.name in said


def test_scene_show_simulates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "scene.png"
    words = ["scene", "show", "--seed", "4", "--index", "2", "--arrangement", "spread"]
    assert cli.main([*words, "--out", str(out)]) == 0
    assert out.is_file()
    assert "Objects of a scene (spread)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--index", "-1"], "'index' is '-1', must be an integer of at least 0"),
        (["--seed", "many"], "'seed' is 'many', must be"),
        (["--arrangement", "heap"], "'arrangement' is 'heap', must be one of"),
        (["DATASET", "--index", "3"], "--index is 3"),
        (["DATASET", "--seed", "1"], "--seed: "),
    ],
)
def test_scene_show_names_what_is_wrong(
    words: list[str],
    said: str,
    dataset: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = [str(dataset) if word == "DATASET" else word for word in words]
    assert cli.main(["scene", "show", *words, "--out", str(tmp_path / "x.png")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "x.png").exists()
