from __future__ import annotations

import itertools

import pytest

from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.reasoning.beliefs import belief, structure_belief
from ros_scenesense.reasoning.program import Axiom
from ros_scenesense.scene import DecisionStatus, Task

NORMAL = Axiom("n", "normal", "", Task.STABILITY)
DEFAULT = Axiom("d", "default", "", Task.STABILITY)

STABLE = Belief(status=DecisionStatus.STRICT, value=True, axioms=["s"])
UNSTABLE = Belief(status=DecisionStatus.STRICT, value=False, axioms=["u"])
USUALLY_STABLE = Belief(status=DecisionStatus.BY_DEFAULT, value=True, axioms=["ds"])
USUALLY_UNSTABLE = Belief(status=DecisionStatus.BY_DEFAULT, value=False, axioms=["du"])
OPEN = Belief(status=DecisionStatus.UNDECIDED)
CLASH = Belief(status=DecisionStatus.INCONSISTENT, axioms=["s", "u"])
LATE = Belief(status=DecisionStatus.TIMED_OUT)


def of(*members: Belief) -> tuple[DecisionStatus, bool | None, list[str]]:
    result = structure_belief(
        map(str, range(len(members))), {str(i): each for i, each in enumerate(members)}
    )
    return result.status, result.value, result.axioms


@pytest.mark.parametrize(
    ("true_by", "false_by", "expected"),
    [
        (None, None, Belief(status=DecisionStatus.UNDECIDED)),
        ([NORMAL], None, Belief(status=DecisionStatus.STRICT, value=True, axioms=["n"])),
        (None, [DEFAULT], Belief(status=DecisionStatus.BY_DEFAULT, value=False, axioms=["d"])),
        (
            None,
            [DEFAULT, NORMAL],
            Belief(status=DecisionStatus.STRICT, value=False, axioms=["d", "n"]),
        ),
        ([], None, Belief(status=DecisionStatus.BY_DEFAULT, value=True)),
        ([NORMAL], [DEFAULT], Belief(status=DecisionStatus.INCONSISTENT, axioms=["n", "d"])),
    ],
)
def test_belief_about_a_literal(
    true_by: list[Axiom] | None, false_by: list[Axiom] | None, expected: Belief
) -> None:
    assert belief(true_by, false_by) == expected


@pytest.mark.parametrize(
    ("members", "expected"),
    [
        ([STABLE, STABLE], (DecisionStatus.STRICT, True, ["s"])),
        ([STABLE, USUALLY_STABLE], (DecisionStatus.BY_DEFAULT, True, ["s", "ds"])),
        ([STABLE, OPEN], (DecisionStatus.UNDECIDED, None, [])),
        ([STABLE, CLASH, OPEN], (DecisionStatus.INCONSISTENT, None, ["s", "u"])),
        ([LATE, LATE], (DecisionStatus.TIMED_OUT, None, [])),
        # One unstable member decides, and only the unstable members are the reason.
        ([STABLE, UNSTABLE, OPEN], (DecisionStatus.STRICT, False, ["u"])),
        ([USUALLY_UNSTABLE, OPEN, CLASH], (DecisionStatus.BY_DEFAULT, False, ["du"])),
        ([USUALLY_UNSTABLE, UNSTABLE], (DecisionStatus.STRICT, False, ["u"])),
    ],
)
def test_belief_about_a_structure(
    members: list[Belief], expected: tuple[DecisionStatus, bool | None, list[str]]
) -> None:
    status, value, axioms = expected
    for order in itertools.permutations(members):
        assert of(*order)[:2] == (status, value)
        assert sorted(of(*order)[2]) == sorted(axioms)


def test_short_explanations_name_the_object_and_the_strongest_axiom() -> None:
    default = Axiom("d", "default", "", Task.STABILITY, "small_base({})")
    normal = Axiom("n", "normal", "", Task.STABILITY, "not above({}, B)")
    assert belief([default, normal], None, "cube").why == "n: not above(cube, B)"
    assert belief([normal], [default], "cube").why == ("n: not above(cube, B); d: small_base(cube)")
    assert belief(None, None, "cube").why == ""
    unstable = belief(None, [default], "cube")
    stable = belief([normal], None, "duck")
    members = {"cube": unstable, "duck": stable}
    assert structure_belief(members, members).why == "d: small_base(cube)"
    assert structure_belief(["duck"], members).why == ""
