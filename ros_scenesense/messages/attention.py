"""Regions of interest, final estimates and the examples that learning starts from."""

from __future__ import annotations

from typing import Literal

from ros_scenesense.messages.base import Count, Name, Part, Probability, SceneMessage
from ros_scenesense.scene import Task


class Roi(Part, frozen=True):
    """A region of interest: its pixels (left, top, width, height), objects, task and why."""

    task: Task
    left: Count
    top: Count
    width: Count
    height: Count
    objects: list[Name]
    targets: list[Name]
    axioms: list[Name]
    relations: list[Name]


class Rois(SceneMessage, frozen=True, tag="rois/1"):
    """The regions that attention selected in a scene."""

    knowledge_revision: Name
    rois: list[Roi]


EstimateSource = Literal["reasoning", "default", "network", "none", "timeout"]


class Estimate(Part, frozen=True):
    """A final decision with its source; None = no decision. `probability` is that of `value`.

    The source of no decision is `timeout` where the solver or the network took too long, else
    `none`.
    """

    value: bool | None
    source: EstimateSource
    probability: Probability | None = None


class ObjectEstimate(Part, frozen=True):
    """Final decisions about one object."""

    name: Name
    stable: Estimate
    occluded: Estimate


class StructureEstimate(Part, frozen=True):
    """Final decision about one structure, keyed by its sorted members."""

    members: list[Name]
    stable: Estimate


class Estimates(SceneMessage, frozen=True, tag="estimates/1"):
    """The final decisions about a scene; the camera paces itself by them."""

    objects: list[ObjectEstimate]
    structures: list[StructureEstimate]
    knowledge_revision: Name
    trust_revision: Count
    network_revision: Name | None = None


class Example(Part, frozen=True):
    """A labelled literal that reasoning left undecided or got wrong."""

    task: Task
    target: Name
    label: bool
    objects: list[Name]
    reason: Literal["undecided", "inconsistent", "timed_out", "wrong", "unexpected_outcome"]


class Examples(SceneMessage, frozen=True, tag="examples/1"):
    """The examples of one scene, for the networks and for the axiom learner."""

    knowledge_revision: Name
    examples: list[Example]
