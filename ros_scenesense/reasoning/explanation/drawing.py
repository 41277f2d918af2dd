"""Explanations as a drawing: a tree from top to bottom, as SVG that any browser shows."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from html import escape

from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.text import remark

_STEP, _GAP, _PAD, _MARGIN = 34, 12, 9, 16
_LINE = 17
_WIDEST = 62  # letters of a line in a box
_LETTER = 7.3  # width of a letter of the literal, which is the widest
_SMALL = 6.3

# Fill and edge by what a reason says: green holds, red does not, grey is only mentioned.
_COLOURS = {
    Role.CONCLUDED: ("#e3f1e4", "#3c7d42"),
    Role.KNOWN: ("#e4edf8", "#3a649c"),
    Role.ASSUMED: ("#fbf0d9", "#a97a1d"),
    Role.ABSENT: ("#f3f3f3", "#7a7a7a"),
    Role.CONDITION: ("#f3f3f3", "#7a7a7a"),
    Role.HOLDS: ("#e3f1e4", "#3c7d42"),
    Role.MISSING: ("#fae3e1", "#a83a32"),
    Role.ATTEMPT: ("#ffffff", "#a83a32"),
    Role.BLOCKED: ("#fae3e1", "#a83a32"),
    Role.UNTRUE: ("#fae3e1", "#a83a32"),
}


@dataclass(frozen=True)
class _Box:
    """A drawn reason: its place, its lines, and the box of the reason that it is for."""

    reason: Reason
    x: float
    y: float
    title: str
    lines: tuple[str, ...]
    parent: _Box | None

    @property
    def width(self) -> float:
        widths = [len(self.title) * _LETTER, *(len(line) * _SMALL for line in self.lines)]
        return max(widths) + 2 * _PAD

    @property
    def height(self) -> float:
        return (1 + len(self.lines)) * _LINE + _PAD


def drawing(reason: Reason) -> str:
    """The tree as an SVG document."""
    boxes: list[_Box] = []
    _place(reason, 0, None, boxes)
    width = max(box.x + box.width for box in boxes) + _MARGIN
    height = max(box.y + box.height for box in boxes) + _MARGIN
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">',
        f"<title>{escape(reason.literal)}</title>",
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        *map(_line, boxes),
        *map(_drawn, boxes),
        "</svg>",
    ]
    return "\n".join(part for part in parts if part) + "\n"


def _place(reason: Reason, depth: int, parent: _Box | None, boxes: list[_Box]) -> None:
    y = _MARGIN if not boxes else boxes[-1].y + boxes[-1].height + _GAP
    title, says = remark(reason)
    title = title if len(title) <= 2 * _WIDEST else title[: 2 * _WIDEST - 1] + "…"
    lines = tuple(textwrap.wrap(says, _WIDEST))[:4]
    box = _Box(reason, _MARGIN + depth * _STEP, y, title, lines, parent)
    boxes.append(box)
    for each in reason.reasons:
        _place(each, depth + 1, box, boxes)


def _line(box: _Box) -> str:
    if box.parent is None:
        return ""
    x, bottom = box.parent.x + _STEP / 2, box.parent.y + box.parent.height
    middle = box.y + box.height / 2
    path = f"M {x:.1f} {bottom:.1f} V {middle:.1f} H {box.x:.1f}"
    return f'<path d="{path}" fill="none" stroke="#9a9a9a"/>'


def _drawn(box: _Box) -> str:
    fill, edge = _COLOURS[box.reason.role]
    text = [
        f'<rect x="{box.x:.1f}" y="{box.y:.1f}" width="{box.width:.1f}" '
        f'height="{box.height:.1f}" rx="5" fill="{fill}" stroke="{edge}"/>',
        f'<text x="{box.x + _PAD:.1f}" y="{box.y + _LINE:.1f}" font-family="monospace" '
        f'font-size="12" font-weight="bold" fill="#1c1c1c">{escape(box.title)}</text>',
    ]
    for number, line in enumerate(box.lines, start=2):
        text.append(
            f'<text x="{box.x + _PAD:.1f}" y="{box.y + number * _LINE:.1f}" '
            f'font-family="sans-serif" font-size="11.5" fill="#444444">{escape(line)}</text>'
        )
    return "\n".join(text)
