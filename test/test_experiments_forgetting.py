"""The experiment on forgetting: its counts, and the whole of it on few scenes."""

import re
from pathlib import Path

from ros_scenesense.cli import main as cli
from ros_scenesense.experiments import forgetting
from ros_scenesense.experiments.forgetting import Plan, Way
from ros_scenesense.experiments.forgetting_report import Life, Lives, report_on
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
        if name == "First run: ours, normal axioms and defaults"
    ]
    assert any("-occluded(A) if not behind(A, B)." in row for row in table.rows)
    assert out.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


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
