"""All that holds in a scene besides what is to be estimated: what axioms are learned from."""

from __future__ import annotations

import clingo

from ros_scenesense.knowledge.classification import statements_about_states
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.reasoning.facts import ATTRIBUTES, SceneFacts
from ros_scenesense.reasoning.program import Messages, Program, add
from ros_scenesense.reasoning.solving import QUIET

Atoms = frozenset[tuple[str, tuple[str | int, ...]]]
"""Names and arguments; objects go by their numbers in the facts."""


class SceneStates:
    """Computes states of scenes by the definitions of a domain.

    Args:
        description: The domain; axioms about estimated fluents play no part.

    Raises:
        ReasoningError: If the domain cannot be translated.
    """

    def __init__(self, description: SystemDescription) -> None:
        attributes = description.signature.attributes
        deciding = {
            axiom.id
            for axiom in statements_about_states(description)
            if attributes[axiom.head.atom.name].kind is AttributeKind.ESTIMATED
        }
        program = Program.of(description.without(deciding))
        self._source = program.source
        self._selection = program.selection(frozenset(), everything=True)
        self._names = {
            each.name for each in attributes.values() if each.kind is not AttributeKind.ESTIMATED
        }

    def of(self, facts: SceneFacts) -> Atoms | None:
        """The atoms that hold in a scene.

        Returns:
            None if something is not known of the scene, or it contradicts itself.

        Raises:
            ReasoningError: If the solver fails.
        """
        if not is_known(facts):
            return None
        with Messages(self._source) as messages:
            control = clingo.Control(QUIET, logger=messages.take)
            add(self._selection.complete, control)
            control.add("base", [], facts.render(self._selection))
            control.ground()
            found: list[clingo.Symbol] = []
            control.solve(on_model=lambda model: found.extend(model.symbols(atoms=True)))
        return (
            frozenset(
                (symbol.name, tuple(map(_value, symbol.arguments)))
                for symbol in found
                if symbol.positive and symbol.name in self._names
            )
            or None
        )


def is_known(facts: SceneFacts) -> bool:
    """Whether every attribute of every object and every relation is known."""
    count = len(facts.objects)
    return (
        count > 0
        and len(facts.relations) == count * (count - 1) // 2
        and all(each.located for each in facts.objects)
        and all(one.of(each) is not None for one in ATTRIBUTES for each in facts.objects)
    )


def _value(term: clingo.Symbol) -> str | int:
    return int(term.number) if term.type == clingo.SymbolType.Number else str(term)
