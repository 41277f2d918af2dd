"""Learned axioms, what people ask about them, and the progress of long jobs."""

from __future__ import annotations

from typing import Literal

from ros_scenesense.messages.base import (
    Count,
    HumanMessage,
    Identifier,
    Message,
    Name,
    Part,
    Probability,
    Text,
)


class LearnedAxiom(Part, frozen=True):
    """An axiom with its record: AL text, strength, support and purity (0 to 1), age in cycles."""

    id: Name
    text: Text
    kind: Literal["normal", "default"]
    strength: Probability
    support: Probability
    purity: Probability
    age: Count
    pinned: bool = False


class Axioms(Message, frozen=True, tag="axioms/1"):
    """State: the learned axioms. `refuted` lists given axioms that experience put out of force."""

    revision: Count
    cycle: Count
    axioms: list[LearnedAxiom]
    refuted: list[Name] = []


class AxiomRequest(HumanMessage, frozen=True, tag="axiom_request/1"):
    """A person pins, vetoes or accepts a learned axiom."""

    axiom: Name
    request: Literal["pin", "veto", "accept"]


class AxiomResult(Message, frozen=True, tag="axiom_result/1"):
    """What became of an axiom request."""

    id: Identifier
    axiom: Name
    outcome: Literal["done", "refused"]
    reason: Text


class JobProgress(Message, frozen=True, tag="job_progress/1"):
    """Progress of a training or learning job, from 0 to 1."""

    job_id: Identifier
    node: Name
    state: Literal["running", "done", "failed"]
    progress: Probability
    text: Text = ""
