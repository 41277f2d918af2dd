"""The program that classifies scenes: parsed once, added to a new solver for every scene.

It is translated from the domain's action language (`knowledge.classification`). Every axiom can be
left out of a scene without parsing anything again, and axioms can be added to a running program.
"""

from __future__ import annotations

import hashlib
import re
from collections import OrderedDict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import clingo
from clingo import ast

from ros_scenesense.errors import LanguageError, ReasoningError, SceneSenseError
from ros_scenesense.knowledge import axioms as language
from ros_scenesense.knowledge.action_language import load
from ros_scenesense.knowledge.action_language import parse as parse_language
from ros_scenesense.knowledge.classification import (
    ClassificationRule,
    Scenes,
    classification_rules,
    statements_about_states,
)
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import terms_of
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import check_name
from ros_scenesense.reasoning.syntax import Signature, Statement, relevant
from ros_scenesense.resources import resource
from ros_scenesense.scene import Task

_KEPT_SELECTIONS = 64
FLUENTS = {"stable": Task.STABILITY, "occluded": Task.OCCLUSION}
"""The fluents that are decided, and the task that each belongs to."""


@dataclass(frozen=True)
class Axiom:
    """An axiom that decides: its kind, its meaning in words, and the task it is about.

    `condition` is its body in the action language, with `{}` for the object that it decides about.
    """

    id: str
    kind: language.Kind
    text: str
    task: Task
    condition: str = ""


@dataclass(frozen=True, eq=False)
class Selection:
    """The statements in force for a scene.

    Attributes:
        complete: For a scene of which everything is known that they ask for.
        open: For any other scene.
        used: Predicates of their bodies: the facts that they ask for.
        denied: Predicates that they use classically negated.
        uncertain: Predicates of which they ask what is unknown.
    """

    complete: tuple[Statement, ...]
    open: tuple[Statement, ...]
    used: frozenset[Signature]
    denied: frozenset[Signature]
    uncertain: frozenset[str]


class Program:
    """A parsed program.

    Args:
        rules: The rules, our own or translated, never with names from outside.
        axioms: The axioms among them that decide, in the order of the text.
        source: Where it comes from, for error messages.

    Attributes:
        axioms: As given.
        source: As given.
        description: The domain that it was translated from; None if it was not.

    Raises:
        ReasoningError: If a rule is broken.
    """

    def __init__(
        self, rules: Iterable[ClassificationRule], axioms: Sequence[Axiom], source: str = "program"
    ) -> None:
        self.source = source
        self.axioms = tuple(axioms)
        self.description: SystemDescription | None = None
        self._statements: dict[Scenes, list[Statement]] = {scenes: [] for scenes in Scenes}
        for rule in (*rules, *map(ClassificationRule, _fixed_part())):
            for node in parse(rule.text, source):
                self._statements[rule.scenes].append(Statement.of(node, rule.axiom))
        self._selections: OrderedDict[tuple[frozenset[str], bool], Selection] = OrderedDict()

    @classmethod
    def of(cls, description: SystemDescription) -> Program:
        """The program of a domain.

        Raises:
            ReasoningError: If the domain lacks what a scene needs.
        """
        try:
            rules = classification_rules(description)
        except LanguageError as error:
            raise ReasoningError(str(error)) from error
        program = cls(rules, list(_deciding(description)), description.source)
        program.description = description
        return program

    @classmethod
    def shipped(cls) -> Program:
        """The domain that comes with SceneSense.

        Raises:
            ReasoningError: If it is missing or broken.
        """
        try:
            domain = load(resource("asp", "robot_assistant.al"))
        except SceneSenseError as error:
            raise ReasoningError(str(error)) from error
        return cls.of(domain.description)

    def extended(self, axioms: Mapping[str, str]) -> Program:
        """The program with more axioms, checked like everything in the action language.

        Args:
            axioms: Texts of state constraints and defaults by id, each one statement such as
                `stable(A) if not above(A, B).`

        Raises:
            LanguageError: If a text is broken or says something else than one such axiom, or an id
                is taken.
            ReasoningError: If this program was not translated from a domain.
        """
        if self.description is None:
            raise ReasoningError(
                f"{self.source} was not translated from a domain: nothing extends it"
            )
        description = self.description
        for identifier, text in axioms.items():
            description = with_axiom(description, identifier, text)
        return Program.of(description)

    def statement(self, identifier: str) -> str:
        """An axiom in the action language, without its id; empty if it was not translated."""
        if self.description is None:
            return ""
        return " ".join(map(str, self.description.axioms_of(identifier)))

    def without(self, ids: Collection[str]) -> Program:
        """The program without the axioms of these ids.

        Raises:
            ReasoningError: If this program was not translated from a domain.
        """
        if self.description is None:
            raise ReasoningError(
                f"{self.source} was not translated from a domain: nothing leaves it"
            )
        return Program.of(self.description.without(ids))

    def revision(self, withheld: Collection[str] = ()) -> str:
        """A short hash that changes if and only if the knowledge in force does.

        Args:
            withheld: Ids of axioms that are switched off.
        """
        selection = self.selection(frozenset(withheld))
        words = [
            f"{axiom.id} {axiom.kind} {axiom.text}"
            for axiom in self.axioms
            if axiom.id not in withheld
        ]
        rules = [
            str(statement.node)
            for statement in (*selection.complete, *selection.open)
            if statement.node.ast_type in (ast.ASTType.Rule, ast.ASTType.Definition)
        ]
        return hashlib.sha256("\n".join(words + rules).encode()).hexdigest()[:12]

    def selection(self, withheld: frozenset[str], everything: bool = False) -> Selection:
        """The statements in force, those that bear on the answer or, for explanations, all."""
        # Selecting takes longer than solving a small scene. (A cache around the method would hold
        # the program in a circle, and every program of before until somebody collects them.)
        key = (withheld, everything)
        if key not in self._selections:
            self._selections[key] = self._selected(withheld, everything)
            if len(self._selections) > _KEPT_SELECTIONS:
                self._selections.popitem(last=False)
        return self._selections[key]

    def _selected(self, withheld: frozenset[str], everything: bool) -> Selection:
        keep = tuple if everything else relevant
        kept = {
            scenes: [each for each in statements if each.axiom not in withheld]
            for scenes, statements in self._statements.items()
        }
        complete = keep(kept[Scenes.ALL] + kept[Scenes.COMPLETE])
        open_ = keep(kept[Scenes.ALL] + kept[Scenes.OPEN])
        both = (*complete, *open_)
        return Selection(
            complete,
            open_,
            used=frozenset[Signature]().union(*(each.bodies for each in both)),
            denied=frozenset[Signature]().union(*(each.denied for each in both)),
            uncertain=frozenset[str]().union(*(each.unknown for each in open_)),
        )


class Messages:
    """Keeps clingo's messages, which would go to standard error, and words its errors with them.

    As a context it turns the solver's exceptions into `ReasoningError`.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        self.words: list[str] = []

    def take(self, code: clingo.MessageCode, text: str) -> None:
        """The logger to hand to clingo."""
        del code
        words = text.strip().replace("<string>", self._source)
        self.words.append(words.replace("<block>", self._source))

    def __enter__(self) -> Messages:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, RuntimeError | MemoryError):
            words = "\n".join(self.words) or f"{self._source}: {error or type(error).__name__}"
            raise ReasoningError(words) from error


def parse(text: str, source: str) -> list[ast.AST]:
    """Parses a logic program.

    Raises:
        ReasoningError: If it is broken; the text says `source:line:column` and why.
    """
    if "\0" in text:
        # clingo takes a zero character for the end of the text and would ignore what follows.
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ReasoningError(f"{source}:{line}: the program holds a zero character")
    nodes: list[ast.AST] = []
    with Messages(source) as messages:
        ast.parse_string(text, nodes.append, logger=messages.take)
    unwanted = (ast.ASTType.Comment, ast.ASTType.Program)
    return [node for node in nodes if node.ast_type not in unwanted]


def add(statements: Iterable[Statement], control: clingo.Control) -> None:
    """Adds statements to a solver."""
    with ast.ProgramBuilder(control) as builder:
        for statement in statements:
            builder.add(statement.node)


def read_program(name: str) -> str:
    """The text of a logic program in `asp/`.

    Raises:
        ReasoningError: If it is missing.
    """
    try:
        path: Path = resource("asp", name)
        return path.read_text(encoding="utf-8")
    except (SceneSenseError, OSError, UnicodeDecodeError) as error:
        raise ReasoningError(f"program {name} cannot be read: {error}") from error


def _fixed_part() -> list[str]:
    shown = [f"#show {name}/2." for name in DERIVED_RELATIONS]
    return [read_program("beliefs.lp"), *shown]


DERIVED_RELATIONS = ("on",)
"""Relations between two objects that domains define; they tell the structures."""


def with_axiom(description: SystemDescription, identifier: str, text: str) -> SystemDescription:
    """A domain with one more axiom about states or actions, such as a learned one.

    Raises:
        LanguageError: If the text is broken or says something else, or the id is taken.
    """
    check_name(identifier)
    source = f"axiom {identifier}"
    if identifier in description.ids:
        raise LanguageError(f"{source}: there is one of this id already: choose another")
    longer = parse_language(f"{identifier}: {text}", source, description).description
    added = longer.axioms[len(description.axioms) :]
    if longer != description.with_axioms(added) or [each.id for each in added] != [identifier]:
        raise LanguageError(f"{source}: found {text[:200]!r}, expected one axiom and nothing else")
    if isinstance(added[0], language.InitialDefault):
        raise LanguageError(
            f"{source}: found {added[0]}, expected `l if ...`, `normally l if ...`, "
            "`a causes l if ...` or `impossible a if ...`"
        )
    return longer


def _deciding(description: SystemDescription) -> Iterable[Axiom]:
    attributes = description.signature.attributes
    for axiom in statements_about_states(description):
        name = axiom.head.atom.name
        if name in FLUENTS and attributes[name].kind is AttributeKind.ESTIMATED:
            words = axiom.words or str(axiom)
            yield Axiom(axiom.id, axiom.kind, words, FLUENTS[name], _condition(axiom))


def _condition(axiom: language.Axiom) -> str:
    subjects = [term for head in axiom.conclusions for term in terms_of(head)]
    body = ", ".join(map(str, axiom.body))
    for subject in subjects[:1]:
        body = re.sub(rf"\b{re.escape(str(subject))}\b", "{}", body)
    return body
