"""Scores of decisions: which share of the labels is right, for each kind of subject."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping

from ros_scenesense.errors import DatasetError
from ros_scenesense.experiments.estimation_views import Literal, View

Members = tuple[str, ...]
Decisions = dict[Literal | Members, bool | None]
"""Decisions about literals and structures of a scene; None = none."""
Scores = dict[str, float]
"""Shares by name. For each of `SUBJECTS` that was decided about: the accuracy, with `_balanced` the
mean over both classes. `accuracy` and `balanced` count the occlusion of objects and the stability
of structures, the labels that every way gives. No decision is a wrong one."""

SUBJECTS = ("occlusion", "stability", "structure", "stack")
"""Occlusion of objects, stability of objects, of structures, and of those of several objects."""
_COMMON = ("occlusion", "structure")


def score(scenes: Iterable[tuple[View, Mapping[Literal | Members, bool | None]]]) -> Scores:
    """Holds decisions against labels; ambiguous ones do not count.

    Raises:
        DatasetError: If there are no labels.
    """
    counts: Counter[tuple[str, bool, bool]] = Counter()
    decided = 0
    for view, decisions in scenes:
        for subject, key, label in labels_of(view):
            if key not in decisions and subject == "stability":
                continue  # this way says nothing about single objects
            value = decisions.get(key)
            counts[subject, label, value is label] += 1
            decided += subject in _COMMON and value is not None
    scores: Scores = {}
    for subject in SUBJECTS:
        if sum(_of(counts, subject)) > 0:
            scores[subject], scores[f"{subject}_balanced"] = _shares(counts, (subject,))
    if not any(sum(_of(counts, each)) for each in _COMMON):
        raise DatasetError("the scenes to test on have no label: take more, or another dataset")
    scores["accuracy"], scores["balanced"] = _shares(counts, _COMMON)
    scores["decided"] = decided / sum(sum(_of(counts, each)) for each in _COMMON)
    return scores


def labels_of(view: View) -> Iterator[tuple[str, Literal | Members, bool]]:
    """Every label of a scene that is not ambiguous: of what, of whom, and the truth."""
    for literal, label in view.labels.items():
        if label is not None:
            yield str(literal[1]), literal, label
    for members, label in view.structures:
        if label is not None:
            yield "structure", members, label
            if len(members) > 1:
                yield "stack", members, label


def majority_of(views: Iterable[View]) -> dict[str, bool]:
    """The more frequent answer for each kind of subject."""
    counts = Counter((subject, label) for view in views for subject, _, label in labels_of(view))
    return {each: counts[each, True] >= counts[each, False] for each in SUBJECTS}


def _of(counts: Counter[tuple[str, bool, bool]], subject: str) -> list[int]:
    return [counts[subject, label, right] for label in (True, False) for right in (True, False)]


def _shares(
    counts: Counter[tuple[str, bool, bool]], subjects: Iterable[str]
) -> tuple[float, float]:
    """Share of right decisions, and the mean of this share over the classes that occur."""
    right: Counter[bool] = Counter()
    total: Counter[bool] = Counter()
    classes = []
    for subject in subjects:
        for label in (True, False):
            hits = counts[subject, label, True]
            number = hits + counts[subject, label, False]
            right[label] += hits
            total[label] += number
            if number:
                classes.append(hits / number)
    return sum(right.values()) / sum(total.values()), sum(classes) / len(classes)
