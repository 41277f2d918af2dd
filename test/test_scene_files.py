"""Scenes written by hand are built as they say, labelled by physics, and can be acted in."""

import json
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from camera_samples import camera, estimates, shown_ids

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import ParameterError, SimulationError
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.messages.scenes import KnownObject, Scene
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.resources import resource
from ros_scenesense.scene import Position, Size, Surface, Truth
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.episodes import EpisodeEngine, Story
from ros_scenesense.simulation.scene_files import read_scenes
from ros_scenesense.stages.withholding import ATTRIBUTES, withhold

SMALL = SimulationConfiguration(width=96, height=72, shadows=False)
SHIPPED = resource("config", "scenes")
TOWER = {
    "objects": [
        {"object": "large_cube", "color": "white"},
        {"object": "small_duck", "color": "yellow", "stands_on": "white_cube", "y_m": 0.01},
        {"object": "small_cube", "color": "red", "x_m": 0.2},
    ]
}


def write(folder: Path, content: object, name: str = "mine.yaml") -> Path:
    path = folder / name
    path.write_text(json.dumps(content))
    return path


def made(path: Path):
    with closing(SimulationEngine(SMALL)) as engine:
        (file,) = read_scenes(path)
        return engine.written(file)


@pytest.mark.parametrize("name", ["trace_1", "attention", "planning", "unstable"])
def test_shipped_scenes_are_what_they_show(name: str) -> None:
    scene = made(SHIPPED / f"{name}.yaml")
    stable = {label.name: label.stable for label in scene.object_labels}
    occluded = {n.name for n in scene.object_labels if n.occluded is Truth.TRUE}
    supports = dict(scene.supports)
    if name in ("trace_1", "attention"):
        assert supports == {"white_cube": "red_cylinder", "yellow_duck": "white_cube"}
    if name == "unstable":
        assert {n for n, truth in stable.items() if truth is Truth.FALSE} == {
            "white_cube",
            "red_cylinder",
        }
    else:
        assert set(stable.values()) == {Truth.TRUE}
    hidden = {"attention": {"blue_mug"}, "planning": {"red_cracker_box"}}
    assert occluded == hidden.get(name, set())


def test_the_readme_shows_every_shipped_scene_and_its_example_is_right(tmp_path: Path) -> None:
    text = (SHIPPED / "README.md").read_text()
    files = sorted(SHIPPED.glob("*.yaml"))
    assert len(files) == 5
    assert all(f"| `{file.name}` |" in text for file in files)
    example = tmp_path / "example.yaml"
    example.write_text(text.split("```yaml\n")[1].split("```")[0])
    scene = made(example)
    assert [known.name for known in scene.objects] == ["white_cube", "yellow_duck", "blue_mug"]
    assert scene.background == 3


def test_things_are_where_the_file_says(tmp_path: Path) -> None:
    scene = made(write(tmp_path, TOWER))
    assert scene.arrangement == "written"
    poses = {placed.piece.name: placed.pose.position for placed in scene.placed}
    assert poses["white_cube"] == pytest.approx((0.0, 0.0, 0.05), abs=0.001)
    assert poses["yellow_duck"][:2] == pytest.approx((0.0, 0.01))
    assert poses["red_cube"][:2] == pytest.approx((0.2, 0.0))
    said = {(one.object, one.reference): one.position for one in scene.relations}
    assert said["red_cube", "white_cube"] is Position.BEHIND
    again = made(write(tmp_path, TOWER, "again.json"))
    assert np.array_equal(scene.frame.color, again.frame.color)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"objects": []}, "length >= 1"),
        ({"objekts": []}, "unknown field `objekts`; known fields are objects, about"),
        ({"objects": [{"object": "large_cube"}]}, "missing required field `color`"),
        ({"objects": [{"object": "cube", "color": "red"}]}, r"\[0\].object is 'cube', the catal"),
        ({"objects": [{"object": "mug", "color": "pink"}]}, "allowed are red, green"),
        ({"objects": [{"object": "apple", "color": "blue"}]}, "color is blue, a apple comes in"),
        ({"objects": [{"object": "mug", "color": "red", "x_m": 3}]}, r"<= 0.9 - at .*x_m"),
        ({"objects": [{"object": "mug", "color": "red", "stands_on": "it"}]}, "'it', before it"),
        ({**TOWER, "camera": {"pitch_deg": 90}}, r"<= 60.0 - at .*camera\.pitch_deg"),
        ({**TOWER, "background": 1001}, "<= 1000"),
        ({"objects": TOWER["objects"][:1] * 2}, r"\[1\] is a second white_cube"),
        (
            {"objects": [TOWER["objects"][0], {"object": "small_cube", "color": "red"}]},
            "red_cube does not come down to the table",
        ),
        (
            {"objects": [TOWER["objects"][0], {**TOWER["objects"][1], "y_m": 0.3}]},
            "yellow_duck does not touch white_cube",
        ),
        ("no scene", "Expected `object`"),
    ],
)
def test_a_wrong_file_is_named_with_its_field(tmp_path: Path, change: object, words: str) -> None:
    path = write(tmp_path, change)
    with pytest.raises(SimulationError, match=rf"mine\.yaml.*{words}"):
        made(path)


def play(**values: object) -> list:
    pipeline = Pipeline([camera(width=96, height=72, shadows=False, **values)])
    published = []
    for item in pipeline.run():
        published.append(item)
        if isinstance(item, Scene):
            pipeline.put(estimates(item.scene_id))
    pipeline.close()
    return published


def test_the_camera_shows_the_scenes_of_a_folder_in_order(tmp_path: Path) -> None:
    write(tmp_path, {"objects": TOWER["objects"][:1]}, "b.json")
    write(tmp_path, TOWER, "a.yaml")
    (tmp_path / "notes.txt").write_text("no scene")
    published = play(scene_files=str(tmp_path))
    assert shown_ids(published) == ["s-0000", "s-0001"]
    shown = [item for item in published if isinstance(item, Scene)]
    assert [len(scene.objects) for scene in shown] == [3, 1]


def test_a_camera_with_wrong_scene_files_does_not_start(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match="holds no"):
        camera(scene_files=str(tmp_path))
    with pytest.raises(SimulationError, match=r"gone\.yaml cannot be read"):
        camera(scene_files=str(tmp_path / "gone.yaml"))
    with pytest.raises(ParameterError, match="'dataset' and 'scene_files' are both set"):
        camera(scene_files=str(SHIPPED), dataset=str(tmp_path))


def test_the_first_trace_can_be_executed_where_the_camera_sees_it() -> None:
    plan = [
        ("yellow_duck", "table"),
        ("white_cube", "table"),
        ("red_cylinder", "white_cube"),
    ]
    story = Story(0, 0)
    with closing(EpisodeEngine(SMALL, read_scenes(SHIPPED / "trace_1.yaml"))) as engine:
        assert len(engine.scene(0, 0).objects) == 3
        for name, location in plan:
            for action in (
                PlannedAction(kind="pickup", object=name),
                PlannedAction(kind="putdown", object=name, location=location),
            ):
                outcome, scene = engine.act(story, action)
                assert outcome.executed, outcome.reason
                story = story.then(action)
    assert outcome.settled_on == "white_cube"
    assert dict(scene.supports) == {"red_cylinder": "white_cube"}


KNOWN = [
    KnownObject(
        instance=number,
        name=f"red_{shape}",
        size=Size.SMALL,
        surface=Surface.FLAT,
        shape=shape,
        color="red",
    )
    for number, shape in enumerate(("cube", "duck", "mug", "apple", "tray"), 1)
]


def missing(objects: list[KnownObject]) -> set[tuple[str, str]]:
    return {(o.name, name) for o in objects for name in ATTRIBUTES if getattr(o, name) is None}


def test_the_stated_share_of_attributes_is_withheld() -> None:
    left_out = [missing(withhold(KNOWN, 0.2, 3, index)) for index in range(200)]
    assert sum(map(len, left_out)) / (200 * 20) == pytest.approx(0.2, abs=0.02)
    assert missing(withhold(KNOWN, 0.0, 3, 0)) == set()
    assert len(missing(withhold(KNOWN, 1.0, 3, 0))) == 20
    # With more withheld, what was withheld before still is.
    assert all(
        before <= missing(withhold(KNOWN, 0.5, 3, index)) for index, before in enumerate(left_out)
    )


def test_what_is_withheld_does_not_depend_on_what_else_is_there() -> None:
    alone, together = withhold(KNOWN[1:2], 0.5, 0, 7), withhold(KNOWN, 0.5, 0, 7)
    assert alone == together[1:2]


def test_the_camera_withholds_attributes_in_scene_alone() -> None:
    whole = play(scene_files=str(SHIPPED / "attention.yaml"))
    less = play(scene_files=str(SHIPPED / "attention.yaml"), withheld_attributes=0.5)
    for one, other in zip(whole, less, strict=True):
        if isinstance(one, Scene):
            assert missing(one.objects) == set()
            assert 2 < len(missing(other.objects)) < 18
            assert [known.name for known in one.objects] == [known.name for known in other.objects]


def test_scene_show_draws_a_scene_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = write(tmp_path, TOWER), tmp_path / "scene.png"
    assert cli.main(["scene", "show", str(path), "--out", str(out)]) == 0
    assert out.is_file()
    assert "yellow_duck" in capsys.readouterr().out
    for words, said in ((["--index", "0"], "--index: "), (["--seed", "1"], "--seed: ")):
        assert cli.main(["scene", "show", str(path), *words, "--out", str(out)]) == 2
        assert said in capsys.readouterr().err
