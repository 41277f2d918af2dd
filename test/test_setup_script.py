"""`tools/setup.sh` with an interpreter that only pretends: when it installs, when it refuses."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1]

# Tells its version, makes a "virtual environment" with itself inside, and writes down what
# pip was asked for.
PRETENDER = """#!/bin/bash
case "$*" in
"-c import sys; print"*) echo VERSION ;;
"-c import ctypes"*) exit "${LIBRARIES_END_WITH:-0}" ;;
"-m venv"*) mkdir -p "$3/bin" && cp "$0" "$3/bin/python" ;;
*pip*install*) echo "${@: -1}" >>pip.txt; exit "${PIP_ENDS_WITH:-0}" ;;
esac
"""


TOOLS = ("bash", "cat", "cp", "cut", "dirname", "env", "flock", "grep", "mkdir", "rm", "sha256sum")
TOOLS += ("tail", "tee", "uname")
ALL_LIBRARIES = "libusb-1.0-0 libgl1 libgomp1 libx11-6"


@pytest.fixture
def machine(tmp_path):
    """A folder for PATH with the basic tools; returns a function that adds commands to it."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in TOOLS:
        (folder / tool).symlink_to(shutil.which(tool))

    def add(**commands):
        for name, script in commands.items():
            path = folder / name.replace("_", "-")
            path.write_text(f"#!/bin/bash\n{script}\n")
            path.chmod(0o755)
        return str(folder)

    return add


@pytest.fixture
def project(tmp_path):
    """A copy of what the script reads, in a folder whose name has a space."""
    folder = tmp_path / "my project"
    (folder / "tools").mkdir(parents=True)
    shutil.copy(SOURCE / "tools/setup.sh", folder / "tools")
    for name in ("requirements.lock", "setup.py", "setup.cfg"):
        shutil.copy(SOURCE / name, folder)
    return folder


def set_up(project, version="3.11.7", **variables):
    python = project / "python"
    python.write_text(PRETENDER.replace("VERSION", version))
    python.chmod(0o755)
    return subprocess.run(
        [project / "tools/setup.sh"],
        env={**os.environ, "PYTHON": str(python), **variables},
        cwd="/",
        capture_output=True,
        text=True,
        check=False,
    )


def installed(project):
    log = project / "pip.txt"
    words = log.read_text().split() if log.exists() else []
    log.unlink(missing_ok=True)
    return words


def test_first_run_installs_and_the_second_does_nothing(project):
    assert set_up(project).returncode == 0
    assert installed(project) == ["requirements.lock", "."]
    again = set_up(project)
    assert (again.returncode, again.stdout) == (0, "")
    assert installed(project) == []


def test_environment_is_kept_when_no_interpreter_is_named(project):
    set_up(project)
    installed(project)
    assert set_up(project, PYTHON="").returncode == 0
    assert installed(project) == []


@pytest.mark.parametrize("name", ["requirements.lock", "setup.py"])
def test_changed_dependencies_are_installed_into_the_same_environment(project, name):
    set_up(project)
    installed(project)
    (project / ".venv/kept").touch()
    with (project / name).open("a") as file:
        file.write("# changed\n")
    assert set_up(project).returncode == 0
    assert installed(project) == ["requirements.lock", "."]
    assert (project / ".venv/kept").exists()


def test_interrupted_set_up_starts_over(project):
    failed = set_up(project, PIP_ENDS_WITH="1")
    assert failed.returncode == 1
    assert "network" in failed.stderr
    (project / ".venv/half-unpacked").touch()
    assert set_up(project).returncode == 0
    assert not (project / ".venv/half-unpacked").exists()


def test_other_interpreter_gets_another_environment(project):
    set_up(project)
    (project / ".venv/of-the-old-one").touch()
    assert set_up(project, version="3.11.8").returncode == 0
    assert not (project / ".venv/of-the-old-one").exists()


@pytest.mark.parametrize("version", ["3.10.2", "3.13.0", ""])
def test_unfit_interpreter_is_refused(project, version):
    refused = set_up(project, version=version)
    assert refused.returncode == 1
    assert "3.11 or 3.12" in refused.stderr
    assert not (project / ".venv").exists()


def test_somebody_elses_environment_is_left_alone(project):
    (project / ".venv").mkdir()
    refused = set_up(project)
    assert refused.returncode == 1
    assert "move it away" in refused.stderr
    assert installed(project) == []


def test_missing_system_libraries_are_installed_with_sudo(project, machine):
    path = machine(
        id="echo 1000", sudo='echo sudo "$@" >>apt.txt; exec "$@"', apt_get='echo "$@" >>apt.txt'
    )
    assert set_up(project, PATH=path, LIBRARIES_END_WITH="1").returncode == 0
    commands = (project / "apt.txt").read_text().splitlines()
    assert commands[-1].startswith("-qq -y")
    assert commands[-1].endswith(f"install --no-install-recommends {ALL_LIBRARIES}")
    assert [words.split()[0] for words in commands] == ["sudo", "-qq", "sudo", "-qq"]


@pytest.mark.parametrize(
    ("commands", "said"),
    [
        ({"id": "echo 0"}, "no apt-get here"),
        ({"id": "echo 1000", "apt_get": ""}, f"run as root: apt-get install {ALL_LIBRARIES}"),
        ({"id": "echo 0", "apt_get": "exit 100"}, f"run as root: apt-get install {ALL_LIBRARIES}"),
    ],
    ids=["no apt", "no sudo", "apt fails"],
)
def test_mend_is_told_when_libraries_cannot_be_installed(project, machine, commands, said):
    refused = set_up(project, PATH=machine(**commands), LIBRARIES_END_WITH="1")
    assert refused.returncode == 1
    assert said in refused.stderr
    assert ALL_LIBRARIES in refused.stdout + refused.stderr
    assert installed(project) == []


def test_compiling_is_announced_before_it_starts(project, machine):
    path = machine(**{"id": "echo 0", "apt-get": 'echo "$@" >>apt.txt'})
    announced = set_up(project, version="3.12.3", PATH=path)
    assert (project / "apt.txt").read_text().endswith(" build-essential\n")
    said = announced.stdout
    assert announced.returncode == 0
    assert said.index("compiled") < said.index("installing")
