"""`scenesense check`: the findings, their mends and the exit code, also where things are broken."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from ros_scenesense.cli import check, examination, main
from ros_scenesense.cli.examination import Finding, State, Trial, attempt
from ros_scenesense.errors import SceneSenseError

SOURCE = Path(examination.__file__).parents[2]


@pytest.fixture
def trials(monkeypatch):
    """Makes every trial end as the test says."""

    def end(trial):
        monkeypatch.setattr(examination, "attempt", lambda *_, **__: trial)

    return end


def test_trial_gives_the_last_line_of_its_answer():
    assert attempt("print('noise'); print('answer')") == Trial(True, "answer")


def test_trial_hands_words_to_the_code():
    assert attempt("import sys; print(sys.argv[1:])", "a b", "c").words == "['a b', 'c']"


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import no_such_module", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("import os; os.abort()", "ended with code -6"),
        ("raise SystemExit('no luck')", "no luck"),
    ],
)
def test_trial_survives_what_the_code_does(code, words):
    assert attempt(code) == Trial(False, words)


def test_trial_is_ended_when_it_hangs():
    trial = attempt("import threading; threading.Event().wait()", timeout_s=0.5)
    assert trial == Trial(False, "no answer within 0.5 s")


def test_missing_module_is_a_finding_with_a_mend():
    (finding,) = examination._dependency("no-such-thing", "no_such_module")
    assert finding.state is State.MISSING
    assert "no_such_module" in finding.found
    assert "make setup" in finding.mend


def test_missing_system_library_is_mended_by_its_package(trials):
    trials(Trial(False, "ImportError: libGL.so.1: cannot open shared object file"))
    (finding,) = examination._dependency("open3d", "open3d")
    assert (finding.state, finding.mend) == (State.MISSING, "apt-get install libgl1")


def test_every_system_library_names_its_package(trials):
    trials(Trial(False, "cannot open shared object file"))
    mends = {finding.mend for finding in examination._system_libraries()}
    assert mends == {
        "apt-get install libusb-1.0-0",
        "apt-get install libgl1",
        "apt-get install libgomp1",
        "apt-get install libx11-6",
    }


@pytest.mark.parametrize(
    ("version", "state"),
    [("2.13.0", State.OK), ("2.13.0+cpu", State.OK), ("2.13.1", State.MISSING)],
)
def test_torch_must_be_the_pinned_version(trials, monkeypatch, version, state):
    trials(Trial(True, ""))
    monkeypatch.setattr(examination, "_version", lambda _: version)
    assert examination._torch()[0].state is state


def test_without_ros_only_the_cause_is_reported(trials):
    trials(Trial(False, "ModuleNotFoundError: No module named 'rclpy'"))
    (finding,) = examination._ros()
    assert finding.state is State.MISSING
    assert "[ros]" in finding.mend


@pytest.mark.parametrize(
    ("domain", "state"),
    [
        ("", State.OK),
        ("0", State.OK),
        ("101", State.OK),
        ("102", State.NOTE),
        ("232", State.NOTE),
        ("233", State.MISSING),
        ("-1", State.MISSING),
        ("seven", State.MISSING),
        ("٣", State.MISSING),
    ],
)
def test_domain(monkeypatch, domain, state):
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    (finding,) = examination._domain()
    assert finding.state is state


def test_missing_data_is_a_finding(monkeypatch):
    def gone(folder, name):
        raise SceneSenseError(f"{folder}/{name} is missing")

    monkeypatch.setattr(examination, "resource", gone)
    (finding,) = examination._shipped_data()
    assert finding.state is State.MISSING
    assert "robot_assistant.al" in finding.found


def test_examination_survives_its_own_failure(monkeypatch):
    def fail():
        raise OSError("no such device")

    for look in ("_python", "_shipped_data", "_system_libraries", "_torch", "_ros", "_disk"):
        monkeypatch.setattr(examination, look, fail)
    monkeypatch.setattr(examination, "DEPENDENCIES", {})
    broken = [finding for finding in examination.examine() if finding.state is State.MISSING]
    assert [finding.name for finding in broken][:3] == [
        "python",
        "shipped data",
        "system libraries",
    ]
    assert len(broken) == 6
    assert "no such device" in broken[0].found


def test_command_succeeds_with_notes_and_fails_with_gaps(monkeypatch, capsys):
    findings = [Finding("rich", State.OK, "15"), Finding("gpu", State.NOTE, "none")]
    monkeypatch.setattr(check, "examine", lambda: findings)
    assert main.main(["check"]) == 0
    assert "everything" in capsys.readouterr().out

    findings.append(Finding("open3d", State.MISSING, "no libGL", "apt-get install libgl1"))
    assert main.main(["check"]) == 1
    shown = capsys.readouterr().out
    assert "-> apt-get install libgl1" in shown
    assert "missing: open3d" in shown


def test_json_says_the_same(monkeypatch, capsys):
    findings = [Finding("open3d", State.MISSING, "no libGL", "apt-get install libgl1")]
    monkeypatch.setattr(check, "examine", lambda: findings)
    assert main.main(["check", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == {
        "ok": False,
        "findings": [
            {
                "name": "open3d",
                "state": "missing",
                "found": "no libGL",
                "mend": "apt-get install libgl1",
            }
        ],
    }


def test_command_needs_the_standard_library_alone():
    code = "import sys; sys.path.insert(0, sys.argv[1]); import ros_scenesense.cli.check"
    ended = subprocess.run(
        [sys.executable, "-I", "-S", "-c", code, str(SOURCE)], capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr


def test_this_installation_is_complete(capsys):
    code = main.main(["check", "--json"])
    findings = json.loads(capsys.readouterr().out)["findings"]
    assert [finding for finding in findings if finding["state"] == "missing"] == []
    assert code == 0
