"""Draws what prepositions mean to the metric grounding, as in the paper's figure of histograms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ros_scenesense.errors import ParameterError
from ros_scenesense.grounding.histograms import DISTANCE_EDGES_M, PHI_BINS, THETA_BINS
from ros_scenesense.grounding.msr import MetricModel
from ros_scenesense.scene import Distance, Position

_COLUMNS = 4
_SIZE_INCHES = (15.0, 9.5)


def draw_groundings(model: MetricModel) -> Any:
    """One panel for each preposition, as a matplotlib figure.

    Positions: where the points of an object are as seen from the reference, over the directions
    about up (left, front, right, behind) and from up to down; the title says how much lies inside
    the reference. Distances: how near the nearest points are. Both as shares.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=_SIZE_INCHES, layout="constrained")
    panels = figure.subplots(3, _COLUMNS).ravel().tolist()
    for position, panel in zip(Position, panels, strict=False):
        _draw_position(panel, model, position)
    panels[len(Position)].set_axis_off()
    for distance, panel in zip(Distance, panels[len(Position) + 1 :], strict=False):
        _draw_distance(panel, model, distance)
    for panel in panels[len(Position) + 1 + len(Distance) :]:
        panel.set_axis_off()
    return figure


def write_groundings(model: MetricModel, path: Path) -> None:
    """Draws into a PNG file.

    Raises:
        ParameterError: If the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draw_groundings(model).savefig(path, format="png", dpi=100)
    except OSError as error:
        raise ParameterError(f"picture '{path}' cannot be written: {error}") from error


def _draw_position(panel: Any, model: MetricModel, position: Position) -> None:
    histogram = model.position_histogram(position)
    if histogram is None:
        _draw_nothing(panel, position)
        return
    angles = histogram[:-1].reshape(THETA_BINS, PHI_BINS)
    panel.imshow(angles, extent=(-180.0, 180.0, 180.0, 0.0), aspect="auto", cmap="viridis", vmin=0)
    panel.set_xticks([-180, -90, 0, 90, 180], ["left", "front", "right", "behind", "left"])
    panel.set_yticks([0, 90, 180], ["up", "level", "down"])
    panel.set_title(f"{position}, {histogram[-1]:.0%} inside\n{_examples(model, position)}")


def _draw_distance(panel: Any, model: MetricModel, distance: Distance) -> None:
    histogram = model.distance_histogram(distance)
    if histogram is None:
        _draw_nothing(panel, distance)
        return
    bins = np.arange(len(histogram))
    panel.bar(bins + 0.5, histogram, width=1.0)
    shown = [index for index in bins if _is_round(DISTANCE_EDGES_M[index])]
    panel.set_xticks(shown, [f"{100 * DISTANCE_EDGES_M[index]:g}" for index in shown])
    panel.set_xlabel("closest distances in cm")
    panel.set_title(f"{distance}\n{_examples(model, distance)}")


def _draw_nothing(panel: Any, relation: Position | Distance) -> None:
    panel.set_title(f"{relation}\nno examples")
    panel.set_xticks([])
    panel.set_yticks([])


def _examples(model: MetricModel, relation: Position | Distance) -> str:
    qsr, own, human = examples_of(model, relation)
    return f"examples: {qsr} QSR, {own} own, {human} human"


def examples_of(model: MetricModel, relation: Position | Distance) -> Sequence[int]:
    """How many examples were merged: named by the QSR, by the model itself, by people."""
    counts: list[int] = model.counts[[*Position, *Distance].index(relation)].tolist()
    return counts


def _is_round(edge_m: float) -> bool:
    return any(abs(edge_m - round_m) < 1e-9 for round_m in (0.0, 0.01, 0.05, 0.2, 0.5, 1.0, 2.0))
