"""A domain as the program that classifies one scene.

The program is about a single state and has no steps. What is perceived are facts; static, inertial
and defined literals are plain atoms. Of an estimated fluent F it derives `pos(F, I)`, true by axiom
I, and `neg(F, I)`, false: plain atoms too, so that an object that gets both is inconsistent alone
and does not make the whole scene unsatisfiable. An axiom that is switched off is left out.

A literal under `not` is the delicate part. Nothing may be concluded from the absence of what was
merely not seen or not said, so absence counts only where it is known: `not above(A, B)` is written
twice, for scenes of which everything is known as it stands, and for the others as
`not possible(above(A, _))`. Possible is what holds, what is `unknown`, and what axioms would
conclude from something possible.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from enum import StrEnum

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.axioms import Axiom, Default, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Condition, Literal
from ros_scenesense.knowledge.rendering import (
    atom_text,
    condition_text,
    guard_text,
    rule_text,
    sort_texts,
)
from ros_scenesense.knowledge.signature import Attribute, AttributeKind
from ros_scenesense.knowledge.sorting import guards, guards_of, local_variables
from ros_scenesense.knowledge.terms import Variable

RESERVED = ("pos", "neg", "possible", "unknown")
"""Predicates of the program that no sort, fluent or static may be called."""


class Scenes(StrEnum):
    """The scenes that a rule is for: all, those of which everything is known, or the others."""

    ALL = "all"
    COMPLETE = "complete"
    OPEN = "open"


@dataclass(frozen=True)
class ClassificationRule:
    """A rule of the program in clingo's language.

    Attributes:
        text: The rule.
        axiom: Id of the axiom that it says; None for what is always there.
        scenes: The scenes that it is for.
    """

    text: str
    axiom: str | None = None
    scenes: Scenes = Scenes.ALL


def classification_rules(description: SystemDescription) -> tuple[ClassificationRule, ...]:
    """Translates what a domain says about single states: its state constraints and defaults.

    Causal laws, executability conditions and defaults about the initial state of a history say
    nothing of a scene that is merely looked at.

    Raises:
        LanguageError: If a name of the domain is `RESERVED`.
    """
    signature = description.signature
    for name in (*signature.sorts, *signature.attributes):
        if name in RESERVED:
            place = (signature.sorts.get(name) or signature.attributes[name]).place
            raise LanguageError(
                f"{place or description.source}: {name!r} is a word of the classification program: "
                "choose another name"
            )
    return tuple(_Translation(description).rules())


def statements_about_states(description: SystemDescription) -> list[StateConstraint | Default]:
    """The axioms that the classification program is made of."""
    return [each for each in description.axioms if isinstance(each, StateConstraint | Default)]


class _Translation:
    def __init__(self, description: SystemDescription) -> None:
        self._description = description
        self._signature = description.signature
        self._axioms = statements_about_states(description)
        self._denied = self._used_denials()
        self._uncertain = self._used_absences()

    def rules(self) -> Iterator[ClassificationRule]:
        for text in sort_texts(self._signature):
            yield ClassificationRule(text)
        for literal in self._description.facts:
            yield ClassificationRule(rule_text(self._believed(literal, str(literal.atom))))
        for axiom in self._axioms:
            yield from self._axiom(axiom)
        for attribute in self._attributes(self._denied):
            if attribute.kind is not AttributeKind.STATIC:
                yield from self._closed(attribute)
        for attribute in self._attributes(self._uncertain):
            yield from self._possible(attribute)

    def _axiom(self, axiom: StateConstraint | Default) -> Iterator[ClassificationRule]:
        atom = atom_text(axiom.head.atom)
        head = self._believed(axiom.head, atom)
        if self._estimated(axiom.head):
            head = f"{head[:-1]}, {axiom.id})"
        exception = []
        if isinstance(axiom, Default):
            exception = [f"not {self._believed(axiom.head.complement, atom)}"]
        bodies = {
            scenes: [*self._body(axiom, scenes), *exception]
            for scenes in (Scenes.COMPLETE, Scenes.OPEN)
        }
        yield from self._rules_for(head, bodies, axiom.id)

    def _closed(self, attribute: Attribute) -> Iterator[ClassificationRule]:
        """Where its absence is known, a literal that is used as false is false."""
        atom = _general(attribute)
        sorts = map(guard_text, guards_of([Literal(atom)], [], self._signature))
        body = [*sorts]
        bodies = {
            Scenes.COMPLETE: [*body, f"not {atom_text(atom)}"],
            Scenes.OPEN: [*body, f"not possible({atom_text(atom)})"],
        }
        yield from self._rules_for(f"-{atom_text(atom)}", bodies, None)

    def _possible(self, attribute: Attribute) -> Iterator[ClassificationRule]:
        text = atom_text(_general(attribute))
        for reason in (text, f"unknown({text})"):
            yield ClassificationRule(f"possible({text}) :- {reason}.", scenes=Scenes.OPEN)
        for axiom in self._axioms:
            if axiom.head.positive and axiom.head.atom.name == attribute.name:
                head = f"possible({atom_text(axiom.head.atom)})"
                body = self._body(axiom, Scenes.OPEN, possible=True)
                yield ClassificationRule(rule_text(head, body), axiom.id, Scenes.OPEN)

    def _rules_for(
        self, head: str, bodies: dict[Scenes, list[str]], axiom: str | None
    ) -> Iterator[ClassificationRule]:
        texts = {scenes: rule_text(head, body) for scenes, body in bodies.items()}
        if len(set(texts.values())) == 1:
            yield ClassificationRule(texts[Scenes.OPEN], axiom)
            return
        for scenes, text in texts.items():
            yield ClassificationRule(text, axiom, scenes)

    def _body(self, axiom: Axiom, scenes: Scenes, possible: bool = False) -> list[str]:
        local = local_variables(axiom.conclusions, axiom.premises)
        body = [self._condition(each, local, scenes, possible) for each in axiom.premises]
        return [*body, *map(guard_text, guards(axiom, self._signature))]

    def _condition(
        self, condition: Condition, local: Collection[Variable], scenes: Scenes, possible: bool
    ) -> str:
        if not isinstance(condition, Belief) or self._estimated(condition.literal):
            return condition_text(condition, self._believed, local, self._signature)
        atom = atom_text(condition.literal.atom, local)
        if not condition.literal.positive:
            # What is false is never more than known to be false, so the program is stratified.
            return condition_text(condition, self._believed, local, self._signature)
        if condition.negated:
            # Possible is what is not known to fail, so here the literal itself must be known.
            certain = scenes is Scenes.COMPLETE or possible
            return f"not {atom}" if certain else f"not possible({atom})"
        return f"possible({atom})" if possible else atom

    def _believed(self, literal: Literal, atom: str) -> str:
        if self._estimated(literal):
            return f"{'pos' if literal.positive else 'neg'}({atom})"
        return atom if literal.positive else f"-{atom}"

    def _estimated(self, literal: Literal) -> bool:
        return self._signature.attributes[literal.atom.name].kind is AttributeKind.ESTIMATED

    def _attributes(self, names: Collection[str]) -> Iterator[Attribute]:
        return (each for each in self._signature.attributes.values() if each.name in names)

    def _beliefs(self) -> Iterator[tuple[Axiom, Belief]]:
        for axiom in self._axioms:
            for premise in axiom.premises:
                if isinstance(premise, Belief) and not self._estimated(premise.literal):
                    yield axiom, premise

    def _used_denials(self) -> set[str]:
        return {
            belief.literal.atom.name for _, belief in self._beliefs() if not belief.literal.positive
        }

    def _used_absences(self) -> set[str]:
        """Attributes that stand under `not`, and what their definitions are made of."""
        found = {
            belief.literal.atom.name
            for _, belief in self._beliefs()
            if belief.negated and belief.literal.positive
        } | {
            name
            for name in self._denied
            if self._signature.attributes[name].kind is not AttributeKind.STATIC
        }
        while True:
            more = found | {
                belief.literal.atom.name
                for axiom, belief in self._beliefs()
                if belief.literal.positive
                and not belief.negated
                and any(_is_positive(head, found) for head in axiom.conclusions)
            }
            if more == found:
                return found
            found = more


def _is_positive(head: Literal | Atom, names: Collection[str]) -> bool:
    return isinstance(head, Literal) and head.positive and head.atom.name in names


def _general(attribute: Attribute) -> Atom:
    """The atom with a variable for each argument."""
    count = len(attribute.arguments)
    return Atom(attribute.name, tuple(Variable(f"X{index + 1}") for index in range(count)))
