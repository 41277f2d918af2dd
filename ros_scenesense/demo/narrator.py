"""Tells a story in a terminal while it happens: readable without colours too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ros_scenesense.demo.clutter import Tidiness
from ros_scenesense.demo.story import Chapter, Done, Ended, Entry, Learned, Planned, Story
from ros_scenesense.demo.story_report import StoryEnd, tidiness_of
from ros_scenesense.messages.actions import Plan
from ros_scenesense.stages.goal_words import words_of


class Narrator:
    """Prints every entry of a story.

    Args:
        console: Where.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._goals: set[str] = set()

    def tell(self, entry: Entry) -> None:
        """Prints an entry."""
        match entry:
            case Chapter():
                self._chapter(entry)
            case Planned(plan):
                self._plan(plan)
            case Done():
                self._action(entry)
            case Learned():
                self._learned(entry)
            case Ended(plan):
                self._end(plan)

    def conclude(self, story: Story, end: StoryEnd, folder: Path) -> None:
        """Prints how it ended, and where the files are."""
        self._print(Text(""))
        tidiness = tidiness_of(end)
        if len(tidiness) == 2:
            self._console.print(_tidiness_table(tidiness[0], tidiness[1]))
            self._print(Text(""))
        if end.error:
            self._console.print(Text(end.error, style="bold red"), highlight=False)
        else:
            actions = sum(len(attempt.steps) for attempt in story.attempts())
            words = f"as it should be, after {actions} actions and {end.seconds:.0f} s"
            self._print(Text(words, style="bold green"))
        for name, what in (("report.html", "report "), ("story.json", "figures")):
            self._print(Text(f"{what}  {folder / name}"))

    def event(self, words: str) -> None:
        """Prints what the launcher says."""
        self._print(Text(f"  {words}", style="dim"))

    def counter(self, words: str, every: int) -> Callable[[int], None]:
        """Prints a number now and then while it grows.

        Args:
            words: What is counted.
            every: After so many a line is printed.
        """
        last = 0

        def show(number: int) -> None:
            nonlocal last
            if number // every > last // every:
                last = number
                self._print(Text(f"  {number} {words}", style="dim"))

        return show

    def _chapter(self, chapter: Chapter) -> None:
        if chapter.title:
            self._print(Text(""))
            self._print(Text(chapter.title, style="bold"))
        if chapter.words:
            self._console.print(Text(chapter.words), highlight=False)

    def _plan(self, plan: Plan) -> None:
        if plan.id not in self._goals:
            self._goals.add(plan.id)
            self._print(Text.assemble("goal ", (plan.goal, "bold")))
        if plan.reason:
            self._console.print(Text(f"  {plan.reason}", style="yellow"), highlight=False)
        count = f"{len(plan.actions)} action{'' if len(plan.actions) == 1 else 's'}"
        self._print(Text(f"  plan, {count}:", style="cyan"))
        for number, action in enumerate(plan.actions):
            self._print(Text(f"    {number}  {words_of(action)}", style="cyan"))

    def _action(self, step: Done) -> None:
        action = words_of(step.transition.action)
        if step.is_expected:
            self._print(Text.assemble(("  ✓ ", "green"), action))
        elif step.transition.outcome == "refused":
            self._print(Text.assemble(("  ✗ ", "red"), action, ("  was refused", "red")))
        else:
            self._print(Text.assemble(("  ✗ ", "red"), action, ("  not as expected", "red")))

    def _learned(self, learned: Learned) -> None:
        if not learned.axioms:
            self._print(Text(f"  learning cycle {learned.cycle}: nothing new", style="magenta"))
            return
        self._print(Text(f"  learning cycle {learned.cycle}, learned:", style="magenta"))
        for axiom in learned.axioms:
            how = f"true of {axiom.purity:.0%} of the examples it speaks of"
            self._print(Text.assemble((f"    {axiom.text}", "bold magenta"), (f"  {how}", "dim")))

    def _end(self, plan: Plan) -> None:
        outcome = plan.outcome.replace("_", " ")
        reason = f": {plan.reason}" if plan.reason else ""
        style = "bold green" if plan.outcome == "reached" else "bold red"
        self._console.print(Text(f"  {outcome}{reason}", style=style), highlight=False)

    def _print(self, text: Text) -> None:
        self._console.print(text, highlight=False, soft_wrap=True)


def _tidiness_table(before: Tidiness, after: Tidiness) -> Table:
    """What physics and pixels say of the table before and afterwards."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, collapse_padding=True)
    for title in ("physics and pixels say", "before", "after"):
        table.add_column(title)
    for title, names in (
        ("hidden", (before.occluded, after.occluded)),
        ("unstable", (before.unstable, after.unstable)),
    ):
        table.add_row(title, *(", ".join(each) or "nothing" for each in names))
    table.add_row("on the table", before.on_table, after.on_table)
    return table
