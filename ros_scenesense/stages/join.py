"""Joins the messages of one scene, whatever their order, with a bound and a timeout."""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Collection, Hashable
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

CAPACITY = 32
"""So many scenes wait where nobody says otherwise, and so many with images at most."""
LATE_COMERS = 256
"""So many may wait of what topics keep for late comers: who starts late gets up to 200 messages of
one topic before the first of the next."""


@dataclass
class _Waiting:
    since_ns: int
    parts: dict[str, Any] = field(default_factory=dict)


class SceneJoin:
    """Collects the named parts of each scene; the first of each kind wins.

    Args:
        parts: Names of the parts that make a scene complete.
        timeout_s: After this time without completion a scene is given up.
        capacity: At most this many scenes wait; the oldest is given up for a newer one.
        memory: How many finished scenes are remembered, to recognise what comes late or twice.
        bulky: Parts that need much memory, such as images: of the scenes that have one of them
            at most `CAPACITY` wait, whatever the capacity for the others.
    """

    def __init__(
        self,
        parts: tuple[str, ...],
        timeout_s: float,
        capacity: int = CAPACITY,
        memory: int = 2000,
        bulky: tuple[str, ...] = (),
    ) -> None:
        self.parts = parts
        self.timeout_s = timeout_s
        self.capacity = capacity
        self.memory = memory
        self.bulky = frozenset(bulky)
        self._waiting: OrderedDict[Hashable, _Waiting] = OrderedDict()
        self._done: OrderedDict[Hashable, None] = OrderedDict()
        self._overflown: deque[tuple[Hashable, list[str]]] = deque(maxlen=memory)

    def add(self, key: Hashable, part: str, value: Any, now_ns: int) -> dict[str, Any] | None:
        """Adds a part of a scene.

        Returns:
            All parts once the scene is complete, else None (also for a part that came twice or
            for a scene that is finished: see `knows`).

        Raises:
            KeyError: If no scene has such a part.
        """
        if part not in self.parts:
            raise KeyError(part)
        if self.knows(key, part):
            return None
        waiting = self._waiting.setdefault(key, _Waiting(since_ns=now_ns))
        waiting.parts[part] = value
        if len(waiting.parts) == len(self.parts):
            self._finish(key)
            return waiting.parts
        if part in self.bulky:
            heavy = [key for key, each in self._waiting.items() if self.bulky & each.parts.keys()]
            self._make_room(heavy, CAPACITY)
        self._make_room(self._waiting, self.capacity)
        return None

    def knows(self, key: Hashable, part: str) -> bool:
        """Whether this part of the scene was taken before, or the scene is finished."""
        waiting = self._waiting.get(key)
        return key in self._done or (waiting is not None and part in waiting.parts)

    def forget(self, key: Hashable) -> None:
        """Lets a finished scene come again from its beginning."""
        self._done.pop(key, None)

    def nearest(self, key: int, part: str, tolerance: int) -> int | None:
        """Of the waiting scenes that lack a part, the one whose key (a number) is nearest.

        Args:
            key: Where to look.
            part: What the scene must lack.
            tolerance: So far its key may be away.
        """
        candidates = [
            other
            for other, waiting in self._waiting.items()
            if isinstance(other, int)
            and abs(other - key) <= tolerance
            and part not in waiting.parts
        ]
        return min(candidates, key=lambda other: abs(other - key), default=None)

    def expired(self, now_ns: int) -> list[tuple[Hashable, list[str]]]:
        """Gives up the scenes that waited too long or were pushed out.

        Such a scene is forgotten, not finished: if it is shown again it starts anew.

        Returns:
            Their keys, each with the parts that were missing.
        """
        given_up = list(self._overflown)
        self._overflown.clear()
        for key, waiting in list(self._waiting.items()):
            if now_ns - waiting.since_ns > self.timeout_s * 1e9:
                given_up.append((key, self._missing(key)))
                del self._waiting[key]
        return given_up

    def _make_room(self, waiting: Collection[Hashable], capacity: int) -> None:
        for oldest in list(islice(waiting, max(0, len(waiting) - capacity))):
            self._overflown.append((oldest, self._missing(oldest)))
            del self._waiting[oldest]

    def _missing(self, key: Hashable) -> list[str]:
        return [part for part in self.parts if part not in self._waiting[key].parts]

    def _finish(self, key: Hashable) -> None:
        del self._waiting[key]
        self._done[key] = None
        while len(self._done) > self.memory:
            self._done.popitem(last=False)
