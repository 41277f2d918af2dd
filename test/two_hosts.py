"""Two hosts on one machine: network namespaces joined by a cable that can be cut."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

ADDRESSES = {"a": "198.18.7.1/24", "b": "198.18.7.2/24"}


def why_not() -> str | None:
    """Why network namespaces cannot be made here; None if they can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    if shutil.which("ip") is None:
        return "the command ip (iproute2) is missing"
    name = f"scenesense-{os.getpid()}-try"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        return f"network namespaces cannot be made: {made.stderr.strip()}"
    subprocess.run(["ip", "netns", "delete", name], check=True)
    return None


class TwoHosts:
    """Hosts `a` and `b`; made by `two_hosts`."""

    def __init__(self, names: dict[str, str]) -> None:
        self._names = names

    def start(self, host: str, *words: str, **values: str) -> subprocess.Popen[str]:
        """Starts the launcher on a host; its output is a pipe. `values` go to the environment."""
        inherited = {k: v for k, v in os.environ.items() if k != "ROS_AUTOMATIC_DISCOVERY_RANGE"}
        command = ["ip", "netns", "exec", self._names[host], sys.executable]
        return subprocess.Popen(
            [*command, "-m", "ros_scenesense.launcher", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**inherited, **values},
        )

    def cut(self) -> None:
        """Cuts the cable."""
        _ip("-n", self._names["a"], "link", "set", "cable", "down")

    def mend(self) -> None:
        """Joins it again."""
        _ip("-n", self._names["a"], "link", "set", "cable", "up")

    def sent(self, host: str) -> int:
        """Packets that have left a host."""
        shown = _ip("-n", self._names[host], "-s", "-j", "link", "show", "cable")
        return int(json.loads(shown)[0]["stats64"]["tx"]["packets"])


@contextmanager
def two_hosts() -> Iterator[TwoHosts]:
    """Two hosts with an address each; both know IPv4 alone, so that nothing else is sent."""
    names = {host: f"scenesense-{os.getpid()}-{host}" for host in ADDRESSES}
    for name in names.values():
        _ip("netns", "add", name)
    try:
        ends = [["netns", name, "name", "cable"] for name in names.values()]
        _ip("link", "add", *ends[0], "type", "veth", "peer", *ends[1])
        for host, name in names.items():
            setting = "net.ipv6.conf.all.disable_ipv6=1"
            _ip("netns", "exec", name, "sysctl", "-qw", setting)
            _ip("-n", name, "address", "add", ADDRESSES[host], "dev", "cable")
            for device in ("lo", "cable"):
                _ip("-n", name, "link", "set", device, "up")
        yield TwoHosts(names)
    finally:
        for name in names.values():
            _ip("netns", "delete", name)


def _ip(*words: str) -> str:
    done = subprocess.run(["ip", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"ip {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout
