"""Makes scenes of the frames of a camera that announces none: at a rate, or when somebody asks.

A real camera runs freely. Of its frames the latest is kept, and becomes a scene when one is due and
the scene before is finished; the others are counted and forgotten, so that nothing piles up.
"""

from __future__ import annotations

import secrets
from collections import deque
from dataclasses import dataclass, replace

from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.scenes import Scene
from ros_scenesense.scene import Frame
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.sessions import new_session
from ros_scenesense.stages.state_file import open_state_file, state_path

STATE_FILE = "grounding_scenes.db"
VERSION = 1
_SCHEMA = """
CREATE TABLE session (
    name TEXT PRIMARY KEY,
    next INTEGER NOT NULL
) WITHOUT ROWID;
"""
_MOST_ASKED = 16


class SceneNumbers:
    """Gives scene ids `<session>-<index>`, each only once, also over restarts.

    Args:
        folder: Folder of the state file; empty = nothing is remembered, and every start is a
            session of its own.
        session: Its name; one that the file knows is continued. Empty = a new one.
        health: Takes the report of a damaged file.

    Attributes:
        session: First part of the ids.

    Raises:
        StateError: If the file cannot be used.
    """

    def __init__(self, folder: str, session: str, health: Health) -> None:
        path = state_path(folder, STATE_FILE)
        self._connection = open_state_file(path, _SCHEMA, VERSION, health)
        self.session = session or new_session()
        if session and not folder:
            # Without a file nobody knows which numbers this session has used.
            self.session = f"{session}-{secrets.token_hex(2)}"

    def next_id(self) -> str:
        """An id that nobody got before, nor will after a crash."""
        with self._connection:
            ((number,),) = self._connection.execute(
                "INSERT INTO session VALUES (?, 1) "
                "ON CONFLICT (name) DO UPDATE SET next = next + 1 RETURNING next - 1",
                (self.session,),
            ).fetchall()
        return f"{self.session}-{number:04d}"

    def close(self) -> None:
        """Closes the file."""
        self._connection.close()


@dataclass(frozen=True)
class _Asked:
    """A scene that somebody asked for, before its frame is there."""

    scene_id: str
    since_ns: int


class OwnScenes:
    """Chooses the frames that become scenes.

    Args:
        numbers: Gives the scene ids.
        rate_hz: At most so many scenes per second; 0 = only when somebody asks.
        patience_s: So long a scene that was asked for waits for its frame.
        health: Counts the frames that were not used.
    """

    def __init__(
        self, numbers: SceneNumbers, rate_hz: float, patience_s: float, health: Health
    ) -> None:
        self._numbers = numbers
        self._period_ns = round(1e9 / rate_hz) if rate_hz > 0.0 else None
        self._patience_s = patience_s
        self._health = health
        self._asked: deque[_Asked] = deque()
        self._latest: tuple[Frame, int] | None = None
        self._next_due_ns = 0
        self._now_ns = 0
        self._last_stamp_ns: int | None = None

    @property
    def session(self) -> str:
        """First part of the scene ids."""
        return self._numbers.session

    def ask(self, now_ns: int) -> str | None:
        """Wants the next frame that comes to be a scene.

        Returns:
            Its scene id, or None if too many wait for their frames already.
        """
        if len(self._asked) >= _MOST_ASKED:
            return None
        self._asked.append(_Asked(self._numbers.next_id(), now_ns))
        return self._asked[-1].scene_id

    def offer(self, frame: Frame, now_ns: int) -> None:
        """Takes a frame that arrives; the one that was kept until now is forgotten."""
        if now_ns < self._now_ns:  # simulated time began anew, e.g. a bag is played again
            self._next_due_ns = now_ns
            self._asked = deque(replace(asked, since_ns=now_ns) for asked in self._asked)
        self._now_ns = now_ns
        if frame.stamp_ns == self._last_stamp_ns:
            self._health.count("repeated")
            return
        if self._latest is not None:
            wanted = self._is_wanted(self._latest[1])
            self._health.count("frames_dropped" if wanted else "frames_passed_over")
        self._latest = (frame, now_ns)

    def take(self, now_ns: int) -> tuple[Frame, Scene] | None:
        """The next scene with its frame, if one is due; call it when the one before is finished."""
        if self._latest is None:
            return None
        frame, received_ns = self._latest
        if self._asked and received_ns >= self._asked[0].since_ns:
            scene_id = self._asked.popleft().scene_id
        elif self._is_due(now_ns):
            scene_id = self._numbers.next_id()
        else:
            return None
        if self._period_ns is not None:
            on_time = self._next_due_ns + self._period_ns
            self._next_due_ns = on_time if on_time > now_ns else now_ns + self._period_ns
        self._latest = None
        self._last_stamp_ns = frame.stamp_ns
        self._health.count("scenes_minted")
        # No labels come with these scenes: nothing is trained on them.
        stamp = Stamp.of(frame.stamp_ns)
        return frame, Scene(stamp=stamp, scene_id=scene_id, mode="testing", objects=[])

    def expire(self, now_ns: int) -> None:
        """Gives up the scenes whose frames do not come; called regularly."""
        while self._asked and now_ns - self._asked[0].since_ns > self._patience_s * 1e9:
            if self._latest is not None and self._latest[1] >= self._asked[0].since_ns:
                return  # it has its frame, and waits for the scene before
            scene_id = self._asked.popleft().scene_id
            self._health.problem(
                "capture_without_frame",
                f"scene {scene_id} was asked for and no frame came within {self._patience_s:g} s: "
                "publish colour, depth and camera info, or remap them to the camera's topics",
            )

    def close(self) -> None:
        """Closes the state file."""
        self._numbers.close()

    def _is_wanted(self, received_ns: int) -> bool:
        """Whether a frame would have become a scene, had the one before been finished."""
        asked = bool(self._asked) and received_ns >= self._asked[0].since_ns
        return asked or self._is_due(received_ns)

    def _is_due(self, now_ns: int) -> bool:
        return self._period_ns is not None and now_ns >= self._next_due_ns
