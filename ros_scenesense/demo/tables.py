"""Tables and lines about a run, for the terminal: readable without colours too."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from ros_scenesense.demo.record import RunRecord, SceneRecord, Subject
from ros_scenesense.demo.summary import (
    Summary,
    TaskSummary,
    graph_order,
    summarise_latency,
    summarise_task,
)

TITLES = {
    Subject.STABILITY: "object is stable",
    Subject.OCCLUSION: "object is occluded",
    Subject.STRUCTURE_STABILITY: "structure is stable",
    Subject.STACK_STABILITY: "… of which real stacks",
}
_LEGEND = (
    "✓ physics agrees   ✗ it disagrees   ? it cannot tell   ! axioms contradict each other\n"
    "strict: follows without exception   default: normally so   open: not decided"
)


def scenes_table(scenes: Sequence[SceneRecord]) -> Table:
    """One row per scene: how each task was decided, and whether physics agrees."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1))
    table.add_column("\nscene", justify="right")
    table.add_column("\nobjects", justify="right")
    for task in ("Stable?", "Occluded?"):
        table.add_column(f"{task}\nstrict", min_width=8)
        table.add_column("\ndefault", min_width=8)
        table.add_column("\nopen", min_width=4)
    table.add_column("\nms", justify="right", min_width=4)
    for scene in scenes:
        table.add_row(*_scene_cells(scene))
    return table


def totals_table(tasks: dict[str, TaskSummary]) -> Table:
    """The counts of a run, one row per task."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1))
    table.add_column("totals", min_width=22)
    table.add_column("strict", min_width=9)
    table.add_column("accuracy", justify="right")
    table.add_column("default", min_width=9)
    table.add_column("open", min_width=5)
    table.add_column("decided", justify="right")
    for subject, title in TITLES.items():
        task = tasks[subject]
        table.add_row(
            title,
            _strict(task),
            _percent(task.strict_accuracy),
            _default(task),
            _open(task),
            _percent(task.decided_share),
        )
    return table


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
        task = _task_of(scene, subject)
        words.append(
            f"{title}? {task.strict} strict ({_judged(task.right, task.wrong)}), "
            f"{task.by_default} by default ({_judged(task.default_right, task.default_wrong)}), "
            f"{task.total - task.strict - task.by_default} open"
        )
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
        task = _task_of(scene, subject)
        cells += [_strict(task), _default(task), _open(task)]
    return [*cells, "" if scene.latency_ms is None else f"{scene.latency_ms:.0f}"]


def _task_of(scene: SceneRecord, subject: Subject) -> TaskSummary:
    return summarise_task([d for d in scene.decisions() if d.subject is subject])


def _object_count(scene: SceneRecord) -> int:
    return len(scene.beliefs.objects) if scene.beliefs else 0


def _strict(task: TaskSummary) -> Text:
    return _tally(task.right, task.wrong, task.unjudged)


def _default(task: TaskSummary) -> Text:
    return _tally(task.default_right, task.default_wrong, task.default_unjudged)


def _open(task: TaskSummary) -> Text:
    undecided = task.undecided + task.timed_out
    return _signs((undecided, "", "yellow"), (task.inconsistent, "!", "red"))


def _tally(right: int, wrong: int, unjudged: int) -> Text:
    return _signs((right, "✓", "green"), (wrong, "✗", "red"), (unjudged, "?", "dim"))


def _signs(*counts: tuple[int, str, str]) -> Text:
    parts = [Text(f"{count}{sign}", style=style) for count, sign, style in counts if count]
    return Text(" ").join(parts) if parts else Text("·", style="dim")


def _judged(right: int, wrong: int) -> str:
    return f"{right} right, {wrong} wrong"


def _milliseconds(value: float) -> str:
    return f"{value:.0f} ms" if value >= 100.0 else f"{value:.3g} ms"


def _percent(share: float | None) -> Text:
    return Text("-", style="dim") if share is None else Text(f"{100 * share:.1f} %")
