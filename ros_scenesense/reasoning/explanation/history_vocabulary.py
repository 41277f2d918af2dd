"""What the atoms of the readable translation mean to people: literals and actions at steps."""

from __future__ import annotations

import re
from collections.abc import Sequence

import clingo
from clingo import ast

from ros_scenesense.knowledge.axioms import CausalLaw
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.rendering import atom_text
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.rules import LOCAL

_AXIOM = re.compile(r"% (\w+) \((?:normal|default)\)")
_TITLE = re.compile(r"% --- (.*)")
_STEP = re.compile(r"\d+ < \d+")
_HIDDEN = frozenset({"step", "fluent", "action", "assumed"})


class HistoryVocabulary:
    """The vocabulary of a translated domain and history.

    Args:
        description: The domain.
        text: Its translation, whose comments tell what each rule says.
        nodes: The statements of the translation.
    """

    def __init__(self, description: SystemDescription, text: str, nodes: Sequence[ast.AST]) -> None:
        self._signature = description.signature
        self._says = {axiom.id: axiom.words or str(axiom) for axiom in description.axioms}
        self._laws = {each.id for each in description.axioms if isinstance(each, CausalLaw)}
        self._defaults = {axiom.id for axiom in description.axioms if axiom.kind == "default"}
        by_line = list(_read(text))
        self._rules = [by_line[node.location.begin.line - 1] for node in nodes]
        self._exceptions = {
            index for index, node in enumerate(nodes) if "applied(exception(" in str(node)
        }

    def literal(self, atom: clingo.Symbol, negated: bool = False) -> str | None:
        """The literal with its step; None for what only the program needs."""
        del negated
        name, arguments = atom.name, atom.arguments
        if name in _HIDDEN or name in self._signature.sorts:
            return None
        sign = "-" if atom.negative else ""
        match name, len(arguments):
            case "holds", 2:
                return f"{sign}{_text(arguments[0])} at step {_text(arguments[1])}"
            case "occurs", 2:
                happens = "does not occur" if sign else "occurs"
                return f"{_text(arguments[0])} {happens} at step {_text(arguments[1])}"
            case "obs", 3:
                truth = "false" if str(arguments[1]) == "false" else "true"
                return f"{_text(arguments[0])} was seen to be {truth} at step {_text(arguments[2])}"
            case "hpd", 2:
                return f"{_text(arguments[0])} was done at step {_text(arguments[1])}"
            case "unknown", 2:
                return f"{_text(arguments[0])} is not known at step {_text(arguments[1])}"
            case "applied", 2:
                return f"{_applied(arguments[0])} at step {_text(arguments[1])}"
        return f"{sign}{_text(clingo.Function(name, arguments))}"

    def axiom(self, rule: int) -> tuple[str | None, str]:
        """Id and words of an axiom; words alone for the general rules of every translation."""
        identifier, title = self._rules[rule]
        if identifier is None:
            return None, title
        if rule in self._exceptions:
            return identifier, f"An exception to this default: {self._says[identifier]}"
        default = " (A default.)" if identifier in self._defaults else ""
        return identifier, f"{self._says[identifier]}{default}"

    def known(self, atom: clingo.Symbol) -> Reason | None:
        """What the domain or its history says."""
        literal = self.literal(atom)
        return None if literal is None else Reason(literal, Role.KNOWN, source="given")

    def condition(self, rule: int, words: str) -> str | None:
        """A comparison; None for those that only the program needs, such as the last step."""
        identifier, _ = self._rules[rule]
        technical = identifier is None or (identifier in self._laws and _STEP.fullmatch(words))
        return None if technical else words

    def absent(self, atom: clingo.Symbol) -> str:
        """Why a literal under `not` may be taken not to hold."""
        del atom
        return "nothing concludes it"

    def mismatch(self, atom: clingo.Symbol) -> str:
        """What stands where its sort or the last step does not allow it."""
        return f"there is no {_text(atom)}"

    def lacking(self, atom: clingo.Symbol) -> str:
        """Why a given literal does not hold."""
        return "the history does not say so" if atom.name in ("obs", "hpd") else ""

    def symbol(self, literal: Literal, step: int) -> clingo.Symbol:
        """The atom that says a literal at a step."""
        fluent = clingo.parse_term(atom_text(literal.atom))
        attribute = self._signature.attributes[literal.atom.name]
        if attribute.kind is AttributeKind.STATIC:
            return clingo.Function(fluent.name, fluent.arguments, literal.positive)
        return clingo.Function("holds", [fluent, clingo.Number(step)], literal.positive)


def _read(text: str) -> list[tuple[str | None, str]]:
    """For each line of a translation the axiom, and the title, that it stands under."""
    found: list[tuple[str | None, str]] = []
    axiom, title = None, ""
    for line in text.splitlines():
        if match := _TITLE.match(line):
            axiom, title = None, re.split("[:,]", match[1])[0]
        elif match := _AXIOM.match(line):
            axiom = match[1]
        found.append((axiom, title))
    return found


def _applied(instance: clingo.Symbol) -> str:
    inner = _text(instance.arguments[0])
    if instance.name == "event":
        return f"{inner} happens without the robot"
    return f"an exception to {inner}"


def _text(term: clingo.Symbol) -> str:
    if term.type == clingo.SymbolType.String:
        return term.string.removeprefix(LOCAL) or LOCAL
    if term.type != clingo.SymbolType.Function or not term.arguments:
        return str(term)
    return f"{term.name}({', '.join(map(_text, term.arguments))})"
