"""What a run looks like in a terminal: a live view, or plain lines where there is no terminal."""

from __future__ import annotations

import time
from typing import Protocol

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from ros_scenesense.demo.finals import summarise_finals
from ros_scenesense.demo.learning_curve import LearningSummary, summarise_learning
from ros_scenesense.demo.record import RunRecord
from ros_scenesense.demo.summary import RunInfo, graph_order
from ros_scenesense.demo.tables import (
    cycle_line,
    latency_line,
    learning_table,
    scene_line,
    scenes_table,
    totals_table,
)

_SILENT_NS = 2_000_000_000
_RESERVED_LINES = 23
_LEARNING_EVERY = 10


class View(Protocol):
    """Shows a run while it goes on."""

    def open(self) -> None:
        """Begins the view."""

    def event(self, words: str) -> None:
        """Shows what the launcher says."""

    def update(self) -> None:
        """Shows what is new in the record; called often."""

    def close(self) -> None:
        """Ends the view; what is printed afterwards stands below it."""


def make_view(console: Console, record: RunRecord, info: RunInfo) -> View:
    """The view that the console can show."""
    live = console.is_terminal and not console.is_dumb_terminal
    return LiveView(console, record, info) if live else PlainView(console, record, info)


class PlainView:
    """One line for each event and each settled scene."""

    def __init__(self, console: Console, record: RunRecord, info: RunInfo) -> None:
        self._console = console
        self._record = record
        self._asked = info.asked
        self._shown: set[str] = set()
        self._cycles = 0

    def open(self) -> None:
        """Nothing to do: lines need no preparation."""

    def event(self, words: str) -> None:
        """Prints the words."""
        self._console.print(words, markup=False, highlight=False, soft_wrap=True)

    def update(self) -> None:
        """Prints a line for each scene that is new and complete."""
        for scene in self._record.in_order():
            if scene.scene_id not in self._shown and (scene.is_complete or scene.is_lost):
                self._shown.add(scene.scene_id)
                self.event(scene_line(scene, self._asked))
        if len(self._record.cycles) > self._cycles:
            self._cycles = len(self._record.cycles)
            learning = summarise_learning(self._record)
            assert learning is not None
            self.event(cycle_line(self._record.cycles[-1].cycle, learning))

    def close(self) -> None:
        """Prints the scenes whose parts did not all come."""
        for scene in self._record.settled():
            if scene.scene_id not in self._shown:
                self.event(scene_line(scene, self._asked))


class LiveView:
    """Progress, nodes, the newest scenes and running totals, redrawn in place."""

    def __init__(self, console: Console, record: RunRecord, info: RunInfo) -> None:
        self._console = console
        self._record = record
        self._info = info
        self._event = "starting the nodes"
        self._counted = (0, 0)
        self._curve: LearningSummary | None = None
        self._live = Live(console=console, auto_refresh=False, transient=True)

    def open(self) -> None:
        """Starts to draw."""
        self._live.start()

    def event(self, words: str) -> None:
        """Shows the words until the next event."""
        self._event = words
        self.update()

    def update(self) -> None:
        """Redraws."""
        self._live.update(self._picture(), refresh=True)

    def close(self) -> None:
        """Takes the live picture away."""
        self._live.stop()

    def _picture(self) -> RenderableType:
        scenes = self._record.settled()
        learning = self._learning(len(scenes))
        reserved = _RESERVED_LINES
        learned: list[RenderableType] = []
        if learning is not None:
            reserved += len(learning.cycles) + 4
            learned = [learning_table(learning), ""]
        fitting = max(3, self._console.height - reserved)
        return Group(
            self._progress(len(scenes)),
            _nodes_line(self._record, time.time_ns()),
            Text(self._event, style="dim", no_wrap=True, overflow="ellipsis"),
            "",
            scenes_table(scenes[-fitting:]),
            "",
            totals_table(summarise_finals(self._record.decisions())),
            "",
            *learned,
            latency_line(self._record),
        )

    def _learning(self, settled: int) -> LearningSummary | None:
        """The figures of learning, made anew now and then: it takes a while to count them all."""
        count = (len(self._record.cycles), settled // _LEARNING_EVERY)
        if count != self._counted:
            self._counted, self._curve = count, summarise_learning(self._record)
        return self._curve

    def _progress(self, settled: int) -> RenderableType:
        grid = Table.grid(padding=(0, 2))
        words = f"{settled} of {self._info.asked} scenes"
        bar = ProgressBar(
            total=self._info.asked, completed=settled, width=36, complete_style="green"
        )
        what = f"{self._info.arrangement}, seed {self._info.seed}, domain {self._info.domain_id}"
        grid.add_row(Text("SceneSense", style="bold"), bar, words, Text(what, style="dim"))
        return grid


def _nodes_line(record: RunRecord, now_ns: int) -> Text:
    parts = []
    for name in sorted(record.nodes, key=graph_order):
        node = record.nodes[name]
        if now_ns - node.received_ns > _SILENT_NS:
            state, style = " silent", "red"
        elif not node.latest.ready:
            state, style = " starting", "yellow"
        else:
            state, style = ("", "green") if node.latest.warm else (" warming up", "yellow")
        if node.processes > 1:
            state += f" (restarted {node.processes - 1}x)"
        parts.append(Text.assemble(("●\N{NO-BREAK SPACE}", style), name, (state, "dim")))
    return Text("   ").join(parts) if parts else Text("no node has answered yet", style="dim")
