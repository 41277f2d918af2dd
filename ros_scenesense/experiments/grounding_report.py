"""Tables, plot and words of the experiment on grounding."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.experiments.grounding_notes import notes_of
from ros_scenesense.experiments.grounding_set import (
    QSR_PAIRS,
    TEST_PAIRS,
    WRONG_SHARES,
    YAWS_DEG,
    Measured,
)
from ros_scenesense.experiments.grounding_trials import DEFAULT
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table
from ros_scenesense.scene import Position

PAPER = {"qsr_pyramids": 70.0, "msr_feedback": 65.0, "msr_qsr_feedback": 79.0, "combined": 87.0}
_PAPER_DEVIATIONS = {"msr_feedback": 7.2, "msr_qsr_feedback": 4.6, "combined": 8.3}
_PAPER_SETS = {
    "msr_feedback": (65, 82, 68, 66, 65, 68, 64, 64, 62, 52),
    "msr_qsr_feedback": (77, 80, 80, 83, 74, 77, 87, 84, 82, 72),
    "combined": (84, 94, 85, 87, 82, 86, 90, 91, 87, 81),
}
_WAYS = {
    "qsr_pyramids": "QSR alone: pyramids, camera axes (the paper's)",
    "qsr_pyramids_gravity": "QSR alone: pyramids, gravity axes",
    "qsr_improved_camera": "QSR alone: improved rule, camera axes",
    "qsr_improved": "QSR alone: improved rule, gravity axes (the default)",
    "msr_feedback": "MSR, 7 feedback pairs",
    "msr_qsr_feedback": f"MSR, {QSR_PAIRS} QSR pairs and 7 feedback pairs",
    "combined_switch": "combined, one switch",
    "combined": "combined, arbiter (the default)",
    "msr_feedback_paper_method": "the paper's method: MSR, 7 feedback pairs",
    "msr_qsr_feedback_paper_method": "the paper's method: MSR, QSR and feedback pairs",
    "combined_paper_method": "the paper's method: combined, arbiter",
    "combined_switch_paper_method": "the paper's method: combined, one switch",
}
_CLAIMS = (
    ("combined", "msr_feedback", "the combination beats MSR taught by 7 feedback pairs"),
    ("combined", "msr_qsr_feedback", "the combination beats MSR taught by QSR and feedback"),
    ("combined", "qsr_improved", "the combination beats its QSR alone"),
    ("combined", "combined_switch", "the arbiter beats one switch"),
    ("msr_qsr_feedback", "msr_feedback", "QSR labels make better use of the same feedback"),
    ("qsr_pyramids_gravity", "qsr_pyramids", "gravity axes beat camera axes (pyramids)"),
    ("qsr_improved", "qsr_pyramids_gravity", "the improved rule beats pyramids (gravity axes)"),
    (
        "combined_switch_paper_method",
        "qsr_pyramids",
        "the paper's method: the combination beats its QSR alone",
    ),
    ("distance_combined", "distance_qsr", "distances: the combination beats its QSR alone"),
    ("distance_qsr", "distance_qsr_pyramids_gravity", "distances: the improved rule beats 1 cm"),
    ("yaw40_feedback7", "yaw40_feedback0", "40 degrees: 7 words help"),
    ("yaw40_feedback28", "yaw40_feedback7", "40 degrees: 28 words help more than 7"),
    (
        "yaw40_feedback28",
        "yaw40_feedback28_learning_alone",
        "40 degrees, 28 words: estimating the angle beats learning alone",
    ),
    ("combined_wrong20", "msr_wrong20", "one of five words wrong: the arbiter beats MSR"),
)


@dataclass(frozen=True)
class Setting:
    """Of a run of the experiment.

    Attributes:
        command: The command line.
        seed: Of everything that was drawn.
        simulated: Whether the scenes were simulated.
    """

    command: str
    seed: int
    simulated: bool


def report_on(sets: Sequence[Measured], setting: Setting) -> Outcome:
    """Summarises what was measured on the sets.

    Args:
        sets: Of each the same figures; those that are NaN on any set are left out.
        setting: Of the run.
    """
    values = {
        name: [one.figures[name] for one in sets]
        for name in sets[0].figures
        if not any(math.isnan(one.figures[name]) for one in sets)
    }
    found = {name: Summary.of(several) for name, several in values.items()}
    figures = {name: one.mean for name, one in found.items()}
    for name in (*PAPER, "combined_switch", "combined_unambiguous", "distance_combined"):
        if name in found:
            figures[f"{name}_sd"] = found[name].deviation
            figures[f"{name}_ci95"] = found[name].margin
    better = max(figures[DEFAULT.name], figures["msr_qsr_feedback"])
    figures["combined_below_better"] = max(0.0, better - figures["combined"])
    claims = {
        words: Comparison.of(values[first], values[second])
        for first, second, words in _CLAIMS
        if first in values and second in values
    }
    tables = {
        "Accuracy of positions, %": _table_of_ways(found),
        "The paper's table beside ours, accuracy of positions, %": _table_of_sets(values),
        "Accuracy of distances, %": _table_of_distances(found),
        "The viewpoint turned, accuracy of positions, %": _table_of_turns(found),
        "Wrong feedback, 28 pairs, accuracy of positions, %": _table_of_errors(found),
        "What was called what, QSR alone": _table_of_confusions(sets, DEFAULT.name),
        "What was called what, combined": _table_of_confusions(sets, "combined"),
        "Claims, paired t-test over the sets": _table_of_claims(claims),
        "Frames without instance ids, objects found": _table_of_shares(found),
    }
    result = Result(
        name="grounding",
        command=setting.command,
        seed=setting.seed,
        versions=versions(),
        machine=machine(),
        figures={name: round(value, 4) for name, value in figures.items()},
        paper=PAPER,
        notes=notes_of(figures, claims, len(sets), TEST_PAIRS, setting.simulated),
        tables={title: table for title, table in tables.items() if table.rows},
    )
    return Outcome(result, _panels(found))


def _table_of_ways(found: dict[str, Summary]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for name, words in _WAYS.items():
        if name in found:
            clear = found.get(f"{name}_unambiguous")
            rows.append(
                [
                    words,
                    *_rounded(found[name].mean, found[name].deviation, found[name].margin),
                    None if clear is None else round(clear.mean, 1),
                    PAPER.get(name),
                    _PAPER_DEVIATIONS.get(name),
                    name,
                ]
            )
    columns = ["way", "mean", "sd", "95 % ±", "unambiguous pairs", "paper", "paper sd", "figure"]
    return Table(columns=columns, rows=rows)


def _table_of_sets(values: dict[str, list[float]]) -> Table:
    names = list(_PAPER_SETS)
    rows: list[list[str | int | float | None]] = []
    for number in range(len(values["combined"])):
        ours = [round(values[name][number], 1) for name in names]
        rows.append([number + 1, *ours, *(_PAPER_SETS[name][number] for name in names)])
    means = [round(Summary.of(values[name]).mean, 1) for name in names]
    rows.append(["mean", *means, *(PAPER[name] for name in names)])
    deviations = [round(Summary.of(values[name]).deviation, 1) for name in names]
    rows.append(["sd", *deviations, *(_PAPER_DEVIATIONS[name] for name in names)])
    words = ("MSR, feedback", "MSR, QSR + feedback", "combined")
    columns = ["set", *words, *(f"paper: {one}" for one in words)]
    return Table(columns=columns, rows=rows)


def _table_of_distances(found: dict[str, Summary]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for name, words in _WAYS.items():
        one = found.get(f"distance_{name}")
        if one is not None and "paper_method" not in name:
            rows.append([words, *_rounded(one.mean, one.deviation, one.margin)])
    return Table(columns=["way", "mean", "sd", "95 % ±"], rows=rows)


def _table_of_turns(found: dict[str, Summary]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for yaw_deg in YAWS_DEG:
        names = [f"yaw{yaw_deg}_feedback{count}" for count in (0, 7, 28)]
        if names[0] not in found:
            continue
        names += [f"{name}_unannounced" for name in names[1:]]
        names += [f"{name}_learning_alone" for name in names[1:3]]
        rows.append([f"{yaw_deg}°", *(round(found[name].mean, 1) for name in names)])
    columns = ["turned by", "no word", "7 words", "28 words"]
    columns += ["7, move not known", "28, move not known"]
    columns += ["7, no angle estimated", "28, no angle estimated"]
    return Table(columns=columns, rows=rows)


def _table_of_errors(found: dict[str, Summary]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for share in WRONG_SHARES:
        name = f"wrong{round(100 * share)}"
        if f"combined_{name}" in found:
            combined, msr = found[f"combined_{name}"], found[f"msr_{name}"]
            rows.append(
                [f"{share:.0%}", *_rounded(combined.mean, combined.margin), round(msr.mean, 1)]
            )
    return Table(columns=["wrong", "combined", "95 % ±", "MSR alone"], rows=rows)


def _table_of_confusions(sets: Sequence[Measured], name: str) -> Table:
    total: Counter[tuple[str, str]] = Counter()
    for one in sets:
        total.update(one.confusions.get(name, {}))
    words = [str(position) for position in Position]
    rows: list[list[str | int | float | None]] = []
    for true in words:
        count = sum(total[true, said] for said in (*words, "None"))
        if count:
            right = round(100.0 * total[true, true] / count, 1)
            rows.append([true, *(total[true, said] for said in words), right])
    return Table(columns=["true", *words, "right, %"], rows=rows)


def _table_of_claims(claims: dict[str, Comparison]) -> Table:
    rows: list[list[str | int | float | None]] = [
        [words, round(one.difference, 2), f"{one.probability:.2g}", one.verdict]
        for words, one in claims.items()
    ]
    return Table(columns=["claim", "difference", "p", "verdict"], rows=rows)


def _table_of_shares(found: dict[str, Summary]) -> Table:
    rows: list[list[str | int | float | None]] = [
        [depth, round(100.0 * found[name].mean, 1), round(100.0 * found[name].margin, 1)]
        for name, depth in (
            ("segmentation_iou70", "perfect"),
            ("segmentation_iou70_kinect", "of a Kinect"),
        )
        if name in found
    ]
    return Table(columns=["depth", "intersection over union > 0.7, %", "95 % ±"], rows=rows)


def _panels(found: dict[str, Summary]) -> list[Panel]:
    short = {
        "qsr_pyramids": "QSR,\npaper's",
        "qsr_improved": "QSR,\nimproved",
        "msr_feedback": "MSR,\nfeedback",
        "msr_qsr_feedback": "MSR,\nQSR + fb",
        "combined": "combined",
    }
    ours = [found[name] for name in short]
    panels = [
        Panel(
            "Positions: ours and the paper's",
            [words.replace("\n", " ") for words in short.values()],
            [
                Series("ours", [one.mean for one in ours], [one.margin for one in ours]),
                Series("paper", [PAPER.get(name) for name in short]),
            ],
            y_label="accuracy, %",
            lowest=50.0,
            highest=100.0,
        )
    ]
    turns = [yaw for yaw in YAWS_DEG if f"yaw{yaw}_feedback0" in found]
    if turns:
        counts = (0, 7, 28)
        panels.append(
            Panel(
                "The viewpoint turned",
                [str(count) for count in counts],
                [
                    Series(f"{yaw}°", *_curve(found, [f"yaw{yaw}_feedback{n}" for n in counts]))
                    for yaw in turns
                ],
                y_label="accuracy, %",
                x_label="feedback pairs after the turn",
                lines=True,
                highest=101.0,
            )
        )
    names = [f"wrong{round(100 * share)}" for share in WRONG_SHARES]
    if f"combined_{names[0]}" in found:
        panels.append(
            Panel(
                "Wrong feedback",
                [f"{round(100 * share)}" for share in WRONG_SHARES],
                [
                    Series("combined", *_curve(found, [f"combined_{one}" for one in names])),
                    Series("MSR alone", *_curve(found, [f"msr_{one}" for one in names])),
                ],
                y_label="accuracy, %",
                x_label="wrong words, % of 28",
                lines=True,
                highest=101.0,
            )
        )
    return panels


def _curve(found: dict[str, Summary], names: Sequence[str]) -> tuple[list[float], list[float]]:
    return [found[name].mean for name in names], [found[name].margin for name in names]


def _rounded(*values: float) -> list[float]:
    return [round(value, 1) for value in values]
