"""The domain as it is in force: what `knowledge` says, on the definitions of the domain's text."""

from __future__ import annotations

from ros_scenesense.attention.relevance import FLUENTS
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.messages.reasoning import Knowledge


def active_description(domain: SystemDescription, knowledge: Knowledge) -> SystemDescription:
    """The domain with exactly those axioms about estimated fluents that the reasoner uses.

    Definitions and the laws of actions are those of the domain; axioms that it does not have, the
    learned ones, are read from the message like any text in the action language.

    Raises:
        LanguageError: If an axiom of the message is broken.
    """
    known = {axiom.id for axiom in knowledge.axioms}
    deciding = {
        axiom.id
        for axiom in domain.axioms
        if isinstance(axiom, StateConstraint | Default) and axiom.head.atom.name in FLUENTS.values()
    }
    description = domain.without(deciding - known)
    for axiom in knowledge.axioms:
        if axiom.origin == "learned":
            text = f"{axiom.id}: {axiom.statement}"
            description = parse(text, f"axiom {axiom.id}", description).description
    return description
