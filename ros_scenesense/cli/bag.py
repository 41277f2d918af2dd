"""Bags: record a session of the graph, tell what a recording holds, repair it, play it."""

from __future__ import annotations

import argparse
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.table import Table

from ros_scenesense.cli.console import plain_console
from ros_scenesense.cli.launch import add_domain_arguments, add_state_argument, stop_requests
from ros_scenesense.errors import BagError, ParameterError
from ros_scenesense.nodes.registry import RECORDER

if TYPE_CHECKING:
    from ros_scenesense.bags.lockstep import Comparison
    from ros_scenesense.bags.reading import BagDescription

_EPILOG = """\
`play --inputs` plays what the camera and people said to a graph without a camera: `scenesense
launch --nodes grounding grounding_control reasoner attention axiom_learner`. With --lockstep each
scene waits for the decisions about the one before, and these are compared with the recorded ones.
Exit code: 0, 3 where decisions differ or did not come, 2 for a wrong value, 1 for any other error.
"""
_DIFFERENT = 3
_SHOWN = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares `scenesense bag record|info|play|repair`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    _add_record(actions.add_parser("record", help="record a running graph until Ctrl-C"))
    for name, words in (
        ("info", "what a bag holds"),
        ("repair", "make a bag whole whose recorder was killed"),
        ("play", "publish the messages of a bag again"),
    ):
        action = actions.add_parser(name, help=words, description=words)
        action.add_argument("bag", type=Path, metavar="BAG", help="folder of the bag")
        if name == "play":
            _add_play(action)


def run(arguments: argparse.Namespace) -> int:
    """Does what was asked."""
    console = plain_console()
    return {"record": _record, "info": _info, "repair": _repair, "play": _play}[arguments.action](
        arguments, console
    )


def _add_record(action: argparse.ArgumentParser) -> None:
    action.add_argument(
        "topics", nargs="*", metavar="TOPIC", help="only these, e.g. `timing/*` (default: all)"
    )
    action.add_argument(
        "--out", type=Path, metavar="DIR", default=Path("bags"), help="default: %(default)s"
    )
    action.add_argument(
        "--leave-out", action="append", metavar="TOPIC", default=[], help="may be repeated"
    )
    action.add_argument("--storage", metavar="FORMAT", default="mcap", help="mcap or sqlite3")
    action.add_argument("--compress", action="store_true", help="compress the chunks of mcap")
    words = "state folder of the graph, of which the bag gets a copy"
    add_state_argument(action, words)
    add_domain_arguments(action)


def _add_play(action: argparse.ArgumentParser) -> None:
    action.add_argument("--rate", type=float, default=1.0, help="times faster (default: 1)")
    action.add_argument(
        "--loop", type=int, metavar="N", default=1, help="so often; 0 = until Ctrl-C (default: 1)"
    )
    action.add_argument(
        "--topic", action="append", metavar="TOPIC", default=[], help="only these; may be repeated"
    )
    action.add_argument(
        "--leave-out", action="append", metavar="TOPIC", default=[], help="may be repeated"
    )
    action.add_argument(
        "--clock",
        nargs="?",
        type=float,
        metavar="HZ",
        const=100.0,
        default=0.0,
        help="publish /clock, for nodes with use_sim_time (default: 100 Hz)",
    )
    action.add_argument(
        "--inputs", action="store_true", help="only what the camera and people said"
    )
    action.add_argument(
        "--lockstep", action="store_true", help="scene by scene, each after the decisions before"
    )
    action.add_argument(
        "--timeout",
        type=float,
        metavar="SECONDS",
        default=30.0,
        help="time for the decisions about a scene, with --lockstep (default: %(default)g)",
    )
    add_domain_arguments(action)


def _record(arguments: argparse.Namespace, console: Console) -> int:
    from ros_scenesense.launcher import Graph, GraphOptions

    folder = arguments.out.expanduser().absolute()
    given = {
        "bag_dir": str(folder),
        "autostart": True,
        "storage": arguments.storage,
        "compression": "zstd" if arguments.compress else "none",
        "topics": ",".join(arguments.topics),
        "leave_out": ",".join(arguments.leave_out),
    }
    options = GraphOptions(
        nodes=(RECORDER,),
        namespace=arguments.namespace,
        domain_id=arguments.domain_id,
        discovery=arguments.discovery,
        state_dir=arguments.state if arguments.state.expanduser().is_dir() else None,
        overrides={RECORDER: given},
    )
    before = set(_bags(folder))
    with stop_requests() as requests:
        with Graph(options, report=lambda line: print(line, flush=True)) as graph:
            while not requests:
                graph.poll(0.2)
        made = [bag for bag in _bags(folder) if bag not in before]
    for bag in made:
        _tell(bag, console)
    return 0


def _info(arguments: argparse.Namespace, console: Console) -> int:
    from ros_scenesense.bags.reading import describe

    described = describe(arguments.bag)
    table = Table(box=box.SIMPLE_HEAD, show_edge=False)
    for column in ("topic", "type", "messages", "per second"):
        table.add_column(column, justify="left" if column in ("topic", "type") else "right")
    seconds = described.duration_ns / 1e9
    for topic in described.topics:
        rate = f"{topic.messages / seconds:.1f}" if topic.messages > 1 and seconds else "-"
        table.add_row(topic.name, topic.type, str(topic.messages), rate)
    console.print(table)
    begun = datetime.fromtimestamp(described.start_ns / 1e9, UTC)
    console.print(f"begun     {begun:%Y-%m-%d %H:%M:%S} UTC, {seconds:.1f} s")
    console.print(
        f"holds     {described.messages} messages, {described.size_bytes / 1e6:.1f} MB of "
        f"{described.storage}: {', '.join(described.files)}"
    )
    if described.state is not None:
        console.print(f"state     {described.state}")
    for topic_name, count in described.dropped.items():
        console.print(f"dropped   {count} on {topic_name}")
    for name in ("ended", "repaired"):
        if name in described.notes:
            console.print(f"{name:9} {described.notes[name]}")
    return 0


def _repair(arguments: argparse.Namespace, console: Console) -> int:
    from ros_scenesense.bags.repair import repair

    done = repair(arguments.bag)
    if done is None:
        console.print(f"{arguments.bag} is whole")
        return 0
    console.print(
        f"{arguments.bag} is whole again: {done.messages} messages; {done.saved} files were cut "
        f"off, {done.sound} were sound"
    )
    return 0


def _play(arguments: argparse.Namespace, console: Console) -> int:
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node

    from ros_scenesense.bags.inputs import Inputs
    from ros_scenesense.bags.lockstep import Lockstep
    from ros_scenesense.bags.playing import Player, PlayOptions
    from ros_scenesense.bags.reading import describe
    from ros_scenesense.launcher import GraphOptions
    from ros_scenesense.nodes.topic_watch import TopicChoice

    _check_play(arguments)
    options = GraphOptions(
        namespace=arguments.namespace,
        domain_id=arguments.domain_id,
        discovery=arguments.discovery,
    )
    bag = describe(arguments.bag)
    choice = TopicChoice(arguments.namespace, tuple(arguments.topic), tuple(arguments.leave_out))
    inputs = Inputs(arguments.namespace)
    topics = [topic.name for topic in bag.topics if choice.takes(topic.name)]
    if arguments.inputs:
        topics = [name for name in topics if name in inputs.topics]
    os.environ.update(options.environment())
    context = Context()
    context.init(args=[], domain_id=options.domain_id)
    executor = SingleThreadedExecutor(context=context)
    node = Node(
        f"player_{os.getpid()}",
        namespace=options.namespace,
        context=context,
        use_global_arguments=False,
        start_parameter_services=False,
        enable_rosout=False,
    )
    executor.add_node(node)
    try:
        with stop_requests() as requests:
            play = PlayOptions(arguments.rate, arguments.loop, arguments.clock)
            player = Player(node, executor, bag, topics, play, lambda: bool(requests))
            for topic, reason in player.skipped.items():
                console.print(f"not played: {topic}: {reason}")
            if arguments.lockstep:
                lockstep = Lockstep(node, player, bag, inputs, arguments.timeout)
                return _tell_comparison(lockstep.run(), console)
            player.wait_for_quiet()
            player.play()
            console.print(f"{player.published} messages played")
        return 0
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()


def _check_play(arguments: argparse.Namespace) -> None:
    for name, value in (("--rate", arguments.rate), ("--timeout", arguments.timeout)):
        if not 0.0 < value < float("inf"):
            raise ParameterError(f"{name} is {value:g}, must be more than 0")
    if not 0.0 <= arguments.clock <= 1000.0:
        raise ParameterError(f"--clock is {arguments.clock:g} Hz, must be from 0 to 1000")
    if arguments.loop < 0:
        raise ParameterError(f"--loop is {arguments.loop}, must be at least 0")
    if arguments.lockstep and not arguments.inputs:
        raise ParameterError("--lockstep: only with --inputs, there is nothing to wait for else")
    if arguments.inputs and arguments.loop != 1:
        raise ParameterError("--loop: not with --inputs, as a graph decides each scene once")


def _tell_comparison(comparison: Comparison, console: Console) -> int:
    for scene_id, words in list(comparison.different.items())[:_SHOWN]:
        console.print(f"{scene_id} is decided otherwise: {words}")
    for scene_id in comparison.undecided[:_SHOWN]:
        console.print(f"{scene_id} got no decision in time")
    same, different = len(comparison.same), len(comparison.different)
    played = same + different + len(comparison.undecided) + len(comparison.new)
    console.print(
        f"{played} scenes played: {same} decided as recorded, {different} otherwise, "
        f"{len(comparison.undecided)} not in time, {len(comparison.new)} with none recorded"
    )
    if comparison.other_revisions:
        console.print(
            f"{len(comparison.other_revisions)} scenes were decided with other knowledge, trust or "
            "another network: give the graph the state of the bag, see `scenesense state import`"
        )
    return _DIFFERENT if comparison.different or comparison.undecided else 0


def _tell(bag: Path, console: Console) -> None:
    from ros_scenesense.bags.reading import describe

    try:
        described: BagDescription = describe(bag)
    except BagError as error:
        console.print(str(error))
        return
    dropped = sum(described.dropped.values())
    console.print(
        f"{bag}: {described.messages} messages, {described.size_bytes / 1e6:.1f} MB, {dropped} "
        "dropped"
    )


def _bags(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("bag-*") if path.is_dir())
