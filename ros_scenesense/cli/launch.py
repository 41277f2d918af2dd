"""Start the nodes of the graph, one process each, and keep them running until asked to stop."""

from __future__ import annotations

import argparse
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import platformdirs

from ros_scenesense.errors import ParameterError
from ros_scenesense.nodes.registry import DEFAULT_NODES, NODES

_EPILOG = """\
A node that dies, or gives no sign of life, is started again: after 0.1 s, then 0.2, 0.4, 0.8 and
1.6 s. When it dies more than 5 times within 60 s, or cannot start at all, everything is stopped and
the end of its log is shown. Ctrl-C (or SIGTERM) stops all nodes: SIGINT, after 5 s SIGTERM, after
3 s more SIGKILL. Exit code: 0 when asked to stop, 2 for a wrong value, 1 when a node failed.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense launch`."""
    parser.epilog = _EPILOG
    add_graph_arguments(parser)
    parser.add_argument(
        "--nodes",
        nargs="+",
        metavar="NODE",
        default=list(DEFAULT_NODES),
        help=f"start only these: {', '.join(NODES)}",
    )
    add_state_argument(parser)
    parser.add_argument(
        "--record",
        nargs="?",
        type=Path,
        metavar="DIR",
        const=Path("bags"),
        help="record the session into a bag in this folder (default: %(const)s); see "
        "`scenesense bag`",
    )
    parser.add_argument(
        "--remap",
        action="append",
        metavar="FROM:=TO",
        default=[],
        help="another name for a topic, e.g. of a camera driver's; may be repeated",
    )
    parser.add_argument(
        "--sim-time",
        action="store_true",
        help="take the time from the topic /clock, e.g. of `scenesense bag play --clock`",
    )
    parser.add_argument(
        "--silence",
        type=float,
        metavar="SECONDS",
        default=10.0,
        help="a ready node without heartbeat for so long is restarted (default: %(default)g)",
    )


def add_graph_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments that every command has that starts the graph."""
    parser.add_argument(
        "--params", type=Path, metavar="FILE", help="params YAML keyed by node (scenesense params)"
    )
    add_overrides_argument(parser)
    add_domain_arguments(parser)
    parser.add_argument(
        "--log-dir",
        type=Path,
        metavar="DIR",
        help="folder of the nodes' logs (default: a new one under "
        f"{platformdirs.user_log_path('scenesense', appauthor=False)})",
    )


def add_overrides_argument(parser: argparse.ArgumentParser) -> None:
    """Declares `-p`, which sets parameters of nodes."""
    parser.add_argument(
        "-p",
        dest="overrides",
        action="append",
        metavar="NODE.PARAMETER=VALUE",
        default=[],
        help="set one parameter, stronger than the params file; may be repeated",
    )


def add_domain_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments that say where the graph is: for all that start or talk to one."""
    parser.add_argument("--namespace", default="/scenesense", help="default: %(default)s")
    parser.add_argument(
        "--domain-id", type=int, metavar="ID", help="ROS domain (default: ROS_DOMAIN_ID, else 0)"
    )
    parser.add_argument(
        "--discovery",
        metavar="RANGE",
        help="LOCALHOST or SUBNET (default: ROS_AUTOMATIC_DISCOVERY_RANGE, else LOCALHOST)",
    )


def add_state_argument(
    parser: argparse.ArgumentParser, words: str = "state folder of the graph"
) -> None:
    """Declares where the nodes remember: for all that start them, or look at what they know."""
    parser.add_argument(
        "--state",
        type=Path,
        metavar="DIR",
        default=platformdirs.user_state_path("scenesense", appauthor=False),
        help=f"{words} (default: %(default)s)",
    )


def add_timeout_argument(
    parser: argparse.ArgumentParser, seconds: float = 10.0, then: str = "to answer"
) -> None:
    """Declares how long to wait for a node: for all that ask one."""
    parser.add_argument(
        "--timeout",
        type=float,
        metavar="SECONDS",
        default=seconds,
        help=f"time for a node to be found, and then {then} (default: %(default)g)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Runs the graph until SIGINT or SIGTERM."""
    # Imports ROS: not for `--help`.
    from ros_scenesense.launcher import Graph, GraphOptions
    from ros_scenesense.launcher.options import with_recorder

    options = GraphOptions(
        nodes=tuple(arguments.nodes),
        state_dir=arguments.state,
        remaps=tuple(arguments.remap),
        sim_time=arguments.sim_time,
        silence_s=arguments.silence,
        **graph_options(arguments),
    )
    if arguments.record is not None:
        options = with_recorder(options, arguments.record)
        print(f"the session is recorded into a bag in {arguments.record}", flush=True)
    with stop_requests() as requests:
        graph = Graph(options, report=lambda line: print(line, flush=True))
        print(f"logs are in {graph.log_dir}", flush=True)
        with graph:
            while not requests:
                graph.poll(0.2)
        print("all nodes are stopped", flush=True)
    return 0


def graph_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The fields of `GraphOptions` that `add_graph_arguments` declares.

    Raises:
        ParameterError: If an override is not written as node.parameter=value.
    """
    return {
        "namespace": arguments.namespace,
        "domain_id": arguments.domain_id,
        "discovery": arguments.discovery,
        "parameters_file": arguments.params,
        "overrides": parse_overrides(arguments.overrides),
        "log_dir": arguments.log_dir,
    }


def parse_overrides(words: Sequence[str]) -> dict[str, dict[str, object]]:
    """Values per node and parameter from words `node.parameter=value`.

    Raises:
        ParameterError: If a word is written in another way.
    """
    overrides: dict[str, dict[str, object]] = {}
    for word in words:
        target, equals, value = word.partition("=")
        node, dot, name = target.partition(".")
        if not (equals and dot and node and name):
            raise ParameterError(f"-p {word}: must be written as node.parameter=value")
        overrides.setdefault(node, {})[name] = value
    return overrides


@contextmanager
def stop_requests() -> Iterator[list[int]]:
    """Collects SIGINT and SIGTERM instead of dying of them, so that stopping is orderly."""
    received: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda got, _frame: received.append(got)) for number in numbers]
    try:
        yield received
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
