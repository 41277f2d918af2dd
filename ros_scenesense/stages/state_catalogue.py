"""The state files that there are: who writes each, in which version, and what it remembers."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from dataclasses import dataclass

from ros_scenesense.stages import (
    attention_store,
    control_ledger,
    goal_ledger,
    grounding_store,
    learner_store,
    own_scenes,
    scene_ledger,
)

NETWORKS = "networks"
"""Folder of the networks that attention trained, beside its state file."""


@dataclass(frozen=True)
class StateFile:
    """A state file.

    Attributes:
        name: Of the file.
        node: Name of the node that writes it.
        version: Schema version that this release writes.
        purpose: What it remembers, for people.
        check: Raises `sqlite3.DatabaseError` if its content is not what its stage wrote.
    """

    name: str
    node: str
    version: int
    purpose: str
    check: Callable[[sqlite3.Connection], object] = lambda _connection: None


STATE_FILES = {
    file.name: file
    for file in (
        StateFile("camera.db", "simulated_camera", scene_ledger.VERSION, "scenes shown, actions"),
        StateFile(
            own_scenes.STATE_FILE, "grounding", own_scenes.VERSION, "numbers of its own scenes"
        ),
        StateFile(
            "grounding.db",
            "grounding",
            grounding_store.VERSION,
            "what prepositions mean",
            grounding_store.read_learned,
        ),
        StateFile(
            "control.db",
            "grounding_control",
            control_ledger.VERSION,
            "feedback, trust, evidence",
            control_ledger.check_content,
        ),
        StateFile("reasoner.db", "reasoner", goal_ledger.VERSION, "goals and what came of them"),
        StateFile("attention.db", "attention", attention_store.VERSION, "examples, networks"),
        StateFile(
            "learner.db",
            "axiom_learner",
            learner_store.VERSION,
            "labelled scenes, axioms",
            learner_store.check_content,
        ),
    )
}
"""By name of the file, in the order of the graph."""
