"""`scenesense groundings show`: the picture and the counts, from the file of a stage."""

import cv2
import numpy as np
import pytest
from grounding_samples import record, sample, update

from ros_scenesense.cli import main as cli
from ros_scenesense.demo.groundings_picture import draw_groundings
from ros_scenesense.grounding.msr import MetricModel, MetricSettings
from ros_scenesense.scene import Distance, Position
from ros_scenesense.stages.grounding_store import GroundingStore
from ros_scenesense.stages.health import Health


@pytest.fixture
def state(tmp_path):
    """A folder with what a stage has learned; the stage still runs."""
    store = GroundingStore(tmp_path / "grounding.db", Health(), 10, MetricSettings())
    store.record_scene(record())
    store.apply(
        update(1, sample("left a b", source="qsr"), sample("touching a b"), sample("in b c"))
    )
    yield tmp_path
    store.close()


def test_the_picture_and_the_counts_are_of_the_running_stage(state, tmp_path, capsys):
    out = tmp_path / "pictures" / "groundings.png"
    assert cli.main(["groundings", "show", "--state", str(state), "--out", str(out)]) == 0
    image = cv2.imread(str(out))
    assert image.shape[0] > 500
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50
    output = capsys.readouterr().out
    rows = {line.split()[0]: line.split()[1:] for line in output.splitlines() if line.strip()}
    assert rows["left"] == rows["right"] == ["1", "0", "0"]
    assert rows["touching"] == ["0", "0", "2"]
    assert rows["in"] == ["0", "0", "1"]
    assert "1 updates merged, 2 statements of people, 1 scenes remembered" in output


def test_every_preposition_has_a_panel_that_shows_where_it_is(state):
    store = GroundingStore(state / "grounding.db", Health(), 10, MetricSettings())
    titles = {}
    for panel in draw_groundings(store.memory.model).axes:
        if panel.get_title():
            titles[panel.get_title().split("\n")[0].split(",")[0]] = panel
    store.close()
    assert set(titles) == {*Position, *Distance}
    assert "no examples" in titles["above"].get_title()
    (left,) = titles["left"].get_images()
    row, column = np.unravel_index(left.get_array().argmax(), left.get_array().shape)
    extent = left.get_extent()
    shown = extent[0] + (column + 0.5) * (extent[1] - extent[0]) / left.get_array().shape[1]
    labels = dict(
        zip(
            titles["left"].get_xticks(),
            [text.get_text() for text in titles["left"].get_xticklabels()],
            strict=True,
        )
    )
    nearest = min(labels, key=lambda tick: abs(tick - shown))
    assert labels[nearest] == "left"
    assert row == 6


def test_a_model_without_examples_can_be_drawn():
    assert all(
        "no examples" in panel.get_title()
        for panel in draw_groundings(MetricModel()).axes
        if panel.get_title()
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "there is no"), (b"nonsense" * 200, "cannot be read")],
    ids=["none", "damaged"],
)
def test_without_a_readable_file_it_is_said(tmp_path, capsys, content, words):
    if content is not None:
        (tmp_path / "grounding.db").write_bytes(content)
    out = tmp_path / "groundings.png"
    assert cli.main(["groundings", "show", "--state", str(tmp_path), "--out", str(out)]) == 1
    assert words in capsys.readouterr().err
    assert not out.exists()
    assert (tmp_path / "grounding.db").exists() == (content is not None)


def test_a_picture_that_cannot_be_written_is_said(state, capsys):
    out = state / "grounding.db" / "x.png"
    assert cli.main(["groundings", "show", "--state", str(state), "--out", str(out)]) == 2
    assert "cannot be written" in capsys.readouterr().err
