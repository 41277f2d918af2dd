"""Tables, plot and words of the experiment on what learned axioms are good for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.experiments.planning_accuracy import Accuracy
from ros_scenesense.experiments.planning_knowledge import Knowledge
from ros_scenesense.experiments.planning_notes import notes_on
from ros_scenesense.experiments.planning_trials import (
    KINDS,
    SLACKS,
    WAYS,
    Limits,
    PlanKind,
    StateTrials,
    Trial,
    Way,
)
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table

PAPER = {
    "plans_ratio": 0.33,
    "time_ratio": 0.89,
    "plans_optimal_without": 0.15,
    "plans_suboptimal_without": 0.31,
    "plans_incorrect_without": 0.54,
    "plans_optimal_with": 0.49,
    "plans_suboptimal_with": 0.51,
    "plans_incorrect_with": 0.0,
}
_SUFFIX = {0: "", 2: "_longer"}
_GOALS = {
    "on": "one object on another",
    "tidied": "one or two objects off the table",
    "visible": "an object not occluded",
    "all_visible": "nothing occluded",
}

Measure = Callable[[Trial], float]
Row = list[str | int | float | None]


@dataclass(frozen=True)
class Findings:
    """What was done and found.

    Attributes:
        command: The command line.
        seed: Of everything that was drawn.
        scenes: How many to learn from, to choose between versions, and to judge decisions by.
        limits: How much was done.
        knowledge: With the learned axioms.
        truths: How often each learned axiom is true.
        accuracy: Of reasoning, by way.
        states: All trials.
    """

    command: str
    seed: int
    scenes: tuple[int, int, int]
    limits: Limits
    knowledge: Knowledge
    truths: Mapping[str, float | None]
    accuracy: Mapping[str, Accuracy]
    states: Sequence[StateTrials]

    @property
    def trials(self) -> list[Trial]:
        """Of all states."""
        return [trial for state in self.states for trial in state.trials]


def report_on(findings: Findings) -> Outcome:
    """Summarises the trials; intervals and tests are over states, whose goals belong together."""
    measures = _measures()
    summaries = {
        name: Summary.of(_by_state(findings, measure)) for name, measure in measures.items()
    }
    accuracy = {way: findings.accuracy[way].whole for way in WAYS}
    figures = {name: round(one.mean, 4) for name, one in summaries.items()}
    figures |= {f"accuracy_{way}": round(accuracy[way].accuracy, 4) for way in WAYS}
    figures |= _counts(findings)
    result = Result(
        name="planning",
        command=findings.command,
        seed=findings.seed,
        versions=versions(),
        machine=machine(),
        figures=figures,
        paper=PAPER,
        notes=notes_on(findings.limits, findings.scenes, figures),
        tables={
            "With the learned axioms as a fraction of without: mean and half the 95 % interval": (
                _ratios(summaries)
            ),
            "Plans, judged by the simulator: mean and half the 95 % interval": _shares(summaries),
            "With against without the learned axioms, paired t-test": _claims(findings, measures),
            "By kind of goal": _kinds(findings, measures),
            "Goals that were drawn": _drawn(findings),
            "Decisions about objects of other scenes": _decisions(findings),
            "The learned axioms": _axioms(findings),
        },
    )
    return Outcome(result, _panels(summaries))


def _measures() -> dict[str, Measure]:
    """What is measured of each trial, by the name of its figure."""
    found: dict[str, Measure] = {}
    for slack in SLACKS:
        words = "_minimal" if slack == 0 else ""
        found[f"plans_ratio{words}"] = partial(_plans_ratio, slack)
        found[f"time_ratio{words}"] = partial(_time_ratio, slack)
    for kind in KINDS:
        for way in WAYS:
            for slack in SLACKS:
                name = f"plans_{kind}_{way}{_SUFFIX[slack]}"
                found[name] = partial(_share_of_plans, kind, way, slack)
            suffix = "" if way == "with" else f"_{way}"
            found[f"chosen_{kind}{suffix}"] = partial(_share_of_chosen, kind, way, True)
            found[f"chosen_{kind}_careless{suffix}"] = partial(_share_of_chosen, kind, way, False)
    return found


def _plans_ratio(slack: int, trial: Trial) -> float:
    return trial.plans["with", slack].count / trial.plans["without", slack].count


def _time_ratio(slack: int, trial: Trial) -> float:
    return trial.plans["with", slack].seconds / trial.plans["without", slack].seconds


def _share_of_plans(kind: PlanKind, way: Way, slack: int, trial: Trial) -> float:
    return trial.plans[way, slack].judged.share(kind)


def _share_of_chosen(kind: PlanKind, way: Way, careful: bool, trial: Trial) -> float:
    return (trial.chosen if careful else trial.careless)[way].share(kind)


def _by_state(findings: Findings, measure: Measure) -> list[float]:
    return [float(np.mean([measure(one) for one in state.trials])) for state in findings.states]


def _counts(findings: Findings) -> dict[str, float]:
    trials = findings.trials
    figures: dict[str, float] = {"trials": len(trials)}
    for way in WAYS:
        capped = sum(not trial.plans[way, SLACKS[-1]].complete for trial in trials)
        figures[f"trials_at_limit_{way}"] = capped
    unable = sum(not trial.expressible for trial in trials)
    figures["trials_without_plan_if_nothing_was_learned"] = unable
    drawn = [each for state in findings.states for each in state.candidates]
    for possible, name in ((True, "possible"), (False, "impossible")):
        some = [each for each in drawn if each.possible is possible]
        figures[f"goals_{name}"] = len(some)
        for way in WAYS:
            planned = sum(each.planned[way] for each in some)
            figures[f"goals_{name}_planned_{way}"] = planned
    return figures


def _ratios(summaries: Mapping[str, Summary]) -> Table:
    rows: list[Row] = [
        [words, _text(summaries[f"{name}_minimal"]), _text(summaries[name]), PAPER[name]]
        for name, words in (("plans_ratio", "number of plans"), ("time_ratio", "planning time"))
    ]
    columns = ["measure", "as long as the best plan", "up to two actions longer", "paper"]
    return Table(columns=columns, rows=rows)


_PLANS = {
    "all plans as long as the best one": "plans_{kind}_{way}",
    "all plans up to two actions longer": "plans_{kind}_{way}_longer",
    "the chosen plan": "chosen_{kind}{other}",
    "the chosen plan, careless hand": "chosen_{kind}_careless{other}",
}


def _shares(summaries: Mapping[str, Summary]) -> Table:
    rows: list[Row] = []
    for words, name in _PLANS.items():
        for way in reversed(WAYS):
            cells = [_text(summaries[_named(name, kind, way)]) for kind in KINDS]
            rows.append([words, way, *cells])
    for way in reversed(WAYS):
        paper: Row = [PAPER[f"plans_{kind}_{way}"] for kind in KINDS]
        rows.append(["paper, all plans", way, *paper])
    columns = ["plans", "learned axioms", "optimal", "sub-optimal", "incorrect"]
    return Table(columns=columns, rows=rows)


def _named(name: str, kind: str, way: Way) -> str:
    return name.format(kind=kind, way=way, other="" if way == "with" else f"_{way}")


def _claims(findings: Findings, measures: Mapping[str, Measure]) -> Table:
    rows: list[Row] = []
    for words, name in _PLANS.items():
        for kind, sign in (("optimal", 1.0), ("incorrect", -1.0)):
            values = {
                way: [sign * one for one in _by_state(findings, measures[_named(name, kind, way)])]
                for way in WAYS
            }
            claim = "more are optimal" if sign > 0.0 else "fewer are incorrect"
            rows.append([words, claim, *_compared(values["with"], values["without"])])
    accuracy = {
        way: [one.accuracy for one in findings.accuracy[way].by_scene if one.labelled]
        for way in WAYS
    }
    row = _compared(accuracy["with"], accuracy["without"])
    rows.append(["decisions, scene by scene", "more are right", *row])
    return Table(columns=["of", "claim", "difference", "p", "with is better"], rows=rows)


def _compared(first: Sequence[float], second: Sequence[float]) -> Row:
    found = Comparison.of(first, second)
    return [abs(found.difference), found.probability, found.verdict]


def _kinds(findings: Findings, measures: Mapping[str, Measure]) -> Table:
    names = ("plans_ratio", "time_ratio", "plans_incorrect_without", "plans_incorrect_with")
    rows: list[Row] = []
    for kind, words in _GOALS.items():
        some = [trial for trial in findings.trials if trial.kind == kind]
        if some:
            means = [float(np.mean([measures[n](trial) for trial in some])) for n in names]
            chosen = float(np.mean([measures["chosen_optimal"](trial) for trial in some]))
            length = float(np.mean([trial.length for trial in some]))
            rows.append([words, len(some), length, *means, chosen])
    columns = [
        "goal",
        "trials",
        "actions of the best plan",
        "plans ratio",
        "time ratio",
        "incorrect without",
        "incorrect with",
        "chosen plan optimal",
    ]
    return Table(columns=columns, rows=rows)


def _drawn(findings: Findings) -> Table:
    counts = _counts(findings)
    rows: list[Row] = [
        [
            words,
            int(counts[f"goals_{name}"]),
            *(int(counts[f"goals_{name}_planned_{way}"]) for way in reversed(WAYS)),
        ]
        for name, words in (("possible", "can be done"), ("impossible", "cannot be done"))
    ]
    columns = ["in the simulator", "goals", "planned without learned axioms", "planned with them"]
    return Table(columns=columns, rows=rows)


def _decisions(findings: Findings) -> Table:
    rows: list[Row] = []
    for way in reversed(WAYS):
        accuracy = findings.accuracy[way]
        for name, tally in (*accuracy.by_fluent.items(), ("both", accuracy.whole)):
            decided = tally.decided / max(1, tally.labelled)
            right = tally.right / max(1, tally.decided)
            rows.append([way, name, tally.labelled, decided, right, tally.accuracy])
    columns = ["learned axioms", "about", "labels", "decided", "right of these", "accuracy"]
    return Table(columns=columns, rows=rows)


def _axioms(findings: Findings) -> Table:
    rows: list[Row] = []
    for line in findings.knowledge.text.splitlines():
        name, _, text = line.partition(": ")
        rows.append([name, text, findings.truths.get(name)])
    return Table(columns=["id", "axiom", "truth on the objects of other scenes"], rows=rows)


def _panels(summaries: Mapping[str, Summary]) -> list[Panel]:
    panels = []
    for words, name in list(_PLANS.items())[:3]:
        series = []
        for way in reversed(WAYS):
            found = [summaries[_named(name, kind, way)] for kind in KINDS]
            means, margins = [one.mean for one in found], [one.margin for one in found]
            series.append(Series(f"{way} learned axioms", means, margins))
            if name == "plans_{kind}_{way}":
                paper = [PAPER[f"plans_{kind}_{way}"] for kind in KINDS]
                series.append(Series(f"{way}, paper", paper))
        panels.append(
            Panel(
                words,
                ["optimal", "sub-optimal", "incorrect"],
                series,
                y_label="share of the plans",
                lowest=0.0,
                highest=1.05,
            )
        )
    names = ("plans_ratio_minimal", "plans_ratio", "time_ratio_minimal", "time_ratio")
    found = [summaries[name] for name in names]
    ratio = Series("measured", [one.mean for one in found], [one.margin for one in found])
    theirs = Series("paper", [None, PAPER["plans_ratio"], None, PAPER["time_ratio"]])
    labels = ["plans, as long", "plans, up to +2", "time, as long", "time, up to +2"]
    panels.append(Panel("with / without learned axioms", labels, [ratio, theirs], lowest=0.0))
    return panels


def _text(one: Summary) -> str:
    return f"{one.mean:.2f} ± {one.margin:.2f}"
