"""The action language: reads domains, histories and goals (docs/action_language.md).

`parse` and `load` read a whole text. With a description they go on from it: a history file, learned
axioms, the objects of a scene. `parse_goal` and `parse_literal` read what a person asks. All of
them report every problem of a text at once.
"""

from __future__ import annotations

from pathlib import Path

from ros_scenesense.knowledge.building import Builder, Domain
from ros_scenesense.knowledge.checking import Checker
from ros_scenesense.knowledge.declarations import Declarations
from ros_scenesense.knowledge.description import Goal, GoalCondition, Quantity, SystemDescription
from ros_scenesense.knowledge.literals import Literal
from ros_scenesense.knowledge.problems import Problems
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.syntax import read, read_alone
from ros_scenesense.knowledge.terms import Place
from ros_scenesense.knowledge.texts import check_length, read_text

EMPTY = SystemDescription(Signature({}, {}, {}))


def parse(text: str, source: str = "text", description: SystemDescription = EMPTY) -> Domain:
    """Reads a text in the action language.

    Args:
        text: Statements in any order.
        source: Name of the text, for messages.
        description: What the text goes on from; its own statements come on top.

    Raises:
        LanguageError: With all problems of the text, one per line, as `source:line:column: ...`.
    """
    problems = Problems()
    check_length(text, source)
    syntax = read(text, source, problems)
    if not syntax.statements and not problems:
        problems.add(Place(source, 1, 1), "found no statement; expected sorts, fluents, axioms")
    declarations = Declarations(description.signature, syntax.unread, problems)
    signature = declarations.signature(syntax.statements)
    builder = Builder(signature, declarations, problems)
    domain = builder.domain(syntax.statements, description, source)
    _check(domain, description, Checker(signature, problems, syntax.unread))
    problems.check()
    return domain


def load(path: Path, description: SystemDescription = EMPTY) -> Domain:
    """Reads a file, as `parse` does.

    Raises:
        LanguageError: If it cannot be read, is no UTF-8 text, or says something wrong.
    """
    return parse(read_text(path), str(path), description)


def parse_goal(text: str, description: SystemDescription, source: str = "goal") -> Goal:
    """Reads a goal such as `on(red_can, white_cube), no occluded(X)`, or the name of one.

    Args:
        text: What was asked.
        description: The domain with the objects that are there.
        source: Name of the text, for messages.

    Raises:
        LanguageError: With all problems of the text.
    """
    name = text.strip().removesuffix(".").rstrip()
    if name in description.goals:
        return description.goals[name]
    conditions = _asked(text, description, source)
    goal = Goal(conditions, place=Place(source, 1, 1))
    problems = Problems()
    Checker(description.signature, problems).goal(goal)
    problems.check()
    return goal


def parse_literal(text: str, description: SystemDescription, source: str = "literal") -> Literal:
    """Reads one literal without variables, such as `-stable(red_can)`.

    Raises:
        LanguageError: With all problems of the text.
    """
    goal = Goal(_asked(text, description, source), place=Place(source, 1, 1))
    problems = Problems()
    if len(goal.conditions) > 1 or goal.conditions[0].quantity is not Quantity.TRUE:
        problems.add(goal.place, f"found {goal}, expected one literal")
    Checker(description.signature, problems).goal(goal)
    problems.check()
    return goal.conditions[0].literal


def _asked(text: str, description: SystemDescription, source: str) -> tuple[GoalCondition, ...]:
    check_length(text, source)
    problems = Problems()
    written = read_alone(text, "asked", source, problems)
    problems.check()
    declarations = Declarations(description.signature, (), problems)
    builder = Builder(description.signature, declarations, problems)
    conditions = builder.goal_conditions(written)
    problems.check()
    return conditions


def _check(domain: Domain, before: SystemDescription, checker: Checker) -> None:
    """Checks what a text added; what was there before was checked then."""
    description = domain.description
    for axiom in description.axioms[len(before.axioms) :]:
        checker.axiom(axiom)
    for fact in description.facts[len(before.facts) :]:
        checker.fact(fact)
    for name, goal in description.goals.items():
        if name not in before.goals:
            checker.goal(goal)
    checker.history(domain.history)
