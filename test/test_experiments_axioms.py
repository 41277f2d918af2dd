"""The experiment on learning axioms: its sets, its report, and the whole of it on few scenes."""

import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments import axioms
from ros_scenesense.experiments.axioms import Plan
from ros_scenesense.experiments.axioms_report import PAPER, Run, Setting, report_on
from ros_scenesense.experiments.axioms_scenes import (
    ExactScenes,
    domain,
    facts_of,
    feedback_on,
    read_records,
)
from ros_scenesense.learning.scoring import Judged
from ros_scenesense.results import read_result
from ros_scenesense.scene import DecisionStatus

TINY = Plan(sets=2, scenes=4, pooled=(6,), repetitions=1, judging=6)


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("axioms") / "scenes"
    count = ["--count", str(TINY.needed), "--jobs", "1"]
    assert cli.main(["dataset", "generate", str(folder), *count]) == 0
    return folder


def judged(kind, right, equals=None, same_text=False):
    return Judged(f"{kind} {equals}", kind, 0.99 if right else 0.5, right, equals, same_text)


def test_sets_share_no_scene_and_hold_the_smaller_ones():
    plan = Plan()
    sets = [axioms._of_set(plan, number, 200) for number in range(plan.sets)]
    numbers = [each for one in sets for each in one]
    assert len(numbers) == len(set(numbers)) == 2000
    assert max(numbers) < plan.needed - plan.judging
    assert set(axioms._of_set(plan, 3, 50)) < set(axioms._of_set(plan, 3, 100)) < set(sets[3])


def test_figures_are_means_over_the_sets():
    runs = [
        Run(
            "covering_50", 0, (judged("normal", True, "s1", True), judged("normal", False)), ("s1",)
        ),
        Run(
            "covering_50",
            1,
            (judged("normal", True, "o1"), judged("default", True, "s3")),
            ("o1", "s3"),
        ),
        Run("paper_50", 0, (judged("normal", True, "s1"),), ("s1",)),
        Run("paper_50", 1, (), ()),
    ]
    setting = Setting("command", 0, 50, (), 1, 600)
    result = report_on(runs, setting, [0.0, 0.02], 0.25).result
    assert result.figures["normal_precision_50"] == 0.75
    assert result.figures["normal_recall_50"] == pytest.approx(1 / 3, abs=1e-4)
    assert result.figures["normal_recall_by_text_50"] == pytest.approx(1 / 6, abs=1e-4)
    assert result.figures["default_recall_50"] == pytest.approx(1 / 6, abs=1e-4)
    # The set in which nothing was learned has no precision, but a recall of 0.
    assert result.figures["normal_precision_paper_algorithm_50"] == 1.0
    assert result.figures["normal_recall_paper_algorithm_50"] == pytest.approx(1 / 6, abs=1e-4)
    assert result.figures["estimated_slack_noisy"] == 0.01
    assert set(PAPER) <= set(result.figures)


def test_labels_by_the_rules_obey_the_knowledge_and_have_its_exceptions(dataset):
    import numpy as np

    records = read_records(dataset, TINY.needed)
    exact = ExactScenes(domain())
    scenes = exact.read(records)
    ruled = exact.ruled(records, scenes, np.random.default_rng(0))
    strict, by_default, kept = 0, [], 0
    for fluent, several in scenes.items():
        for record, examples, own in zip(records, several, ruled[fluent], strict=True):
            decided = exact._decided(facts_of(record), frozenset())[fluent]
            for before, after in zip(examples, own, strict=True):
                belief = decided[after.target]
                if belief.status is DecisionStatus.STRICT:
                    assert after.label == belief.value
                    strict += 1
                elif belief.status is DecisionStatus.BY_DEFAULT:
                    by_default.append(after.label == belief.value)
                else:
                    assert after.label == before.label
                    kept += 1
                # The reduced knowledge says nothing of occlusion.
                assert fluent == "stable" or after.reason == "undecided"
    assert min(strict, kept) > 0
    assert 0.4 < sum(by_default) / len(by_default) <= 1.0


def test_people_disagree_with_wrong_relations_only(dataset):
    import numpy as np

    records = read_records(dataset, TINY.needed)
    scenes = ExactScenes(domain()).read(records)["stable"]
    found = feedback_on(scenes, records, np.random.default_rng(0), 28)
    assert (found.asked, found.wrong, found.slack) == (28, 0, 0.0)
    shuffled = feedback_on(scenes[1:], records[:-1], np.random.default_rng(0), 28)
    assert shuffled.asked == 0 or shuffled.wrong > 0


def test_the_whole_experiment(dataset, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(axioms, "QUICK", TINY)
    out = tmp_path / "axioms.json"
    words = ["--quick", "--dataset", str(dataset), "--jobs", "1", "--out", str(out)]
    assert cli.main(["experiment", "axioms", *words]) == 0
    result = read_result(out)
    assert result.name == "axioms"
    assert "normal_recall_noisy_4" in result.figures
    assert 0.0 <= result.figures["normal_recall_6"] <= 1.0
    assert out.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    assert "Algorithm 1" in capsys.readouterr().out


def test_too_few_scenes_are_told(dataset):
    with pytest.raises(DatasetError, match="2600 are needed"):
        read_records(dataset, Plan().needed)
