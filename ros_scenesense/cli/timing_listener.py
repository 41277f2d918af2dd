"""Listens to the timings of a running graph."""

from __future__ import annotations

import argparse
import os
import time
from collections import deque
from collections.abc import Iterator

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from ros_scenesense.errors import ConversationError
from ros_scenesense.launcher.options import GraphOptions
from ros_scenesense.nodes.lean_node import LeanNode
from ros_scenesense.nodes.timing_watch import TimingWatch

_FIRST_S = 15.0


def listen(arguments: argparse.Namespace) -> Iterator[tuple[float, str, float]]:
    """What is heard: seconds since 1970, the step, its milliseconds.

    The time begins when the first step is heard, and ends with Ctrl-C at the latest.

    Args:
        arguments: Those of `launch.add_domain_arguments`, and `seconds`, 0 = until Ctrl-C.

    Raises:
        ConversationError: If nothing is heard.
        ParameterError: If an argument is wrong.
    """
    options = GraphOptions(
        namespace=arguments.namespace,
        domain_id=arguments.domain_id,
        discovery=arguments.discovery,
    )
    os.environ.update(options.environment())
    context = Context()
    context.init(args=[], domain_id=options.domain_id)
    node = LeanNode(
        f"timing_{os.getpid()}",
        namespace=options.namespace,
        context=context,
        use_global_arguments=False,
        start_parameter_services=False,
        enable_rosout=False,
    )
    heard: deque[tuple[float, str, float]] = deque()
    TimingWatch(node, lambda one: heard.append((time.time(), one.name, one.milliseconds)))
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        first_until = time.monotonic() + _FIRST_S
        until = None
        while until is None or time.monotonic() < until:
            executor.spin_once(timeout_sec=0.1)
            if until is None and heard:
                until = time.monotonic() + (arguments.seconds or float("inf"))
            if until is None and time.monotonic() > first_until:
                raise ConversationError(
                    f"no step of a graph in {options.namespace} is heard within {_FIRST_S:g} s: "
                    "start it with 'scenesense launch' and let it work, and give the --namespace, "
                    "--domain-id and --discovery that it has"
                )
            while heard:
                yield heard.popleft()
    except KeyboardInterrupt:
        yield from heard
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()
