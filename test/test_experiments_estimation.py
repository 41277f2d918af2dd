"""The experiments on estimation: what is scored, what is learned from, and a run from the shell."""

import numpy as np
import pytest

from ros_scenesense.attention.inputs import pack
from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments.estimation import EstimationOptions, conduct
from ros_scenesense.experiments.estimation_plans import ESTIMATION, Plan
from ros_scenesense.experiments.estimation_report import Setting, images_needed, report_on
from ros_scenesense.experiments.estimation_samples import WAYS, samples_of
from ros_scenesense.experiments.estimation_scores import majority_of, score
from ros_scenesense.experiments.estimation_segments import own_instances
from ros_scenesense.experiments.estimation_trials import Trial, Tried
from ros_scenesense.experiments.estimation_views import (
    Attended,
    Picture,
    Question,
    Reasoned,
    Region,
    View,
)
from ros_scenesense.results import read_result
from ros_scenesense.scene import Task

STABLE, OCCLUDED = Task.STABILITY, Task.OCCLUSION
PICTURE = Picture(np.zeros((3, 56, 56), np.uint8), np.zeros((3, 115, 115), np.uint8))


def view(number=0):
    """A cube on a can, which falls, left of a mug that hides nothing; of the can less is known."""
    image = pack(np.zeros((6, 32, 32), np.float32))
    question = Question(STABLE, "cube", image, np.ones(8, np.float32))
    region = Region(STABLE, ("can", "cube"), ("cube",), PICTURE)
    nothing = Attended([], [])
    return View(
        number=number,
        objects=("can", "cube", "mug"),
        labels={
            ("can", STABLE): True,
            ("cube", STABLE): False,
            ("mug", STABLE): True,
            ("can", OCCLUDED): None,
            ("cube", OCCLUDED): False,
            ("mug", OCCLUDED): True,
        },
        structures=[(("can", "cube"), False), (("mug",), True)],
        picture=PICTURE,
        whole=[Question(STABLE, name, image, np.ones(8, np.float32)) for name in ("can", "mug")],
        reasoned={"incomplete": Reasoned({}, nothing, Attended([region], [question]), [])},
    )


def test_right_is_what_the_labels_say_and_no_decision_is_wrong():
    scene = view()
    right = {key: value for key, value in scene.labels.items() if value is not None}
    right |= dict(scene.structures)
    assert set(score([(scene, right)]).values()) == {1.0}
    # Nothing is said of the can's occlusion by its label: it does not count.
    scores = score([(scene, {**right, ("can", OCCLUDED): True, ("mug", OCCLUDED): None})])
    assert scores["occlusion"] == 0.5
    assert scores["occlusion_balanced"] == 0.5
    assert scores["accuracy"] == 0.75  # of two occlusions and two structures
    assert scores["decided"] == 0.75
    assert scores["stack"] == 1.0


def test_who_says_nothing_about_single_objects_has_no_score_there():
    scores = score([(view(), {("can", "cube"): True, ("mug",): True})])
    assert "stability" not in scores
    assert (scores["structure"], scores["stack"], scores["occlusion"]) == (0.5, 0.0, 0.0)


def test_scenes_without_labels_are_refused():
    empty = View(0, (), {}, [], PICTURE, [], {})
    with pytest.raises(DatasetError, match="no label"):
        score([(empty, {})])


def test_the_most_frequent_answers():
    usual = majority_of([view()])
    assert usual == {"occlusion": True, "stability": True, "structure": True, "stack": False}


def test_whole_images_have_a_slot_for_all_and_regions_for_what_they_hold():
    (whole,) = samples_of(WAYS["lenet"], [view()], "incomplete").answers
    (region,) = samples_of(WAYS["lenet_att"], [view()], "incomplete").answers
    unknown = np.nan
    np.testing.assert_array_equal(whole[:2], [0, 1])
    np.testing.assert_array_equal(whole[5:8], [unknown, 0, 1])
    np.testing.assert_array_equal(region[:2], [0, unknown])
    np.testing.assert_array_equal(region[5:8], [unknown, 0, unknown])


def test_questions_ask_one_literal_and_without_geometry_have_no_numbers():
    asked = samples_of(WAYS["query"], [view(7)], "incomplete")
    np.testing.assert_array_equal(asked.answers, [[0, np.nan]])
    np.testing.assert_array_equal(asked.numbers, np.ones((1, 8)))
    np.testing.assert_array_equal(asked.groups, [7])
    assert not samples_of(WAYS["query_pixels"], [view()], "incomplete").numbers.any()
    both = samples_of(WAYS["same_channels"], [view()], "incomplete").answers
    np.testing.assert_array_equal(both, [[1, np.nan], [1, 1]])


def test_what_is_segmented_has_the_ids_of_what_it_fits():
    true = np.zeros((4, 8), np.uint16)
    true[:, :4], true[:, 4:6] = 1, 2
    found = np.zeros_like(true)
    found[:, 1:4], found[:2, 4:8] = 5, 3
    seen = own_instances(true, found)
    np.testing.assert_array_equal(seen == 1, found == 5)
    assert not (seen == 2).any()  # a third of what is there or seen
    assert set(np.unique(seen[found == 3])).isdisjoint({0, 1, 2})
    np.testing.assert_array_equal(seen == 0, found == 0)


def tried(way, images, accuracy, seed=0, balanced=0.5):
    trial = Trial(way, "incomplete", images, seed, 10)
    scores = {"accuracy": accuracy, "balanced": balanced, "occlusion": accuracy, "decided": 1.0}
    return Tried(trial, {way: scores}, 10, 10, 1.0)


def test_images_needed_lie_between_two_sizes_along_the_logarithm():
    setting = Setting("samples", "scenesense", 0, 30, 10, 1, "validated")
    trials = [tried("lenet", 1000, 0.8), tried("query", 10, 0.7), tried("query", 1000, 0.9)]
    figures = report_on(trials, setting).result.figures
    assert figures["images_ratio_query"] == pytest.approx(0.1)
    assert figures["baseline_1000"] == 0.8
    assert images_needed({}, "query", "lenet") is None
    # By balanced accuracy no training was better than any other: the fewest images do.
    assert figures["images_ratio_query_balanced"] == pytest.approx(0.01)
    trials[0] = tried("lenet", 1000, 0.8, balanced=0.6)
    assert "images_ratio_query_balanced" not in report_on(trials, setting).result.figures
    # Never as good: no ratio.
    trials[2] = tried("query", 1000, 0.75)
    assert "images_ratio_query" not in report_on(trials, setting).result.figures


def test_what_three_trainings_do_not_show_is_not_claimed():
    setting = Setting("estimation", "scenesense", 0, 30, 10, 3, "validated")
    close = [
        tried(way, 100, accuracy, seed)
        for way, several in (("lenet", (0.7, 0.9, 0.8)), ("lenet_att", (0.8, 0.85, 0.84)))
        for seed, accuracy in enumerate(several)
    ]
    (row,) = report_on(close, setting).result.tables["Compared on the same images and seeds"].rows
    assert row[-1] == "not shown"


def test_no_trial_trains_on_scenes_that_test():
    for trial in ESTIMATION.trials(300, seed=0, schedule="validated", device="cpu"):
        assert trial.images + trial.tests <= 300
    plan = Plan(sizes={"query": (10, 20)}, repeats=2)
    trials = list(plan.trials(30, seed=5, schedule="paper", device="cpu"))
    assert [(one.images, one.seed) for one in trials[:4]] == [(20, 5), (20, 6), (10, 5), (10, 6)]


def test_experiment_from_the_shell_and_again_from_what_was_kept(tmp_path, capsys):
    arguments = ["experiment", "estimation", "--quick", "--jobs", "1", "--ways", "query,lenet"]
    arguments[-1] += ",query_segmented"
    arguments += ["--seed", "1", "--sizes", "16", "--work", str(tmp_path / "work")]
    assert cli.main([*arguments, "--out", str(tmp_path / "one.json")]) == 0
    assert (tmp_path / "one.md").exists()
    assert (tmp_path / "one.png").exists()
    result = read_result(tmp_path / "one.json")
    assert result.figures["scenes"] == 24
    for name in (
        "architecture_16",
        "architecture_16_complete",
        "baseline_16",
        "majority",
        "query_segmented_16",
    ):
        assert 0.0 <= result.figures[name] <= 1.0
    # Complete knowledge decides most without a network, incomplete knowledge hardly anything.
    assert result.figures["reasoning_decided"] < 0.3 < result.figures["reasoning_decided_complete"]
    kept = {file: file.stat().st_mtime_ns for file in (tmp_path / "work").rglob("*.joblib")}
    assert cli.main([*arguments, "--out", str(tmp_path / "two.json")]) == 0
    assert read_result(tmp_path / "two.json").figures == result.figures
    assert kept == {each: each.stat().st_mtime_ns for each in (tmp_path / "work").rglob("*.joblib")}
    arguments[arguments.index("--seed") + 1] = "2"
    assert cli.main(arguments) != 0
    assert "keeps other scenes" in capsys.readouterr().err


def test_backgrounds_from_the_shell(tmp_path):
    arguments = ["experiment", "backgrounds", "--quick", "--jobs", "1", "--ways", "query"]
    assert cli.main([*arguments, "--out", str(tmp_path / "b.json")]) == 0
    figures = read_result(tmp_path / "b.json").figures
    two = [figures[f"query_16_backgrounds_{count}"] for count in (2, 10)]
    assert figures["background_spread"] == pytest.approx(100 * abs(two[0] - two[1]), abs=0.02)


def test_unknown_ways_and_sizes_are_refused(capsys):
    assert cli.main(["experiment", "samples", "--ways", "resnet"]) != 0
    assert "resnet" in capsys.readouterr().err
    assert cli.main(["experiment", "samples", "--sizes", "many"]) != 0
    assert "--sizes" in capsys.readouterr().err


def test_a_dataset_that_is_too_small_is_refused(tmp_path):
    from ros_scenesense.simulation.dataset.generation import generate
    from ros_scenesense.simulation.dataset.metadata import DatasetOptions, describe
    from ros_scenesense.simulation.engine import SimulationConfiguration

    metadata = describe(SimulationConfiguration(), DatasetOptions(count=3))
    generate(tmp_path / "small", metadata)
    with pytest.raises(DatasetError, match="too few"):
        conduct(EstimationOptions("scenesense", dataset=tmp_path / "small"), lambda _line: None)
