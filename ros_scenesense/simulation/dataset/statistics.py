"""What is in a dataset: counts, the balance of labels, and how true the axioms are in physics.

An axiom is true of an object if the label is what its head says; objects with an ambiguous label
are left out and counted. Defaults are judged on what the normal axioms leave open.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from ros_scenesense.scene import Distance, Position, Task, Truth
from ros_scenesense.simulation.dataset.record import SceneRecord
from ros_scenesense.simulation.dataset.regions import possible_groups, region_label
from ros_scenesense.simulation.dataset.situations import Situation, situations

Cell = str | int | float | None
TableOf = tuple[list[str], list[list[Cell]]]


@dataclass(frozen=True)
class Statistics:
    """Figures by stable name; tables (columns, rows) by title."""

    figures: dict[str, float]
    tables: dict[str, TableOf]


@dataclass(frozen=True)
class Axiom:
    """An axiom as a question to the labels.

    Attributes:
        figure: Name of the share of objects of which it is true.
        words: What it says.
        kind: `normal` or `default`.
        applies: Whether its body holds of an object, and normal axioms leave it open.
        label: Which label its head speaks of.
        head: What the head says.
    """

    figure: str
    words: str
    kind: str
    applies: Callable[[Situation], bool]
    label: Callable[[Situation], Truth]
    head: Truth


def _stable(one: Situation) -> Truth:
    return one.label.stable


def _occluded(one: Situation) -> Truth:
    return one.label.occluded


def _open(one: Situation) -> bool:
    """Whether the normal axioms of stability leave it open."""
    return one.above and not one.irregular_below


AXIOMS = (
    Axiom(
        "p_stable_not_above",
        "S1 stable(A) if not above(A, B)",
        "normal",
        lambda one: not one.above,
        _stable,
        Truth.TRUE,
    ),
    Axiom(
        "p_unstable_irregular_below",
        "S2 -stable(A) if irregular_below(A)",
        "normal",
        lambda one: one.irregular_below,
        _stable,
        Truth.FALSE,
    ),
    Axiom(
        "p_unstable_small_base",
        "S3 -stable(A) if small_base(A)",
        "default",
        lambda one: one.small_base and _open(one),
        _stable,
        Truth.FALSE,
    ),
    Axiom(
        "p_not_occluded_not_behind",
        "O1 -occluded(A) if not behind(A, B)",
        "normal",
        lambda one: not one.behind,
        _occluded,
        Truth.FALSE,
    ),
    Axiom(
        "p_not_occluded_behind_above",
        "O2 -occluded(A) if behind(A, B), above(A, C)",
        "default",
        lambda one: one.behind and one.above,
        _occluded,
        Truth.FALSE,
    ),
    Axiom(
        "p_occluded_behind_not_above",
        "O3 occluded(A) if behind(A, B), not above(A, C)",
        "default",
        lambda one: one.behind and not one.above,
        _occluded,
        Truth.TRUE,
    ),
    Axiom(
        "p_unstable_large_on_small",
        "given: -stable(A) if large on small",
        "default",
        lambda one: one.large_on_small and _open(one),
        _stable,
        Truth.FALSE,
    ),
    Axiom(
        "p_unstable_tower_above_4",
        "given: -stable(A) if tower height above four",
        "default",
        lambda one: one.tower_height > 4 and _open(one),
        _stable,
        Truth.FALSE,
    ),
)
"""The six axioms that are withheld, and the two defaults that are given."""


def statistics(records: Iterable[SceneRecord]) -> Statistics:
    """Counts everything in one pass.

    Raises:
        DatasetError: If a record cannot be read, where the records come from a reader.
    """
    scenes: Counter[str] = Counter()
    labels: Counter[tuple[str, str, Truth]] = Counter()
    stacks: Counter[tuple[str, int, Truth]] = Counter()
    truths: Counter[tuple[str, Truth]] = Counter()
    pairs: Counter[tuple[Position | Distance, bool]] = Counter()
    regions: Counter[tuple[Task, str, Truth]] = Counter()
    objects = 0
    for record in records:
        scenes[record.arrangement] += 1
        objects += len(record.objects)
        for structure in record.structure_labels:
            stacks[record.arrangement, len(structure.members), structure.stable] += 1
        for said in record.relations:
            pairs[said.position, said.position_ambiguous] += 1
            pairs[said.distance, said.distance_ambiguous] += 1
        regions.update(_region_counts(record))
        for one in situations(record):
            labels[record.arrangement, "stable", one.label.stable] += 1
            labels[record.arrangement, "occluded", one.label.occluded] += 1
            for axiom in AXIOMS:
                if axiom.applies(one):
                    truths[axiom.figure, axiom.label(one)] += 1
    figures: dict[str, float] = {"scenes": scenes.total(), "objects": objects}
    figures |= {f"scenes_{name}": count for name, count in sorted(scenes.items())}
    figures |= dict(_label_figures(labels))
    figures |= dict(_stack_figures(stacks))
    figures |= {f"pairs_{said}": pairs[said, False] for said in (*Position, *Distance)}
    figures |= {
        f"regions_{task}": sum(regions[task, "structure", truth] for truth in Truth)
        for task in Task
    }
    figures |= dict(_axiom_figures(truths))
    tables = {
        "Labels of objects": _label_table(labels),
        "Structures": _stack_table(stacks),
        "Relations of pairs": _pair_table(pairs),
        "Regions of interest": _region_table(regions),
        "Axioms in physics": _axiom_table(truths),
    }
    return Statistics({name: round(value, 4) for name, value in figures.items()}, tables)


def _region_counts(record: SceneRecord) -> Iterator[tuple[Task, str, Truth]]:
    """The labels of the regions that the tasks ask about: of the structure, and of each object."""
    own = {label.name: label for label in record.object_labels}
    for task, group in possible_groups(record):
        labels = [own[name] for name in group]
        yield task, "structure", region_label(labels)
        for label in labels:
            yield task, "occluded", label.occluded


def _label_figures(labels: Counter[tuple[str, str, Truth]]) -> Iterator[tuple[str, float]]:
    for label in ("stable", "occluded"):
        counts = [
            sum(count for key, count in labels.items() if key[1:] == (label, truth))
            for truth in Truth
        ]
        for truth, count in zip(Truth, counts, strict=True):
            if sum(counts):
                yield f"share_{label}_{truth}", count / sum(counts)


def _stack_figures(stacks: Counter[tuple[str, int, Truth]]) -> Iterator[tuple[str, float]]:
    for arrangement, members in sorted({key[:2] for key in stacks if key[1] > 1}):
        share = _share(
            *(stacks[arrangement, members, truth] for truth in (Truth.FALSE, Truth.TRUE))
        )
        if share is not None:
            yield f"share_unstable_{arrangement}_{members}", share


def _axiom_figures(truths: Counter[tuple[str, Truth]]) -> Iterator[tuple[str, float]]:
    for axiom in AXIOMS:
        share = _share(
            truths[axiom.figure, axiom.head], truths[axiom.figure, _opposite(axiom.head)]
        )
        if share is not None:
            yield axiom.figure, share


def _label_table(labels: Counter[tuple[str, str, Truth]]) -> TableOf:
    rows: list[list[Cell]] = [
        [arrangement, label, *(labels[arrangement, label, truth] for truth in Truth)]
        for arrangement, label in sorted({key[:2] for key in labels})
    ]
    return ["arrangement", "label", *Truth], rows


def _stack_table(stacks: Counter[tuple[str, int, Truth]]) -> TableOf:
    rows: list[list[Cell]] = []
    for arrangement, members in sorted({key[:2] for key in stacks}):
        counts = {truth: stacks[arrangement, members, truth] for truth in Truth}
        share = _share(counts[Truth.FALSE], counts[Truth.TRUE])
        rows.append([arrangement, members, *counts.values(), share])
    columns = ["arrangement", "objects", *(f"stable: {truth}" for truth in Truth)]
    return [*columns, "share unstable"], rows


def _pair_table(pairs: Counter[tuple[Position | Distance, bool]]) -> TableOf:
    rows: list[list[Cell]] = [
        [str(said), pairs[said, False], pairs[said, True]] for said in (*Position, *Distance)
    ]
    return ["preposition", "clear", "ambiguous"], rows


def _region_table(regions: Counter[tuple[Task, str, Truth]]) -> TableOf:
    rows: list[list[Cell]] = []
    for task in Task:
        for label, words in (("structure", "structure stable"), ("occluded", "object occluded")):
            counts = [regions[task, label, truth] for truth in Truth]
            rows.append([f"{task}: {_REGIONS[task]}", words, *counts])
    return ["regions", "label", *Truth], rows


_REGIONS = {Task.STABILITY: "stacks", Task.OCCLUSION: "objects with all that they are behind"}


def _axiom_table(truths: Counter[tuple[str, Truth]]) -> TableOf:
    rows: list[list[Cell]] = []
    for axiom in AXIOMS:
        right = truths[axiom.figure, axiom.head]
        wrong = truths[axiom.figure, _opposite(axiom.head)]
        ambiguous = truths[axiom.figure, Truth.AMBIGUOUS]
        share = _share(right, wrong)
        rows.append([axiom.words, axiom.kind, right + wrong, ambiguous, share, axiom.figure])
    return ["axiom", "kind", "objects", "ambiguous", "share true", "figure"], rows


def _share(one: int, other: int) -> float | None:
    return round(one / (one + other), 4) if one + other else None


def _opposite(truth: Truth) -> Truth:
    return Truth.FALSE if truth is Truth.TRUE else Truth.TRUE
