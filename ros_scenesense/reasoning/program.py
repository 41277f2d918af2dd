"""A logic program with named axioms, parsed once and added to a new solver for every scene.

The axioms declare themselves in the text, `axiom(id, normal | default, "in words")`; the solver
reads them. Rules of an axiom carry its id in their heads and are guarded by `enabled(id)`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

import clingo
from clingo import ast

from ros_scenesense.errors import ReasoningError, SceneSenseError
from ros_scenesense.reasoning.syntax import Signature, Statement, relevant
from ros_scenesense.resources import resource
from ros_scenesense.scene import Task

Kind = Literal["normal", "default"]

FLUENTS = {"stable": Task.STABILITY, "occluded": Task.OCCLUSION}
"""The fluents that axioms may conclude, and the task that each belongs to."""


@dataclass(frozen=True)
class Axiom:
    """An axiom of a program: its kind, its meaning in words, and the task it is about."""

    id: str
    kind: Kind
    text: str
    task: Task


class Program:
    """A parsed and checked program.

    Args:
        text: The program in clingo's language; our own or generated, never names from outside.
        source: Where it comes from, for error messages.

    Attributes:
        source: As given.
        axioms: Its axioms, in the order of the text.
        used: Predicates in the bodies of rules that bear on the answer.

    Raises:
        ReasoningError: If the program is broken; the text says `source:line:column` and why.
    """

    def __init__(self, text: str, source: str = "program") -> None:
        self.source = source
        statements = [Statement.of(node) for node in _parse(text, source)]
        self._statements = relevant(statements)
        self.used: frozenset[Signature] = frozenset().union(
            *(statement.bodies for statement in self._statements)
        )
        self.axioms = self._read_axioms(statements)

    @classmethod
    def load(cls, path: Path) -> Program:
        """Reads a program from a file.

        Raises:
            ReasoningError: If the file cannot be read or the program is broken.
        """
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ReasoningError(f"program {path} cannot be read: {error}") from error
        return cls(text, str(path))

    @classmethod
    def shipped(cls) -> Program:
        """The classification program that comes with SceneSense, `asp/classification.lp`.

        Raises:
            ReasoningError: If it is missing or broken.
        """
        try:
            path = resource("asp", "classification.lp")
        except SceneSenseError as error:
            raise ReasoningError(str(error)) from error
        return cls.load(path)

    def add_to(self, control: clingo.Control) -> None:
        """Adds the statements that bear on the answer to a solver."""
        _add(self._statements, control)

    def revision(self, withheld: Collection[str] = ()) -> str:
        """A short hash that changes if and only if the knowledge in force does.

        Args:
            withheld: Ids of axioms that are switched off.
        """
        words = [
            f"{axiom.id} {axiom.kind} {axiom.text}"
            for axiom in self.axioms
            if axiom.id not in withheld
        ]
        rules = [
            str(statement.node)
            for statement in self._statements
            if statement.node.ast_type in (ast.ASTType.Rule, ast.ASTType.Definition)
            and statement.guards.isdisjoint(withheld)
        ]
        return hashlib.sha256("\n".join(words + rules).encode()).hexdigest()[:12]

    def _read_axioms(self, statements: Sequence[Statement]) -> tuple[Axiom, ...]:
        declared = self._declarations(statements)
        tasks: dict[str, set[Task]] = {}
        for statement in statements:
            for fluent, axiom in statement.concludes:
                self._check_rule(statement, fluent, axiom, declared)
                tasks.setdefault(axiom, set()).add(FLUENTS[fluent])
        axioms = []
        for identifier, (kind, text) in declared.items():
            about = tasks.get(identifier, set())
            if len(about) != 1:
                raise ReasoningError(
                    f"{self.source}: axiom '{identifier}' is declared, but its rules conclude "
                    f"{len(about)} fluents: an axiom is about one"
                )
            axioms.append(Axiom(identifier, kind, text, about.pop()))
        return tuple(axioms)

    def _check_rule(
        self, rule: Statement, fluent: str, axiom: str, declared: Collection[str]
    ) -> None:
        problem = None
        if fluent not in FLUENTS:
            problem = f"'{fluent}' is no fluent of one object, known are {', '.join(FLUENTS)}"
        elif axiom not in declared:
            problem = f"axiom '{axiom}' is not declared: add axiom({axiom}, normal, \"in words\")."
        elif axiom not in rule.guards:
            problem = f"this rule cannot be switched off: add enabled({axiom}) to its body"
        if problem is not None:
            raise ReasoningError(f"{self.source}:{rule.place}: {problem}")

    def _declarations(self, statements: Sequence[Statement]) -> dict[str, tuple[Kind, str]]:
        """Kind and text of each axiom, from the facts axiom/3 as the solver understands them."""
        with Messages(self.source) as messages:
            control = clingo.Control(logger=messages.take)
            _add(statements, control)
            control.ground()
        if messages.words:
            raise ReasoningError("\n".join(messages.words))
        found: dict[str, tuple[Kind, str]] = {}
        for atom in control.symbolic_atoms.by_signature("axiom", 3):
            identifier, kind, text = atom.symbol.arguments
            well_formed = (
                identifier.type == clingo.SymbolType.Function
                and not identifier.arguments
                and 0 < len(identifier.name) <= 64
                and str(kind) in ("normal", "default")
                and text.type == clingo.SymbolType.String
                and len(text.string) <= 4096
            )
            if not well_formed or identifier.name in found:
                raise ReasoningError(
                    f"{self.source}: {atom.symbol} must be the only axiom(id, normal | default, "
                    '"in words") of its id, with at most 64 letters of id and 4096 of text'
                )
            found[identifier.name] = (cast(Kind, str(kind)), text.string)
        return found


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
        self.words.append(text.strip().replace("<string>", self._source))

    def __enter__(self) -> Messages:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, RuntimeError | MemoryError):
            words = "\n".join(self.words) or f"{self._source}: {error or type(error).__name__}"
            raise ReasoningError(words) from error


def _parse(text: str, source: str) -> list[ast.AST]:
    if "\0" in text:
        # clingo takes a zero character for the end of the text and would ignore what follows.
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ReasoningError(f"{source}:{line}: the program holds a zero character")
    nodes: list[ast.AST] = []
    with Messages(source) as messages:
        ast.parse_string(text, nodes.append, logger=messages.take)
    return [node for node in nodes if node.ast_type != ast.ASTType.Comment]


def _add(statements: Sequence[Statement], control: clingo.Control) -> None:
    with ast.ProgramBuilder(control) as builder:
        for statement in statements:
            builder.add(statement.node)
