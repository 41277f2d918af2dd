"""The database of real scenes: layouts, sets, labels; damage is one clear error."""

import cv2
import frame_samples as samples
import numpy as np
import pytest
from box_scenes import Block, render

from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments.grounding import conduct
from ros_scenesense.experiments.options import Options
from ros_scenesense.experiments.pcd import decompress_lzf, read_pcd
from ros_scenesense.experiments.relation_labels import RelationLabel, write_labels
from ros_scenesense.experiments.tosd import Split, Tosd, instances_of_annotation
from ros_scenesense.experiments.tosd_scenes import observed_scenes
from ros_scenesense.scene import Distance, Position

BLOCKS = [
    Block("one", (0.0, 0.0, 0.0)),
    Block("two", (0.0, -0.15, 0.0)),
    Block("three", (0.25, 0.1, 0.0), (0.08, 0.08, 0.15)),
]
FRAME = render(BLOCKS)
LEFT = RelationLabel("test2", "object_1", "object_2", "left")


def image_scene(folder, name):
    samples.write_color(folder / "image_color" / f"{name}.png", FRAME)
    samples.write_depth(folder / "disparity" / f"{name}.png", FRAME)
    samples.write_annotation(folder / "annotation" / f"{name}.png", FRAME)


@pytest.fixture
def tosd(tmp_path):
    """A folder of images, with a camera file as its images are not a Kinect's."""
    for name in ("learn0", "learn10", "learn2", "test2"):
        image_scene(tmp_path, name)
    samples.write_camera(tmp_path / "camera.json", FRAME)
    return tmp_path


def test_scenes_are_found_in_order_and_in_their_sets(tosd):
    loader = Tosd(tosd)
    assert loader.names(Split.TRAINING) == ["learn0", "learn2", "learn10"]
    assert loader.names(Split.TEST) == ["test2"]
    assert loader.names() == ["learn0", "learn2", "learn10", "test2"]


def test_a_scene_of_images_is_the_frame(tosd):
    scene = Tosd(tosd).load("test2")
    np.testing.assert_array_equal(scene.frame.color, FRAME.color)
    np.testing.assert_array_equal(scene.frame.instances, FRAME.instances)
    np.testing.assert_allclose(scene.frame.depth, FRAME.depth, atol=0.0006)
    assert scene.frame.intrinsics == FRAME.intrinsics
    assert scene.objects == ["object_1", "object_2", "object_3"]
    assert scene.split is Split.TEST


@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_a_cloud_gives_the_frame_and_its_intrinsics(tmp_path, encoding):
    samples.write_pcd(tmp_path / "training" / "0007.pcd", FRAME, encoding)
    loader = Tosd(tmp_path)
    scene = loader.load("training/0007")
    assert scene.split is Split.TRAINING
    np.testing.assert_array_equal(scene.frame.color, FRAME.color)
    np.testing.assert_array_equal(scene.frame.instances, FRAME.instances)
    np.testing.assert_array_equal(scene.frame.depth, FRAME.depth)
    for name in ("fx", "fy", "cx", "cy"):
        measured, true = (getattr(each.intrinsics, name) for each in (scene.frame, FRAME))
        assert measured == pytest.approx(true, abs=0.01)


def test_clouds_stand_in_for_missing_images(tmp_path):
    image_scene(tmp_path, "learn0")
    (tmp_path / "disparity" / "learn0.png").unlink()
    with pytest.raises(DatasetError, match=r"'learn0' .* lacks '.*disparity"):
        Tosd(tmp_path)
    samples.write_pcd(tmp_path / "pcd" / "learn0.pcd", FRAME)
    assert Tosd(tmp_path).load("learn0").objects == ["object_1", "object_2", "object_3"]


def test_labelled_scenes_come_with_what_was_said(tosd):
    unclear = RelationLabel("learn0", "object_1", "object_2", "unclear")
    near = RelationLabel("test2", "object_1", "object_2", "not_touching")
    write_labels(tosd / "relations.jsonl", [LEFT, unclear, near])
    (scene,) = Tosd(tosd).labelled()
    assert (scene.name, scene.labels) == ("test2", (LEFT, near))
    assert [label.position for label in scene.labels] == [Position.LEFT, None]
    assert [label.distance for label in scene.labels] == [None, Distance.NOT_TOUCHING]
    assert list(Tosd(tosd).labelled(Split.TRAINING)) == []


def test_labelled_scenes_become_scenes_of_the_experiment(tosd):
    labels = [
        RelationLabel("test2", "object_1", "object_2", "left"),
        RelationLabel("test2", "object_2", "object_1", "not_touching"),
        RelationLabel("test2", "object_3", "object_1", "far"),
        RelationLabel("test2", "object_1", "object_3", "front"),
        RelationLabel("test2", "object_2", "object_3", "touching"),
    ]
    write_labels(tosd / "relations.jsonl", labels)
    (scene,) = observed_scenes(Tosd(tosd), Split.TEST, seed=0)
    truths = {(one.first, one.second): (one.position, one.distance) for one in scene.truths}
    assert truths == {
        (0, 1): (Position.LEFT, Distance.NOT_TOUCHING),
        (0, 2): (Position.FRONT, Distance.FAR),
        (1, 2): (None, Distance.TOUCHING),
    }
    assert len(scene.clouds) == 3
    assert scene.axes.name == "viewer"
    (again,) = observed_scenes(Tosd(tosd), Split.TEST, seed=0)
    np.testing.assert_array_equal(again.clouds[0], scene.clouds[0])
    assert list(observed_scenes(Tosd(tosd), Split.TRAINING, seed=0)) == []


def test_labels_of_objects_without_depth_are_left_out(tosd):
    depth = cv2.imread(str(tosd / "disparity" / "test2.png"), cv2.IMREAD_UNCHANGED)
    depth[FRAME.instances == 1] = 0
    cv2.imwrite(str(tosd / "disparity" / "test2.png"), depth)
    labels = [LEFT, RelationLabel("test2", "object_2", "object_3", "front")]
    write_labels(tosd / "relations.jsonl", labels)
    (scene,) = observed_scenes(Tosd(tosd), Split.TEST, seed=0)
    assert [(one.first, one.second, one.position) for one in scene.truths] == [(0, 1, "front")]
    assert len(scene.clouds) == 2


def test_a_coloured_annotation_has_an_object_per_colour():
    pixels = np.zeros((2, 3, 3), np.uint8)
    pixels[0, 1] = (0, 0, 128)
    pixels[1] = (0, 128, 0)
    ids = instances_of_annotation(pixels)
    assert ids.tolist() == [[0, 1, 0], [2, 2, 2]]
    assert instances_of_annotation(pixels[1:]).tolist() == [[1, 1, 1]]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("{", "line 2"),
        ('{"scene": "test2", "object": "object_1"}', "reference"),
        (
            '{"scene": "test2", "object": "mug", "reference": "object_2", "relation": "in"}',
            "object",
        ),
        (
            '{"scene": "test2", "object": "object_1", "reference": "object_2", "relation": "on"}',
            "relation",
        ),
        (
            '{"scene": "test2", "object": "object_1", "reference": "object_1", "relation": "in"}',
            "to itself",
        ),
        (
            '{"scene": "gone", "object": "object_1", "reference": "object_2", "relation": "in"}',
            "'gone', which is not in",
        ),
    ],
)
def test_wrong_labels_are_refused(tosd, line, words):
    header = '{"schema": "relation_labels/1", "naming_frame": "viewer"}'
    (tosd / "relations.jsonl").write_text(f"{header}\n{line}\n")
    with pytest.raises(DatasetError, match=words):
        Tosd(tosd)


def test_labels_that_contradict_each_other_or_have_other_axes_are_refused(tosd):
    write_labels(tosd / "relations.jsonl", [LEFT, RelationLabel(*_reversed(LEFT), "right")])
    with pytest.raises(DatasetError, match=r"line 3.*in line 2 already"):
        Tosd(tosd)
    header = '{"schema": "relation_labels/1", "naming_frame": "robot"}'
    (tosd / "relations.jsonl").write_text(header)
    with pytest.raises(DatasetError, match=r"line 1.*'robot'"):
        Tosd(tosd)


def _reversed(label):
    return label.scene, label.reference, label.object


def test_labels_of_objects_that_are_not_there_are_refused(tosd):
    write_labels(tosd / "relations.jsonl", [RelationLabel("test2", "object_1", "object_9", "left")])
    with pytest.raises(DatasetError, match="'test2' has no object_9"):
        Tosd(tosd).load("test2")


def test_folders_that_are_not_the_database_are_refused(tmp_path):
    with pytest.raises(DatasetError, match="is no folder"):
        Tosd(tmp_path / "gone")
    with pytest.raises(DatasetError, match="holds no scenes"):
        Tosd(tmp_path)
    samples.write_pcd(tmp_path / "0001.pcd", FRAME)
    with pytest.raises(DatasetError, match="'0001' belongs to no set"):
        Tosd(tmp_path)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda content: content[:-1000], "no readable PCD"),
        (lambda content: content.replace(b"DATA binary", b"DATA unheard"), "'unheard'"),
        (lambda content: content.replace(b"WIDTH 160", b"WIDTH many"), "many"),
        (lambda content: content.replace(b"HEIGHT 120", b"HEIGHT 121"), "no readable PCD"),
        (lambda content: content.replace(b"FIELDS", b"FELDS"), "FIELDS"),
        (lambda content: content.replace(b"label", b"other"), "no field label"),
        (lambda content: content.replace(b"HEIGHT 120", b"HEIGHT 1"), "not organised"),
        (lambda _content: b"ply\n" * 5000, "no line DATA"),
    ],
)
def test_a_damaged_cloud_is_one_error(tmp_path, spoil, words):
    path = samples.write_pcd(tmp_path / "test0.pcd", FRAME)
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(DatasetError, match=words):
        Tosd(tmp_path).load("test0")


def test_a_cloud_of_holes_is_refused(tmp_path):
    holes = render([Block("far", (9.0, 0.0, 0.0))], table=False)
    samples.write_pcd(tmp_path / "test0.pcd", holes)
    with pytest.raises(DatasetError, match="fewer than 100 points"):
        Tosd(tmp_path).load("test0")


def test_compressed_bytes_come_back_and_damage_is_seen():
    rng = np.random.default_rng(0)
    content = b"".join(bytes([value]) * int(rng.integers(1, 400)) for value in rng.bytes(60))
    packed = samples.compress_lzf(content)
    assert decompress_lzf(packed, len(content)) == content
    for broken in (packed[:-1], packed + b"\x00x", b"\x20\x05" + packed, b"\xe0"):
        with pytest.raises(ValueError, match="compressed data"):
            decompress_lzf(broken, len(content))


def test_open3d_reads_the_same_cloud(tmp_path):
    import open3d

    path = samples.write_pcd(tmp_path / "test0.pcd", FRAME)
    cloud = open3d.t.io.read_point_cloud(str(path))
    packed = tmp_path / "packed.pcd"
    open3d.t.io.write_point_cloud(str(packed), cloud, compressed=True)
    ours = read_pcd(packed)
    assert b"binary_compressed" in packed.read_bytes()[:400]
    expected = cloud.point.positions.numpy()
    for axis, name in enumerate("xyz"):
        np.testing.assert_array_equal(ours.fields[name], expected[:, axis])
    np.testing.assert_array_equal(ours.fields["label"], cloud.point.label.numpy()[:, 0])


def test_a_damaged_image_is_one_error_with_the_scene(tosd):
    path = tosd / "image_color" / "test2.png"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(DatasetError, match=r"scene 'test2': .*damaged"):
        Tosd(tosd).load("test2")
    cv2.imwrite(str(path), np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(DatasetError, match=r"scene 'test2': .*5x5"):
        Tosd(tosd).load("test2")


def test_the_experiment_on_grounding_runs_on_a_labelled_folder(tmp_path):
    rng = np.random.default_rng(0)
    placed = {
        "right": (0.0, -0.18, 0.0),
        "left": (0.0, 0.18, 0.0),
        "front": (-0.2, 0.0, 0.0),
        "behind": (0.25, 0.0, 0.0),
        "above": (0.0, 0.0, 0.08),
    }
    labels = []
    for number in range(14):
        name = f"{'learn' if number < 12 else 'test'}{number}"
        blocks = [Block("middle", (0.0, 0.0, 0.0))]
        for relation, place in placed.items():
            x, y = rng.uniform(-0.015, 0.015, 2)
            size = (0.05, 0.05, 0.05) if relation in ("front", "above") else (0.07, 0.07, 0.11)
            blocks.append(Block(relation, (place[0] + x, place[1] + y, place[2]), size))
            pair = (name, f"object_{len(blocks)}", "object_1")
            near = "touching" if relation == "above" else "not_touching"
            labels += [RelationLabel(*pair, relation), RelationLabel(*pair, near)]
        samples.write_pcd(tmp_path / f"{name}.pcd", render(blocks))
    write_labels(tmp_path / "relations.jsonl", labels)
    said = []
    outcome = conduct(
        Options("scenesense experiment grounding", quick=True, dataset=tmp_path), said.append
    )
    assert said[:2] == [
        "training: 12 labelled scenes with 60 pairs",
        "test: 2 labelled scenes with 10 pairs",
    ]
    figures = outcome.result.figures
    assert figures["qsr_improved"] == figures["combined"] == 100.0
    assert figures["msr_feedback"] > 50.0
    assert figures["distance_combined"] == 100.0
    write_labels(tmp_path / "relations.jsonl", labels[::2])
    with pytest.raises(DatasetError, match="label distances too"):
        conduct(Options("scenesense experiment grounding", quick=True, dataset=tmp_path), print)


def test_the_experiment_asks_for_more_labels_if_there_are_too_few(tosd):
    write_labels(tosd / "relations.jsonl", [LEFT])
    with pytest.raises(DatasetError, match=r"0 training and 1 test scenes.*scenesense label"):
        conduct(Options("scenesense experiment grounding", quick=True, dataset=tosd), print)
