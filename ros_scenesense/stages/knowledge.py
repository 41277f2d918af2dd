"""The knowledge in force: what is given, less what is withheld or refuted, and what was learned."""

from __future__ import annotations

import hashlib

from ros_scenesense.errors import ParameterError, SceneSenseError
from ros_scenesense.knowledge.axioms import CausalLaw, ExecutabilityCondition
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import Axioms, LearnedAxiom
from ros_scenesense.messages.reasoning import Knowledge, KnownAxiom
from ros_scenesense.reasoning.program import Program, with_axiom


class KnowledgeInForce:
    """Follows the learned axioms.

    Args:
        given: The program of what is given.
        withheld: Ids of given axioms to leave out, separated by commas.

    Attributes:
        program: What is given and what was learned.
        withheld: Ids of axioms of the program that are not in force.
        revision: Changes if and only if the axioms in force do.

    Raises:
        ParameterError: If an axiom to leave out does not exist.
    """

    def __init__(self, given: Program, withheld: str) -> None:
        self._given = given
        self._withheld = _ids(withheld, given)
        self._learned: frozenset[str] = frozenset()
        self._laws: tuple[CausalLaw | ExecutabilityCondition, ...] = ()
        self.program = given
        self.withheld = self._withheld
        self.revision = self._revision()

    def apply(self, axioms: Axioms) -> list[str]:
        """Puts learned axioms in the place of those before, each checked like any other.

        Returns:
            What was refused, in words.
        """
        description = self._given.description
        if description is None:
            return [f"{self._given.source} is no domain, so nothing can be learned about it"]
        refused: list[str] = []
        accepted: list[str] = []
        for each in axioms.axioms:
            try:
                longer = with_axiom(description, each.id, each.text)
                _check_kind(each, longer.axioms[-1].kind)
            except SceneSenseError as error:
                refused.append(f"learned axiom {each.id!r} is refused: {error}")
            else:
                description = longer
                accepted.append(each.id)
        known = {axiom.id for axiom in self._given.axioms}
        for name in axioms.refuted:
            if name not in known:
                refused.append(f"refuted axiom {name!r} is none of the given ones")
        self._learned = frozenset(accepted)
        self.program = Program.of(description) if accepted else self._given
        self.withheld = self._withheld | (known & set(axioms.refuted))
        self._laws = tuple(
            axiom
            for axiom in description.axioms
            if axiom.id in self._learned and isinstance(axiom, CausalLaw | ExecutabilityCondition)
        )
        self.revision = self._revision()
        return refused

    def message(self, now_ns: int) -> Knowledge:
        """The axioms in force: those that decide, and what was learned about actions."""
        axioms = [
            KnownAxiom(
                id=axiom.id,
                text=axiom.text,
                statement=self.program.statement(axiom.id),
                kind=axiom.kind,
                origin="learned" if axiom.id in self._learned else "given",
            )
            for axiom in self.program.axioms
            if axiom.id not in self.withheld
        ]
        axioms += [
            KnownAxiom(
                id=law.id, text=str(law), statement=str(law), kind=law.kind, origin="learned"
            )
            for law in self._laws
        ]
        return Knowledge(stamp=Stamp.of(now_ns), revision=self.revision, axioms=axioms)

    def _revision(self) -> str:
        """A hash of all that is in force, actions included."""
        deciding = self.program.revision(self.withheld)
        about_actions = [
            *sorted(self.withheld - {axiom.id for axiom in self.program.axioms}),
            *(f"{law.id}: {law}" for law in self._laws),
        ]
        if not about_actions:
            return deciding
        words = "\n".join([deciding, *about_actions])
        return hashlib.sha256(words.encode()).hexdigest()[:12]


def _check_kind(learned: LearnedAxiom, kind: str) -> None:
    if learned.kind != kind:
        raise ParameterError(f"it says it is {learned.kind}, but its text is {kind}")


def _ids(names: str, program: Program) -> frozenset[str]:
    chosen = frozenset(name.strip() for name in names.split(",") if name.strip())
    known = [axiom.id for axiom in program.axioms]
    if program.description is not None:
        laws = (CausalLaw, ExecutabilityCondition)
        known += [each.id for each in program.description.axioms if isinstance(each, laws)]
    known = list(dict.fromkeys(known))
    if not chosen <= set(known):
        raise ParameterError(
            f"parameter 'withheld' is {names!r}, must be a comma-separated choice of "
            f"{', '.join(known)}"
        )
    return chosen
