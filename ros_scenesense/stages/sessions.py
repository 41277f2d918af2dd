"""Names of sessions: the first part of every scene id."""

from __future__ import annotations

import secrets
import time


def new_session() -> str:
    """A name for a session that no other one has."""
    return f"{time.strftime('%Y%m%dT%H%M%S')}-{secrets.token_hex(2)}"


def session_of(scene_id: str) -> str:
    """The session of a scene id `<session>-<index>`."""
    return scene_id.rpartition("-")[0]
