"""Plays a story on the graph, tells it, and writes the run folder."""

from __future__ import annotations

import shlex
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from ros_scenesense.demo import clutter, trace
from ros_scenesense.demo.domains import LAST_DOMAIN
from ros_scenesense.demo.narrator import Narrator
from ros_scenesense.demo.record import SceneRecord
from ros_scenesense.demo.run_folder import make_folder, new_folder
from ros_scenesense.demo.session import SessionOptions
from ros_scenesense.demo.story import Story
from ros_scenesense.demo.story_report import StoryEnd, write_story, write_story_report
from ros_scenesense.errors import LaunchError
from ros_scenesense.parameters import parameter

STORIES = ("trace", "clutter")
_NOT_GIVEN = -1


@dataclass(frozen=True)
class StoryOptions:
    """What the user may choose; `overrides` are values per node and parameter."""

    scenes: int = parameter(
        100, "labelled scenes that the robot is shown before", minimum=2, maximum=1000
    )
    seed: int = parameter(0, "seed of these scenes, and of where the robot puts things", minimum=0)
    scene: str = parameter("", "scene file to tidy up; config/scenes/clutter.yaml if not given")
    out: str = parameter("", "run folder; runs/<date and time> if not given")
    domain_id: int = parameter(
        _NOT_GIVEN,
        "ROS domain; if not given ROS_DOMAIN_ID, else one that nobody uses",
        minimum=0,
        maximum=LAST_DOMAIN,
    )
    params: str = parameter("", "params YAML of the nodes; the shipped one if not given")
    overrides: Mapping[str, Mapping[str, object]] = field(default_factory=dict)

    def command(self, what: str) -> str:
        """The command line that repeats the run."""
        words = ["scenesense", "demo", what]
        names = ("scenes", "seed") if what == "trace" else ("scene", "seed")
        for name in (*names, "params"):
            value = getattr(self, name)
            if value != "":
                words += [f"--{name}", str(value)]
        for node, values in self.overrides.items():
            for name, value in values.items():
                words += ["-p", f"{node}.{name}={value}"]
        return shlex.join(words)


def tell(what: str, options: StoryOptions, console: Console) -> int:
    """Plays a story, and writes `report.html` and `story.json`, whatever ends it.

    Args:
        what: `trace` or `clutter`.
        options: What the user chose.
        console: Where it is told.

    Returns:
        0 if it went as it should, 130 if the user stopped it, else 1.

    Raises:
        ParameterError: If an option is wrong, or the run folder cannot be made.
    """
    started = datetime.now(UTC)
    folder = Path(options.out) if options.out else new_folder(started)
    domain = None if options.domain_id == _NOT_GIVEN else options.domain_id
    session = SessionOptions(
        folder, domain, Path(options.params) if options.params else None, options.overrides
    )
    make_folder(folder)
    narrator = Narrator(console)
    story = Story(narrator.tell)
    error, code = "", 0
    scenes: tuple[SceneRecord, SceneRecord] | None = None
    begun = time.monotonic()
    try:
        if what == "trace":
            shown = narrator.counter("scenes kept", every=20)
            trace.play(session, story, options.scenes, options.seed, narrator.event, shown)
        else:
            scenes = clutter.play(session, story, options.scene, options.seed, narrator.event)
    except LaunchError as failure:
        error, code = str(failure), 1
    except KeyboardInterrupt:
        error, code = "stopped by the user", 130
    end = StoryEnd(
        what=what,
        command=options.command(what),
        started=f"{started:%Y-%m-%d %H:%M:%S} UTC",
        seconds=time.monotonic() - begun,
        error=error,
        scenes=scenes,
    )
    write_story(story, end, folder / "story.json")
    write_story_report(story, end, folder / "report.html")
    narrator.conclude(story, end, folder)
    return code
