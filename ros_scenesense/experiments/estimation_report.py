"""Figures, tables and plot of the experiments on estimation."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ros_scenesense.experiments.comparison import Comparison, Summary
from ros_scenesense.experiments.estimation_notes import notes_of
from ros_scenesense.experiments.estimation_scores import SUBJECTS
from ros_scenesense.experiments.estimation_trials import Tried
from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table

PAPER = {"lenet_1000": 0.77, "images_ratio_lenet": 0.6}
"""What the paper's text says: LeNet with 1000 images, and LeNet(Att) as good with 600."""
WORDS = {
    "lenet": "LeNet, whole image",
    "lenet_att": "reasoning, then LeNet on regions",
    "alexnet": "AlexNet (reduced), whole image",
    "alexnet_att": "reasoning, then AlexNet (reduced) on regions",
    "same_channels": "our network and inputs on whole images, no reasoning",
    "query": "reasoning, then our network on regions (the architecture)",
    "query_overrule": "as query, but the network may overrule defaults",
    "query_pixels": "as query, without the geometric input",
    "query_geometry": "as query, without pixels",
    "query_segmented": "as query, with our own segmentation instead of the simulator's instances",
    "reasoning": "reasoning alone, undecided counts as wrong",
    "reasoning_majority": "reasoning, then the most frequent answer",
    "majority": "the most frequent answer",
}
_UNTRAINED = ("reasoning", "reasoning_majority", "majority")
_CLAIMS = (
    ("lenet_att", "lenet", "reasoning and attention help LeNet"),
    ("alexnet_att", "alexnet", "reasoning and attention help AlexNet"),
    ("query", "lenet", "the architecture beats LeNet on whole images"),
    ("query", "same_channels", "the architecture beats its own network on whole images"),
    ("same_channels", "lenet", "our network and inputs alone beat LeNet on whole images"),
    ("query", "query_pixels", "the geometric input helps"),
    ("query", "query_geometry", "pixels help"),
    ("query", "query_segmented", "the simulator's instances are better than our segmentation"),
    ("query_overrule", "query", "overruling defaults helps"),
)
_TRIED = (100, 1000)
"""Training sizes that the claims are about."""

Key = tuple[str, str, int]
"""Way, knowledge, images."""


@dataclass(frozen=True)
class Setting:
    """Of a run.

    Attributes:
        experiment: `estimation` or `samples`.
        command: The command line.
        seed: Of everything that was drawn.
        scenes: How many there were.
        tests: How many of them were tested on.
        repeats: Trainings of each.
        schedule: How long was trained.
    """

    experiment: str
    command: str
    seed: int
    scenes: int
    tests: int
    repeats: int
    schedule: str


def report_on(tried: Sequence[Tried], setting: Setting) -> Outcome:
    """Summarises the trials."""
    scores = _by_key(tried)
    figures = _figures(scores, setting)
    claims = _claims(scores)
    tables = {
        "Ways": Table(columns=["way", "is"], rows=_present(scores)),
        "Incomplete knowledge": _table(scores, "incomplete"),
        "Complete knowledge": _table(scores, "complete"),
        "Images to be as good as LeNet and AlexNet on whole images": _needed(scores),
        "Trainings": _trainings(tried),
        "Compared on the same images and seeds": _compared(claims),
    }
    result = Result(
        name=setting.experiment,
        command=setting.command,
        seed=setting.seed,
        versions=versions(),
        machine=machine(),
        figures={name: round(value, 4) for name, value in figures.items()},
        paper=PAPER,
        notes=notes_of(figures, dict(claims), setting),
        tables={title: table for title, table in tables.items() if table.rows},
    )
    return Outcome(result, _panels(scores))


def _present(scores: Iterable[Key]) -> list[list[str | int | float | None]]:
    """The ways that were tried, in words."""
    tried = {way for way, _, _ in scores}
    return [[way, words] for way, words in WORDS.items() if way in tried]


def _by_key(tried: Iterable[Tried]) -> dict[Key, dict[str, list[float]]]:
    """The scores of all repetitions, in their order."""
    found: dict[Key, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for one in tried:
        for way, scores in one.scores.items():
            images = 0 if way in _UNTRAINED else one.trial.images
            for name, value in scores.items():
                found[way, one.trial.knowledge, images][name].append(value)
    return {key: dict(scores) for key, scores in found.items()}


def _figures(scores: Mapping[Key, Mapping[str, list[float]]], setting: Setting) -> dict[str, float]:
    """Means by stable names; those with complete knowledge end in `_complete`."""
    figures: dict[str, float] = {"scenes": setting.scenes, "tests": setting.tests}
    for (way, knowledge, images), each in scores.items():
        end = "" if knowledge == "incomplete" else "_complete"
        size = f"_{images}" if images else ""
        for name, values in each.items():
            figure = f"{way}{size}{end}" if name == "accuracy" else f"{way}_{name}{size}{end}"
            figures[figure] = float(np.mean(values))
        if way == "query":
            figures[f"architecture{size}{end}"] = float(np.mean(each["accuracy"]))
            for subject, name in (
                ("occlusion", "occlusion"),
                ("stability", "stability"),
                ("structure", "stability_structures"),
                ("stack", "stability_stacks"),
            ):
                if subject in each:
                    figures[f"{name}{size}{end}"] = float(np.mean(each[subject]))
        if way == "lenet":
            figures[f"baseline{size}{end}"] = float(np.mean(each["accuracy"]))
        if way == "same_channels":
            figures[f"baseline_same_channels{size}{end}"] = float(np.mean(each["accuracy"]))
        if way == "reasoning":
            figures[f"reasoning_alone{end}"] = float(np.mean(each["accuracy"]))
    figures |= {each.figure: each.few / each.many for each in _ratios(scores)}
    return figures


_RATIOS = (
    ("lenet", "lenet_att", "lenet"),
    ("alexnet", "alexnet_att", "alexnet"),
    ("query", "query", "lenet"),
)
_MEASURES = (("accuracy", ""), ("balanced", "_balanced"))
"""Where a class is rare, who never says it is accurate; balanced accuracy sees through that."""


def images_needed(
    scores: Mapping[Key, Mapping[str, list[float]]],
    way: str,
    baseline: str,
    measure: str = "accuracy",
) -> tuple[float, int] | None:
    """How many images a way needs to be as good as a baseline with the most images up to 1000.

    Between two sizes along the logarithm of images; the smallest size where already that is enough.

    Args:
        scores: Of all repetitions.
        way: Whose images are counted.
        baseline: What it has to be as good as.
        measure: By which score.

    Returns:
        Images of the way, and of the baseline; None where they were not tried, or never suffice.
    """
    curve = _curve(scores, way, measure)
    known = _curve(scores, baseline, measure)
    reached = [(images, mean) for images, mean in known if images <= 1000]
    if not curve or not reached:
        return None
    many, goal = reached[-1]
    if curve[0][0] >= many:
        return None  # fewer were not tried
    if curve[0][1] >= goal:
        return float(curve[0][0]), many
    for (few, low), (more, high) in pairwise(curve):
        if high >= goal:
            share = (goal - low) / (high - low)
            return math.exp(math.log(few) + share * math.log(more / few)), many
    return None


def _curve(
    scores: Mapping[Key, Mapping[str, list[float]]], way: str, name: str
) -> list[tuple[int, float]]:
    return sorted(
        (images, float(np.mean(each[name])))
        for (other, knowledge, images), each in scores.items()
        if other == way and knowledge == "incomplete" and name in each
    )


def _claims(scores: Mapping[Key, Mapping[str, list[float]]]) -> list[tuple[str, Comparison]]:
    found = []
    for first, second, words in _CLAIMS:
        for knowledge in ("incomplete", "complete"):
            for images in _TRIED:
                one = scores.get((first, knowledge, images))
                # No knowledge takes part in what a baseline says.
                other = scores.get((second, knowledge, images)) or scores.get(
                    (second, "incomplete", images) if second in _WHOLE else (second, "", 0)
                )
                if one is None or other is None or len(one["accuracy"]) < 2:
                    continue
                about = f"{words} ({images} images, {knowledge} knowledge)"
                found.append((about, Comparison.of(one["accuracy"], other["accuracy"])))
    return found


_WHOLE = ("lenet", "alexnet", "same_channels")


def _table(scores: Mapping[Key, Mapping[str, list[float]]], knowledge: str) -> Table:
    rows: list[list[str | int | float | None]] = []
    for way in WORDS:
        for (other, about, images), each in sorted(scores.items()):
            if other != way or about != knowledge:
                continue
            summary = Summary.of(each["accuracy"])
            cells = [
                _percent(float(np.mean(each[name]))) if name in each else None for name in _NAMES
            ]
            row: list[str | int | float | None] = [way, images or None]
            margin = _percent(summary.margin) if len(each["accuracy"]) > 1 else None
            rows.append([*row, _percent(summary.mean), margin, *cells])
    columns = ["way", "images", "accuracy %", "95 % ±", "balanced %"]
    return Table(
        columns=[*columns, *(f"{each} %{kind}" for each in _TITLES for kind in ("", " balanced"))],
        rows=rows,
    )


_NAMES = ("balanced", *(f"{each}{kind}" for each in SUBJECTS for kind in ("", "_balanced")))
_TITLES = ("occlusion", "stability of objects", "of structures", "of stacks")


def _percent(share: float) -> float:
    return round(100.0 * share, 1)


@dataclass(frozen=True)
class _Ratio:
    """Images that a way needs, `few`, to be as good as a baseline with `many`, by a measure."""

    figure: str
    way: str
    baseline: str
    measure: str
    few: float
    many: int


def _ratios(scores: Mapping[Key, Mapping[str, list[float]]]) -> list[_Ratio]:
    found = []
    for measure, end in _MEASURES:
        for network, way, baseline in _RATIOS:
            needed = images_needed(scores, way, baseline, measure)
            if needed is not None:
                figure = f"images_ratio_{network}{end}"
                found.append(_Ratio(figure, way, baseline, measure, *needed))
    return found


def _needed(scores: Mapping[Key, Mapping[str, list[float]]]) -> Table:
    rows: list[list[str | int | float | None]] = []
    for each in _ratios(scores):
        smallest = _curve(scores, each.way, each.measure)[0][0]
        enough = "at most" if each.few == smallest else "about"
        ratio = round(each.few / each.many, 4)
        names = (each.measure, each.way, each.baseline)
        rows.append([*names, each.many, enough, round(each.few), ratio, each.figure])
    columns = ["by", "way", "as good as", "with images", "", "needs", "ratio", "figure"]
    return Table(columns=columns, rows=rows)


def _trainings(tried: Iterable[Tried]) -> Table:
    groups: dict[Key, list[Tried]] = defaultdict(list)
    for one in tried:
        if one.examples:
            groups[one.trial.way, one.trial.knowledge, one.trial.images].append(one)
    rows: list[list[str | int | float | None]] = []
    for (way, knowledge, images), several in groups.items():
        means = [
            float(np.mean([getattr(each, name) for each in several]))
            for name in ("examples", "iterations", "seconds")
        ]
        rows.append([way, knowledge, images, round(means[0]), round(means[1]), round(means[2], 1)])
    columns = ["network", "knowledge", "images", "examples", "best after batches", "CPU s"]
    return Table(columns=columns, rows=sorted(rows, key=str))


def _compared(claims: Iterable[tuple[str, Comparison]]) -> Table:
    return Table(
        columns=["claim", "difference, points", "p (paired t-test)", "at 95 %"],
        rows=[
            [words, round(100.0 * one.difference, 1), round(one.probability, 4), one.verdict]
            for words, one in claims
        ],
    )


def _panels(scores: Mapping[Key, Mapping[str, list[float]]]) -> list[Panel]:
    sizes = sorted({images for _, _, images in scores if images})
    return [
        Panel(
            title=title,
            labels=[str(size) for size in sizes],
            series=[
                _series(scores, way, name, sizes)
                for way in (
                    "lenet",
                    "lenet_att",
                    "alexnet",
                    "alexnet_att",
                    "same_channels",
                    "query",
                )
                if any((way, "incomplete", size) in scores for size in sizes)
            ],
            y_label="accuracy, %",
            x_label="training images",
            lines=len(sizes) > 1,
        )
        for title, name in (
            ("occlusion and stability", "accuracy"),
            ("occlusion", "occlusion"),
            ("stability of stacks", "stack"),
        )
    ]


def _series(
    scores: Mapping[Key, Mapping[str, list[float]]], way: str, name: str, sizes: Sequence[int]
) -> Series:
    found = [scores.get((way, "incomplete", size), {}).get(name) for size in sizes]
    summaries = [None if values is None else Summary.of(values) for values in found]
    return Series(
        way,
        [None if one is None else 100.0 * one.mean for one in summaries],
        [None if one is None else 100.0 * one.margin for one in summaries],
    )
