"""Starts the graph with `ros2 launch ros_scenesense scenesense.launch.py`.

For people with a full ROS 2; without one, `scenesense launch` does the same, and also restarts what
dies. Nodes, namespace and Fast DDS profile are the launcher's own.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.conditions import IfCondition
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import Node

from ros_scenesense.nodes.registry import NODES
from ros_scenesense.resources import resource

PROFILE_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"


def generate_launch_description() -> LaunchDescription:
    """One process per node, all in one namespace, with one params file."""
    profile = EnvironmentVariable(
        PROFILE_VARIABLE, default_value=str(resource("config", "fastdds_profile.xml"))
    )
    arguments = [
        DeclareLaunchArgument(
            "namespace", default_value="/scenesense", description="namespace of nodes and topics"
        ),
        DeclareLaunchArgument(
            "params_file",
            default_value=str(resource("config", "scenesense.yaml")),
            description="params YAML, keyed by node",
        ),
        DeclareLaunchArgument(
            "domain",
            default_value=EnvironmentVariable("ROS_DOMAIN_ID", default_value="0"),
            description="ROS domain id",
        ),
        DeclareLaunchArgument(
            "record", default_value="false", description="whether to record the session into a bag"
        ),
    ]
    environment = [
        SetEnvironmentVariable(PROFILE_VARIABLE, profile),
        SetEnvironmentVariable("ROS_DOMAIN_ID", LaunchConfiguration("domain")),
    ]
    nodes = [
        Node(
            package="ros_scenesense",
            executable=name,
            name=name,
            namespace=LaunchConfiguration("namespace"),
            parameters=[LaunchConfiguration("params_file")],
            output="screen",
            respawn=True,
            respawn_delay=1.0,
            condition=IfCondition(LaunchConfiguration("record")) if entry.asked_for else None,
        )
        for name, entry in NODES.items()
    ]
    return LaunchDescription([*arguments, *environment, *nodes])
