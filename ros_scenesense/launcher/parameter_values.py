"""The parameter values that the nodes of a graph get: from the params YAML and from overrides.

All are checked here, before anything is started, and written to one file that the nodes read: what
was checked is what runs. (ROS itself would ignore a misspelt name, and lets a file win over `-p`.)
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from ros_scenesense.errors import ParameterError
from ros_scenesense.launcher.options import GraphOptions
from ros_scenesense.nodes.registry import NODES
from ros_scenesense.parameters import Parameter, parameters_of
from ros_scenesense.resources import resource
from ros_scenesense.stages.sessions import new_session

SIM_TIME = "use_sim_time"
ROS_PARAMETERS = (SIM_TIME, "start_type_description_service", "qos_overrides")
"""Parameters that every ROS node has; passed on as they are."""


_SIM_TIME = Parameter(SIM_TIME, bool, False, "whether the time is that of the topic /clock")


def parameter_values(options: GraphOptions) -> dict[str, dict[str, object]]:
    """The checked values per node.

    Raises:
        ParameterError: If the file cannot be read, or a name or value is wrong.
    """
    file = options.parameters_file or resource("config", "scenesense.yaml")
    sections = _read(file)
    for name in options.overrides:
        if name not in options.nodes:
            raise ParameterError(
                f"node '{name}' is not started, started are: {', '.join(options.nodes)}"
            )
    values = {}
    for node in options.nodes:
        given = _from_sections(sections, node, options.full_name(node), file)
        if options.state_dir is not None and "state_dir" in _declared(node):
            given["state_dir"] = str(options.state_dir.expanduser().absolute())
        if options.sim_time:
            given[SIM_TIME] = True
        given.update(options.overrides.get(node, {}))
        if "session" in _declared(node) and not given.get("session"):
            # A node that is restarted goes on with the session of its graph.
            given["session"] = new_session()
        values[node] = _checked(node, given)
    return values


def write_parameter_values(
    file: Path, options: GraphOptions, values: dict[str, dict[str, object]]
) -> None:
    """Writes the values as a params YAML, keyed by the full name of each node."""
    sections = {
        options.full_name(node): {"ros__parameters": given}
        for node, given in values.items()
        if given
    }
    file.write_text(yaml.safe_dump(sections, sort_keys=False))


def _read(file: Path) -> dict[str, dict[str, Any]]:
    try:
        document = yaml.safe_load(file.read_text()) or {}
    except (OSError, UnicodeError, yaml.YAMLError) as error:
        words = " ".join(str(error).split())
        raise ParameterError(f"params file {file} cannot be read: {words}") from error
    sections = {}
    for key, section in document.items() if isinstance(document, dict) else [("", None)]:
        values = section.get("ros__parameters") if isinstance(section, dict) else None
        if not isinstance(values, dict):
            raise ParameterError(
                f"params file {file}: section '{key}' must hold 'ros__parameters' with name: value"
            )
        sections[str(key)] = values
    return sections


def _from_sections(
    sections: dict[str, dict[str, Any]], node: str, full_name: str, file: Path
) -> dict[str, object]:
    given: dict[str, object] = {}
    for key, values in sections.items():
        if not _matches(key, node, full_name):
            continue
        of_this_node_alone = key.rpartition("/")[2] == node
        for name, value in values.items():
            if name in _declared(node) or name in ROS_PARAMETERS:
                given[name] = value
            elif of_this_node_alone:
                known = ", ".join(sorted(_declared(node)))
                raise ParameterError(
                    f"params file {file}: {node}: parameter '{name}' is unknown, known are: {known}"
                )
    return given


def _matches(key: str, node: str, full_name: str) -> bool:
    """Whether a section is the node's: by ROS's wildcards, or by the bare name of the node."""
    pattern = re.escape(key if key.startswith("/") else f"/{key}")
    pattern = pattern.replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")
    return key == node or re.fullmatch(pattern, full_name) is not None


def _checked(node: str, given: dict[str, object]) -> dict[str, object]:
    declared = _declared(node)
    checked = {}
    for name, value in given.items():
        if name in ROS_PARAMETERS:
            # The command line gives text, of which ROS would say that it is no boolean.
            checked[name] = _SIM_TIME.check(value) if name == SIM_TIME else value
            continue
        if name not in declared:
            known = ", ".join(sorted(declared))
            raise ParameterError(f"{node}: parameter '{name}' is unknown, known are: {known}")
        try:
            checked[name] = declared[name].check(value)
        except ParameterError as error:
            raise ParameterError(f"{node}: {error}") from error
    return checked


def _declared(node: str) -> dict[str, Any]:
    return {parameter.name: parameter for parameter in parameters_of(NODES[node].configuration())}
