"""The nodes of the graph, as data: a node more is one entry more. Imports no ROS."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

RECORDER = "recorder"
LAUNCHER_VARIABLE = "SCENESENSE_LAUNCHER_PID"
"""Environment variable with the process id of the launcher; a node ends when it is gone."""


@dataclass(frozen=True)
class NodeEntry:
    """A node of the graph; its module `ros_scenesense.nodes.<name>` has `main()`.

    Attributes:
        name: Name of the node, and of its section in the params YAML.
        configuration_path: `module:class` of the dataclass that declares its parameters.
        purpose: What the node does, for people.
        asked_for: Whether it is only started when somebody asks for it.
    """

    name: str
    configuration_path: str
    purpose: str
    asked_for: bool = False

    @property
    def module(self) -> str:
        """The module that runs the node."""
        return f"ros_scenesense.nodes.{self.name}"

    def configuration(self) -> type[Any]:
        """The configuration, imported when somebody asks."""
        module, _, name = self.configuration_path.partition(":")
        configuration: type[Any] = getattr(importlib.import_module(module), name)
        return configuration


_ALL = [
    NodeEntry(
        "simulated_camera",
        "ros_scenesense.stages.simulated_camera:SimulatedCameraConfiguration",
        "shows simulated RGB-D scenes with their labels",
    ),
    NodeEntry(
        "grounding",
        "ros_scenesense.nodes.configurations:GroundingNodeConfiguration",
        "turns RGB-D frames into objects and spatial relations",
    ),
    NodeEntry(
        "grounding_control",
        "ros_scenesense.stages.grounding_control:GroundingControlConfiguration",
        "settles on one relation per pair of objects",
    ),
    NodeEntry(
        "reasoner",
        "ros_scenesense.stages.reasoner:ReasonerConfiguration",
        "decides stability and occlusion with an answer-set program",
    ),
    NodeEntry(
        "attention",
        "ros_scenesense.nodes.configurations:AttentionNodeConfiguration",
        "looks where reasoning is undecided, and makes the final decisions",
    ),
    NodeEntry(
        "axiom_learner",
        "ros_scenesense.stages.axiom_learner:AxiomLearnerConfiguration",
        "learns axioms from labelled scenes, strengthens and forgets them",
    ),
    NodeEntry(
        RECORDER,
        "ros_scenesense.stages.recorder:RecorderConfiguration",
        "writes all topics into bags, which any ROS 2 tool reads",
        asked_for=True,
    ),
]

NODES: dict[str, NodeEntry] = {entry.name: entry for entry in _ALL}
"""All nodes in the order in which the launcher starts them."""

DEFAULT_NODES = tuple(name for name, entry in NODES.items() if not entry.asked_for)
"""The nodes that are started when nobody says which."""
