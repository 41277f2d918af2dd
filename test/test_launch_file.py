"""The launch file builds its description, checked with stand-ins for ROS's launch packages.

There are no wheels of them; the stand-ins only keep what they are given.
"""

import runpy
import sys
import types
from pathlib import Path

import pytest

from ros_scenesense.nodes.registry import NODES

LAUNCH_FILE = Path(__file__).parent.parent / "launch" / "scenesense.launch.py"


def kept(name: str) -> type:
    def __init__(self, *arguments, **options):  # noqa: N807
        self.arguments, self.options = arguments, options

    return type(name, (), {"__init__": __init__})


@pytest.fixture
def description(monkeypatch):
    modules = {
        "launch": ["LaunchDescription"],
        "launch.actions": ["DeclareLaunchArgument", "SetEnvironmentVariable"],
        "launch.conditions": ["IfCondition"],
        "launch.substitutions": ["EnvironmentVariable", "LaunchConfiguration"],
        "launch_ros": [],
        "launch_ros.actions": ["Node"],
    }
    for module_name, names in modules.items():
        module = types.ModuleType(module_name)
        for name in names:
            setattr(module, name, kept(name))
        monkeypatch.setitem(sys.modules, module_name, module)
    described = runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]()
    return described.arguments[0]


def named(description, kind: str) -> list:
    return [entity for entity in description if type(entity).__name__ == kind]


def test_every_node_is_started_by_its_executable(description):
    nodes = named(description, "Node")
    assert [node.options["executable"] for node in nodes] == list(NODES)
    assert {node.options["package"] for node in nodes} == {"ros_scenesense"}
    for node in nodes:
        assert node.options["namespace"].arguments == ("namespace",)
        assert node.options["parameters"][0].arguments == ("params_file",)


def test_the_recorder_is_started_when_asked_for(description):
    conditions = {
        node.options["executable"]: node.options["condition"] for node in named(description, "Node")
    }
    (asked,) = conditions.pop("recorder").arguments
    assert asked.arguments == ("record",)
    assert set(conditions.values()) == {None}


def test_arguments_and_environment(description):
    declared = {argument.arguments[0] for argument in named(description, "DeclareLaunchArgument")}
    assert declared == {"namespace", "params_file", "domain", "record"}
    set_ = {entity.arguments[0] for entity in named(description, "SetEnvironmentVariable")}
    assert set_ == {"FASTRTPS_DEFAULT_PROFILES_FILE", "ROS_DOMAIN_ID"}


def test_default_files_exist(description):
    for argument in named(description, "DeclareLaunchArgument"):
        if argument.arguments[0] == "params_file":
            assert Path(argument.options["default_value"]).is_file()
