"""Draws a decision tree, with the branches that became axioms marked (the paper's figures)."""

from __future__ import annotations

import io
from collections.abc import Collection
from typing import Any

from ros_scenesense.learning.bodies import Body
from ros_scenesense.learning.columns import Table
from ros_scenesense.learning.trees import Node, Test, branches

_MARKED, _PLAIN = "tab:blue", "0.6"


def draw_tree(node: Node, table: Table, fluent: str, marked: Collection[Body] = ()) -> bytes:
    """A tree as PNG.

    Args:
        node: Its root.
        table: Its columns.
        fluent: What the labels are about.
        marked: Bodies of axioms; branches that hold all tests of one of them are marked.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    paths = [frozenset(path) for path, _ in branches(node)]
    chosen = [path for path in paths if any(body <= path for body in marked)]
    depth = max((len(path) for path in paths), default=0)
    figure = Figure(figsize=(max(4.0, 1.9 * len(paths)), 1.2 * (depth + 1)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set_axis_off()
    _draw(axes, node, table, fluent, frozenset(), chosen, [0])
    content = io.BytesIO()
    # No version: the same tree gives the same bytes.
    figure.savefig(content, format="png", dpi=100, metadata={"Software": None})
    return content.getvalue()


def _draw(
    axes: Any,
    node: Node,
    table: Table,
    fluent: str,
    path: frozenset[Test],
    chosen: Collection[Body],
    leaves: list[int],
) -> tuple[float, float]:
    """Draws what is below a node and then the node; returns its place."""
    y = -float(len(path))
    color = _MARKED if any(path <= each for each in chosen) else _PLAIN
    tally = f"{node.positive} : {node.count - node.positive}"
    if node.column is None or node.yes is None or node.no is None:
        x = float(leaves[0])
        leaves[0] += 1
        _write(axes, (x, y), f"{fluent if node.label else f'not {fluent}'}\n{tally}", color)
        return x, y
    places = []
    for child, answer in ((node.yes, True), (node.no, False)):
        longer = path | {(node.column, answer)}
        place = _draw(axes, child, table, fluent, longer, chosen, leaves)
        places.append((place, answer, _MARKED if any(longer <= c for c in chosen) else _PLAIN))
    x = sum(place[0] for place, _, _ in places) / 2.0
    for place, answer, edge in places:
        axes.plot([x, place[0]], [y, place[1]], color=edge, zorder=1, linewidth=2.0)
        middle = ((x + place[0]) / 2.0, (y + place[1]) / 2.0)
        axes.annotate("yes" if answer else "no", middle, ha="center", fontsize=8)
    _write(axes, (x, y), f"{table.columns[node.column]}?\n{tally}".replace("), ", "),\n"), color)
    return x, y


def _write(axes: Any, place: tuple[float, float], text: str, color: str) -> None:
    box = {"boxstyle": "round", "facecolor": "white", "edgecolor": color}
    axes.annotate(text, place, ha="center", va="center", fontsize=8, bbox=box)
