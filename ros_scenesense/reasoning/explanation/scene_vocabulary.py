"""What the atoms of the classification program mean to people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import clingo

from ros_scenesense.knowledge.classification import statements_about_states
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.names import Names
from ros_scenesense.knowledge.rendering import term_text
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Constant, Term
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.rules import LOCAL
from ros_scenesense.reasoning.facts import ATTRIBUTES, RELATIONS, SceneFact, SceneFacts
from ros_scenesense.reasoning.syntax import Statement

_NUMBER = clingo.SymbolType.Number
_TAGS = {"pos": "", "neg": "-"}


def _tag(literal: Literal) -> str:
    return "pos" if literal.positive else "neg"


class SceneVocabulary:
    """The vocabulary of one scene.

    Args:
        description: The domain.
        facts: The scene.
        statements: The program, as rules count it.
        names: What the objects are called in the action language.
        known: The facts of the scene by their atoms.
    """

    def __init__(
        self,
        description: SystemDescription,
        facts: SceneFacts,
        statements: Sequence[Statement],
        names: Names,
        known: Mapping[clingo.Symbol, SceneFact],
    ) -> None:
        self._signature = description.signature
        self._facts = facts
        self._statements = statements
        self._names = names
        self._known = known
        self._constants = [str(names.constant(each.name)) for each in facts.objects]
        self._number = {name: index for index, name in enumerate(self._constants)}
        self._says: dict[str, str] = {}
        self._defaults: set[str] = set()
        for axiom in statements_about_states(description):
            self._says[axiom.id] = axiom.words or str(axiom)
            if axiom.kind == "default":
                self._defaults.add(axiom.id)
                self._says[axiom.id] += " (A default.)"

    def literal(self, atom: clingo.Symbol, negated: bool = False) -> str | None:
        """The literal in the action language; None for sorts and for what is not well-sorted."""
        if atom.name in _TAGS and 1 <= len(atom.arguments) <= 2:
            return f"{_TAGS[atom.name]}{self._text(atom.arguments[0])}"
        if atom.name == "possible":
            text = self._text(atom.arguments[0])
            return text if negated else f"{text} may hold"
        if atom.name == "unknown":
            return f"{self._text(atom.arguments[0])} is not known"
        if atom.name in self._signature.sorts or self._misfits(atom):
            return None
        return self._text(atom)

    def axiom(self, rule: int) -> tuple[str | None, str]:
        """Id and words of an axiom."""
        identifier = self._statements[rule].axiom
        return identifier, "" if identifier is None else self._says[identifier]

    def known(self, atom: clingo.Symbol) -> Reason | None:
        """What was perceived, given or measured."""
        literal = self.literal(atom)
        if literal is None:
            return None
        fact = self._known.get(atom)
        if fact is None:
            return Reason(literal, Role.KNOWN)
        perceived = atom.name in RELATIONS and fact.source not in ("", "given")
        sure = fact.confidence if perceived else None
        return Reason(literal, Role.KNOWN, source=fact.source, confidence=sure)

    def condition(self, rule: int, words: str) -> str | None:
        """A comparison of an axiom."""
        del rule
        return words

    def absent(self, atom: clingo.Symbol) -> str:
        """Why a literal under `not` may be taken not to hold."""
        inner = atom.arguments[0] if atom.name == "possible" else atom
        if inner.name in RELATIONS:
            return "the relations are known, and this is none of them"
        return "nothing concludes it"

    def mismatch(self, atom: clingo.Symbol) -> str:
        """What stands where its sort does not allow it."""
        return ", ".join(f"{value} is no {sort}" for value, sort in self._misfits(atom))

    def lacking(self, atom: clingo.Symbol) -> str:
        """What the scene says instead of a relation or an attribute."""
        numbers = [each.number for each in atom.arguments if each.type == _NUMBER]
        names = [self._constants[each] for each in numbers if each < len(self._constants)]
        for attribute in ATTRIBUTES:
            if atom.name == attribute.predicate and names:
                value = attribute.of(self._facts.objects[numbers[0]])
                return f"the {attribute.name} of {names[0]} is {value or 'not known'}"
        if atom.name not in RELATIONS:
            return ""
        if len(names) < 2:
            return "no such relation was perceived"
        pair = {self._facts.objects[each].name for each in numbers}
        for each in self._facts.relations:
            if each.pair == pair:
                one, other = (self._names.constant(name) for name in (each.object, each.reference))
                return f"{one} is {each.position} {other}, {each.distance}"
        return f"how {names[0]} stands to {names[1]} is not known"

    def is_default(self, rule: int) -> bool:
        """Whether a rule says a default."""
        return self._statements[rule].axiom in self._defaults

    def is_estimated(self, literal: Literal) -> bool:
        """Whether a literal is one that may stay undecided."""
        return self._signature.attributes[literal.atom.name].kind is AttributeKind.ESTIMATED

    def symbol(self, literal: Literal) -> clingo.Symbol:
        """The atom that says a literal."""
        arguments = [self._symbol(each) for each in literal.atom.arguments]
        if self.is_estimated(literal):
            return clingo.Function(_tag(literal), [clingo.Function(literal.atom.name, arguments)])
        return clingo.Function(literal.atom.name, arguments, literal.positive)

    def pattern(self, literal: Literal) -> clingo.Symbol:
        """The atoms that rules conclude to say a literal, with the string `_` for the axiom."""
        symbol = self.symbol(literal)
        if not self.is_estimated(literal):
            return symbol
        return clingo.Function(symbol.name, [*symbol.arguments, clingo.String(LOCAL)])

    def _symbol(self, term: Term) -> clingo.Symbol:
        index = self._number.get(str(term))
        return clingo.parse_term(term_text(term)) if index is None else clingo.Number(index)

    def _text(self, atom: clingo.Symbol) -> str:
        sign = "-" if atom.negative else ""
        if not atom.arguments:
            return f"{sign}{atom.name}"
        try:
            sorts: Sequence[str] = self._signature.argument_sorts(atom.name)
        except KeyError:
            sorts = [""] * len(atom.arguments)
        arguments = map(self._argument, sorts, atom.arguments)
        return f"{sign}{atom.name}({', '.join(arguments)})"

    def _argument(self, sort: str, value: clingo.Symbol) -> str:
        if value.type == clingo.SymbolType.Number and self._is_of_objects(sort):
            return self._constants[value.number]
        if value.type == clingo.SymbolType.String:
            return value.string.removeprefix(LOCAL) or LOCAL
        return str(value)

    def _misfits(self, atom: clingo.Symbol) -> list[tuple[clingo.Symbol, str]]:
        """The constants other than objects that stand where objects are meant, with the sort."""
        if atom.name not in self._signature.attributes:
            return []
        sorts = self._signature.argument_sorts(atom.name)
        return [
            (value, sort)
            for sort, value in zip(sorts, atom.arguments, strict=True)
            if value.type == clingo.SymbolType.Function
            and self._is_of_objects(sort)
            and not self._signature.contains(sort, Constant(value.name))
        ]

    def _is_of_objects(self, sort: str) -> bool:
        known = self._signature.sorts
        return sort in known and self._signature.is_subsort("object", sort)
