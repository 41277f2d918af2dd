"""Short trials of the running graph: nodes killed at random, nonsense on every topic."""

import pytest

from ros_scenesense.reliability.fuzz import fuzz
from ros_scenesense.reliability.kills import kill_at_random
from ros_scenesense.reliability.trial import TrialOptions

SMALL = {"simulated_camera": {"width": 160, "height": 120, "resend_s": 1.0, "attempts": 60}}


@pytest.fixture
def options(tmp_path):
    return TrialOptions(tmp_path, rate_hz=3.0, feedback_share=1.0, overrides=SMALL)


def test_kills_at_random_lose_and_double_nothing(options):
    outcome = kill_at_random(options, kills=6, interval_s=0.7, report=print)
    figures = outcome.figures
    assert figures["kills"] == 6
    bad = ("kills_lost_items", "kills_doubled_items", "kills_corrupted_files")
    assert [figures[name] for name in bad] == [0, 0, 0], outcome.tables
    title = next(title for title in outcome.tables if title.endswith("what is on disk"))
    scenes, feedback, *_ = outcome.tables[title].rows
    assert scenes[1] > 0, "no scene was shown: the trial says nothing"
    assert feedback[1] > 0, "nobody said anything: the trial says nothing"


def test_nonsense_is_counted_and_changes_no_decision(options, monkeypatch):
    monkeypatch.setattr("ros_scenesense.reliability.fuzz._FALSE_FRAMES", 2)
    outcome = fuzz(options, messages=300, report=print)
    figures = outcome.figures
    assert figures["fuzz_messages"] == 300
    names = ("dead_nodes", "not_counted", "different_decisions", "false_dead_nodes")
    bad = [f"fuzz_{name}" for name in names]
    assert [figures[name] for name in bad] == [0, 0, 0, 0], outcome.tables
    assert figures["fuzz_good_scenes"] >= 5
    assert figures["fuzz_false_messages"] > 30
