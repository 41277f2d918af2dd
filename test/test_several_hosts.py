"""The graph on two hosts: found by asking for it only, and alive after the network was gone."""

import contextlib
import os
import signal
import sqlite3
import threading
import time
from collections import Counter

import pytest
from conftest import holds
from two_hosts import two_hosts, why_not

REASON = why_not()
pytestmark = pytest.mark.skipif(REASON is not None, reason=REASON or "")
# Longer than nodes that are not heard of count as there (5 s).
CUT_S = float(os.environ.get("SCENESENSE_CUT_S", "6"))
SCENES = ["-p", "simulated_camera.width=160", "-p", "simulated_camera.height=120"]
SCENES += ["-p", "simulated_camera.attempts=30", "-p", "simulated_camera.resend_s=1.0"]
SCENES += ["-p", "simulated_camera.session=far", "-p", "simulated_camera.in_flight=1"]


class Launchers:
    """Launchers on hosts, and what they say."""

    def __init__(self, hosts):
        self.hosts = hosts
        self.lines = []
        self.started = []

    def start(self, host, *words, **values):
        process = self.hosts.start(host, *words, **values)
        self.started.append(process)
        threading.Thread(target=lambda: self.lines.extend(process.stdout), daemon=True).start()

    def ready(self):
        return sum("all nodes are ready" in line for line in self.lines) == len(self.started)

    def stop(self):
        for process in self.started:
            process.send_signal(signal.SIGINT)
        for process in self.started:
            assert process.wait(timeout=40.0) == 0, self.lines


@pytest.fixture
def hosts():
    with two_hosts() as made:
        yield made


@pytest.fixture
def launchers(hosts):
    made = Launchers(hosts)
    yield made
    for process in made.started:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait()


def scenes_by_state(folder):
    """How many of the camera's scenes are open, settled and lost."""
    try:
        with contextlib.closing(sqlite3.connect(folder / "camera.db")) as connection:
            return Counter(state for (state,) in connection.execute("SELECT state FROM scene"))
    except sqlite3.OperationalError:  # not made yet
        return Counter()


@pytest.mark.parametrize(("values", "leaves"), [([], False), (["--discovery", "SUBNET"], True)])
def test_nothing_leaves_the_host_unless_it_is_asked_for(hosts, launchers, tmp_path, values, leaves):
    words = ["--nodes", "grounding_control", "--log-dir", str(tmp_path / "log"), *values]
    launchers.start("a", *words, "--state", str(tmp_path))
    assert holds(launchers.ready), launchers.lines
    launchers.stop()
    assert (hosts.sent("a") > 0) == leaves


def test_a_camera_on_another_host_survives_that_the_link_is_cut(hosts, launchers, tmp_path):
    common = ["--discovery", "SUBNET"]
    rest = ["grounding", "grounding_control", "reasoner", "attention"]
    logs = [["--log-dir", str(tmp_path / name), "--state", str(tmp_path / name)] for name in "nf"]
    launchers.start("a", *common, "--nodes", "simulated_camera", *SCENES, *logs[1])
    launchers.start("b", *common, "--nodes", *rest, "-p", "attention.network=none", *logs[0])

    def settled():
        return scenes_by_state(tmp_path / "f")["settled"]

    assert holds(lambda: settled() >= 3, timeout_s=120.0), launchers.lines
    hosts.cut()
    begin = time.monotonic()
    # What had arrived before the cut may still be on its way through a node.
    assert holds(lambda: time.monotonic() - begin > CUT_S / 4)
    before = settled()
    assert holds(lambda: time.monotonic() - begin > CUT_S, timeout_s=2 * CUT_S)
    assert settled() == before
    hosts.mend()
    assert holds(lambda: settled() >= before + 3, timeout_s=120.0), launchers.lines
    launchers.stop()
    assert scenes_by_state(tmp_path / "f")["lost"] == 0
    assert not [line for line in launchers.lines if "died" in line or "no sign of life" in line]
