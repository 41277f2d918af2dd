"""Asks a running node something, and waits for its answer: what commands and graph talk by."""

from __future__ import annotations

import argparse
import contextlib
import os
import time
from collections.abc import Callable
from typing import TypeVar

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String

from ros_scenesense.errors import ConversationError, MessageError, ParameterError
from ros_scenesense.launcher.options import GraphOptions
from ros_scenesense.messages.base import AnyMessage, HumanMessage
from ros_scenesense.messages.codec import decode, encode
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.nodes.audience import audience
from ros_scenesense.nodes.qos import profile_of

Answer = TypeVar("Answer", bound=AnyMessage)

_QUIET_S, _SETTLED_S = 0.3, 1.0


def ask(
    arguments: argparse.Namespace,
    request: HumanMessage,
    answer: type[Answer],
    is_answer: Callable[[Answer], bool],
) -> Answer:
    """Publishes a request once a node listens, and waits for the answer to it.

    Args:
        arguments: Those of `launch.add_domain_arguments`, and `timeout` in seconds.
        request: What is asked.
        answer: Message type of the answer.
        is_answer: Whether an answer is the one to this request.

    Raises:
        ConversationError: If no node listens, or none answers in time.
        ParameterError: If an argument is wrong.
        MessageError: If the request is no message that can be sent.
    """
    if not arguments.timeout > 0.0:
        raise ParameterError(f"--timeout is {arguments.timeout:g}, must be more than 0")
    options = GraphOptions(
        namespace=arguments.namespace,
        domain_id=arguments.domain_id,
        discovery=arguments.discovery,
    )
    payload = encode(request).decode()
    os.environ.update(options.environment())
    context = Context()
    context.init(args=[], domain_id=options.domain_id)
    try:
        node = Node(
            f"ask_{os.getpid()}",
            namespace=options.namespace,
            context=context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        return _converse(node, payload, type(request), answer, is_answer, arguments.timeout)
    finally:
        context.try_shutdown()


def _converse(
    node: Node,
    payload: str,
    request: type[AnyMessage],
    answer: type[Answer],
    is_answer: Callable[[Answer], bool],
    timeout_s: float,
) -> Answer:
    asked, answered = TOPICS[request], TOPICS[answer]
    answers: list[Answer] = []

    def take(received: String) -> None:
        with contextlib.suppress(MessageError):
            message = decode(received.data, answer)
            if is_answer(message):
                answers.append(message)

    publisher = node.create_publisher(String, asked.name, profile_of(asked.qos))
    node.create_subscription(String, answered.name, take, profile_of(answered.qos))
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def wait_for(condition: Callable[[], bool], seconds: float = timeout_s) -> bool:
        deadline = time.monotonic() + seconds
        while not condition():
            if time.monotonic() > deadline:
                return False
            executor.spin_once(timeout_sec=0.05)
        return True

    try:
        # Others may listen too, so it counts that the one is there who answers.
        if not wait_for(
            lambda: audience(node, publisher) > 0 and node.count_publishers(answered.name) > 0
        ):
            raise ConversationError(
                f"no node listens on {publisher.topic_name} within {timeout_s:g} s: start the "
                "graph with 'scenesense launch', and give the --namespace, --domain-id and "
                "--discovery that it has"
            )
        # A recorder is to hear it too, and is perhaps found a little later.
        wait_for(_stands_still(publisher.get_subscription_count), _SETTLED_S)
        publisher.publish(String(data=payload))
        if not wait_for(lambda: bool(answers)):
            raise ConversationError(
                f"no answer on '{answered.name}' within {timeout_s:g} s: see the log of the node, "
                "or give a longer --timeout"
            )
        return answers[0]
    finally:
        executor.shutdown()
        node.destroy_node()


def _stands_still(count: Callable[[], int]) -> Callable[[], bool]:
    """A condition that holds once a number has not changed for a while."""
    last, since = count(), time.monotonic()

    def holds() -> bool:
        nonlocal last, since
        now = count()
        if now != last:
            last, since = now, time.monotonic()
        return time.monotonic() - since >= _QUIET_S

    return holds
