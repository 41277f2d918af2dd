"""The examination behind `scenesense check`: one look per thing that SceneSense needs.

It must answer in a broken installation too: it uses the standard library alone, and whatever may
crash or hang is tried in a process of its own.
"""

from __future__ import annotations

import enum
import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.resources import resource

# Distribution and the module it brings: what setup.py requires. torch is tried on its own.
DEPENDENCIES = {
    "clingo": "clingo",
    "Jinja2": "jinja2",
    "joblib": "joblib",
    "lark-parser": "lark",
    "matplotlib": "matplotlib",
    "msgspec": "msgspec",
    "numpy": "numpy",
    "open3d": "open3d",
    "opencv-python-headless": "cv2",
    "platformdirs": "platformdirs",
    "pybullet": "pybullet",
    "PyYAML": "yaml",
    "rich": "rich",
    "rosbags": "rosbags",
    "scipy": "scipy",
}
TORCH_VERSION = "2.13.0"
TESTED_PYTHONS = ("3.11", "3.12")

# Libraries that open3d loads, and their Debian packages.
SYSTEM_LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libgomp.so.1": "libgomp1",
    "libX11.so.6": "libx11-6",
}
ROS_PACKAGES = (
    "builtin_interfaces.msg",
    "diagnostic_msgs.msg",
    "geometry_msgs.msg",
    "rcl_interfaces.msg",
    "rosgraph_msgs.msg",
    "sensor_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
    "visualization_msgs.msg",
)
SHIPPED = (
    ("asp", "robot_assistant.al"),
    ("config", "scenesense.yaml"),
    ("config", "fastdds_profile.xml"),
    ("config", "objects/cube.yaml"),
    ("msg_defs", "scene.schema.json"),
)
DISK_MB = 500  # a long run with its report
SHARED_MEMORY_MB = 32  # Fast DDS keeps about half a megabyte per process, images come on top
TRIAL_TIMEOUT_S = 60.0

REINSTALL = "make setup, or pip install ."
INSTALL_ROS = "pip install '.[ros]', or source the setup file of a ROS 2 Jazzy of your own"


class State(enum.Enum):
    """What a finding means for the user."""

    OK = "ok"
    NOTE = "note"  # works without it, or with less
    MISSING = "missing"


@dataclass(frozen=True)
class Finding:
    """One line of the answer.

    Attributes:
        name: What was looked at.
        state: Whether it is as it must be.
        found: What was seen.
        mend: What to do; empty when there is nothing to do.
    """

    name: str
    state: State
    found: str
    mend: str = ""


@dataclass(frozen=True)
class Trial:
    """How a piece of Python code ended in a process of its own; `words` is its last line."""

    worked: bool
    words: str


def examine() -> list[Finding]:
    """Looks at everything; slow things side by side."""
    looks: dict[str, Callable[[], list[Finding]]] = {
        "python": _python,
        "shipped data": _shipped_data,
        "system libraries": _system_libraries,
        **{name: partial(_dependency, name, module) for name, module in DEPENDENCIES.items()},
        "torch": _torch,
        "ros": _ros,
        "ros domain": _domain,
        "disk": _disk,
        "shared memory": _shared_memory,
    }
    with ThreadPoolExecutor(max_workers=os.cpu_count() or 1) as pool:
        return [finding for found in pool.map(_guarded, looks.items()) for finding in found]


def attempt(code: str, *words: str, timeout_s: float = TRIAL_TIMEOUT_S) -> Trial:
    """Runs Python code in a process of its own, which may crash or hang.

    Args:
        code: The code; the last line that it prints is its answer.
        words: Its `sys.argv[1:]`.
        timeout_s: Seconds after which it is killed.
    """
    try:
        process = subprocess.run(
            [sys.executable, "-c", code, *words],
            capture_output=True,
            text=True,
            errors="replace",
            timeout=timeout_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return Trial(False, f"no answer within {timeout_s:g} s")
    if process.returncode == 0:
        return Trial(True, _last_line(process.stdout))
    ended = f"ended with code {process.returncode}"
    return Trial(False, _last_line(process.stderr) or ended)


def _guarded(named_look: tuple[str, Callable[[], list[Finding]]]) -> list[Finding]:
    """A doctor that dies of the illness is no use: whatever goes wrong is a finding."""
    name, look = named_look
    try:
        return look()
    except Exception as error:
        words = f"could not be examined: {type(error).__name__}: {error}"
        return [Finding(name, State.MISSING, words)]


def _python() -> list[Finding]:
    version = platform.python_version()
    found = f"{version} ({sys.executable})"
    if version.rpartition(".")[0] in TESTED_PYTHONS:
        return [Finding("python", State.OK, found)]
    state = State.NOTE if sys.version_info >= (3, 11) else State.MISSING
    return [Finding("python", state, found, f"tested with {' and '.join(TESTED_PYTHONS)}")]


def _shipped_data() -> list[Finding]:
    try:
        for folder, name in SHIPPED:
            resource(folder, name)
    except SceneSenseError as error:
        return [Finding("shipped data", State.MISSING, str(error), REINSTALL)]
    return [Finding("shipped data", State.OK, str(resource("asp").parent))]


def _system_libraries() -> list[Finding]:
    code = "import ctypes, sys; ctypes.CDLL(sys.argv[1])"
    findings = []
    for library, package in SYSTEM_LIBRARIES.items():
        trial = attempt(code, library)
        state = State.OK if trial.worked else State.MISSING
        mend = "" if trial.worked else f"apt-get install {package}"
        findings.append(Finding(library, state, "found" if trial.worked else trial.words, mend))
    return findings


def _dependency(name: str, module: str) -> list[Finding]:
    trial = attempt("import importlib, sys; importlib.import_module(sys.argv[1])", module)
    if trial.worked:
        return [Finding(name, State.OK, _version(name))]
    packages = [package for library, package in SYSTEM_LIBRARIES.items() if library in trial.words]
    mend = f"apt-get install {packages[0]}" if packages else REINSTALL
    return [Finding(name, State.MISSING, trial.words, mend)]


def _torch() -> list[Finding]:
    code = "import torch\nprint(torch.cuda.get_device_name(0) if torch.cuda.is_available() else '')"
    trial = attempt(code)
    version = _version("torch")
    if not trial.worked:
        return [Finding("torch", State.MISSING, trial.words, REINSTALL)]
    if version.partition("+")[0] != TORCH_VERSION:
        mend = f"pip install torch=={TORCH_VERSION}"
        return [Finding("torch", State.MISSING, f"{version}, must be {TORCH_VERSION}", mend)]
    return [
        Finding("torch", State.OK, version),
        Finding("gpu", State.OK, trial.words)
        if trial.words
        else Finding("gpu", State.NOTE, "none that torch can use; the CPU does"),
    ]


def _ros() -> list[Finding]:
    code = (
        "import importlib, sys, rclpy\n"
        "for name in sys.argv[1:]: importlib.import_module(name)\n"
        "print(rclpy.get_rmw_implementation_identifier(), rclpy.__file__)"
    )
    trial = attempt(code, *ROS_PACKAGES)
    if not trial.worked:
        return [Finding("ros", State.MISSING, trial.words, INSTALL_ROS)]
    middleware, _, path = trial.words.partition(" ")
    version = _version("ros-rclpy")
    origin = f"rclpy {version} from wheels" if version != "unknown" else f"rclpy in {path}"
    findings = [Finding("ros", State.OK, f"{origin}, {middleware}")]
    if not attempt("import tf2_msgs.msg").worked:
        words = "tf2_msgs is not installed: the camera pose is in `scene`, not on /tf"
        findings.append(Finding("ros tf2_msgs", State.NOTE, words, "comes with a full ROS 2"))
    return [*findings, _discovery()]


def _domain() -> list[Finding]:
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if not domain:
        return [Finding("ros domain", State.OK, "0, ROS_DOMAIN_ID is not set")]
    if domain.isascii() and domain.isdigit() and int(domain) <= 232:
        if int(domain) <= 101:
            return [Finding("ros domain", State.OK, domain)]
        words = f"{domain}: its ports may collide with those that Linux gives out"
        return [Finding("ros domain", State.NOTE, words, "export ROS_DOMAIN_ID=0 to 101")]
    words = f"ROS_DOMAIN_ID is {domain!r}, must be an integer from 0 to 101"
    return [Finding("ros domain", State.MISSING, words, "export ROS_DOMAIN_ID=0")]


def _discovery() -> Finding:
    reach = os.environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "")
    words = f"range {reach}" if reach else "range not set, `scenesense launch` takes LOCALHOST"
    trial = attempt("from ros_scenesense.cli.discovery import main; main()")
    found = f"{trial.words}; {words}"
    if trial.worked:
        return Finding("ros discovery", State.OK, found)
    mend = "unset ROS_AUTOMATIC_DISCOVERY_RANGE; allow UDP and multicast on the loopback device"
    return Finding("ros discovery", State.MISSING, found, mend)


def _disk() -> list[Finding]:
    free_mb = shutil.disk_usage(Path.cwd()).free // 2**20
    found = f"{free_mb} MB free in {Path.cwd()}"
    if free_mb >= DISK_MB:
        return [Finding("disk", State.OK, found)]
    return [Finding("disk", State.MISSING, found, f"make room for {DISK_MB} MB")]


def _shared_memory() -> list[Finding]:
    folder = Path("/dev/shm")
    if not folder.is_dir():
        return [Finding("shared memory", State.NOTE, "no /dev/shm: images go through UDP, slower")]
    free_mb = shutil.disk_usage(folder).free // 2**20
    found = f"{free_mb} MB free in {folder}"
    if free_mb >= SHARED_MEMORY_MB:
        return [Finding("shared memory", State.OK, found)]
    mend = "remove what killed nodes left: rm /dev/shm/fastrtps_*; in a container: --shm-size=256m"
    return [Finding("shared memory", State.NOTE, found, mend)]


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].strip() if lines else ""
