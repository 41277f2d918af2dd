"""The experiment on planning: its goals, its counts, and the whole of it on few scenes."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.experiments import planning
from ros_scenesense.experiments.axioms_scenes import ExactScenes, domain, read_records
from ros_scenesense.experiments.planning import Plan
from ros_scenesense.experiments.planning_accuracy import Accuracy, Tally, accuracies
from ros_scenesense.experiments.planning_goals import Wanted, draw_goals, is_possible
from ros_scenesense.experiments.planning_knowledge import Knowledge, learn, truths
from ros_scenesense.experiments.planning_report import PAPER, Findings, report_on
from ros_scenesense.experiments.planning_trials import (
    AllPlans,
    Candidate,
    Judged,
    Limits,
    StateTrials,
    Trial,
)
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.resources import resource
from ros_scenesense.results import read_result
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.configuration import SimulationConfiguration
from ros_scenesense.simulation.rehearsal import Rehearsal, Tried
from ros_scenesense.simulation.scene_files import read_scenes

TINY = Plan(20, 4, 6, 1, Limits(plans=50, executed=3))
BOX, CUBE, DUCK = "red_cracker_box", "white_cube", "yellow_duck"


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("planning") / "scenes"
    count = ["--count", str(TINY.needed), "--jobs", "1"]
    assert cli.main(["dataset", "generate", str(folder), *count]) == 0
    return folder


@pytest.fixture(scope="module")
def stage() -> Iterator[tuple]:
    """The paper's scene of a hidden box, and the world in which plans are tried."""
    (file,) = read_scenes(resource("config", "scenes/planning.yaml"))
    rehearsal = Rehearsal(SimulationConfiguration(width=160, height=120, shadows=False))
    yield rehearsal.written(file), rehearsal
    rehearsal.close()


def tried(supports=(), in_hand=None, failure="", **occluded) -> Tried:
    return Tried(failure, tuple(supports), in_hand, occluded)


def test_goals_are_said_in_the_language_and_judged_by_the_simulator():
    on = Wanted("on", ("a", "b"))
    assert on.text == "on(a, b)"
    assert on.reached(tried([("a", "b")]))
    assert not on.reached(tried([("b", "a")]))
    assert not on.reached(tried([("a", "b")], failure="it fell"))
    tidied = Wanted("tidied", ("a", "b"))
    assert tidied.text == "-on(a, table), -on(b, table), no in_hand(R, X)"
    assert tidied.reached(tried([("a", "c"), ("b", "a")]))
    assert not tidied.reached(tried([("a", "c")]))
    assert not tidied.reached(tried([("a", "c"), ("b", "a")], in_hand="d"))
    visible = Wanted("visible", ("a",))
    assert visible.text == "-occluded(a), no in_hand(R, X)"
    assert visible.reached(tried(a=Truth.FALSE, b=Truth.TRUE))
    assert not visible.reached(tried(a=Truth.AMBIGUOUS))
    everything = Wanted("all_visible")
    assert everything.text == "all -occluded(X), no in_hand(R, X)"
    assert not everything.reached(tried(a=Truth.FALSE, b=Truth.TRUE))
    assert [each.looks for each in (on, tidied, visible, everything)] == [False, False, True, True]


def test_drawn_goals_do_not_hold_and_come_once(stage):
    scene, rehearsal = stage
    goals = list(draw_goals(scene, np.random.default_rng(0)))
    assert len(goals) == len(set(goals))
    # All kinds come first; the only hidden object is the box.
    assert {each.kind for each in goals[:5]} == {"visible", "all_visible", "tidied", "on"}
    assert [each.objects for each in goals if each.kind == "visible"] == [(BOX,)]
    assert sum(each.kind == "on" for each in goals) == 6
    before = rehearsal.attempt([], looks=True)
    assert not any(each.reached(before) for each in goals)


def test_the_simulator_says_what_is_possible(stage):
    scene, rehearsal = stage

    def possible(kind, *objects):
        return is_possible(Wanted(kind, objects), scene, rehearsal)

    assert possible("on", BOX, CUBE)
    assert not possible("on", CUBE, DUCK)
    assert possible("visible", BOX)
    assert possible("all_visible")
    # First the box goes on the cube, then the duck on the box; not the other way round.
    assert possible("tidied", DUCK, BOX)


def test_axioms_are_learned_and_said_in_the_action_language(dataset):
    records = read_records(dataset, TINY.needed)
    scenes = ExactScenes(domain()).read(records)
    knowledge = learn(scenes, range(20), range(20, 24), 0)
    assert "-occluded(A) if not behind(A, B)." in knowledge.text
    assert knowledge.learned == {line.partition(":")[0] for line in knowledge.text.splitlines()}
    assert knowledge.about_stability < knowledge.learned
    # None of those that were to be learned is left.
    assert not any(axiom.withheld for axiom in knowledge.description.axioms)
    assert truths(knowledge, scenes, range(24, 30)).keys() == knowledge.learned
    decided = accuracies(knowledge, records[24:])
    assert decided["with"].whole.accuracy > 0.5 > decided["without"].whole.accuracy
    labelled = [decided[way].whole.labelled for way in ("with", "without")]
    assert labelled[0] == labelled[1] == sum(each.labelled for each in decided["with"].by_scene)


def test_what_is_undecided_is_not_right():
    tally = Tally()
    for label, decided in ((True, True), (True, False), (False, None), (False, False)):
        tally.add(label, decided)
    assert (tally.labelled, tally.decided, tally.right, tally.accuracy) == (4, 3, 2, 0.5)


def all_plans(count, judged, seconds=1.0, complete=True) -> AllPlans:
    return AllPlans(count, complete, seconds, judged)


def a_trial(with_plans, without_plans) -> Trial:
    plans = {
        (way, slack): each
        for way, each in (("with", with_plans), ("without", without_plans))
        for slack in (0, 2)
    }
    good, bad = Judged(optimal=1), Judged(incorrect=1)
    chosen = {"with": good, "without": bad}
    return Trial("on", "on(a, b)", 2, plans, chosen, {"with": bad, "without": bad}, False)


def test_figures_are_means_of_the_shares_of_each_trial():
    few = a_trial(all_plans(1, Judged(1, 0, 0)), all_plans(4, Judged(1, 1, 2), 2.0, False))
    many = a_trial(all_plans(2, Judged(1, 1, 0)), all_plans(2, Judged(0, 0, 2)))
    known = Candidate(True, {"with": True, "without": True})
    refused = Candidate(False, {"with": False, "without": True})
    states = [StateTrials(0, (few,), (known, refused)), StateTrials(1, (many,), (known,))]
    knowledge = Knowledge(
        parse("learned_1: stable(A) if not above(A, B).", "test", domain()).description,
        frozenset({"learned_1"}),
        frozenset({"learned_1"}),
        "learned_1: stable(A) if not above(A, B).",
    )
    accuracy = {
        way: Accuracy({"stable": Tally(4, 4, right)}, [Tally(2, 2, right // 2)] * 2)
        for way, right in (("with", 4), ("without", 2))
    }
    findings = Findings(
        "command", 0, (590, 10, 600), Limits(), knowledge, {"learned_1": 1.0}, accuracy, states
    )
    outcome = report_on(findings)
    figures = outcome.result.figures
    assert (figures["plans_ratio"], figures["time_ratio"]) == (0.625, 0.75)
    assert figures["plans_optimal_with"] == figures["plans_optimal_with_longer"] == 0.75
    assert figures["plans_suboptimal_with"] == 0.25
    assert figures["plans_incorrect_with"] == 0.0
    assert figures["plans_optimal_without"] == 0.125
    assert figures["plans_incorrect_without"] == 0.75
    assert (figures["chosen_optimal"], figures["chosen_optimal_without"]) == (1.0, 0.0)
    assert figures["chosen_incorrect_careless"] == 1.0
    assert (figures["accuracy_with"], figures["accuracy_without"]) == (1.0, 0.5)
    assert (figures["trials_at_limit_with"], figures["trials_at_limit_without"]) == (0, 1)
    assert figures["trials_without_plan_if_nothing_was_learned"] == 2
    assert (figures["goals_possible"], figures["goals_impossible_planned_with"]) == (2, 0)
    assert set(PAPER) <= set(figures)
    assert all(len(row) == len(t.columns) for t in outcome.result.tables.values() for row in t.rows)


def test_the_whole_experiment(dataset, tmp_path, monkeypatch):
    out = tmp_path / "planning.json"
    monkeypatch.setattr(planning, "QUICK", TINY)
    words = ["--quick", "--jobs", "1", "--dataset", str(dataset), "--out", str(out)]
    assert cli.main(["experiment", "planning", *words]) == 0
    result = read_result(out)
    assert result.figures["trials"] == 5
    assert set(PAPER) <= set(result.figures)
    for way in ("with", "without"):
        kinds = ("optimal", "suboptimal", "incorrect")
        shares = [result.figures[f"plans_{kind}_{way}"] for kind in kinds]
        assert sum(shares) == pytest.approx(1.0, abs=1e-3)
    assert result.figures["accuracy_with"] > result.figures["accuracy_without"]
    assert result.tables["The learned axioms"].rows
    assert out.with_suffix(".png").read_bytes().startswith(b"\x89PNG")


def test_the_page_on_planning_quotes_what_was_measured():
    docs = Path(__file__).resolve().parent.parent / "docs"
    figures = read_result(docs / "results/planning.json").figures
    quoted = re.findall(r"\| `(\w+)`: [^|]*\| ([\d.]+) \|", (docs / "planning.md").read_text())
    assert len(quoted) > 10
    for name, value in quoted:
        assert f"{figures[name]:.{len(value.partition('.')[2])}f}" == value, name
