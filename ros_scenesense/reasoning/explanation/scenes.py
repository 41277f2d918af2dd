"""Explanations of what was decided about a scene."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from ros_scenesense.errors import LanguageError, ReasoningError
from ros_scenesense.knowledge.action_language import parse_literal
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.names import Names
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Constant
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.scene_case import SceneCase, SceneQuestion
from ros_scenesense.reasoning.facts import PerceivedRelation, SceneFacts
from ros_scenesense.reasoning.program import Program


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
        self._program = program
        self._question = SceneQuestion(
            self._domain, facts, self._names, frozenset(withheld), program.source, time_limit_s
        )
        self._deciding = program.selection(self._question.withheld)
        self._cases = {False: SceneCase(self._question, self._deciding)}

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
        case = self._case(everything=not self._bears_on_decisions(literal))
        reason = case.reason(literal)
        return SceneExplanation(
            literal=str(literal),
            holds=reason.role is not Role.MISSING,
            reason=reason,
            withdrawn=case.withdrawn,
            renamed=tuple(self._renamed()),
        )

    def _case(self, everything: bool) -> SceneCase:
        """The case with the statements that decide or, at more cost, with all."""
        if everything not in self._cases:
            asked = self._program.selection(self._question.withheld, everything)
            self._cases[everything] = SceneCase(self._question, asked)
        return self._cases[everything]

    def _bears_on_decisions(self, literal: Literal) -> bool:
        atom = literal.atom
        attribute = self._domain.signature.attributes[atom.name]
        return (
            attribute.kind is AttributeKind.ESTIMATED
            or (atom.name, len(atom.arguments)) in self._deciding.used
        )

    def _renamed(self) -> Iterator[tuple[str, str]]:
        for constant in self._names.constants:
            name = self._names.name(constant)
            if name != str(constant):
                yield str(constant), name


def _constants(description: SystemDescription) -> set[str]:
    signature = description.signature
    members = (each for sort in signature.sorts for each in signature.members(sort))
    return {each.name for each in members if isinstance(each, Constant)}
