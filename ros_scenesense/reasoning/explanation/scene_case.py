"""One scene as the solver sees it: its answer set, and the proofs and refutations in it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import clingo

from ros_scenesense.errors import ReasoningError
from ros_scenesense.knowledge.classification import statements_about_states
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.names import Names
from ros_scenesense.reasoning.explanation.proof import Proof, Proofs
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.refutation import Refutations
from ros_scenesense.reasoning.explanation.rules import Rule
from ros_scenesense.reasoning.explanation.scene_vocabulary import SceneVocabulary
from ros_scenesense.reasoning.explanation.support import Instance, atoms_of, instances
from ros_scenesense.reasoning.explanation.telling import Teller
from ros_scenesense.reasoning.facts import PerceivedRelation, SceneFacts, cyclic_pairs
from ros_scenesense.reasoning.program import Messages, Selection, add
from ros_scenesense.reasoning.retraction import retract
from ros_scenesense.reasoning.solving import QUIET, Outcome
from ros_scenesense.reasoning.syntax import Statement


@dataclass(frozen=True)
class SceneQuestion:
    """What there is to explain.

    Attributes:
        domain: The domain with the objects of the scene.
        facts: The scene.
        names: What the objects are called in the action language.
        withheld: Ids of axioms that were switched off.
        source: Where the program comes from, for messages.
        time_limit_s: Limit of each search where the scene contradicts itself.
    """

    domain: SystemDescription
    facts: SceneFacts
    names: Names
    withheld: frozenset[str]
    source: str
    time_limit_s: float


class SceneCase:
    """The explanations that a selection of the program allows.

    Args:
        question: What there is to explain.
        asked: The statements to explain it by.

    Attributes:
        withdrawn: Perceived relations that are not believed, since the scene contradicts itself.

    Raises:
        ReasoningError: If there is no answer set, whatever is withdrawn.
    """

    def __init__(self, question: SceneQuestion, asked: Selection) -> None:
        facts = question.facts
        self._question = question
        self._solved = _solved(facts, asked, question.source, question.time_limit_s)
        self.withdrawn = self._solved.withdrawn
        known = {clingo.parse_term(each.atom): each for each in facts.statements(asked)}
        self._vocabulary = SceneVocabulary(
            question.domain, facts, self._solved.statements, question.names, known
        )

    def reason(self, literal: Literal) -> Reason:
        """Why a literal holds, or why it does not: then its role is `missing`."""
        teller = Teller(self._vocabulary, self._proofs)
        proof = self._proof(literal)
        if proof is None:
            return self._failure(literal, teller)
        opposite = self._proof(literal.complement)
        if opposite is not None:
            # Of plain atoms only the two sides of an estimated fluent can both be concluded.
            words = f"{literal.complement} is concluded too, which is inconsistent"
            both = (teller.proof(proof), teller.proof(opposite))
            return Reason(str(literal), Role.MISSING, words=words, reasons=both)
        if self._solved.is_certain(self._vocabulary.symbol(literal)):
            return teller.proof(proof)
        words = "it holds in some answer sets only, as there are defaults that oppose each other"
        return Reason(str(literal), Role.MISSING, words=words, reasons=(teller.proof(proof),))

    @cached_property
    def _rules(self) -> list[Rule]:
        found = (Rule.of(index, each.node) for index, each in enumerate(self._solved.statements))
        return [rule for rule in found if rule is not None]

    @cached_property
    def _proofs(self) -> Proofs:
        facts = atoms_of(self._solved.text)
        applied = instances(self._rules, (), self._solved.answer)
        return Proofs(facts, applied, self._preference)

    def _preference(self, instance: Instance) -> int:
        return int(self._vocabulary.is_default(instance.rule))

    def _proof(self, literal: Literal) -> Proof | None:
        """The proof of a literal, by a normal axiom if there is one."""
        proofs = map(self._proofs.of, self._tagged(literal))
        found = [proof for proof in proofs if proof is not None]
        return min(
            found,
            key=lambda proof: (proof.by is not None and self._preference(proof.by), proof.atom),
            default=None,
        )

    def _tagged(self, literal: Literal) -> list[clingo.Symbol]:
        """The atoms that conclude a literal by one axiom, or the literal itself."""
        pattern = self._vocabulary.pattern(literal)
        if pattern == self._vocabulary.symbol(literal):
            return [pattern]
        return self._refutations.matches(pattern)

    @cached_property
    def _refutations(self) -> Refutations:
        return Refutations(self._rules, (), self._solved.answer)

    def _failure(self, literal: Literal, teller: Teller) -> Reason:
        # The opposite first, since what is told once is only mentioned after that.
        opposite = self._proof(literal.complement)
        told = [] if opposite is None else [teller.proof(opposite)]
        reason = teller.refutation(self._refutations.of(self._vocabulary.pattern(literal)))
        reason = replace(reason, literal=str(literal))
        reasons = [*told, *reason.reasons, *self._left_out(literal)]
        words = reason.words
        if opposite is None and self._vocabulary.is_estimated(literal):
            words = f"nor does {literal.complement}: it is undecided"
        return replace(reason, words=words, reasons=tuple(reasons))

    def _left_out(self, literal: Literal) -> Iterator[Reason]:
        """The axioms that might conclude a literal but are switched off."""
        for axiom in statements_about_states(self._question.domain):
            head = axiom.head
            about = (head.positive, head.atom.name) == (literal.positive, literal.atom.name)
            if about and axiom.id in self._question.withheld:
                says = f"{axiom.words or axiom} It is withheld."
                yield Reason(str(literal), Role.ATTEMPT, axiom.id, says)


@dataclass(frozen=True)
class _Solved:
    """One answer set of a scene, and what it was computed from.

    Attributes:
        statements: The program.
        text: The facts.
        control: The solver, grounded.
        answer: The answer set.
        withdrawn: Perceived relations that the facts leave out.
    """

    statements: tuple[Statement, ...]
    text: str
    control: clingo.Control
    answer: frozenset[clingo.Symbol]
    withdrawn: tuple[PerceivedRelation, ...] = ()

    def is_certain(self, atom: clingo.Symbol) -> bool:
        """Whether an atom of this answer set is in all others too."""
        return bool(self.control.solve(assumptions=[(atom, False)]).unsatisfiable)


def _solved(facts: SceneFacts, asked: Selection, source: str, time_limit_s: float) -> _Solved:
    statements = asked.complete if facts.is_complete(asked) else asked.open
    found = _first(statements, facts.render(asked), source)
    if found is not None and not cyclic_pairs(_supports(found.answer)):
        return found
    retraction = retract(facts, asked, source, time_limit_s)
    if retraction.outcome is Outcome.FOUND:
        text = facts.render(asked, retractable=True)
        text += "".join(f"retracted({index})." for index in sorted(retraction.chosen))
        restored = _first(asked.open, text, source)
        if restored is not None:
            perceived = facts.perceived(asked.used)
            withdrawn = tuple(perceived[index] for index in sorted(retraction.chosen))
            return replace(restored, withdrawn=withdrawn)
    raise ReasoningError(
        "the scene is inconsistent, whatever of it is withdrawn: nothing holds, so there is "
        "nothing to explain; its beliefs say what contradicts each other"
    )


def _first(statements: tuple[Statement, ...], text: str, source: str) -> _Solved | None:
    found: list[frozenset[clingo.Symbol]] = []
    with Messages(source) as messages:
        control = clingo.Control(QUIET, logger=messages.take)
        add(statements, control)
        control.add("base", [], text)
        control.ground()
        control.solve(on_model=lambda model: found.append(frozenset(model.symbols(atoms=True))))
    return _Solved(statements, text, control, found[-1]) if found else None


def _supports(answer: Collection[clingo.Symbol]) -> list[tuple[str, str]]:
    pairs = (each.arguments for each in answer if each.match("on", 2) or each.match("in", 2))
    return [(str(upper), str(lower)) for upper, lower in pairs]
