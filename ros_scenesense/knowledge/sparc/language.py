"""SPARC programs: reads and checks them (docs/sparc.md). All problems are reported at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.sparc.checking import check
from ros_scenesense.knowledge.sparc.declarations import Signature, declared
from ros_scenesense.knowledge.sparc.statements import Form, Rule, Text
from ros_scenesense.knowledge.sparc.syntax import read
from ros_scenesense.knowledge.texts import check_length, read_text


@dataclass(frozen=True)
class Program:
    """A program that is sound.

    Attributes:
        text: Its statements.
        signature: Its sorts and predicates.
        source: Where it comes from, for messages.
    """

    text: Text
    signature: Signature
    source: str

    @property
    def restores(self) -> bool:
        """Whether it has CR rules."""
        return any(isinstance(each, Rule) and each.form is Form.CR for each in self.text.rules)

    @property
    def optimizes(self) -> bool:
        """Whether it says which of its answer sets are best."""
        forms = (Form.WEAK, Form.MINIMIZE, Form.MAXIMIZE)
        return any(isinstance(each, Rule) and each.form in forms for each in self.text.rules)


def parse(text: str, source: str = "text", constants: Mapping[str, int] | None = None) -> Program:
    """Reads a program.

    Args:
        text: The program.
        source: Its name, for messages.
        constants: Values of constants, instead of those that the program gives them.

    Raises:
        LanguageError: With all problems, one per line, as `source:line:column: ...`.
    """
    check_length(text, source)
    problems = Problems()
    statements = read(text, source, dict(constants or {}), problems)
    signature = declared(statements, problems)
    check(statements, signature, problems)
    problems.check()
    return Program(statements, signature, source)


def load(path: Path, constants: Mapping[str, int] | None = None) -> Program:
    """Reads a file, as `parse` does.

    Raises:
        LanguageError: If it cannot be read, is no UTF-8 text, or says something wrong.
    """
    return parse(read_text(path), str(path), constants)
