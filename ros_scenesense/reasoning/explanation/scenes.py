"""Explanations of what was decided about a scene."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import clingo

from ros_scenesense.errors import LanguageError, ReasoningError
from ros_scenesense.knowledge.action_language import parse_literal
from ros_scenesense.knowledge.classification import statements_about_states
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.names import Names
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.explanation.proof import Proof, Proofs
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.refutation import Refutations
from ros_scenesense.reasoning.explanation.rules import Rule
from ros_scenesense.reasoning.explanation.scene_vocabulary import SceneVocabulary
from ros_scenesense.reasoning.explanation.support import Instance, atoms_of, instances
from ros_scenesense.reasoning.explanation.telling import Teller
from ros_scenesense.reasoning.facts import PerceivedRelation, SceneFacts, cyclic_pairs
from ros_scenesense.reasoning.program import Messages, Program, Selection, add
from ros_scenesense.reasoning.retraction import retract
from ros_scenesense.reasoning.solving import QUIET, Outcome
from ros_scenesense.reasoning.syntax import Statement


@dataclass(frozen=True)
class SceneExplanation:
    """The answer to "why?" or "why not?".

    Attributes:
        literal: The literal asked about, in the action language.
        holds: Whether it holds.
        reason: Why it does, or why it does not.
        withdrawn: Perceived relations that are not believed, since the scene contradicts itself.
        renamed: Objects that are called otherwise in the action language: name there, own name.
    """

    literal: str
    holds: bool
    reason: Reason
    withdrawn: tuple[PerceivedRelation, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()


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


class SceneExplainer:
    """Explains the literals of one scene.

    Args:
        program: The knowledge, translated from a domain.
        facts: The scene.
        withheld: Ids of axioms that were switched off.
        time_limit_s: Limit of each search where the scene contradicts itself.

    Raises:
        ReasoningError: If the program was not translated from a domain, or the scene has no answer
            set whatever is withdrawn, so that there is nothing to explain.
    """

    def __init__(
        self,
        program: Program,
        facts: SceneFacts,
        withheld: Collection[str] = (),
        time_limit_s: float = 10.0,
    ) -> None:
        if program.description is None:
            raise ReasoningError(f"{program.source} was not translated from a domain")
        self._names = Names([each.name for each in facts.objects], _constants(program.description))
        self._domain = program.description.with_members("object", self._names.constants)
        self._withheld = frozenset(withheld)
        asked = program.selection(self._withheld, everything=True)
        self._solved = _solved(facts, asked, program.source, time_limit_s)
        known = {clingo.parse_term(each.atom): each for each in facts.statements(asked)}
        self._vocabulary = SceneVocabulary(
            self._domain, facts, self._solved.statements, self._names, known
        )

    def literal(self, text: str) -> Literal:
        """Reads a literal such as `-stable(red_can)`; objects go by their names.

        Raises:
            LanguageError: If it is none, or speaks of what is not in the scene.
        """
        try:
            return parse_literal(text, self._domain)
        except LanguageError as error:
            renamed = [f"{name!r} is called {constant}" for constant, name in self._renamed()]
            hint = f" ({'; '.join(renamed[:5])})" if renamed else ""
            raise LanguageError(f"{error}{hint}") from error

    def explain(self, literal: Literal) -> SceneExplanation:
        """Why a literal holds, or why it does not."""
        teller = Teller(self._vocabulary, self._proofs)
        proof = self._proof(literal)
        if proof is None:
            reason = self._failure(literal, teller)
        elif self._solved.is_certain(self._vocabulary.symbol(literal)):
            reason = teller.proof(proof)
        else:
            words = (
                "it holds in some answer sets only, as there are defaults that oppose each other"
            )
            reason = Reason(str(literal), Role.MISSING, words=words, reasons=(teller.proof(proof),))
        return SceneExplanation(
            literal=str(literal),
            holds=reason.role is not Role.MISSING,
            reason=reason,
            withdrawn=self._solved.withdrawn,
            renamed=tuple(self._renamed()),
        )

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
        for axiom in statements_about_states(self._domain):
            head = axiom.head
            about = (head.positive, head.atom.name) == (literal.positive, literal.atom.name)
            if about and axiom.id in self._withheld:
                says = f"{axiom.words or axiom} It is withheld."
                yield Reason(str(literal), Role.ATTEMPT, axiom.id, says)

    def _renamed(self) -> Iterator[tuple[str, str]]:
        for constant in self._names.constants:
            name = self._names.name(constant)
            if name != str(constant):
                yield str(constant), name


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


def _constants(description: SystemDescription) -> set[str]:
    signature = description.signature
    members = (each for sort in signature.sorts for each in signature.members(sort))
    return {each.name for each in members if isinstance(each, Constant)}
