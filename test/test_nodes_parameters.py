"""Parameters as ROS sees them: described, converted, checked with one clear line."""

from dataclasses import dataclass

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from ros_scenesense.cli.params import params_file
from ros_scenesense.errors import ParameterError
from ros_scenesense.nodes.parameters import declare_configuration
from ros_scenesense.nodes.registry import NODES
from ros_scenesense.parameters import parameter
from ros_scenesense.resources import resource


@dataclass(frozen=True)
class Settings:
    ratio: float = parameter(0.5, "a ratio", minimum=0.0, maximum=10.0)
    count: int = parameter(3, "a count", minimum=1)
    level: float = parameter(0.0, "a level", maximum=4.0)
    kind: str = parameter("a", "a kind", choices=("a", "b"))
    text: str = parameter("", "any text")
    switch: bool = parameter(True, "a switch")


def test_defaults(ros_room):
    assert declare_configuration(ros_room.add(Node, "tested"), Settings) == Settings()


def test_given_values_are_converted(ros_room):
    # A params YAML says 5 for 5.0.
    node = ros_room.add(Node, "tested", ratio=5, count=7, kind="b", text="x", switch=False)
    assert declare_configuration(node, Settings) == Settings(5.0, 7, 0.0, "b", "x", False)
    assert isinstance(node.get_parameter("ratio").value, float)


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("ratio", 11.0, "a number from 0 to 10"),
        ("ratio", "half", "a number from 0 to 10"),
        ("ratio", [0.1, 0.2], "a number from 0 to 10"),
        ("count", 0, "an integer of at least 1"),
        ("count", 2.5, "an integer of at least 1"),
        ("kind", "c", "one of"),
        ("text", 5, "a string"),
        ("switch", 1, "true or false"),
    ],
)
def test_wrong_values_name_parameter_and_range(ros_room, name, value, allowed):
    node = ros_room.add(Node, "tested", **{name: value})
    with pytest.raises(ParameterError, match=allowed) as refused:
        declare_configuration(node, Settings)
    assert f"'{name}'" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_descriptors_tell_meaning_and_range(ros_room):
    node = ros_room.add(Node, "tested")
    declare_configuration(node, Settings)
    ratio = node.describe_parameter("ratio")
    assert ratio.description == "a ratio"
    assert (ratio.floating_point_range[0].from_value, ratio.floating_point_range[0].to_value) == (
        0.0,
        10.0,
    )
    assert node.describe_parameter("count").integer_range[0].from_value == 1
    assert node.describe_parameter("level").floating_point_range[0].to_value == 4.0
    assert "one of a, b" in node.describe_parameter("kind").additional_constraints


def test_they_are_set_at_start_only(ros_room):
    node = ros_room.add(Node, "tested")
    declare_configuration(node, Settings)
    [answer] = node.set_parameters([Parameter("count", value=9)])
    assert not answer.successful
    assert node.get_parameter("count").value == 3


def test_the_shipped_file_has_every_parameter_with_its_default():
    text = resource("config", "scenesense.yaml").read_text()
    assert text == params_file(list(NODES)), "run: scenesense params > config/scenesense.yaml"


@pytest.mark.parametrize("name", list(NODES))
def test_every_parameter_takes_its_default(ros_room, name):
    configuration = NODES[name].configuration()
    assert declare_configuration(ros_room.add(Node, "tested"), configuration) == configuration()
