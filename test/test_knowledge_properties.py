"""The translation against the definitions of the action language, on random small domains."""

from __future__ import annotations

from collections.abc import Callable

import clingo
from brute_force import BruteForce, Path
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.action_language import Domain, parse
from ros_scenesense.knowledge.translation import Options, translate

SIGNATURE = """\
sort thing = {a, b}. sort special < thing. sort special += {b}. sort number = 1..2.
static link(thing, thing).
inertial fluent p(thing), q.
defined fluent d(number).
estimated fluent e(thing).
action go(thing), stop. exogenous action hit(special).
"""
INERTIAL = ["p(X)", "p(Y)", "p(a)", "q", "-p(X)", "-p(b)", "-q"]
CONDITIONS = [
    *INERTIAL,
    *("d(N)", "d(1)", "-d(2)", "e(X)", "-e(X)", "-e(b)", "link(X, Y)", "link(a, X)", "-link(X, X)"),
    *("not p(X)", "not p(_)", "not q", "not -p(X)", "not d(N)", "not e(X)", "not link(Z, Z)"),
    *(
        "not -e(a)",
        "not link(_, X)",
        "not -p(_)",
        "X != Y",
        "N > 1",
        "special(X)",
        "not special(X)",
    ),
]
HEADS = ["p(X)", "p(b)", "-p(X)", "q", "-q", "d(1)", "d(N)", "d(N + 1)", "e(X)", "-e(X)", "e(a)"]
ACTIONS = ["go(X)", "go(a)", "stop", "hit(X)"]


@st.composite
def bodies(draw: Callable, most: int = 2) -> str:
    conditions = draw(st.lists(st.sampled_from(CONDITIONS), max_size=most, unique=True))
    return f" if {', '.join(conditions)}" if conditions else ""


@st.composite
def laws(draw: Callable) -> str:
    form = draw(st.sampled_from(["constraint"] * 3 + ["causes"] * 3 + ["impossible"]))
    body = draw(bodies())
    if form == "constraint":
        return f"{draw(st.sampled_from(HEADS))}{body or ' if q'}."
    if form == "causes":
        other = draw(st.sampled_from(["", "", "", "not hit(b)", "stop"]))
        joined = f"{body}, {other}" if body and other else body or (other and f" if {other}")
        return f"{draw(st.sampled_from(ACTIONS))} causes {draw(st.sampled_from(INERTIAL))}{joined}."
    actions = draw(st.lists(st.sampled_from(ACTIONS), min_size=1, max_size=2, unique=True))
    return f"impossible {', '.join(actions)}{body}."


@st.composite
def defaults(draw: Callable) -> str:
    if draw(st.booleans()):
        head = draw(st.sampled_from(["p(X)", "-p(X)", "q", "-q", "e(X)", "-e(b)"]))
        return f"initially normally {head}{draw(bodies(1))}."
    return f"normally {draw(st.sampled_from(['e(X)', '-e(X)', 'e(a)']))}{draw(bodies(1))}."


@st.composite
def domains(draw: Callable, restoring: bool) -> Domain:
    statements = draw(st.lists(laws(), min_size=1, max_size=5))
    if restoring:
        statements += draw(st.lists(defaults(), min_size=1, max_size=2))
    for pair in draw(st.sets(st.sampled_from(["a, a", "a, b", "b, a", "b, b"]), max_size=3)):
        statements.append(f"{draw(st.sampled_from(['', '-']))}link({pair}).")
    steps = 1 if restoring else draw(st.integers(1, 2))
    for step in range(steps):
        for action in draw(st.sets(st.sampled_from(["go(a)", "go(b)", "stop"]), max_size=2)):
            statements.append(f"hpd({action}, {step}).")
    fluents = st.sampled_from(["p(a)", "p(b)", "q", "d(1)", "e(a)", "e(b)"])
    for fluent in draw(st.lists(fluents, max_size=4 if restoring else 1, unique=True)):
        value = draw(st.sampled_from(["true", "false"]))
        for step in draw(st.sampled_from([[0], [steps], list(range(steps + 1))])):
            statements.append(f"obs({fluent}, {value}, {step}).")
    if draw(st.booleans()):
        statements.append(draw(st.sampled_from(["initially q.", "initially -p(a), p(b)."])))
    statements.append("obs(q, true, 0)." if draw(st.booleans()) else "obs(q, false, 0).")
    try:
        return parse(SIGNATURE + "\n".join(statements))
    except LanguageError:
        assume(False)  # e.g. a variable that has no sort
        raise


def answer_sets(
    domain: Domain, *arguments: str, complete: bool = True
) -> list[list[clingo.Symbol]]:
    options = Options(complete=complete, show_all=True)
    control = clingo.Control(["0", *arguments], logger=lambda *_: None)
    control.add(translate(domain.description, domain.history, options))
    control.ground()
    found: list[list[clingo.Symbol]] = []
    with control.solve(yield_=True) as handle:
        for model in handle:
            if not model.cost or model.optimality_proven:
                found.append(list(model.symbols(shown=True)))
    return found


def path(symbols: list[clingo.Symbol], last: int) -> Path:
    states: list[set] = [set() for _ in range(last + 1)]
    for symbol in symbols:
        if symbol.name == "holds":
            fluent, step = symbol.arguments
            states[step.number].add((str(fluent).replace(",", ", "), symbol.positive))
    return tuple(map(frozenset, states))


def applied(symbols: list[clingo.Symbol]) -> frozenset[tuple[str, int]]:
    return frozenset(
        (str(symbol.arguments[0]).replace(",", ", "), symbol.arguments[1].number)
        for symbol in symbols
        if symbol.name == "applied"
    )


COST = settings(
    max_examples=200,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)


@COST
@given(domains(restoring=False))
def test_answer_sets_are_the_paths_of_the_transition_diagram(domain: Domain) -> None:
    last = domain.history.last_step
    found = [path(symbols, last) for symbols in answer_sets(domain, "-c", "restore=0")]
    assert len(found) == len(set(found))
    assert set(found) == BruteForce(domain.description).paths(domain.history)


@settings(COST, max_examples=60)
@given(domains(restoring=False))
def test_what_is_not_known_initially_stays_unknown_until_something_says_it(domain: Domain) -> None:
    last = domain.history.last_step
    sets = answer_sets(domain, "-c", "restore=0", complete=False)
    found = [path(symbols, last) for symbols in sets]
    assert len(found) == len(set(found))
    assert set(found) == BruteForce(domain.description, complete=False).paths(domain.history)


@COST
@given(domains(restoring=True))
def test_as_few_cr_rules_as_can_be_are_applied(domain: Domain) -> None:
    last = domain.history.last_step
    sets = answer_sets(domain, "--opt-mode=optN")
    found = {(applied(symbols), path(symbols, last)) for symbols in sets}
    assert found == BruteForce(domain.description).restored(domain.history)
