"""System description and history as a readable program that clingo can run alone.

This is the paper's program Pi(D, H) (section *Knowledge Representation and Reasoning in ASP*) for a
fixed number of steps: signature, axioms, inertia, closed world for defined fluents and actions,
reality checks, the history, and CR rules. holds(F, I) and occurs(A, I) are the paper's predicates.

Where the paper's printed program reverses the converse laws of its action language, statements (b)
and (c), this translates them as they are written in the action language.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.description import History, SystemDescription
from ros_scenesense.knowledge.literals import (
    Belief,
    Literal,
    variables_of,
)
from ros_scenesense.knowledge.rendering import (
    WIDTH,
    atom_text,
    body_texts,
    rule_text,
    sort_texts,
)
from ros_scenesense.knowledge.signature import Action, Attribute, AttributeKind, Signature

CR_PRIORITY = 1000
"""Fewest applied CR rules come before everything else that a program minimises."""


@dataclass(frozen=True)
class Options:
    """What a translation is for.

    Attributes:
        steps: Last step; None for the last step of the history.
        complete: Whether inertial fluents have one value or the other in the initial state, as in
            the states of the action language. Otherwise what is not known of it stays unknown.
        show_all: Whether answers show everything that is believed false, not only of estimated
            fluents.
    """

    steps: int | None = None
    complete: bool = False
    show_all: bool = False


def translate(
    description: SystemDescription, history: History, options: Options | None = None
) -> str:
    """The program for a description and a history.

    `clingo program.lp 0` computes all answer sets; with `-c restore=0` without CR rules.
    """
    options = options or Options()
    steps = history.last_step if options.steps is None else options.steps
    parts = (
        _introduction(description, steps),
        _signature(description),
        _axioms(description),
        _frame(options),
        _history(history, options),
        _restoring(description, options),
        _shown(options),
    )
    return "\n".join(chain.from_iterable(parts)) + "\n"


def _introduction(description: SystemDescription, steps: int) -> Iterator[str]:
    yield f"% The domain {_in_words(description.source)} and a history, for clingo."
    yield "%"
    yield "% holds(F, I): fluent F is believed to be true at step I; -holds(F, I): to be false."
    yield "% occurs(A, I): action A occurs at step I. applied(R, I): CR rule R is applied there."
    yield "% The variable for the step is I, or the first free one of J, K, ..."
    yield ""
    yield f"#const steps = {steps}."
    yield "step(0..steps)."
    yield "#const restore = 1."


def _signature(description: SystemDescription) -> Iterator[str]:
    signature = description.signature
    yield from _title("Sorts.")
    yield from sort_texts(signature)
    yield from _title("Fluents and actions.")
    for attribute in signature.attributes.values():
        if attribute.kind is not AttributeKind.STATIC:
            yield _declared(f"fluent({attribute.kind}, {{}})", attribute)
    yield "#defined fluent/2."
    for action in signature.actions.values():
        kind = "exogenous" if action.exogenous else "agent"
        yield _declared(f"action({kind}, {{}})", action)
    yield "#defined action/2."
    yield from _title("Statics.")
    for static in signature.attributes_of(AttributeKind.STATIC):
        for sign in ("", "-"):
            yield f"#defined {sign}{static.name}/{len(static.arguments)}."
    for fact in description.facts:
        yield f"{'' if fact.positive else '-'}{atom_text(fact.atom)}."


def _axioms(description: SystemDescription) -> Iterator[str]:
    yield from _title("Axioms.")
    before = None
    for axiom in description.axioms:
        if axiom.id != before:
            words = f": {_in_words(axiom.words)}" if axiom.words else ""
            yield ""
            yield from _comment(f"{axiom.id} ({axiom.kind}){words}")
            before = axiom.id
        yield from _axiom(axiom, description.signature)


def _axiom(axiom: Axiom, signature: Signature) -> Iterator[str]:
    yield from _comment(f"  {axiom}")
    step = _step_of(axiom)
    now = "0" if isinstance(axiom, InitialDefault) else step
    body = body_texts(axiom, signature, _Dialect(signature, now).believed)
    timed = _Dialect(signature, now)
    match axiom:
        case CausalLaw(effect=effect):
            later = _Dialect(signature, f"{step} + 1").believed(effect, atom_text(effect.atom))
            yield rule_text(later, [*body, f"{step} < steps"])
        case ExecutabilityCondition(actions=(action,)):
            yield rule_text(f"-occurs({atom_text(action)}, {step})", [*body, f"step({step})"])
        case ExecutabilityCondition(actions=actions):
            together = [f"occurs({atom_text(action)}, {step})" for action in actions]
            yield rule_text("", [*together, *body])
        case StateConstraint(head=head):
            if not _is_static(head, signature):
                body = [*body, *_stepping(axiom, signature, step)]
            yield rule_text(timed.believed(head, atom_text(head.atom)), body)
        case Default(head=head) | InitialDefault(head=head):
            if not isinstance(axiom, InitialDefault):
                body = [*body, *_stepping(axiom, signature, step)]
            yield from _default(axiom, head, body, timed)


def _default(axiom: Axiom, head: Literal, body: Sequence[str], timed: _Dialect) -> Iterator[str]:
    believed = timed.believed(head, atom_text(head.atom))
    opposite = timed.believed(head.complement, atom_text(head.atom))
    yield rule_text(believed, [*body, f"not {opposite}"])
    variables = ", ".join(dict.fromkeys(map(str, variables_of(head))))
    instance = f"exception({axiom.id}({variables}))" if variables else f"exception({axiom.id})"
    applied = f"applied({instance}, {timed.step})"
    yield rule_text(f"{{ {applied} }}", ["restore = 1", *body])
    yield rule_text(opposite, [applied])


def _frame(options: Options) -> Iterator[str]:
    yield from _title("Inertia: what nothing changes stays as it is.")
    yield "holds(F, I + 1) :- fluent(inertial, F), holds(F, I), not -holds(F, I + 1), I < steps."
    yield "-holds(F, I + 1) :- fluent(inertial, F), -holds(F, I), not holds(F, I + 1), I < steps."
    yield from _title("Closed world: defined fluents are false, actions do not occur, unless ...")
    yield "-holds(F, I) :- fluent(defined, F), step(I), not holds(F, I)."
    yield "-occurs(A, I) :- action(_, A), step(I), not occurs(A, I)."
    if options.complete:
        yield from _title("The initial state is complete; where a default speaks, by the default.")
        yield "1 { holds(F, 0); -holds(F, 0) } 1 :- fluent(inertial, F), not assumed(F)."
        yield "#defined assumed/1."


def _history(history: History, options: Options) -> Iterator[str]:
    yield from _title("History: obs(F, true | false, I) was seen, hpd(A, I) was done.")
    yield "#defined obs/3."
    yield "#defined hpd/2."
    for seen in history.observations:
        yield f"obs({atom_text(seen.fluent)}, {str(seen.value).lower()}, {seen.step})."
    for done in history.happened:
        yield f"hpd({atom_text(done.action)}, {done.step})."
    for literal in history.initial:
        sign = "" if literal.positive else "-"
        yield f"{sign}holds({atom_text(literal.atom)}, 0)."
    yield "occurs(A, I) :- hpd(A, I), step(I)."
    if not options.complete:
        yield from _title("What is seen is believed, of fluents that were unknown until then.")
        yield "holds(F, 0) :- obs(F, true, 0), fluent(inertial, F)."
        yield "-holds(F, 0) :- obs(F, false, 0), fluent(inertial, F)."
        yield "unknown(F, I) :- fluent(inertial, F), step(I), not holds(F, I), not -holds(F, I)."
        yield "holds(F, I + 1) :- obs(F, true, I + 1), unknown(F, I)."
        yield "-holds(F, I + 1) :- obs(F, false, I + 1), unknown(F, I)."
    yield from _title("Reality checks: beliefs do not contradict what is seen.")
    yield ":- obs(F, true, I), -holds(F, I)."
    yield ":- obs(F, false, I), holds(F, I)."


def _restoring(description: SystemDescription, options: Options) -> Iterator[str]:
    yield from _title("CR rules: exogenous actions and exceptions of defaults, as few as possible.")
    yield "{ applied(event(A), I) } :- restore = 1, action(exogenous, A), step(I), I < steps."
    yield "occurs(A, I) :- applied(event(A), I)."
    yield f"#minimize {{ 1@{CR_PRIORITY}, R, I : applied(R, I) }}."
    if options.complete:
        for axiom in description.axioms:
            if isinstance(axiom, InitialDefault) and _is_inertial(
                axiom.head, description.signature
            ):
                dialect = _Dialect(description.signature, "0")
                body = body_texts(axiom, description.signature, dialect.believed)
                yield rule_text(f"assumed({atom_text(axiom.head.atom)})", body)


def _shown(options: Options) -> Iterator[str]:
    yield from _title("What an answer shows.")
    yield "#show holds/2."
    if options.show_all:
        yield "#show -holds/2."
    else:
        yield "#show -holds(F, I) : -holds(F, I), fluent(estimated, F)."
    yield "#show occurs/2."
    yield "#show applied/2."


@dataclass(frozen=True)
class _Dialect:
    """How literals are believed at a step."""

    signature: Signature
    step: str

    def believed(self, literal: Literal, atom: str) -> str:
        sign = "" if literal.positive else "-"
        if literal.atom.name in self.signature.actions:
            return f"{sign}occurs({atom}, {self.step})"
        if _is_static(literal, self.signature):
            return f"{sign}{atom}"
        return f"{sign}holds({atom}, {self.step})"


def _stepping(axiom: Axiom, signature: Signature, step: str) -> list[str]:
    """The guard for the step, where no fluent that is believed says it already."""
    timed = any(
        isinstance(each, Belief) and not each.negated and not _is_static(each.literal, signature)
        for each in axiom.body
    )
    return [] if timed else [f"step({step})"]


def _is_static(literal: Literal, signature: Signature) -> bool:
    attribute = signature.attributes.get(literal.atom.name)
    return attribute is not None and attribute.kind is AttributeKind.STATIC


def _is_inertial(literal: Literal, signature: Signature) -> bool:
    return signature.attributes[literal.atom.name].kind is AttributeKind.INERTIAL


def _step_of(axiom: Axiom) -> str:
    """A variable for the step that the axiom does not use."""
    parts = (*axiom.conclusions, *axiom.premises)
    used = {str(variable) for part in parts for variable in variables_of(part)}
    names = chain("IJKLMN", (f"I{number}" for number in range(len(used) + 1)))
    return next(name for name in names if name not in used)


def _declared(form: str, declared: Attribute | Action) -> str:
    """A rule that says what there is, e.g. `fluent(inertial, on(X1, X2)) :- object(X1), ...`."""
    variables = [f"X{number}" for number, _ in enumerate(declared.arguments, start=1)]
    arguments = f"({', '.join(variables)})" if variables else ""
    guards = [f"{sort}({name})" for sort, name in zip(declared.arguments, variables, strict=True)]
    return rule_text(form.format(declared.name + arguments), guards)


def _title(words: str) -> Iterable[str]:
    return ("", "", f"% --- {words}", "")


def _comment(text: str) -> list[str]:
    indent = " " * (len(text) - len(text.lstrip()) + 4)
    return textwrap.wrap(f"% {text}", WIDTH, subsequent_indent=f"%{indent}", break_long_words=False)


def _in_words(text: str) -> str:
    """A text for a comment, in one line whatever it holds."""
    return " ".join(text.replace("\0", " ").split())
