"""Runs one node until it is asked to stop: the `main` of every node."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor

from ros_scenesense.errors import ParameterError, SceneSenseError
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.registry import LAUNCHER_VARIABLE


def run(name: str, make_node: Callable[[], StageNode]) -> int:
    """Initialises ROS, spins the node, shuts down.

    Args:
        name: Begins the one line on the standard error that says why a node does not start.
        make_node: Makes the node once ROS is initialised.

    Returns:
        0 when asked to stop (SIGINT, SIGTERM), 2 for a wrong parameter, 1 if it cannot start.
    """
    node: StageNode | None = None
    _take_one_core()
    try:
        _initialise()
        node = make_node()
        _end_with_launcher(node)
        # What is there now stays: collecting garbage among it would only pause the node.
        gc.collect()
        gc.freeze()
        # Measured: one thread lost no message at 200 Hz, the multi-threaded executor half of them.
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while rclpy.ok():
            _spin_once(executor, node)
        return 0
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    except SceneSenseError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 2 if isinstance(error, ParameterError) else 1
    except Exception:
        # A signal while the node is being built invalidates its context under its feet.
        if rclpy.ok():
            raise
        return 0
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()


def _take_one_core() -> None:
    """Keeps the libraries of this process and of its worker to one thread, unless it is said.

    The nodes share few cores. Threads of one library that wait for each other while other nodes
    work burn what these need: on two busy cores a network was trained ten times slower with two
    threads than with one, and scenes waited behind it for half a minute.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")


def _spin_once(executor: SingleThreadedExecutor, node: StageNode) -> None:
    try:
        executor.spin_once()
    except ExternalShutdownException:
        raise
    except Exception as error:
        if not rclpy.ok():
            raise
        node.internal_error(error)


def _end_with_launcher(node: StageNode) -> None:
    launcher = os.environ.get(LAUNCHER_VARIABLE)
    if launcher is None:
        return

    def check() -> None:
        if str(os.getppid()) != launcher:
            node.get_logger().warning("the launcher is gone: ending")
            rclpy.try_shutdown()

    node.create_timer(1.0, check, clock=Clock(clock_type=ClockType.STEADY_TIME))


def _initialise() -> None:
    try:
        rclpy.init()
    except RuntimeError as error:
        words = str(error).partition(", at ")[0]
        raise ParameterError(f"the ROS arguments are wrong: {words}") from error
