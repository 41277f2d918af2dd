"""The report of a story: one HTML file that needs nothing else, and the same as `story.json`.

This module says what the page shows; `story.html.j2` says how it looks.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ros_scenesense.demo.cards import Card, make_card, png_of
from ros_scenesense.demo.clutter import Tidiness
from ros_scenesense.demo.overlay import FONT_SIZE
from ros_scenesense.demo.record import SceneRecord
from ros_scenesense.demo.story import Chapter, Done, Ended, Learned, Planned, Story
from ros_scenesense.demo.templates import template
from ros_scenesense.messages.actions import Plan
from ros_scenesense.messages.learning import LearnedAxiom
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import write_atomically
from ros_scenesense.stages.goal_words import words_of

TITLES = {
    "trace": "The paper's first execution trace",
    "clutter": "A table is tidied up",
}
_LEADS = {
    "trace": "Goal, plan, an unexpected outcome, its explanation, what the robot learned, and how "
    "it does better the next time",
    "clutter": "Nothing hidden, nothing unstable, and as little as can be on the table; physics "
    "and pixels judge",
}


@dataclass(frozen=True)
class StoryEnd:
    """How a story was played.

    Attributes:
        what: Which story.
        command: The command line that repeats it.
        started: When, in words.
        seconds: How long it took.
        error: What went otherwise than it should; empty if nothing.
        scenes: The scene before and the one afterwards, where they are compared.
    """

    what: str
    command: str
    started: str
    seconds: float
    error: str = ""
    scenes: tuple[SceneRecord, SceneRecord] | None = None


@dataclass(frozen=True)
class Step:
    """An action on the page: a picture of the world after it, and what came of it."""

    number: int
    words: str
    image: str | None
    outcome: str
    missed: tuple[str, ...] = ()
    seen: tuple[str, ...] = ()


@dataclass
class Part:
    """A part of the page: a title, words, or something that happened."""

    kind: str
    title: str = ""
    words: str = ""
    plan: list[str] = field(default_factory=list)
    image: str | None = None
    steps: list[Step] = field(default_factory=list)
    axioms: Sequence[LearnedAxiom] = ()


@dataclass(frozen=True)
class Tile:
    """A figure at the top of the page."""

    label: str
    value: str
    note: str


def write_story_report(story: Story, end: StoryEnd, path: Path) -> None:
    """Writes `report.html`."""
    write_atomically(path, render_story(story, end).encode())


def render_story(story: Story, end: StoryEnd) -> str:
    """The report as HTML text."""
    tidiness = tidiness_of(end)
    context: dict[str, Any] = {
        "title": TITLES[end.what],
        "lead": _LEADS[end.what],
        "end": end,
        "tiles": list(_tiles(story, end)),
        "parts": list(_parts(story)),
        "plans": _first_plans(story) if end.what == "trace" else [],
        "cards": _cards(story, end),
        "tidiness": tidiness,
        "objects": sorted({name for each in tidiness for name in each.visible}),
        "font_size": FONT_SIZE,
        "versions": versions(),
        "machine": machine(),
    }
    return template("story.html.j2").render(context)


def write_story(story: Story, end: StoryEnd, path: Path) -> None:
    """Writes `story.json`: goals, plans, actions, what was learned, what physics says."""
    content = {
        "schema": "story/1",
        "what": end.what,
        "command": end.command,
        "started": end.started,
        "seconds": round(end.seconds, 1),
        "error": end.error,
        "goals": [
            {
                "goal": attempt.goal,
                "outcome": None if attempt.end is None else attempt.end.outcome,
                "plans": [
                    {"reason": plan.reason, "actions": list(map(words_of, plan.actions))}
                    for plan in attempt.plans
                ],
                "actions": [
                    {
                        "action": words_of(step.transition.action),
                        "outcome": step.transition.outcome,
                        "missed": step.missed,
                        "seen": step.seen,
                    }
                    for step in attempt.steps
                ],
            }
            for attempt in story.attempts()
        ],
        "learned": [
            {"id": each.id, "text": each.text, "kind": each.kind, "purity": each.purity}
            for each in story.axioms
        ],
        "physics": [
            {
                "occluded": each.occluded,
                "unstable": each.unstable,
                "structures": each.structures,
                "visible": each.visible,
            }
            for each in tidiness_of(end)
        ],
        "versions": versions(),
        "machine": machine(),
    }
    write_atomically(path, json.dumps(content, indent=2).encode() + b"\n")


def tidiness_of(end: StoryEnd) -> list[Tidiness]:
    """What physics says of the scenes before and afterwards, where they are compared."""
    scenes = end.scenes or ()
    return [Tidiness.of(each.labels) for each in scenes if each.labels is not None]


def _tiles(story: Story, end: StoryEnd) -> Iterator[Tile]:
    attempts = story.attempts()
    steps = [step for attempt in attempts for step in attempt.steps]
    tidiness = tidiness_of(end)
    if len(tidiness) == 2:
        before, after = tidiness
        for label, names in (
            ("Hidden objects", [each.occluded for each in tidiness]),
            ("Unstable objects", [each.unstable for each in tidiness]),
        ):
            left = ", ".join(names[1]) or "none is left"
            yield Tile(label, f"{len(names[0])} → {len(names[1])}", left)
        on_table = f"{len(before.structures)} → {len(after.structures)}"
        yield Tile("Things on the table", on_table, "stacks count as one")
    else:
        plans = [len(attempt.plans) for attempt in attempts]
        note = ", then ".join(str(each) for each in plans)
        yield Tile("Plans made", str(sum(plans)), f"for the same goal: {note}")
        learned = sum(len(e.axioms) for e in story.entries if isinstance(e, Learned))
        cycles = f"{story.cycle} cycle{'' if story.cycle == 1 else 's'}"
        yield Tile("Axioms learned", str(learned), f"in {cycles}")
        reached = sum(attempt.is_reached for attempt in attempts)
        yield Tile("Goal reached", f"{reached} of {len(attempts)}", "judged by what was seen")
    surprised = sum(not step.is_expected for step in steps)
    yield Tile("Actions", str(len(steps)), f"{surprised} with an unexpected outcome")


def _parts(story: Story) -> Iterator[Part]:
    """The entries as parts; actions in a row are one part."""
    row: Part | None = None
    for entry in story.entries:
        if isinstance(entry, Done):
            row = row or Part("steps")
            row.steps.append(_step(story, entry, len(row.steps) + 1))
            continue
        if row is not None:
            yield row
            row = None
        match entry:
            case Chapter():
                yield Part("chapter", entry.title, entry.words)
            case Planned(plan):
                actions = list(map(words_of, plan.actions))
                image = _image(story, plan.scene_id)
                yield Part("plan", plan.goal, plan.reason, actions, image)
            case Learned():
                yield Part("learned", str(entry.cycle), axioms=entry.axioms)
            case Ended(plan):
                yield Part("end", plan.outcome, _last_words(story, plan))
    if row is not None:
        yield row


def _step(story: Story, entry: Done, number: int) -> Step:
    transition = entry.transition
    outcome = "fine" if entry.is_expected else "unexpected"
    if transition.outcome == "refused":
        outcome = "refused"
    return Step(
        number,
        words_of(transition.action),
        _image(story, transition.scene_after),
        outcome,
        entry.missed,
        entry.seen,
    )


def _last_words(story: Story, plan: Plan) -> str:
    """The reason, or what physics says of the last scene."""
    if plan.reason:
        return plan.reason
    scene = story.run.scenes.get(plan.scene_id)
    if scene is None or scene.labels is None:
        return ""
    tidiness = Tidiness.of(scene.labels)
    unstable = ", ".join(tidiness.unstable) or "nothing"
    return f"physics says: on the table {tidiness.on_table}; unstable: {unstable}"


def _first_plans(story: Story) -> list[list[tuple[str, bool]]]:
    """The first plan of each attempt, and which actions are in all of them."""
    plans = [
        [words_of(action) for action in attempt.plans[0].actions]
        for attempt in story.attempts()
        if attempt.plans
    ]
    if len(plans) < 2:
        return []
    return [[(each, all(each in other for other in plans)) for each in plan] for plan in plans]


def _cards(story: Story, end: StoryEnd) -> list[Card]:
    return [make_card(each, story.run) for each in end.scenes or ()]


def _image(story: Story, scene_id: str) -> str | None:
    scene = story.run.scenes.get(scene_id)
    image = None if scene is None else story.run.image(scene, color=True)
    return None if image is None else png_of(image)
