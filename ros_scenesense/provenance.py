"""Where a figure comes from: versions of what was used, and the machine. Part of every result."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path

import ros_scenesense

_DISTRIBUTIONS = ("numpy", "clingo", "open3d", "pybullet", "msgspec")


def versions() -> dict[str, str]:
    """Versions of SceneSense, Python and the libraries that decide about results."""
    found = {"ros_scenesense": ros_scenesense.__version__, "python": platform.python_version()}
    for name in _DISTRIBUTIONS:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def machine() -> dict[str, str | int]:
    """What the figures were measured on; no name of host or user."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or "unknown"
