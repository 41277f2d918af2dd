"""Axioms as text in the action language, with their names and words: what can be read again."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from textwrap import wrap

from ros_scenesense.knowledge.axioms import Axiom, CausalLaw
from ros_scenesense.knowledge.rendering import WIDTH


def written(axioms: Iterable[Axiom]) -> str:
    """The statements of axioms, one after the other; `action_language.parse` reads them.

    Axioms of one name are the laws of one statement. Words lose what words in quotes cannot hold.
    """
    statements = []
    for _, group in groupby(axioms, key=lambda axiom: axiom.id):
        statements.append(_statement(list(group)))
    return "".join(statements)


def _statement(axioms: list[Axiom]) -> str:
    first = axioms[0]
    # No control characters, and no quotes that would end the words.
    plain = "".join(each if each.isprintable() else " " for each in first.words)
    words = " ".join(plain.replace('"', "'").split())
    label = first.id + (" withheld" if first.withheld else "") + (f' "{words}"' if words else "")
    text = str(first)
    if isinstance(first, CausalLaw) and len(axioms) > 1:
        effects = ", ".join(str(effect) for axiom in axioms for effect in axiom.conclusions)
        conditions = f" if {', '.join(map(str, first.body))}" if first.body else ""
        text = f"{first.action} causes {effects}{conditions}."
    lines = wrap(
        text,
        WIDTH,
        initial_indent="    ",
        subsequent_indent="        ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join((f"{label}:", *lines)) + "\n"
