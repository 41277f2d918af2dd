from __future__ import annotations

import clingo
import pytest

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.axioms import (
    CausalLaw,
    Default,
    ExecutabilityCondition,
    StateConstraint,
)
from ros_scenesense.knowledge.literals import Atom, Belief, Comparison, Literal, Membership
from ros_scenesense.knowledge.names import Names
from ros_scenesense.knowledge.rendering import body_texts, rule_text, sort_texts
from ros_scenesense.knowledge.signature import Action, Attribute, AttributeKind, Signature, Sort
from ros_scenesense.knowledge.sorting import Guard, guards, sorts_of
from ros_scenesense.knowledge.terms import Arithmetic, Constant, Number, Record, Term, Variable

A, B, N = Variable("A"), Variable("B"), Variable("N")
OBJECT, LOCATION = Sort("object", ("location",)), Sort("location", members=(Constant("table"),))


def literal(name: str, *arguments: Term, positive: bool = True) -> Literal:
    return Literal(Atom(name, arguments), positive)


def believed(name: str, *arguments: Term) -> Belief:
    return Belief(literal(name, *arguments))


@pytest.fixture
def signature() -> Signature:
    fluents = {
        "on": ("object", "location"),
        "above": ("object", "object"),
        "height": ("object", "level"),
        "stable": ("object",),
    }
    return Signature(
        {each.name: each for each in (LOCATION, OBJECT, Sort("level", bounds=(1, 8)))},
        {name: Attribute(name, AttributeKind.INERTIAL, sorts) for name, sorts in fluents.items()},
        {"put": Action("put", ("object", "location"))},
    )


def dialect(literal: Literal, atom: str) -> str:
    return f"{'' if literal.positive else '-'}holds({atom}, I)"


def test_terms_and_axioms_are_written_as_in_the_language() -> None:
    height = literal("height", A, Arithmetic("+", N, Number(1)))
    law = StateConstraint(id="h", head=height, body=(believed("on", A, B), Comparison("<", N, B)))
    assert str(law) == "height(A, N + 1) if on(A, B), N < B."
    nested = Arithmetic("*", Arithmetic("-", N, Number(-1)), Record("f", (A, Constant("b"))))
    assert str(nested) == "(N - -1) * f(A, b)"
    put = Atom("put", (A, B))
    causal = CausalLaw(id="p", action=put, effect=literal("on", A, B))
    assert str(causal) == "put(A, B) causes on(A, B)."
    condition = ExecutabilityCondition(
        id="i", actions=(put, put), body=(Belief(literal("above", B, A, positive=False), True),)
    )
    assert str(condition) == "impossible put(A, B), put(A, B) if not -above(B, A)."
    default = Default(id="d", head=literal("stable", A), body=(Membership("object", A, True),))
    assert str(default) == "normally stable(A) if not object(A)."
    assert default.kind == "default"


@pytest.mark.parametrize("name", ["", "A", "not", "a). bad(", "a-b", "é", "a\n", "a" * 10_000])
def test_what_is_no_name_becomes_no_part_of_a_term(name: str) -> None:
    for make in (Constant, Atom, lambda text: Record(text, ()), lambda text: Membership(text, A)):
        with pytest.raises(LanguageError) as caught:
            make(name)
        assert len(str(caught.value)) < 300


def test_a_number_of_more_than_32_bits_is_refused() -> None:
    assert str(Number(2**31 - 1)) == "2147483647"
    with pytest.raises(LanguageError, match="beyond 2147483647"):
        Number(2**31)


def test_a_sort_holds_what_the_sorts_below_it_hold(signature: Signature) -> None:
    scene = signature.with_members("object", [Constant("can"), Constant("can")])
    assert scene.is_subsort("object", "location")
    assert not scene.is_subsort("location", "object")
    assert scene.members("location") == (Constant("table"), Constant("can"))
    assert scene.members("object") == (Constant("can"),)
    assert scene.contains("location", Constant("can"))
    assert not scene.contains("object", Constant("table"))
    assert scene.contains("level", Number(8))
    assert not scene.contains("level", Number(9))
    assert len(scene.members("level")) == 8


def test_a_sort_below_itself_does_no_harm() -> None:
    sorts = {"a": Sort("a", ("b",)), "b": Sort("b", ("a",), (Constant("x"),))}
    assert Signature(sorts, {}, {}).members("a") == (Constant("x"),)


def test_guards_say_what_the_premises_do_not_imply(signature: Signature) -> None:
    body = (believed("on", A, B), believed("height", B, N))
    law = StateConstraint(
        id="h", head=literal("height", A, Arithmetic("+", N, Number(1))), body=body
    )
    assert guards(law, signature) == (Guard("level", Arithmetic("+", N, Number(1))),)
    bottom = StateConstraint(
        id="s", head=literal("stable", A), body=(Belief(literal("above", A, B), True),)
    )
    assert guards(bottom, signature) == (Guard("object", A),)
    impossible = ExecutabilityCondition(
        id="i", actions=(Atom("put", (A, B)),), body=(Belief(literal("on", B, A), True),)
    )
    assert guards(impossible, signature) == (Guard("object", A), Guard("object", B))
    assert sorts_of(B, impossible.conclusions, impossible.premises, signature) == ("object",)


def test_a_rule_of_an_axiom_has_guards_and_local_variables(signature: Signature) -> None:
    law = CausalLaw(
        id="p",
        action=Atom("put", (A, B)),
        effect=literal("on", A, B),
        body=(Belief(literal("above", N, A), True), Comparison("!=", A, B)),
    )
    body = body_texts(law, signature, dialect)
    assert rule_text("x", body) == "x :- holds(put(A, B), I), not holds(above(_, A), I), A != B."
    assert rule_text("x") == "x."
    long = rule_text("x", [f"condition({number})" for number in range(20)])
    assert len(long.splitlines()) > 2
    assert all(len(line) <= 100 for line in long.splitlines())


def test_sorts_become_predicates(signature: Signature) -> None:
    control = clingo.Control()
    scene = signature.with_members("object", [Constant("can"), Constant("duck")])
    control.add("\n".join(sort_texts(scene)))
    control.ground()
    names = {str(atom.symbol) for atom in control.symbolic_atoms if atom.symbol.name == "location"}
    assert names == {"location(table)", "location(can)", "location(duck)"}
    assert len(list(control.symbolic_atoms.by_signature("level", 1))) == 8


def test_names_from_outside_become_constants_and_come_back() -> None:
    bad = "a). bad("
    names = Names(["can", bad, "table", "object_2", "can", "x" * 10_000], taken={"table"})
    assert [str(each) for each in names.constants] == [
        "can",
        "object_2",
        "object_1",
        "object_3",
        "object_4",
    ]
    assert names.name(names.constant(bad)) == bad
    assert str(names.constant(bad)) == "object_1"
    assert str(names.constant("can")) == "can"
    with pytest.raises(KeyError):
        names.constant("dog")
