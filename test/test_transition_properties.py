"""The program of planning against the definitions of the action language, on random domains."""

from __future__ import annotations

import clingo
from brute_force import BruteForce, State
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from test_knowledge_properties import COST, domains

from ros_scenesense.knowledge.action_language import Domain, parse_literal
from ros_scenesense.knowledge.description import Happened, History
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.knowledge.transition_program import TransitionProgram

ACTIONS = [Atom("go", (Constant("a"),)), Atom("go", (Constant("b"),)), Atom("stop")]


@settings(COST, max_examples=100)
@given(domains(restoring=False), st.data())
def test_a_step_of_the_program_leads_where_the_transition_diagram_does(
    domain: Domain, data: st.DataObject
) -> None:
    brute = BruteForce(domain.description)
    initial = sorted(brute.paths(History()), key=lambda path: sorted(path[0]))
    assume(initial)
    (start,) = data.draw(st.sampled_from(initial))
    action = data.draw(st.sampled_from(ACTIONS))
    given_at_first = tuple(
        parse_literal(atom if sign else f"-{atom}", domain.description)
        for atom, sign in sorted(start)
        if atom in brute.inertial
    )
    history = History(happened=(Happened(action, 0),), initial=given_at_first)
    paths = {path for path in brute.paths(history) if path[0] == start}
    assert successors(domain, given_at_first, action, brute, start) == paths


def successors(
    domain: Domain, initial: tuple[Literal, ...], action: Atom, brute: BruteForce, start: State
) -> set[tuple[State, State]]:
    """The pairs of states that the program has, if everything bears on the question."""
    atoms = (*brute.inertial, *brute.defined, *brute.estimated)
    asked = [parse_literal(atom, domain.description) for atom in atoms]
    program = TransitionProgram(domain.description, asked, initial)
    fact = f"#program base. {program.occurring(action, '1')}."
    control = clingo.Control(["0", "--opt-mode=ignore"], logger=lambda *_: None)
    control.add("base", [], program.text() + fact)
    number = [[clingo.Number(step)] for step in range(2)]
    control.ground([("base", []), ("state", number[0]), ("step", number[1]), ("state", number[1])])
    found = set()
    with control.solve(yield_=True) as handle:
        for model in handle:
            true = {str(symbol).replace(",", ", ") for symbol in model.symbols(atoms=True)}
            states = tuple(
                frozenset(_believed(domain, program, atoms, true, step)) for step in range(2)
            )
            if states[0] == start:
                found.add(states)
    return found


def _believed(domain, program, atoms, true, step):
    for atom in atoms:
        literal = parse_literal(atom, domain.description)
        kind = domain.description.signature.attributes[literal.atom.name].kind
        timed = f"{atom[:-1]}, {step})" if atom.endswith(")") else f"{atom}({step})"
        if timed in true:
            yield atom, True
        elif kind is not AttributeKind.ESTIMATED:
            yield atom, False
        if program.helper(f"no_{timed}") in true:
            yield atom, False
