"""Random SPARC programs: our answer sets are those of the definitions."""

from __future__ import annotations

from collections.abc import Callable

from brute_sparc import BruteForce
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.sparc.language import Program, parse
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, Question

SIGNATURE = """\
#maxint = 3.
sorts
#s = {a, b}. #n = 0..2. #t = #s * {b} + {1}. #r = f(#s) + {g(a)}.
predicates
z(). p(#s). q(#n). r(#r). e(#s, #n). w(#t).
rules
"""
SORTS = {
    "s": {"a", "b"},
    "n": {0, 1, 2},
    "t": {"b", 1},
    "r": {"f(a)", "f(b)", "g(a)"},
    "nat": {0, 1, 2, 3},
}
PREDICATES = {"z": (), "p": ("s",), "q": ("n",), "r": ("r",), "e": ("s", "n"), "w": ("t",)}
HEADS = ["z", "-z", "p(X)", "p(a)", "-p(X)", "q(1)", "q(N)", "q(N + 1)", "r(f(X))", "r(R)", "w(X)"]
CONDITIONS = [
    *("p(X)", "p(b)", "-p(X)", "q(N)", "q(N - 1)", "q(M)", "r(f(X))", "r(R)", "z", "-z", "w(X)"),
    *("e(X, N)", "e(X, _)", "-e(X, N)", "e(a, N + 1)", "w(N)"),
    *("not p(X)", "not q(N)", "not q(N * 2)", "not z", "not -p(X)", "not -z", "not r(g(X))"),
    *("not e(X, _)", "not -e(_, N)", "not w(X)", "not r(R)"),
    *("X != Y", "X = a", "N < M", "N + M = 2", "#s(Y)", "#t(X)", "not #t(X)", "#n(M)", "R != f(X)"),
    *("#count{Y : e(Y, N)} = 1", "#count{Y, M : e(Y, M)} > N", "N = #sum{M, X : e(X, M)}"),
    *("#count{X : not e(X, N)} <= 1", "#count{M : #t(M), M > 0} = N"),
]
CHOICES = [
    *("{p(X) : e(X, M)}", "1 {q(N) : N > 0} 1", "{q(M) : e(X, M)}", "{r(f(X)) : #s(X)} 1"),
    *("{p(a); z}", "1 <= {w(X)}", "{q(N + 1)}"),
]


@st.composite
def rules(draw: Callable, form: str = ":-") -> str:
    body = ", ".join(draw(st.lists(st.sampled_from(CONDITIONS), max_size=3, unique=True)))
    if form == ":~":
        return f":~ {body or 'z'}. [{draw(st.sampled_from(['1', '2']))}:]"
    kind = draw(st.sampled_from(["one"] * 6 + ["two", "choice", "none"])) if form == ":-" else "one"
    if kind == "none":
        return f":- {body or 'z'}."
    if kind == "choice":
        head = draw(st.sampled_from(CHOICES))
    else:
        heads = st.lists(st.sampled_from(HEADS), min_size=1, max_size=1 + (kind == "two"))
        head = " | ".join(draw(heads))
    return f"{head} {form} {body}." if body or form == ":+" else f"{head}."


@st.composite
def programs(draw: Callable) -> Program:
    statements = draw(st.lists(rules(), min_size=1, max_size=4))
    if draw(st.booleans()):
        statements += draw(st.lists(rules(":+"), min_size=1, max_size=2))
        statements.append(draw(st.sampled_from([":- not z.", ":- not q(1).", ":- z, not p(a)."])))
    if draw(st.booleans()):
        statements += draw(st.lists(rules(":~"), min_size=1, max_size=2))
    pairs = st.sampled_from(["a, 0", "a, 2", "b, 1", "b, 2"])
    for pair in draw(st.sets(pairs, max_size=3)):
        statements.append(f"{draw(st.sampled_from(['', '', '-']))}e({pair}).")
    try:
        return parse(SIGNATURE + "\n".join(statements))
    except LanguageError:
        assume(False)  # e.g. a variable that occurs in no atom
        raise


@settings(
    max_examples=200,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)
@given(programs())
def test_answer_sets_are_those_of_the_definitions(program: Program) -> None:
    brute = BruteForce(program.text.rules, SORTS, PREDICATES, 3)
    assume(len(brute.bits) <= 18)
    assume(sum(rule.form == ":+" for rule in brute.rules) <= 5)
    translation = translated(program)
    answers = AnswerSetEngine().solve(
        Question(
            text=translation.text,
            applied=translation.applied,
            models=0,
            optimize=program.optimizes,
        )
    )
    found = [frozenset(each) for each in answers.sets]
    assert len(found) == len(set(found))
    assert set(found) == brute.answer_sets()
