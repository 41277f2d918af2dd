"""Summaries and paired comparisons of repeated measurements, and how results are plotted."""

import pytest

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.plots import Panel, Series, figure_of, write_plot


def test_summary_by_students_distribution():
    found = Summary.of([1.0, 2.0, 3.0])
    assert (found.mean, found.deviation) == (2.0, 1.0)
    assert found.margin == pytest.approx(4.303 / 3**0.5, abs=1e-3)
    assert Summary.of([5.0]) == Summary(5.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        ([5.0, 6.0, 7.5], [1.0, 2.5, 3.0], "shown"),
        ([1.0, 2.5, 3.0], [5.0, 6.0, 7.5], "the opposite is shown"),
        ([1.0, 5.0, 3.0], [2.0, 3.0, 3.5], "not shown"),
        ([1.0, 2.0], [1.0, 2.0], "not shown"),
        ([2.0, 3.0, 4.0], [1.0, 2.0, 3.0], "shown"),
        ([2.0], [1.0], "not shown"),
    ],
    ids=["better", "worse", "unclear", "equal", "constant", "single"],
)
def test_what_is_shown(first, second, verdict):
    assert Comparison.of(first, second).verdict == verdict


def test_plots_are_pngs_and_the_same_every_time(tmp_path):
    panels = [
        Panel("bars", ["a", "b"], [Series("ours", [1.0, 2.0], [0.1, 0.2])]),
        Panel("lines", ["0", "7"], [Series("x", [1.0, None]), Series("y", [2.0, 3.0])], lines=True),
    ]
    paths = [tmp_path / "new" / "one.png", tmp_path / "two.png"]
    for path in paths:
        write_plot(path, panels)
    contents = [path.read_bytes() for path in paths]
    assert contents[0].startswith(b"\x89PNG")
    assert contents[0] == contents[1]


def test_legends_cover_nothing():
    series = [Series(f"a node of the graph {number}", [100.0, 1.0]) for number in range(7)]
    labels = ["long words", "of the x axis"]
    panels = [
        Panel("bars", labels, series),
        Panel("x", ["0", "1"], series, x_label="s", lines=True),
    ]
    figure = figure_of(panels)
    figure.canvas.draw()
    for axes in figure.axes:
        legend = axes.get_legend().get_window_extent()
        assert legend.y1 <= axes.xaxis.get_tightbbox().y0
        assert figure.bbox.y0 <= legend.y0
        assert figure.bbox.x0 <= legend.x0 <= legend.x1 <= figure.bbox.x1


def test_a_plot_that_cannot_be_written_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SceneSenseError, match="cannot be written"):
        write_plot(tmp_path / "file" / "one.png", [Panel("x", ["a"], [Series("s", [1.0])])])
