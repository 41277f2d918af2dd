"""One real frame from files: what is found, what is written, and bad input as one clear error."""

import dataclasses
import json
import os
from pathlib import Path

import cv2
import frame_samples as samples
import msgspec
import numpy as np
import pytest
from box_scenes import Block, render

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import FrameError
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.messages.grounding import NameAttribute, SizeAttribute
from ros_scenesense.perceive.frame_files import read_camera, read_frame
from ros_scenesense.perceive.picture import draw
from ros_scenesense.perceive.run import Report, perceive
from ros_scenesense.perceive.words import by_weight, decision, described, relation
from ros_scenesense.scene import Size

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = Path(os.environ.get("SCENESENSE_SAMPLES", ROOT.parent / "shared" / "samples"))
NEAR = Block("near", (-0.1, 0.12, 0.0))
TOWER = [Block("low", (0.0, -0.15, 0.0)), Block("top", (0.0, -0.15, 0.08), (0.05, 0.05, 0.05))]
FRAME = render([NEAR, *TOWER])


class Files:
    """The three files of a frame, and the command on them."""

    def __init__(self, folder, frame=FRAME):
        self.folder = folder
        self.color = samples.write_color(folder / "color.png", frame)
        self.depth = samples.write_depth(folder / "depth.png", frame)
        self.camera = samples.write_camera(folder / "camera.json", frame)

    def run(self, *words):
        given = ["--color", str(self.color), "--depth", str(self.depth)]
        return cli.main(["perceive", *given, "--intrinsics", str(self.camera), *words])


@pytest.fixture
def files(tmp_path):
    return Files(tmp_path)


class TestFound:
    def test_given_instances_are_named_related_and_decided(self):
        found = perceive(FRAME)
        assert [one.name for one in found.report.objects] == ["object_1", "object_2", "object_3"]
        said = {(one.object, one.reference): one for one in found.report.relations}
        assert said["object_2", "object_3"].position == "below"
        assert said["object_2", "object_3"].distance == "touching"
        assert said["object_1", "object_2"].position == "left"
        stable = {one.name: one.stable for one in found.report.decisions}
        assert (stable["object_1"].value, stable["object_1"].axioms) == (True, ["s1"])
        assert [one.members for one in found.report.structures] == [
            ["object_1"],
            ["object_2", "object_3"],
        ]
        assert found.report.problems == []
        np.testing.assert_array_equal(found.instances, FRAME.instances)

    def test_without_instances_separate_objects_are_found(self):
        blocks = [NEAR, TOWER[0]]
        bare = dataclasses.replace(render(blocks), instances=None)
        found = perceive(bare)
        assert len(found.report.objects) == 2
        assert all(one.box is not None for one in found.report.objects)
        assert {one.name for one in found.report.decisions} == {"object_1", "object_2"}

    def test_same_frame_same_report(self):
        def bare(report: Report):
            return msgspec.structs.replace(report, timings_ms={})

        assert bare(perceive(FRAME).report) == bare(perceive(FRAME).report)

    def test_no_table_is_one_error(self):
        rng = np.random.default_rng(0)
        depth = rng.uniform(0.5, 3.0, FRAME.depth.shape).astype(np.float32)
        with pytest.raises(FrameError, match=r"the frame was not grounded.* table"):
            perceive(dataclasses.replace(FRAME, depth=depth, instances=None))

    @pytest.mark.parametrize("factor", [1000.0, 0.001, 0.0, float("nan")])
    def test_impossible_depth_is_one_error(self, factor):
        depth = (FRAME.depth * np.float32(factor)).astype(np.float32)
        with pytest.raises(FrameError, match="millimetres"):
            perceive(dataclasses.replace(FRAME, depth=depth))

    def test_depth_that_is_mostly_holes_is_said(self):
        rng = np.random.default_rng(0)
        depth = np.where(rng.random(FRAME.depth.shape) < 0.8, 0.0, FRAME.depth)
        sparse = dataclasses.replace(FRAME, depth=depth.astype(np.float32), instances=None)
        (words,) = perceive(sparse).report.problems
        assert words.startswith("scene frame-0000: only ")
        assert "objects may be missed" in words


class TestCommand:
    def test_prints_tables_and_writes_picture_and_json(self, files, capsys):
        out = files.folder / "out"
        assert files.run("--out", str(out)) == 0
        printed = capsys.readouterr()
        assert "160x120 pixels" in printed.out
        assert "object_1" in printed.out
        assert "written" in printed.err
        report = msgspec.json.decode((out / "perceived.json").read_bytes(), type=Report)
        assert json.loads((out / "perceived.json").read_text())["schema"] == "perceived/1"
        assert {one.name for one in report.objects} == {one.name for one in report.decisions}
        picture = cv2.imread(str(out / "annotated.png"))
        assert picture.shape[0] == 720
        assert picture.shape[1] > 960

    def test_json_alone_is_what_stands_in_the_file(self, files, capsys):
        assert files.run("--json", "--out", str(files.folder)) == 0
        printed = capsys.readouterr().out
        assert printed == (files.folder / "perceived.json").read_text()

    def test_depth_in_other_units_is_read_when_they_are_said(self, files, capsys):
        samples.write_depth(files.depth, FRAME, units_per_metre=10_000)
        assert files.run("--json", "--depth-scale", "10000") == 0
        boxes = [
            one["box"]["pose"]["position"] for one in json.loads(capsys.readouterr().out)["objects"]
        ]
        assert all(0.4 < box[2] < 1.5 for box in boxes)
        assert files.run("--json", "--depth-scale", "0.0001") == 0
        assert files.run("--depth-scale", "0") == files.run("--depth-scale", "nan") == 2

    @pytest.mark.parametrize("part", ["color", "depth", "camera"])
    def test_a_missing_file_is_named(self, files, capsys, part):
        getattr(files, part).unlink()
        assert files.run() == 1
        assert getattr(files, part).name in one_line(capsys)

    @pytest.mark.parametrize(
        ("spoil", "words"),
        [
            (lambda f: f.color.write_bytes(b"GIF89a"), "not a PNG"),
            (lambda f: f.color.write_bytes(f.color.read_bytes()[:90]), "damaged PNG"),
            (lambda f: flip_a_byte(f.color), "damaged PNG"),
            (lambda f: f.color.write_bytes(f.depth.read_bytes()), "16 bits per channel"),
            (lambda f: f.depth.write_bytes(f.color.read_bytes()), "8 bits and 3 channels"),
            (lambda f: cv2.imwrite(str(f.depth), np.zeros((120, 160), np.uint16)), "no depth read"),
            (lambda f: cv2.imwrite(str(f.depth), np.ones((60, 80), np.uint16) * 900), "aligned"),
            (lambda f: samples.write_depth(f.depth, FRAME, 1.0), "metres taken for millimetres"),
            (lambda f: samples.write_depth(f.depth, FRAME, 10.0), "(1 would fit)|metres"),
            (lambda f: f.camera.write_text("{"), "cannot be read"),
            (lambda f: f.camera.write_text("[1]"), "fx, fy, cx, cy"),
            (lambda f: f.camera.write_text('{"fx": 500, "fy": 500, "cx": 80}'), "cy is missing"),
            (lambda f: f.camera.write_text('{"fx": NaN, "fy": 1, "cx": 1, "cy": 1}'), "fx is nan"),
            (lambda f: f.camera.write_text('{"fx": 0, "fy": 1, "cx": 1, "cy": 1}'), "positive"),
            (lambda f: samples.write_camera(f.camera, FRAME, width=640), "640x120"),
            (lambda f: samples.write_camera(f.camera, FRAME, depth_scale=-1), "depth_scale"),
        ],
    )
    def test_bad_input_is_one_clear_line(self, files, capfd, spoil, words):
        spoil(files)
        assert files.run() == 1
        line = one_line(capfd)
        assert any(word in line for word in words.split("|")), line


def flip_a_byte(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def one_line(capsys) -> str:
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert printed.err.startswith("scenesense perceive: ")
    return printed.err


NUMBERS = {"fx": 1.0, "fy": 2.0, "cx": 3.0, "cy": 4.0}
MATRIX = [1.0, 0.0, 3.0, 0.0, 2.0, 4.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("document", "size"),
    [
        (NUMBERS, (7, 5)),
        (NUMBERS | {"width": 7, "height": 5}, (7, 5)),
        ({"fx": 1, "fy": 2, "x_offset": 3, "y_offset": 4, "img_width": 7, "img_height": 5}, (7, 5)),
        ({"k": MATRIX, "width": 7, "height": 5, "distortion_model": "plumb_bob"}, (7, 5)),
        ({"K": MATRIX}, (7, 5)),
        ({"camera_matrix": {"rows": 3, "cols": 3, "data": MATRIX}, "image_width": 7}, (7, 5)),
    ],
)
@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_intrinsics_are_read_in_every_layout(tmp_path, document, size, suffix):
    path = tmp_path / f"camera{suffix}"
    path.write_text(json.dumps(document))  # which is YAML too
    assert read_camera(path).intrinsics(*size) == Intrinsics(7, 5, 1.0, 2.0, 3.0, 4.0)


def test_ros_camera_info_is_read_as_it_is_echoed(tmp_path):
    path = tmp_path / "info.yaml"
    path.write_text(
        "height: 5\nwidth: 7\nk:\n- 1.0\n- 0.0\n- 3.0\n- 0.0\n- 2.0\n- 4.0\n"
        "- 0.0\n- 0.0\n- 1.0\n---\n"
    )
    assert read_camera(path).intrinsics(7, 5).fy == 2.0


@pytest.mark.parametrize(("scale", "units"), [(1000, 1000.0), (0.001, 1000.0), (1, 1.0)])
def test_depth_scale_is_units_per_metre_or_metres_per_unit(tmp_path, scale, units):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(NUMBERS | {"depth_scale": scale}))
    assert read_camera(path).units_per_metre == pytest.approx(units)


def test_the_frame_in_files_is_the_frame(files):
    frame = read_frame(files.color, files.depth, files.camera)
    np.testing.assert_array_equal(frame.color, FRAME.color)
    np.testing.assert_allclose(frame.depth, FRAME.depth, atol=0.0006)
    assert frame.intrinsics == FRAME.intrinsics


def test_grey_and_transparent_colour_images_are_taken(files):
    grey = cv2.imread(str(files.color), cv2.IMREAD_GRAYSCALE)
    cv2.imwrite(str(files.color), grey)
    assert read_frame(files.color, files.depth, files.camera).color.shape == (120, 160, 3)
    cv2.imwrite(str(files.color), np.dstack([grey, grey, grey, grey]))
    assert read_frame(files.color, files.depth, files.camera).color.shape == (120, 160, 3)


def test_the_picture_shows_masks_outlines_and_what_has_no_room_is_counted():
    found = perceive(FRAME)
    picture = draw(FRAME, found.instances, found.report)
    inside = picture[:, :960][FRAME.instances.repeat(6, 0).repeat(6, 1) == 1]
    assert len(np.unique(inside // 32, axis=0)) > 3  # veil, outline, tag
    many = msgspec.structs.replace(found.report, relations=found.report.relations * 20)
    full, few = (draw(FRAME, found.instances, each)[:, 960:] for each in (many, found.report))
    assert (full < 128).sum() > 2 * (few < 128).sum()


def test_an_object_is_described_by_what_is_known_of_it():
    one = perceive(FRAME).report.objects[0]
    bare = msgspec.structs.replace(one, size=None, color=None, shape=None)
    assert described(bare) == "object_1"
    color = NameAttribute(value="red", source="measured")
    size = SizeAttribute(value=Size.SMALL, source="measured")
    red = msgspec.structs.replace(bare, color=color, size=size)
    assert described(red) == "object_1 (small red)"
    other = NameAttribute(value="other", source="measured")
    assert described(msgspec.structs.replace(red, shape=other)) == "object_1 (small red)"


def test_what_matters_most_is_said_first_and_in_words():
    report = perceive(FRAME).report
    first = by_weight(report)[0]
    assert relation(first) == "object_2 is below object_3, touching"
    beliefs = {one.name: one for one in report.decisions}
    assert decision(beliefs["object_1"].stable, "stable", "unstable") == "stable"
    undecided = [one for one in report.decisions if one.stable.value is None]
    for one in undecided:
        assert decision(one.stable, "stable", "unstable").startswith("stable? ")


# A pixel (column, row) on every object that a person sees on the table, how many of these must be
# found apart, and how many objects there may be at most.
REAL = {
    "uoc/000000": (
        "73,309 174,263 204,196 282,110 343,116 300,251 233,330 422,334 496,245 542,373",
        10,
        14,
    ),
    "uoc/000004": ("240,130 245,290 430,180 470,280", 4, 4),
    "osd/learn6": ("255,270 190,215", 2, 2),
    "osd/test64": (
        "125,220 165,147 239,177 177,312 297,361 239,245 343,282 282,199 304,153 349,150 398,177 "
        "346,202 441,214 474,288 520,165 551,245",
        11,
        17,
    ),
}


@pytest.mark.skipif(not SAMPLES.is_dir(), reason="the real sample frames are not here")
@pytest.mark.parametrize("name", list(REAL))
def test_objects_in_real_frames_are_found_apart(tmp_path, name):
    pixels, least, most = REAL[name]
    camera = SAMPLES / "uoc" / "camera_params.json"
    if name.startswith("osd"):
        camera = tmp_path / "kinect.json"
        camera.write_text('{"fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5}')
    color, depth = (SAMPLES / f"{name}-{kind}.png" for kind in ("color", "depth"))
    found = perceive(read_frame(color, depth, camera))
    places = [tuple(map(int, pixel.split(","))) for pixel in pixels.split()]
    ids = [int(found.instances[row, column]) for column, row in places]
    assert len(set(ids) - {0}) >= least, ids
    report = found.report
    assert len(report.objects) <= most
    assert all(one.box is not None and max(one.box.size) < 0.6 for one in report.objects)
    assert {one.name for one in report.decisions} == {one.name for one in report.objects}
    assert any(one.stable.value is not None for one in report.decisions)
