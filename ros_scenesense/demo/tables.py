"""Tables and lines about a run, for the terminal: readable without colours too."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ros_scenesense.demo.finals import DECIDERS, FinalSummary, SourceSummary, summarise_final
from ros_scenesense.demo.learning_curve import LearningSummary
from ros_scenesense.demo.record import RunRecord, SceneRecord, Subject
from ros_scenesense.demo.summary import Summary, graph_order, summarise_latency

TITLES = {
    Subject.STABILITY: "object is stable",
    Subject.OCCLUSION: "object is occluded",
    Subject.STRUCTURE_STABILITY: "structure is stable",
    Subject.STACK_STABILITY: "… of real stacks",
}
_LEGEND = (
    "✓ physics agrees   ✗ it disagrees   ? it cannot tell   open: nobody decided\n"
    "strict: follows without exception   default: normally so   network: where axioms say nothing\n"
    "right: of all whose truth is clear, decided or not"
)
_BAR = 12
_COLUMNS = (("strict", 6), ("default", 7), ("network", 7), ("open", 4))
_SAID = {"reasoning": "strict", "default": "by default", "network": "by the network"}


def scenes_table(scenes: Sequence[SceneRecord]) -> Table:
    """One row per scene: who decided each task in the end, and whether physics agrees."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, collapse_padding=True)
    table.add_column("\nscene", justify="right")
    table.add_column("\nobjects", justify="right")
    for task in ("Stable?", "Occluded?"):
        for number, (title, width) in enumerate(_COLUMNS):
            table.add_column(f"{'' if number else task}\n{title}", min_width=width)
    table.add_column("\nms", justify="right", min_width=4)
    for scene in scenes:
        table.add_row(*_scene_cells(scene))
    return table


def totals_table(finals: dict[str, FinalSummary]) -> Table:
    """Who decided in a run, one row per task, beside what reasoning alone decided."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, collapse_padding=True)
    table.add_column("\nwho decided", min_width=19)
    for title, width in _COLUMNS:
        table.add_column(f"\n{title}", min_width=width)
    for whose in ("finally", "reasoning"):
        table.add_column(f"{whose}\ndecided", justify="right")
        table.add_column("\nright", justify="right")
    for subject, title in TITLES.items():
        final = finals[subject]
        table.add_row(
            title,
            *_who_decided(final),
            _percent(final.decided_share),
            _percent(final.right_share),
            _percent(final.reasoning_decided_share),
            _percent(final.reasoning_right_share),
        )
    return table


def learning_table(learning: LearningSummary) -> Table:
    """What reasoning decided from cycle to cycle, one row for each."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, collapse_padding=True)
    table.add_column("\nlearning cycle")
    for title in ("\nscenes", "axioms\nlearned", "reasoning\ndecided", "\nstable?", "\noccluded?"):
        table.add_column(title, justify="right")
    table.add_column("\nright", justify="right")
    table.add_column("\nof decided", justify="right")
    table.add_column("", min_width=_BAR)
    for each in filter(lambda cycle: cycle.scenes, learning.cycles):
        shares = (each.decided_share, each.stability_share, each.occlusion_share)
        table.add_row(
            f"after {each.cycle}" if each.cycle else "before",
            str(each.scenes),
            str(each.axioms),
            *map(_percent, shares),
            _percent(each.right_share),
            _percent(each.accuracy),
            _share_bar(each.decided_share),
        )
    return table


def axioms_table(learning: LearningSummary) -> Table:
    """Every learned axiom with its strength after each cycle."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, collapse_padding=True)
    table.add_column("learned axiom, strength after cycle", min_width=34)
    cycles = [each.cycle for each in learning.cycles if each.cycle]
    for cycle in cycles:
        table.add_column(str(cycle), justify="right", min_width=4)
    for axiom in learning.axioms:
        strengths = [axiom.strengths.get(cycle) for cycle in cycles]
        cells = ["·" if each is None else f"{each:.2f}" for each in strengths]
        table.add_row(Text(axiom.text), *cells)
    return table


def cycle_line(cycle: int, learning: LearningSummary) -> str:
    """What a cycle has taught, in one line of plain words."""
    new = [each.text for each in learning.axioms if min(each.strengths) == cycle]
    return f"learning cycle {cycle}: {' '.join(new) or 'nothing new'}"


def latency_line(record: RunRecord) -> Text:
    """Median latency from frame to decision, and of each step."""
    latencies = [scene.latency_ms for scene in record.settled() if scene.latency_ms is not None]
    named = {"frame to decision": latencies}
    named |= {name: record.timings[name] for name in sorted(record.timings, key=graph_order)}
    words = [
        f"{name} {_milliseconds(summarise_latency(values).p50_ms)}".replace(
            " ", "\N{NO-BREAK SPACE}"
        )
        for name, values in named.items()
        if values
    ]
    return Text("median latency: " + " · ".join(words or ["not known yet"]), style="dim")


def scene_line(scene: SceneRecord, asked: int) -> str:
    """One settled scene in one line of plain words."""
    start = f"scene {scene.number + 1}/{asked}: "
    if scene.is_lost:
        return f"{start}lost, {scene.lost.reason if scene.lost else ''}"
    words = [f"{_object_count(scene)} objects"]
    for subject, title in ((Subject.STABILITY, "stable"), (Subject.OCCLUSION, "occluded")):
        final = _final_of(scene, subject)
        counts = [
            f"{source.total} {_SAID[name]} ({source.right} right, {source.wrong} wrong)"
            for name, source in final.by_source.items()
            if source.total
        ]
        counts += [f"{final.undecided} open"] if final.undecided else []
        words.append(f"{title}? {', '.join(counts) or 'nothing to decide'}")
    if scene.latency_ms is not None:
        words.append(f"{scene.latency_ms:.0f} ms")
    return start + "; ".join(words)


def final_words(summary: Summary) -> Text:
    """How the run ended, in one line."""
    complete = summary.scenes == summary.asked
    words = Text(
        f"{summary.scenes} of {summary.asked} scenes", "bold green" if complete else "bold"
    )
    if summary.lost:
        words.append(f", {summary.lost} lost", "bold red")
    if summary.scenes_per_s is not None:
        words.append(
            f" in {summary.scenes_s:.1f} s, {summary.scenes_per_s:.1f} per second", "not bold"
        )
    if summary.ready_s is not None:
        words.append(f"; nodes ready after {summary.ready_s:.1f} s")
    return words


def legend() -> Text:
    """What the columns and signs of the tables mean."""
    return Text(_LEGEND, style="dim")


def _scene_cells(scene: SceneRecord) -> list[RenderableType]:
    number = str(scene.number + 1)
    if scene.is_lost:
        return [number, "", Text("lost", style="bold red")]
    cells: list[RenderableType] = [number, str(_object_count(scene))]
    for subject in (Subject.STABILITY, Subject.OCCLUSION):
        cells += _who_decided(_final_of(scene, subject))
    return [*cells, "" if scene.latency_ms is None else f"{scene.latency_ms:.0f}"]


def _final_of(scene: SceneRecord, subject: Subject) -> FinalSummary:
    return summarise_final([d for d in scene.decisions() if d.subject is subject])


def _object_count(scene: SceneRecord) -> int:
    return len(scene.beliefs.objects) if scene.beliefs else 0


def _who_decided(final: FinalSummary) -> list[Text]:
    tallies = [_tally(final.by_source[source]) for source in DECIDERS]
    return [*tallies, _signs((final.undecided, "", "yellow"))]


def _tally(source: SourceSummary) -> Text:
    return _signs(
        (source.right, "✓", "green"), (source.wrong, "✗", "red"), (source.unjudged, "?", "dim")
    )


def _signs(*counts: tuple[int, str, str]) -> Text:
    parts = [Text(f"{count}{sign}", style=style) for count, sign, style in counts if count]
    return Text(" ").join(parts) if parts else Text("·", style="dim")


def _milliseconds(value: float) -> str:
    return f"{value:.0f} ms" if value >= 100.0 else f"{value:.3g} ms"


def _share_bar(share: float | None) -> Text:
    full = 0 if share is None else round(_BAR * share)
    return Text("█" * full, style="green") + Text("░" * (_BAR - full), style="dim")


def _percent(share: float | None) -> Text:
    return Text("-", style="dim") if share is None else Text(f"{100 * share:.1f} %")
