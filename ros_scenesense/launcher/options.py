"""What to start and how: the options of a graph, and the environment its processes share."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from rclpy.exceptions import InvalidNamespaceException, InvalidTopicNameException
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_topic_name import validate_topic_name

from ros_scenesense.errors import ParameterError
from ros_scenesense.nodes.registry import DEFAULT_NODES, NODES, RECORDER
from ros_scenesense.resources import resource

DISCOVERY_VARIABLE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
DISCOVERY_RANGES = ("LOCALHOST", "SUBNET")
LARGEST_DOMAIN_ID = 232


@dataclass(frozen=True)
class GraphOptions:
    """What to start and how.

    Attributes:
        nodes: Names of the nodes to start.
        namespace: Namespace of nodes and topics.
        domain_id: ROS domain; None = that of the environment.
        discovery: `LOCALHOST` or `SUBNET`; None = that of the environment, else `LOCALHOST`.
        parameters_file: Params YAML; None = the shipped one.
        overrides: Values per node and parameter, stronger than the file; text is converted.
        remaps: Other names for topics or services, each `FROM:=TO`, for all nodes.
        sim_time: Whether the time is that of the topic `/clock`.
        state_dir: Folder that the nodes remember in; None = what the parameters say.
        log_dir: Folder of the nodes' logs; None = a new one among the user's state files.
        silence_s: A ready node without heartbeat for so long is restarted.

    Raises:
        ParameterError: If a value is wrong.
    """

    nodes: tuple[str, ...] = DEFAULT_NODES
    namespace: str = "/scenesense"
    domain_id: int | None = None
    discovery: str | None = None
    parameters_file: Path | None = None
    overrides: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    remaps: tuple[str, ...] = ()
    sim_time: bool = False
    state_dir: Path | None = None
    log_dir: Path | None = None
    silence_s: float = 10.0

    def __post_init__(self) -> None:
        for name in self.nodes:
            if name not in NODES:
                raise ParameterError(f"node '{name}' is unknown, known are: {', '.join(NODES)}")
        try:
            validate_namespace(self.namespace)
        except InvalidNamespaceException as error:
            words = str(error).splitlines()[0]
            raise ParameterError(f"namespace '{self.namespace}' is wrong: {words}") from error
        for remap in self.remaps:
            _check_remap(remap)
        if self.domain_id is not None and not 0 <= self.domain_id <= LARGEST_DOMAIN_ID:
            raise ParameterError(
                f"domain id is {self.domain_id}, must be an integer from 0 to {LARGEST_DOMAIN_ID}"
            )
        if self.discovery not in (None, *DISCOVERY_RANGES):
            raise ParameterError(
                f"discovery is '{self.discovery}', must be one of {', '.join(DISCOVERY_RANGES)}"
            )
        if not self.silence_s >= 1.0:
            raise ParameterError(f"silence is {self.silence_s:g} s, must be a number of at least 1")

    def full_name(self, node: str) -> str:
        """Name of a node with its namespace."""
        return f"{self.namespace.rstrip('/')}/{node}"

    def environment(self) -> dict[str, str]:
        """The variables that every process of the graph needs, this one too.

        What the user has set stays, unless an option says otherwise.
        """
        variables = {DISCOVERY_VARIABLE: self.discovery or _given(DISCOVERY_VARIABLE, "LOCALHOST")}
        if self.domain_id is not None:
            variables["ROS_DOMAIN_ID"] = str(self.domain_id)
        if "FASTDDS_DEFAULT_PROFILES_FILE" not in os.environ:
            profile = str(resource("config", "fastdds_profile.xml"))
            variable = "FASTRTPS_DEFAULT_PROFILES_FILE"
            variables[variable] = _given(variable, profile)
        return variables


def with_recorder(options: GraphOptions, folder: Path) -> GraphOptions:
    """The same graph with a recorder, which writes a bag into this folder from the start on."""
    given = dict(options.overrides)
    chosen: dict[str, object] = {"bag_dir": str(folder.expanduser().absolute()), "autostart": True}
    given[RECORDER] = {**chosen, **given.get(RECORDER, {})}
    others = tuple(name for name in options.nodes if name != RECORDER)
    # It starts first, so that it misses nothing.
    return replace(options, nodes=(RECORDER, *others), overrides=given)


def _check_remap(remap: str) -> None:
    names = remap.split(":=")
    try:
        if len(names) != 2:
            raise ValueError("it must be written FROM:=TO")
        for name in names:
            validate_topic_name(name)
    except (ValueError, InvalidTopicNameException) as error:
        words = str(error).splitlines()[0]
        raise ParameterError(f"remapping '{remap}' is wrong: {words}") from error


def _given(variable: str, otherwise: str) -> str:
    return os.environ.get(variable) or otherwise
