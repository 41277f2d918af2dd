"""Proofs and refutations of atoms of any logic program."""

from __future__ import annotations

from collections.abc import Iterator

import clingo
import pytest
from clingo import ast
from hypothesis import given, settings
from hypothesis import strategies as st

from ros_scenesense.errors import ReasoningError
from ros_scenesense.reasoning.explanation.proof import Proof, Proofs
from ros_scenesense.reasoning.explanation.refutation import Attempt, Refutation, Refutations
from ros_scenesense.reasoning.explanation.rules import Rule
from ros_scenesense.reasoning.explanation.support import GroundLiteral, Instance, Sign, instances

Answer = frozenset[clingo.Symbol]


class Solved:
    """A program and one of its answer sets."""

    def __init__(self, program: str, answer: Answer) -> None:
        nodes: list[ast.AST] = []
        ast.parse_string(program, nodes.append)
        self.nodes = nodes
        found = (Rule.of(index, node) for index, node in enumerate(nodes))
        self.rules = [rule for rule in found if rule is not None]
        self.definitions = [n for n in nodes if n.ast_type == ast.ASTType.Definition]
        self.answer = answer
        self.instances = instances(self.rules, self.definitions, answer)
        self.proofs = Proofs((), self.instances)
        self.refutations = Refutations(self.rules, self.definitions, answer)

    def proof(self, text: str) -> Proof | None:
        return self.proofs.of(clingo.parse_term(text))

    def attempts(self, text: str) -> tuple[Attempt, ...]:
        return self.refutations.of(clingo.parse_term(text)).attempts


def answers(program: str) -> list[Answer]:
    control = clingo.Control(["0"], logger=lambda *_: None)
    control.add("base", [], program)
    control.ground()
    found: list[Answer] = []
    control.solve(on_model=lambda model: found.append(frozenset(model.symbols(atoms=True))))
    return found


def solved(program: str) -> Solved:
    return Solved(program, answers(program)[0])


def nodes_of(proof: Proof) -> Iterator[Proof]:
    yield proof
    for premise in proof.premises:
        if isinstance(premise, Proof):
            yield from nodes_of(premise)


def lines(proof: Proof, depth: int = 0) -> list[str]:
    found = [f"{'  ' * depth}{proof.atom}"]
    for premise in proof.premises:
        if isinstance(premise, Proof):
            found += lines(premise, depth + 1)
        else:
            found.append(
                f"{'  ' * (depth + 1)}{premise.sign.value} {premise.atom or premise.words}"
            )
    return found


# --- The property: what a proof rests on, with the axioms that it uses, entails what it proves.


def entailed_by_the_proof(proof: Proof) -> bool:
    """Whether the used instances of rules and the leaves alone have the root as a consequence."""
    program = []
    for node in nodes_of(proof):
        if node.by is None or node.by.chosen:
            program.append(f"{node.atom}.")
            continue
        body = []
        for literal in node.by.body:
            if literal.sign is Sign.HOLDS:
                body.append(str(literal.atom))
            elif literal.sign is Sign.FAILS:
                body.append(f"not {str(literal.atom).replace(chr(34) + '_' + chr(34), '_')}")
        tail = f" :- {', '.join(body)}" if body else ""
        program.append(f"{node.atom}{tail}.")
    found = answers("\n".join(program))
    return len(found) == 1 and proof.atom in found[0]


predicates = st.sampled_from(["p", "q", "r", "s"])
terms = st.sampled_from(["X", "Y", "1", "2"])
atoms = st.builds(lambda name, one, two: f"{name}({one},{two})", predicates, terms, terms)
bodies = st.lists(
    st.builds(lambda sign, atom: sign + atom, st.sampled_from(["", "", "not "]), atoms),
    max_size=3,
)


@st.composite
def rules(draw: st.DrawFn) -> str:
    head = draw(atoms)
    if draw(st.integers(0, 5)) == 0:
        head = f"{{ {head} }}"
    # Every variable is bound by the domain, whatever the body.
    return f"{head} :- {', '.join([*draw(bodies), 'd(X)', 'd(Y)'])}."


@st.composite
def programs(draw: st.DrawFn) -> str:
    facts = draw(
        st.lists(st.sampled_from(["p(1,2).", "q(2,1).", "r(1,1).", "s(2,2)."]), max_size=2)
    )
    return "\n".join(["d(1..2).", *facts, *draw(st.lists(rules(), min_size=1, max_size=6))])


@settings(max_examples=60, deadline=None)
@given(programs())
def test_every_atom_of_an_answer_set_is_proved_by_what_entails_it(program: str) -> None:
    for answer in answers(program)[:2]:
        case = Solved(program, answer)
        for atom in answer:
            proof = case.proofs.of(atom)
            assert proof is not None
            assert entailed_by_the_proof(proof)
        assert all(case.proofs.of(atom) is None for atom in absent(answer))


def absent(answer: Answer) -> list[clingo.Symbol]:
    every = [clingo.parse_term(f"{name}({a},{b})") for name in "pqrs" for a in "12" for b in "12"]
    return [atom for atom in every if atom not in answer]


@settings(max_examples=20, deadline=None)
@given(programs())
def test_every_rule_that_could_have_derived_an_atom_is_told_with_what_it_lacks(
    program: str,
) -> None:
    for answer in answers(program)[:1]:
        case = Solved(program, answer)
        for atom in absent(answer):
            told = {attempt.rule for attempt in case.refutations.of(atom).attempts}
            heads = {rule.index for rule in case.rules if could_derive(rule, atom)}
            assert told == heads
            for attempt in case.refutations.of(atom).attempts:
                assert all(is_true(literal, case) for literal in attempt.holds)
                if attempt.fails is None:
                    assert str(case.nodes[attempt.rule]).startswith("{")
                else:
                    assert not is_true(attempt.fails, case)


def could_derive(rule: Rule, atom: clingo.Symbol) -> bool:
    (head,) = rule.heads
    if head.atom.symbol.name != atom.name:
        return False
    arguments = [str(argument) for argument in head.atom.symbol.arguments]
    values = [str(value) for value in atom.arguments]
    bound = dict(zip(arguments, values, strict=True))
    return all(
        value == (argument if argument.isdigit() else bound[argument])
        for argument, value in zip(arguments, values, strict=True)
    )


def is_true(literal: GroundLiteral, case: Solved) -> bool:
    assert literal.atom is not None
    holds = bool(case.refutations.matches(literal.atom))
    return holds if literal.sign is Sign.HOLDS else not holds


# --- Single cases.


def test_a_recursion_is_followed_down_to_its_base() -> None:
    case = solved(
        "on(3,2). on(2,1). small(1). base(A) :- on(A,B), small(B). base(A) :- on(A,B), base(B)."
    )
    proof = case.proof("base(3)")
    assert proof is not None
    assert lines(proof) == [
        "base(3)",
        "  on(3,2)",
        "  base(2)",
        "    on(2,1)",
        "    small(1)",
    ]


def test_a_circle_of_converses_proves_nothing_by_itself() -> None:
    case = solved("above(1,2). below(B,A) :- above(A,B). above(B,A) :- below(A,B).")
    above, below = case.proof("above(1,2)"), case.proof("below(2,1)")
    assert above is not None
    assert below is not None
    assert lines(above) == ["above(1,2)"]
    assert lines(below) == ["below(2,1)", "  above(1,2)"]


def test_a_long_chain_does_not_exhaust_the_stack() -> None:
    case = solved("on(1..2000). on(0). up(0) :- on(0). up(N+1) :- up(N), on(N+1).")
    proof = case.proof("up(2000)")
    assert proof is not None
    depth = 0
    while proof.premises and isinstance(proof.premises[0], Proof):
        proof, depth = proof.premises[0], depth + 1
    assert depth == 2001


def test_a_default_rests_on_what_does_not_hold() -> None:
    case = solved("bird(1). bird(2). -fly(2). fly(X) :- bird(X), not -fly(X).")
    proof = case.proof("fly(1)")
    assert proof is not None
    assert lines(proof) == ["fly(1)", "  bird(1)", "  1 -fly(1)"]
    [attempt] = case.attempts("fly(2)")
    assert [str(each.atom) for each in attempt.holds] == ["bird(2)"]
    assert attempt.fails == GroundLiteral(Sign.FAILS, clingo.parse_term("-fly(2)"))
    assert attempt.because == (clingo.parse_term("-fly(2)"),)


def test_an_applied_cr_rule_is_an_assumption() -> None:
    # A default, an observation against it, and the CR exception that restores consistency.
    program = """
    small(1). obs(1).
    -stable(X) :- small(X), not stable(X).
    { exception(X) } :- small(X).
    stable(X) :- exception(X).
    :- obs(X), not stable(X).
    """
    case = solved(program)
    proof = case.proof("stable(1)")
    assert proof is not None
    assert lines(proof) == ["stable(1)", "  exception(1)", "    small(1)"]
    (exception,) = proof.premises
    assert isinstance(exception, Proof)
    assert exception.by is not None
    assert exception.by.chosen
    assert not proof.by.chosen  # type: ignore[union-attr]


def test_the_shortest_proof_is_preferred_then_the_shortest_body() -> None:
    case = solved("a. b :- a. c :- b. d :- c. d :- a, b. d :- b, a, a.")
    proof = case.proof("d")
    assert proof is not None
    assert proof.by is not None
    assert len(proof.by.body) == 2


def test_comparisons_arithmetic_and_aggregates_are_conditions() -> None:
    case = solved(
        'h(5). n("a\\"b"). tall(N) :- h(N), N > 4, X = N - 1, #count { Y : h(Y) } < 3, 1 <= X <= 9.'
    )
    proof = case.proof("tall(5)")
    assert proof is not None
    words = [each.words for each in proof.premises if isinstance(each, GroundLiteral)]
    assert words == ["5 > 4", "4 = 4", "3 > #count { Y: h(Y) }", "1 <= 4 <= 9"]
    [attempt] = solved("h(3). tall(N) :- h(N), N > 4.").attempts("tall(3)")
    assert attempt.fails == GroundLiteral(Sign.CONDITION, words="3 > 4")


def test_why_not_goes_as_deep_as_there_are_rules_and_not_in_circles() -> None:
    case = solved(
        "on(2,1). base(A) :- on(A,B), small(B). base(A) :- on(A,B), base(B). small(B) :- tiny(B)."
    )
    first, second = case.attempts("base(2)")
    assert str(first.fails and first.fails.atom) == "small(1)"
    [small] = first.because
    assert isinstance(small, Refutation)
    [tiny] = small.attempts[0].because
    assert isinstance(tiny, Refutation)
    assert (str(tiny.atom), tiny.attempts, tiny.cut) == ("tiny(1)", (), False)
    [base] = second.because
    assert isinstance(base, Refutation)
    assert {str(each.fails and each.fails.atom) for each in base.attempts} == {'on(1,"_B")'}
    circle = solved("d(1). p(X) :- q(X), d(X). q(X) :- p(X), d(X).").attempts("p(1)")
    [inner] = circle[0].because[0].attempts  # type: ignore[union-attr]
    assert inner.because[0].cut  # type: ignore[union-attr]


def test_a_choice_that_was_not_made_lacks_nothing() -> None:
    [attempt] = solved("a. { b } :- a. :- b.").attempts("b")
    assert attempt.fails is None
    assert [str(each.atom) for each in attempt.holds] == ["a"]


def test_constants_of_the_program_count() -> None:
    case = solved("#const most = 3. h(2). low(N) :- h(N), N < most.")
    assert case.proof("low(2)") is not None


def test_a_rule_that_the_solver_refuses_is_an_error() -> None:
    nodes: list[ast.AST] = []
    ast.parse_string("p(X) :- not q(X).", nodes.append)
    rule = Rule.of(1, nodes[1])
    assert rule is not None
    with pytest.raises(ReasoningError, match="unsafe"):
        instances([rule], [], [])


def test_an_instance_needs_what_stands_in_its_body() -> None:
    case = solved("a. b. c :- a, b, not d.")
    [instance] = [each for each in case.instances if str(each.head) == "c"]
    assert isinstance(instance, Instance)
    assert [str(each) for each in instance.needs] == ["a", "b"]
