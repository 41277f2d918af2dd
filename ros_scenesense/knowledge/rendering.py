"""Literals, conditions and sorts as clingo's text, shared by all translations.

A translation differs from another in how it says that a literal is believed: as `holds(f, I)`, as
`pos(f)`, as a plain atom. It hands its way over as a `Dialect`; local variables, guards, default
negation and comparisons are the same for all.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence

from ros_scenesense.knowledge.axioms import Axiom
from ros_scenesense.knowledge.literals import (
    Atom,
    Belief,
    Comparison,
    Condition,
    Literal,
    variables_of,
)
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.sorting import Guard, guards, local_variables, sorts_of
from ros_scenesense.knowledge.terms import Arithmetic, Record, Term, Variable

Dialect = Callable[[Literal, str], str]
"""(literal, clingo's text of its atom) -> clingo's text for "this literal is believed".

For example `lambda literal, atom: f"holds({atom}, I)"`. The literal tells name and sign; the text
is to be used for the atom, as local variables are `_` in it.
"""

WIDTH = 100


def term_text(term: Term, local: Collection[Variable] = ()) -> str:
    """A term; local variables as `_`."""
    match term:
        case Variable():
            return "_" if term in local else term.name
        case Record():
            return _applied(term.functor, term.arguments, local)
        case Arithmetic():
            left, right = (
                f"({term_text(side, local)})"
                if isinstance(side, Arithmetic)
                else term_text(side, local)
                for side in (term.left, term.right)
            )
            return f"{left} {term.operator} {right}"
        case _:
            return str(term)


def atom_text(atom: Atom, local: Collection[Variable] = ()) -> str:
    """An atom such as `above(A, _)`."""
    return _applied(atom.name, atom.arguments, local)


def guard_text(guard: Guard) -> str:
    """A sort as a predicate, e.g. `object(A)`."""
    return f"{guard.sort}({term_text(guard.term)})"


def condition_text(
    condition: Condition, dialect: Dialect, local: Collection[Variable], signature: Signature
) -> str:
    """A condition of a body."""
    if isinstance(condition, Belief):
        return _belief_text(condition, dialect, local, signature)
    if isinstance(condition, Comparison):
        left, right = term_text(condition.left), term_text(condition.right)
        return f"{left} {condition.operator} {right}"
    member = guard_text(Guard(condition.sort, condition.term))
    return f"not {member}" if condition.negated else member


def _belief_text(
    belief: Belief, dialect: Dialect, local: Collection[Variable], signature: Signature
) -> str:
    literal = belief.literal
    own = [each for each in variables_of(literal) if each in local]
    if not own or (literal.positive and len(own) == len(set(own))):
        believed = dialect(literal, atom_text(literal.atom, local))
        return f"not {believed}" if belief.negated else believed
    # clingo has no `_` in what is negated twice, and no two that are the same.
    guarded = ", ".join(
        f"{sort}({variable})"
        for variable in dict.fromkeys(own)
        for sort in sorts_of(variable, (), (belief,), signature)
    )
    return f"not {dialect(literal, atom_text(literal.atom))} : {guarded}"


def body_texts(axiom: Axiom, signature: Signature, dialect: Dialect) -> list[str]:
    """The body of the rule for an axiom: its premises in order, then the guards of its variables.

    The premises of a causal law begin with its action; the dialect says how an action occurs.
    """
    local = local_variables(axiom.conclusions, axiom.premises)
    premises = [condition_text(each, dialect, local, signature) for each in axiom.premises]
    return [*premises, *map(guard_text, guards(axiom, signature))]


def rule_text(head: str, body: Iterable[str] = ()) -> str:
    """`head :- body.`, broken after commas where a line gets too long; an empty head for `:- `."""
    parts = list(body)
    if not parts:
        return f"{head}."
    start = f"{head} :-" if head else ":-"
    parts = [*(part + _separator(part) for part in parts[:-1]), f"{parts[-1]}."]
    line = " ".join((start, *parts))
    if len(line) <= WIDTH:
        return line
    return "\n".join((start, *_wrapped(parts)))


def sort_texts(signature: Signature) -> Iterator[str]:
    """Facts and rules that make each sort a predicate; numeric ranges are not written out."""
    for sort in signature.sorts.values():
        if sort.members:
            members = "; ".join(map(term_text, sort.members))
            yield f"{sort.name}({members})."
        if sort.bounds is not None:
            low, high = sort.bounds
            yield f"{sort.name}({low}..{high})."
        for upper in sort.supersorts:
            yield f"{upper}(X) :- {sort.name}(X)."
        if not sort.members and sort.bounds is None:
            # A sort that is empty, or filled by sorts below it alone.
            yield f"#defined {sort.name}/1."


def _applied(name: str, arguments: Sequence[Term], local: Collection[Variable]) -> str:
    if not arguments:
        return name
    return f"{name}({', '.join(term_text(each, local) for each in arguments)})"


def _wrapped(parts: Sequence[str]) -> Iterator[str]:
    line = "   "
    for part in parts:
        if len(line) + 1 + len(part) > WIDTH and line.strip():
            yield line
            line = "   "
        line += f" {part}"
    yield line


def _separator(part: str) -> str:
    """What follows a part of a body: a comma would go on with the condition of a literal."""
    return ";" if " : " in part else ","
