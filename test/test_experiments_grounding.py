"""The experiment on grounding: its scenes, its trials on scenes of blocks, and its report."""

import math

import numpy as np
import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.experiments import grounding
from ros_scenesense.experiments.grounding_report import PAPER, Setting, report_on
from ros_scenesense.experiments.grounding_scenes import ObservedScene, SceneMaker, Truth
from ros_scenesense.experiments.grounding_set import Measured, measure_schemes
from ros_scenesense.experiments.grounding_trials import (
    DEFAULT,
    Answer,
    Asked,
    Learner,
    Question,
    accuracy,
    distance_accuracy,
    examine,
    one_of_each,
    questions_of,
    spoilt,
)
from ros_scenesense.experiments.options import Options
from ros_scenesense.grounding.frames import gravity_axes
from ros_scenesense.grounding.msr import Source
from ros_scenesense.plots import write_plot
from ros_scenesense.results import markdown, read_result, write_result
from ros_scenesense.scene import Distance, Position

OFFSETS = {  # along right, away and up
    Position.RIGHT: (0.3, 0.0, 0.0),
    Position.LEFT: (-0.3, 0.02, 0.0),
    Position.BEHIND: (0.0, 0.3, 0.0),
    Position.FRONT: (0.02, -0.3, 0.0),
    Position.ABOVE: (0.0, 0.0, 0.1),
    Position.BELOW: (0.0, 0.0, -0.1),
    Position.IN: (0.0, 0.0, 0.0),
}
AXES = gravity_axes(np.array([0.0, -1.0, 0.0]))


def blocks(position: Position, seed: int) -> ObservedScene:
    """A pair one metre before the camera that stands in a relation."""
    rng = np.random.default_rng(seed)
    edge = 0.04 if position is Position.IN else 0.1
    centre = np.array([0.0, 1.0, 0.0])
    clouds = [
        rng.uniform(-size / 2, size / 2, (200, 3)) + centre + offset
        for size, offset in ((edge, np.array(OFFSETS[position])), (0.1, np.zeros(3)))
    ]
    near = position in (Position.IN, Position.ABOVE, Position.BELOW)
    distance = Distance.TOUCHING if near else Distance.NOT_TOUCHING
    optical = [cloud @ AXES.rows for cloud in clouds]
    return ObservedScene(optical, AXES, [Truth(0, 1, position, distance)])


SCENES = [
    blocks(position, 10 * n + seed) for seed in range(2) for n, position in enumerate(Position)
]


def test_scenes_are_the_same_every_time_and_turn_with_the_camera():
    maker = SceneMaker()
    first, again = maker.scene(3, 0), maker.scene(3, 0)
    turned = maker.scene(3, 0, math.radians(90.0))
    maker.close()
    for one, other in zip(first.clouds, again.clouds, strict=True):
        np.testing.assert_array_equal(one, other)
    assert first.truths == again.truths
    assert len(first.truths) == 10
    # The same things stand there, and people call them the same from where they stand.
    assert [one.position for one in turned.truths] == [one.position for one in first.truths]
    said = [
        accuracy(examine(Learner(speaks=(Source.QSR,)), questions_of([Asked(scene)])))
        for scene in (first, turned)
    ]
    assert said[0] > said[1] + 20.0


def test_one_of_each_names_a_pair_in_the_direction_that_is_wanted():
    questions = questions_of([Asked(blocks(Position.LEFT, 1)), Asked(blocks(Position.ABOVE, 2))])
    chosen = one_of_each(questions, 1, np.random.default_rng(0))
    assert len(chosen) == 2  # a pair serves once, under one of its names
    for one in chosen:
        assert one.truth.position in (Position.LEFT, Position.RIGHT, Position.ABOVE, Position.BELOW)
        flipped = one.truth.position in (Position.RIGHT, Position.BELOW)
        assert (one.truth.first, one.truth.second) == ((1, 0) if flipped else (0, 1))


def test_spoilt_words_are_wrong_ones():
    questions = questions_of(Asked(scene) for scene in SCENES)
    rng = np.random.default_rng(1)
    assert list(spoilt(questions, 0.0, rng)) == questions
    for one, other in zip(questions, spoilt(questions, 1.0, rng), strict=True):
        assert other.truth.position is not one.truth.position
        assert other.truth.distance is not one.truth.distance
        assert other.asked is one.asked


def test_a_learner_learns_from_seven_words_what_the_others_mean():
    words = questions_of(Asked(scene) for scene in SCENES[:7])
    tested = questions_of(Asked(scene) for scene in SCENES[7:])
    learner = Learner(speaks=(Source.MSR,))
    assert {one.position for one in examine(learner, tested)} == {None}
    for one in words:
        learner.hear(one)
    assert accuracy(examine(learner, tested)) == 100.0
    assert learner.memory.model.counts.sum() == 13 + 14
    assert learner.control.state.feedback_count == 14


def test_accuracies_leave_out_what_is_ambiguous_or_was_not_told():
    right = Truth(0, 1, Position.LEFT, Distance.FAR)
    unsure = Truth(0, 1, Position.LEFT, Distance.FAR, True, True)
    unknown = Truth(0, 1, None, None)
    answers = [
        Answer(right, Position.LEFT, Distance.TOUCHING),
        Answer(right, Position.RIGHT, Distance.FAR),
        Answer(unsure, Position.LEFT, Distance.FAR),
        Answer(unknown, Position.LEFT, Distance.FAR),
    ]
    assert accuracy(answers) == pytest.approx(200 / 3)
    assert accuracy(answers, clear=True) == distance_accuracy(answers) == 50.0
    assert math.isnan(accuracy(answers[3:]))


def measured(seed: int) -> Measured:
    return measure_schemes(SCENES[:7], SCENES[7:], np.random.default_rng(seed))


def test_the_report_has_the_figures_tables_words_and_plot(tmp_path):
    outcome = report_on([measured(0), measured(1)], Setting("scenesense experiment", 3, True))
    result = outcome.result
    for name in ("msr_feedback", "msr_qsr_feedback", "combined", "combined_switch", "distance_qsr"):
        assert 0.0 <= result.figures[name] <= 100.0
    assert result.figures[DEFAULT.name] == 100.0
    assert result.figures["combined_below_better"] == 0.0
    assert result.paper == PAPER
    assert result.notes[0].startswith("These figures are from simulation")
    write_result(result, tmp_path / "g.json")
    write_plot(tmp_path / "g.png", outcome.panels)
    assert read_result(tmp_path / "g.json") == result
    page = markdown(result)
    assert "| 1 |" in page
    assert result.notes[1] in page
    assert not any("yaw" in name for name in result.figures)
    real = report_on([measured(0)], Setting("x", 0, False)).result
    assert "Table Object Scene Database" in real.notes[0]


def test_too_few_labels_and_wrong_values_are_one_line(tmp_path, capsys):
    assert cli.main(["experiment", "grounding", "--tosd", str(tmp_path / "none")]) == 1
    assert cli.main(["experiment", "grounding", "--out", "table.txt"]) == 2
    assert cli.main(["experiment", "grounding", "--seed", "-1"]) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 3
    assert "is no folder" in errors[0]
    assert "ends in .json" in errors[1]


def test_real_scenes_are_divided_among_the_sets(monkeypatch, tmp_path):
    monkeypatch.setattr(grounding, "Tosd", lambda folder: folder)
    monkeypatch.setattr(
        grounding,
        "observed_scenes",
        lambda _tosd, split, _seed: SCENES[:7] if split == "training" else SCENES[7:],
    )
    lines: list[str] = []
    options = Options("x", quick=True, dataset=tmp_path)
    outcome = grounding.conduct(options, lines.append)
    assert lines[0] == "training: 7 labelled scenes with 7 pairs"
    assert outcome.result.figures[DEFAULT.name] == 100.0
    with pytest.raises(grounding.DatasetError, match="at least 10 and 1"):
        grounding.conduct(Options("x", dataset=tmp_path), lines.append)


def test_a_question_may_be_asked_again():
    (question,) = questions_of([Asked(blocks(Position.LEFT, 3))])
    assert isinstance(question, Question)
    learner = Learner()
    learner.watch([question])
    before = learner.memory.to_arrays()
    assert examine(learner, [question]) == examine(learner, [question])
    after = learner.memory.to_arrays()
    for name, array in before.items():
        np.testing.assert_array_equal(array, after[name])
