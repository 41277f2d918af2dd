"""Plots of results as PNG: panels of bars or lines with error bars, side by side; or of rows."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.results import write_atomically


@dataclass(frozen=True)
class Series:
    """Values of one colour, in the order of the panel's labels.

    Attributes:
        name: For the legend.
        values: None where there is none.
        errors: Half lengths of the error bars; empty = none are drawn.
    """

    name: str
    values: Sequence[float | None]
    errors: Sequence[float | None] = ()


@dataclass(frozen=True)
class Panel:
    """One diagram.

    Attributes:
        title: Above it.
        labels: Along the x axis.
        series: What is drawn.
        y_label: What the y axis shows, with the unit.
        x_label: What the x axis shows.
        lines: Lines with markers instead of bars.
        rows: Each series in a row of its own, as an area of values from 0 to 1 under its name.
        lowest: Where the y axis begins; None leaves it to the values.
        highest: Where it ends.
    """

    title: str
    labels: Sequence[str]
    series: Sequence[Series]
    y_label: str = ""
    x_label: str = ""
    lines: bool = False
    rows: bool = False
    lowest: float | None = None
    highest: float | None = None


def write_plot(path: Path, panels: Sequence[Panel]) -> None:
    """Draws panels into a PNG file.

    Raises:
        SceneSenseError: If the file cannot be written.
    """
    content = io.BytesIO()
    # No date and no version: the same panels give the same bytes.
    figure_of(panels).savefig(content, format="png", dpi=100, metadata={"Software": None})
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content.getvalue())
    except OSError as error:
        raise SceneSenseError(f"plot '{path}' cannot be written: {error}") from error


def figure_of(panels: Sequence[Panel]) -> Any:
    """The figure of the panels: side by side, or below each other if they have rows."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if any(panel.rows for panel in panels):
        heights = [1.2 + 0.4 * len(panel.series) for panel in panels]
        figure = Figure(figsize=(12.0, sum(heights)), layout="constrained")
        places = figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights)[:, 0]
    else:
        height = 4.5 + _LEGEND_ROW * max(_legend_rows(panel) for panel in panels)
        figure = Figure(figsize=(_WIDTH * len(panels), height), layout="constrained")
        places = figure.subplots(1, len(panels), squeeze=False)[0]
    FigureCanvasAgg(figure)
    for axes, panel in zip(places, panels, strict=True):
        (_draw_rows if panel.rows else _draw)(axes, panel)
    return figure


def _draw(axes: Any, panel: Panel) -> None:
    count = len(panel.series)
    width = 0.8 / max(1, count)
    for number, series in enumerate(panel.series):
        shift = 0.0 if panel.lines else (number - (count - 1) / 2.0) * width
        places = [index + shift for index, one in enumerate(series.values) if one is not None]
        values = [one for one in series.values if one is not None]
        errors = None
        if series.errors:
            pairs = zip(series.values, series.errors, strict=True)
            errors = [error or 0.0 for value, error in pairs if value is not None]
        if panel.lines:
            axes.errorbar(places, values, errors, label=series.name, marker="o", capsize=3)
        else:
            axes.bar(places, values, width, yerr=errors, label=series.name, capsize=3)
    axes.set_title(panel.title)
    axes.set_xticks(range(len(panel.labels)), panel.labels)
    if any(len(label) > 6 for label in panel.labels):
        axes.tick_params(axis="x", labelrotation=25)
    axes.set_xlabel(panel.x_label)
    axes.set_ylabel(panel.y_label)
    axes.set_ylim(panel.lowest, panel.highest)
    axes.grid(axis="y", alpha=0.4)
    axes.set_axisbelow(True)
    if count > 1:
        _put_legend_below(axes, _legend_columns(panel))


def _put_legend_below(axes: Any, columns: int) -> None:
    """The legend below the diagram and the words of its x axis, where it covers nothing."""
    labels = axes.xaxis.get_tightbbox()
    below = axes.get_window_extent().y0 - labels.y0  # pixels
    legend = axes.legend(fontsize="small", loc="upper center", ncols=columns)
    pixels_of_font = legend.get_texts()[0].get_fontsize() * axes.figure.dpi / 72.0
    legend.borderaxespad = below / pixels_of_font + 0.5
    legend.set_bbox_to_anchor((0.5, 0.0), axes.transAxes)


def _legend_columns(panel: Panel) -> int:
    longest = max(len(series.name) for series in panel.series)
    return max(1, min(len(panel.series), int(_WIDTH / (0.5 + 0.07 * longest))))


def _legend_rows(panel: Panel) -> int:
    return 0 if len(panel.series) < 2 else math.ceil(len(panel.series) / _legend_columns(panel))


def _draw_rows(axes: Any, panel: Panel) -> None:
    count = len(panel.series)
    for number, series in enumerate(panel.series):
        base = float(count - 1 - number)
        known = [index for index, one in enumerate(series.values) if one is not None]
        tops = [base + _ROW * (series.values[index] or 0.0) for index in known]
        colour = f"C{number % 10}"
        axes.fill_between(known, base, tops, color=colour, alpha=0.25, linewidth=0)
        axes.plot(known, tops, marker="o", markersize=4, color=colour)
    axes.set_yticks(
        [count - 1 - number + _ROW / 2 for number in range(count)],
        [series.name for series in panel.series],
        fontsize="small",
    )
    axes.tick_params(axis="y", length=0)
    axes.set_xticks(range(len(panel.labels)), panel.labels)
    axes.set_xlim(-0.4, len(panel.labels) - 0.6)
    axes.set_ylim(-0.1, count)
    axes.set_title(panel.title)
    axes.set_xlabel(panel.x_label)
    for number in range(count):
        axes.axhline(number, color="0.8", linewidth=0.6, zorder=0)


_WIDTH = 6.0
"""Inches of a diagram."""
_LEGEND_ROW = 0.2
"""Inches."""
_ROW = 0.75
"""Height of a value of 1, where rows are 1 apart."""
