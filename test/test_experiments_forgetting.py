"""The experiment on forgetting: its counts, and the whole of it on few scenes."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.experiments import forgetting
from ros_scenesense.experiments.forgetting import Plan, Way
from ros_scenesense.experiments.forgetting_report import Life, Lives, report_on
from ros_scenesense.plots import write_plot
from ros_scenesense.results import read_result

TINY = Plan(runs=1, cycles=2, scenes=8, merging=2, pool=16, judging=6)


def life(true=True, equals=None, ended=None):
    return Life("text", "normal", 1, ended, (1.0, None), true, 0.9, equals)


def test_wrong_and_lost_axioms_are_counted():
    lives = Lives(
        "both",
        0,
        (
            life(equals="s1"),
            life(equals="s1", ended="forgotten in cycle 2"),
            life(equals="o1", ended="forgotten in cycle 2"),
            life(true=False),
            life(true=False, ended="forgotten in cycle 2"),
        ),
        {},
    )
    assert (lives.wrong_left, lives.right_lost, lives.known) == (1, 1, 1)
    figures = report_on([lives], "command", 0, 2).result.figures
    assert figures["wrong_left_after_2"] == 1.0
    assert figures["right_lost_after_2"] == 1.0
    assert figures["wrong_learned"] == 2.0


def test_the_whole_experiment(tmp_path, monkeypatch):
    folder, out = tmp_path / "scenes", tmp_path / "forgetting.json"
    count = ["--count", str(TINY.needed), "--jobs", "1"]
    assert cli.main(["dataset", "generate", str(folder), *count]) == 0
    monkeypatch.setattr(forgetting, "QUICK", TINY)
    monkeypatch.setattr(forgetting, "WAYS", (Way("both"), Way("bad_given", given=True)))
    words = ["--quick", "--dataset", str(folder), "--out", str(out)]
    assert cli.main(["experiment", "forgetting", *words]) == 0
    result = read_result(out)
    assert result.figures["known_after_2"] >= 1.0
    assert {"wrong_left_after_2_bad_given", "given_wrong_refuted"} <= set(result.figures)
    (table,) = [
        t
        for name, t in result.tables.items()
        if name == "First run: ours, and defaults (th1 = 70 %)"
    ]
    assert any("-occluded(A) if not behind(A, B)." in row for row in table.rows)
    assert out.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_the_world_changes_half_way_or_for_a_while():
    half, back = Way("changing", changes=True), Way("returning", returns=True)
    assert [half.has_changed(cycle, 10) for cycle in range(10)] == [False] * 5 + [True] * 5
    assert [n for n in range(10) if back.has_changed(n, 10)] == [3, 4, 5]
    assert not any(Way("both").has_changed(cycle, 10) for cycle in range(10))


def test_a_given_axiom_counts_as_restored_if_it_is_in_force_in_the_end():
    lives = [
        Lives("returning", 0, (life(),), {}, ("s2",)),
        Lives("returning", 1, (life(),), {"s2": "true of few"}, ("s2",)),
        Lives("returning", 2, (life(),), {}),
    ]
    figures = report_on(lives, "command", 0, 2).result.figures
    assert figures["given_restored_returning"] == pytest.approx(1 / 3, abs=1e-4)


def test_each_axiom_has_a_row_of_its_own_in_the_plot(tmp_path):
    import cv2
    import numpy as np

    def drawn(count, path):
        axioms = tuple(
            replace(life(), text=f"axiom {n}", strengths=(1.0, 1.0)) for n in range(count)
        )
        write_plot(path, report_on([Lives("both", 0, axioms, {})], "command", 0, 2).panels)
        image = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_COLOR)
        # Rows in which something coloured is drawn, in runs: one per axiom.
        coloured = (image.max(axis=2).astype(int) - image.min(axis=2) > 60).any(axis=1)
        return int((coloured[1:] & ~coloured[:-1]).sum())

    assert drawn(3, tmp_path / "plot.png") == 3
    assert drawn(5, tmp_path / "plot.png") == 5


def test_a_plan_needs_scenes_for_every_run():
    assert Plan().needed == 3 * 10 * 60 + 600


def test_the_page_on_learning_quotes_what_was_measured():
    root = Path(__file__).resolve().parent.parent / "docs"
    figures = {
        **read_result(root / "results/axioms.json").figures,
        **read_result(root / "results/forgetting.json").figures,
    }
    quoted = re.findall(r"\| `(\w+)`: [^|]*\| ([\d.]+) \|", (root / "learning.md").read_text())
    assert len(quoted) > 10
    for name, value in quoted:
        assert f"{figures[name]:.2f}" == value, name
