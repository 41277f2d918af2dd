"""A self-test of the ROS installation: do two participants find each other and pass a message?

`scenesense check` runs it in a process of its own.
"""

from __future__ import annotations

import os
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import String

TIMEOUT_S = 15.0


def main() -> None:
    """Prints how long the message took; exits with the reason if it never came."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    topic = f"/scenesense_check_{os.getpid()}"
    contexts = [rclpy.Context(), rclpy.Context()]
    for context in contexts:
        rclpy.init(args=[], context=context)
    talker = rclpy.create_node("scenesense_check_talker", context=contexts[0])
    listener = rclpy.create_node("scenesense_check_listener", context=contexts[1])
    heard: list[str] = []
    listener.create_subscription(String, topic, lambda message: heard.append(message.data), 1)
    publisher = talker.create_publisher(String, topic, 1)
    executor = SingleThreadedExecutor(context=contexts[1])
    executor.add_node(listener)

    start = time.monotonic()
    while not heard and time.monotonic() - start < TIMEOUT_S:
        publisher.publish(String(data="hello"))
        executor.spin_once(timeout_sec=0.05)
    took_s = time.monotonic() - start

    executor.shutdown()
    for node, context in zip((talker, listener), contexts, strict=True):
        node.destroy_node()
        rclpy.shutdown(context=context)
    if not heard:
        raise SystemExit(f"two participants did not find each other within {TIMEOUT_S:g} s")
    print(f"two participants found each other in {took_s:.1f} s")
