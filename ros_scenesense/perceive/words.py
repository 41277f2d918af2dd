"""What was found in a frame, as lines for people: in the terminal and beside the picture."""

from __future__ import annotations

from rich import box
from rich.table import Table
from rich.text import Text

from ros_scenesense.messages.grounding import PerceivedObject, Relation
from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.perceive.run import Report, distance_m
from ros_scenesense.scene import DecisionStatus, Distance, Position

_PHRASES = {
    Position.IN: "in",
    Position.ABOVE: "above",
    Position.BELOW: "below",
    Position.FRONT: "in front of",
    Position.BEHIND: "behind",
    Position.RIGHT: "right of",
    Position.LEFT: "left of",
}
_DISTANCES = {
    Distance.TOUCHING: "touching",
    Distance.NOT_TOUCHING: "not touching",
    Distance.FAR: "far",
}
_KNOWN = {DecisionStatus.STRICT: "", DecisionStatus.BY_DEFAULT: " (by default)"}
_VERTICAL = {Position.IN, Position.ABOVE, Position.BELOW}
_MOST_RELATIONS = 30


def described(one: PerceivedObject) -> str:
    """An object with what is known of it: `object_1 (small red cube)`."""
    given = [each.value for each in (one.size, one.color, one.shape) if each is not None]
    known = [str(value) for value in given if value != "other"]
    return f"{one.name} ({' '.join(known)})" if known else one.name


def decision(belief: Belief, yes: str, no: str) -> str:
    """A belief in words: `stable`, `not stable (by default)`, `stable?` where it is not decided."""
    if belief.value is None:
        return f"{yes}? {belief.status.replace('_', ' ')}"
    return (yes if belief.value else no) + _KNOWN[belief.status]


def relation(one: Relation) -> str:
    """A relation as a sentence."""
    phrase, distance = _PHRASES[one.position], _DISTANCES[one.distance]
    return f"{one.object} is {phrase} {one.reference}, {distance}"


def by_weight(report: Report) -> list[Relation]:
    """The relations, those first that matter most to stability; those of far pairs last."""
    return sorted(report.relations, key=lambda one: (not _is_chief(one), one.distance == "far"))


def listing(report: Report) -> list[Text | Table]:
    """What a person reads in the terminal: headings and tables."""
    shown = by_weight(report)
    heading = f"{len(shown)} pairs, named by the {report.naming_frame}"
    if len(shown) > _MOST_RELATIONS:
        shown = [one for one in shown if _is_chief(one)]
        heading += f"; these {len(shown)} are in, above, below or touching"
    seen = (
        f"{len(report.objects)} objects in {report.width}x{report.height} pixels, "
        f"{100 * report.readings:.0f} % of them with a depth reading"
    )
    return [Text(seen), _objects(report), Text(heading), _relations(shown)]


def _is_chief(one: Relation) -> bool:
    return one.position in _VERTICAL or one.distance is Distance.TOUCHING


def _objects(report: Report) -> Table:
    table = _table(
        "object", "size", "surface", "shape", "colour", "away", "stable", "occluded", "axioms"
    )
    decisions = {one.name: one for one in report.decisions}
    for one in report.objects:
        attributes = (one.size, one.surface, one.shape, one.color)
        cells = [one.name, *("" if each is None else str(each.value) for each in attributes)]
        away = distance_m(one)
        cells.append("not located" if away is None else f"{away:.2f} m")
        known = decisions.get(one.name)
        if known is not None:
            cells.append(decision(known.stable, "stable", "unstable"))
            cells.append(decision(known.occluded, "occluded", "visible"))
            cells.append(" ".join([*known.stable.axioms, *known.occluded.axioms]))
        table.add_row(*(Text(cell) for cell in cells))
    return table


def _relations(shown: list[Relation]) -> Table:
    table = _table("relation", "confidence")
    for one in shown:
        sure = f"{one.position_confidence:.2f} / {one.distance_confidence:.2f}"
        table.add_row(Text(relation(one)), Text(sure))
    return table


def _table(*columns: str) -> Table:
    return Table(*columns, box=box.SIMPLE_HEAD, show_edge=False)
