"""Tries one installation of SceneSense; `tools/check_installs.sh` runs it with that one's Python.

Everything is looked at from the working directory of the caller, which is not the source folder.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from std_msgs.msg import String

import ros_scenesense
from ros_scenesense.cli.examination import SHIPPED
from ros_scenesense.messages.schemas import file_name
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.resources import resource

NODE = "reasoner"  # it needs a logic program from asp/
READY_TIMEOUT_S = 60.0
STOP_TIMEOUT_S = 10.0


def main() -> None:
    """Arguments: the folder in which the package must be, and that of its executables."""
    where, executables = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    package = Path(ros_scenesense.__file__).resolve().parent
    if not package.is_relative_to(where):
        sys.exit(f"ros_scenesense was imported from {package}, not from {where}")
    for folder, name in [*SHIPPED, *(("msg_defs", file_name(message)) for message in TOPICS)]:
        resource(folder, name)
    print(
        f"  data found in {resource('asp').parent}: asp, config, {len(TOPICS)} message definitions"
    )
    subprocess.run([executables / "scenesense", "--help"], check=True, stdout=subprocess.DEVNULL)
    print("  scenesense --help runs")
    took_s = start_and_stop(executables / NODE)
    print(f"  node {NODE} was ready after {took_s:.1f} s and ended with 0 on SIGINT")
    run_demo(executables / "scenesense")
    print("  scenesense demo ran the whole graph and wrote its report")


def start_and_stop(executable: Path) -> float:
    """Starts a node, waits for its heartbeat, stops it; returns the seconds until the heartbeat."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    rclpy.init()
    watcher = rclpy.create_node("try_install")
    heard: list[String] = []
    watcher.create_subscription(String, f"/{NODE}_try/heartbeat", heard.append, 10)
    process = subprocess.Popen([executable, "--ros-args", "-r", f"__ns:=/{NODE}_try"])
    start = time.monotonic()
    try:
        while not heard:
            rclpy.spin_once(watcher, timeout_sec=0.1)
            if process.poll() is not None:
                sys.exit(f"{executable} ended with {process.returncode} before it was ready")
            if time.monotonic() - start > READY_TIMEOUT_S:
                sys.exit(f"{executable} was not ready within {READY_TIMEOUT_S:g} s")
        took_s = time.monotonic() - start
        process.send_signal(signal.SIGINT)
        code = process.wait(STOP_TIMEOUT_S)
    finally:
        process.kill()
        watcher.destroy_node()
        rclpy.try_shutdown()
    if code != 0:
        sys.exit(f"{executable} ended with {code} on SIGINT")
    return took_s


def run_demo(executable: Path) -> None:
    """Two scenes through all nodes, which the launcher starts as it does everywhere."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "run")
        words = ["demo", "--scenes", "2", "--out", str(out)]
        ended = subprocess.run([executable, *words], capture_output=True, text=True, check=False)
        if ended.returncode != 0 or not (out / "report.html").is_file():
            sys.exit(f"scenesense {' '.join(words)} ended with {ended.returncode}:\n{ended.stderr}")


if __name__ == "__main__":
    main()
