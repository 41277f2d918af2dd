"""The benchmarks: targets, results on disk, and the real steps on a few scenes."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from demo_samples import INFO, parts, run
from test_demo_view import console, printed

from ros_scenesense.bench import (
    attention,
    classification,
    datasets,
    decisions,
    graph,
    learning,
    perception,
    planning,
    reasoning,
    steps,
)
from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.bench.suite import GROUPS, Group, run_suite
from ros_scenesense.cli import bench as command
from ros_scenesense.cli import main as cli
from ros_scenesense.demo.run import DemoResult
from ros_scenesense.demo.summary import RunEnd, summarise
from ros_scenesense.errors import LaunchError, ReasoningError, SceneSenseError
from ros_scenesense.results import Result, Table, markdown, read_result, write_result

QUICK = BenchOptions(quick=True)
SPEED = Figure("speed", "how fast | per second", at_least=2.0)
DELAY = Figure("delay_ms", "how slow", at_most=10.0)
SHARE = Figure("share", "how much")


def measure(_options):
    table = Table(columns=["step", "ms"], rows=[["a|b", 1.23456], ["none", None]])
    return Measured({"speed": 3.0, "delay_ms": 20.0, "share": 0.5}, {"Steps": table})


@pytest.fixture
def result() -> Result:
    groups = [Group("nothing", (SPEED, DELAY, SHARE), measure)]
    return run_suite(QUICK, "scenesense bench", lambda _line: None, groups)


def test_a_ratio_of_one_and_more_reaches_the_target():
    assert SPEED.ratio(3.0) == 1.5
    assert DELAY.ratio(20.0) == 0.5
    assert DELAY.ratio(0.0) == float("inf")
    assert SHARE.ratio(0.5) is None
    between = Figure("between", "neither rare nor sure", at_least=0.5, at_most=0.8)
    assert between.target == "0.5 to 0.8"
    assert [between.ratio(value) for value in (0.25, 0.5, 0.8, 1.0)] == [0.5, 1.0, 1.0, 0.8]


def test_the_suite_puts_figures_beside_their_targets(result):
    assert result.figures == {"speed": 3.0, "delay_ms": 20.0, "share": 0.5}
    assert result.tables["Figures"].rows == [
        ["speed", 3.0, "at least 2", 1.5, SPEED.meaning],
        ["delay_ms", 20.0, "at most 10", 0.5, DELAY.meaning],
        ["share", 0.5, "", None, SHARE.meaning],
    ]


def test_results_are_written_as_json_and_markdown(result, tmp_path):
    path = tmp_path / "results" / "bench.json"
    write_result(result, path)
    assert read_result(path) == result
    assert set(msgspec.json.decode(path.read_bytes())) == {
        "name",
        "command",
        "seed",
        "versions",
        "machine",
        "notes",
        "figures",
        "paper",
        "tables",
    }
    assert path.with_suffix(".md").read_text() == markdown(result)
    assert sorted(file.name for file in path.parent.iterdir()) == ["bench.json", "bench.md"]


def test_markdown_tables_have_as_many_cells_as_columns(result):
    rows = [line for line in markdown(result).splitlines() if line.startswith("| ")]
    assert "| a\\|b | 1.235 |" in rows
    assert "| none | - |" in rows
    for row in rows:
        assert row.replace("\\|", "").count("|") in (3, 6)


def test_a_place_that_cannot_be_written_is_named(result):
    with pytest.raises(SceneSenseError, match=r"/dev/null/bench\.json"):
        write_result(result, Path("/dev/null/bench.json"))


@pytest.mark.parametrize(
    ("words", "named"),
    [(["--seed", "-1"], "seed"), (["--seed", "x"], "seed"), (["--json", "bench.txt"], ".json")],
)
def test_wrong_values_end_with_one_line_and_exit_code_2(capsys, words, named):
    assert cli.main(["bench", *words]) == 2
    error = capsys.readouterr().err
    assert named in error
    assert error.count("\n") == 1


def test_the_command_prints_and_writes(result, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(command, "run_suite", lambda *_: result)
    assert cli.main(["bench", "--quick", "--json", str(tmp_path / "b.json")]) == 0
    assert "delay_ms" in capsys.readouterr().out
    assert read_result(tmp_path / "b.json") == result


def test_show_prints_every_table(result):
    target = console()
    command.show(result, target)
    assert "Steps" in printed(target)
    assert "at most 10" in printed(target)


def test_figures_have_names_of_their_own():
    names = [figure.name for group in GROUPS for figure in group.figures]
    assert len(names) == len(set(names))
    assert {"graph_scenes_per_s", "graph_ready_s", "relations_ms_5", "classify_ms_5"} <= set(names)


def test_attention_and_its_network_are_timed():
    measured = attention.measure(QUICK)
    assert set(measured.figures) >= {figure.name for figure in attention.FIGURES}
    assert min(measured.figures.values()) > 0.0


def test_learning_axioms_is_timed():
    measured = learning.measure(QUICK)
    assert set(measured.figures) == {figure.name for figure in learning.FIGURES}
    assert min(measured.figures.values()) > 0.0


def stand_in(monkeypatch, tmp_path, record, end):
    summary = summarise(record, INFO, end)

    class Demo:
        def __init__(self, *_):
            pass

        def run(self):
            return DemoResult(record, summary, tmp_path)

    monkeypatch.setattr(graph, "Demo", Demo)


def test_figures_of_the_graph(monkeypatch, tmp_path):
    record = run(*(parts(number) for number in range(5)))
    stand_in(monkeypatch, tmp_path, record, RunEnd("complete", ready_s=2.0, scenes_s=2.5))
    figures = graph.measure(QUICK).figures
    assert figures == {"graph_ready_s": 2.0, "graph_scenes_per_s": 2.0, "graph_latency_ms": 5.0}


@pytest.mark.parametrize(
    ("scenes", "end", "error"),
    [
        (4, RunEnd("complete", ready_s=2.0, scenes_s=2.5), LaunchError),
        (5, RunEnd("failed", error="a node died"), LaunchError),
        (0, RunEnd("interrupted"), KeyboardInterrupt),
    ],
)
def test_a_run_that_is_not_complete_gives_no_figures(monkeypatch, tmp_path, scenes, end, error):
    record = run(*(parts(number) for number in range(scenes)))
    stand_in(monkeypatch, tmp_path, record, end)
    with pytest.raises(error):
        graph.measure(QUICK)


def test_real_steps_are_measured():
    measured = steps.measure(QUICK)
    assert set(measured.figures) == {"relations_ms_5", "decide_ms_5"}
    assert all(value > 0.0 for value in measured.figures.values())
    (table,) = measured.tables.values()
    assert [row[1] for row in table.rows] == [15, 15]


def test_reasoning_about_scenes_is_measured():
    measured = classification.measure(QUICK)
    assert {"classify_ms_5", "classify_ms_40", "explain_ms_5"} <= set(measured.figures)
    assert set(measured.figures) <= {figure.name for figure in classification.FIGURES}
    assert all(value > 0.0 for value in measured.figures.values())
    assert measured.figures["classify_ms_5"] < measured.figures["classify_ms_40"]


def test_knowledge_and_reasoning_are_timed():
    figures = reasoning.measure(QUICK).figures
    assert set(figures) == {figure.name for figure in reasoning.FIGURES}
    assert all(value > 0.0 for value in figures.values())


def test_other_plans_than_those_found_by_hand_are_noticed(monkeypatch):
    by_hand = planning.plans_by_hand
    monkeypatch.setattr(
        planning, "plans_by_hand", lambda *asked: set(list(by_hand(*asked))[1:]) or {("wait",)}
    )
    with pytest.raises(ReasoningError, match="other plans"):
        planning.measure(QUICK)


def test_strict_decisions_agree_with_physics():
    measured = decisions.measure(QUICK)
    assert set(measured.figures) <= {figure.name for figure in decisions.FIGURES}
    for task in ("stability", "occlusion", "structure_stability"):
        assert measured.figures[f"{task}_strict_accuracy"] >= 0.95
        assert 0.0 < measured.figures[f"{task}_decided_share"] <= 1.0


def test_datasets_are_measured(monkeypatch):
    monkeypatch.setattr(datasets.os, "sched_getaffinity", lambda _: {0})
    measured = datasets.measure(QUICK)
    assert set(measured.figures) <= {figure.name for figure in datasets.FIGURES}
    assert measured.figures["images_per_s"] > 0.0
    assert measured.figures["share_of_limit"] > 0.0
    for name in ("label_agreement", "p_stable_not_above", "p_not_occluded_not_behind_natural"):
        assert measured.figures[name] >= 0.9
    assert [len(table.rows) for table in measured.tables.values()] == [8, 8]


def test_perception_is_measured_on_frames_with_and_without_noise():
    measured = perception.measure(QUICK)
    assert set(measured.figures) == {figure.name for figure in perception.FIGURES}
    shares = [v for name, v in measured.figures.items() if not name.startswith("perceive")]
    assert all(0.0 <= share <= 1.0 for share in shares)
    assert measured.figures["segmentation_iou70"] > 0.6
    table = measured.tables["Segmentation without instance ids"]
    assert {row[1] for row in table.rows} == {"none", "kinect"}


def test_overlap_is_that_of_the_best_found_object():
    true = np.array([[1, 1, 2, 2, 3]], np.uint16)
    found = np.array([[5, 5, 5, 2, 0]], np.uint16)
    assert perception.best_overlaps(true, found).tolist() == [2 / 3, 1 / 2, 0.0]
    assert perception.best_overlaps(true, np.zeros_like(true)).tolist() == [0.0, 0.0, 0.0]
