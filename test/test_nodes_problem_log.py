"""One warning per problem, and one line for a flood."""

import pytest

from ros_scenesense.nodes.problem_log import BURST, QUIET_S, ProblemLog
from ros_scenesense.stages.health import Health


class Log:
    def __init__(self):
        self.now = 100.0
        self.health = Health()
        self.lines = []
        self.log = ProblemLog(self.health, self.lines.append, clock=lambda: self.now)

    def report(self, *problems):
        for kind, words in problems:
            self.health.problem(kind, words)
        self.log.report()


@pytest.fixture
def log():
    return Log()


def test_each_problem_is_logged_at_once_and_once(log):
    log.report(("a", "first"), ("b", "second"))
    log.report()
    assert log.lines == ["first", "second"]


def test_a_flood_becomes_one_line_with_its_number(log):
    count = 5000
    for number in range(count):
        log.report(("a", f"problem {number}"))
    assert log.lines == [f"problem {number}" for number in range(BURST)]
    log.now += QUIET_S
    log.report()
    assert len(log.lines) == BURST + 1
    assert f"problem {count - 1}" in log.lines[-1]
    assert f"{count - BURST} more of 'a'" in log.lines[-1]


def test_problems_that_health_did_not_keep_are_counted_too(log):
    log.report(*[("a", "words")] * 1000)
    log.now += QUIET_S
    log.report()
    assert f"{1000 - BURST} more of 'a'" in log.lines[-1]


def test_what_comes_with_the_summary_is_not_counted_in_it(log):
    log.report(*[("a", "words")] * 10)
    log.now += QUIET_S
    log.report(("a", "later"))
    assert log.lines[BURST:] == [f"words ({10 - BURST} more of 'a' in 5 s)", "later"]


def test_a_flood_of_one_kind_hides_no_other(log):
    log.report(*[("a", "words")] * 50)
    log.report(("b", "other"))
    assert log.lines[-1] == "other"


def test_after_a_quiet_time_problems_are_logged_at_once_again(log):
    log.report(("a", "old"))
    log.now += QUIET_S
    log.report(("a", "new"))
    assert log.lines == ["old", "new"]


def test_age_of_the_newest_problem(log):
    assert log.log.age_s() == float("inf")
    log.report(("a", "words"))
    log.now += 3.0
    assert log.log.age_s() == 3.0
