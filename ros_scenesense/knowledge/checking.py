"""Whether axioms, facts, goals and histories fit the signature; whatever they were made from."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from ros_scenesense.knowledge.axioms import (
    Axiom,
    CausalLaw,
    Default,
    ExecutabilityCondition,
    InitialDefault,
    StateConstraint,
)
from ros_scenesense.knowledge.description import Goal, History, Quantity
from ros_scenesense.knowledge.literals import (
    Atom,
    Belief,
    Comparison,
    Condition,
    Literal,
    Membership,
    variables_of,
)
from ros_scenesense.knowledge.numbers import Numbers
from ros_scenesense.knowledge.problems import Problems, listed, nearest
from ros_scenesense.knowledge.signature import Action, Attribute, AttributeKind, Signature
from ros_scenesense.knowledge.sorting import Head, local_variables, sorts_of
from ros_scenesense.knowledge.terms import (
    Arithmetic,
    Number,
    Place,
    Record,
    Symbol,
    Term,
    Variable,
    variables,
)


class Checker:
    """Checks against a signature.

    Args:
        signature: What is declared.
        problems: Where to note what is wrong.
        unread: Names of which it is unknown what they are; nothing is said about them.
    """

    def __init__(
        self, signature: Signature, problems: Problems, unread: Collection[str] = ()
    ) -> None:
        self._signature = signature
        self._problems = problems
        # An attribute of an unknown sort was reported where it was declared.
        declared: list[Attribute | Action] = [
            *signature.attributes.values(),
            *signature.actions.values(),
        ]
        odd = [each for each in declared if not signature.sorts.keys() >= set(each.arguments)]
        self._unread = {*unread, *(each.name for each in odd)}

    def axiom(self, axiom: Axiom) -> None:
        """Checks an axiom: names, arguments, kinds of fluents, variables, numbers."""
        acting = isinstance(axiom, CausalLaw)
        known = [self._premise(premise, acting) for premise in axiom.body]
        match axiom:
            case CausalLaw(action=action, effect=effect):
                known += [self._action(action), self._fluent(effect.atom)]
                self._kind(effect, (AttributeKind.INERTIAL,), "causes")
            case ExecutabilityCondition(actions=actions):
                known += [self._action(action) for action in actions]
            case StateConstraint(head=head):
                known.append(self._fluent(head.atom))
                self._constraint(axiom)
            case Default(head=head):
                known.append(self._fluent(head.atom))
                self._kind(head, (AttributeKind.ESTIMATED,), "normally")
            case InitialDefault(head=head):
                known.append(self._fluent(head.atom))
                allowed = (AttributeKind.INERTIAL, AttributeKind.ESTIMATED)
                self._kind(head, allowed, "initially normally")
        if all(known):
            self._variables(axiom.conclusions, axiom.premises, axiom.place)

    def fact(self, fact: Literal) -> None:
        """Checks the value of a static."""
        self._fluent(fact.atom)
        self._ground(fact.atom, "a fact")

    def goal(self, goal: Goal) -> None:
        """Checks a goal."""
        for condition in goal.conditions:
            literal = condition.literal
            if not self._fluent(literal.atom):
                continue
            if condition.quantity is Quantity.TRUE:
                for variable in list(variables_of(literal))[:1]:
                    self._problems.add(
                        variable.place,
                        f"found the variable {variable}, expected 'no', 'all' or 'fewest' before "
                        f"{literal}: which {variable} is meant?",
                    )
            else:
                self._variables((literal,), (), goal.place)

    def history(self, history: History) -> None:
        """Checks observations, actions and initial facts."""
        for observation in history.observations:
            self._fluent(observation.fluent)
            self._ground(observation.fluent, "an observation")
            self._step(observation.step, observation.fluent.place)
            attribute = self._signature.attributes.get(observation.fluent.name)
            if attribute is not None and attribute.kind is AttributeKind.STATIC:
                self._problems.add(
                    observation.fluent.place,
                    f"'{observation.fluent.name}' is a static; expected a fluent, or the fact "
                    f"'{observation.fluent}.'",
                )
        for happened in history.happened:
            self._action(happened.action)
            self._ground(happened.action, "an action that happened")
            self._step(happened.step, happened.action.place)
        for literal in history.initial:
            self._fluent(literal.atom)
            self._ground(literal.atom, "an initial fact")
            self._kind(literal, (AttributeKind.INERTIAL,), "initially")

    def _premise(self, premise: Condition, acting: bool) -> bool:
        match premise:
            case Belief(literal):
                if acting and literal.positive and literal.atom.name in self._signature.actions:
                    return self._action(literal.atom)
                return self._fluent(literal.atom)
            case Membership(sort):
                return sort in self._signature.sorts
            case Comparison():
                return True

    def _fluent(self, atom: Atom) -> bool:
        attributes = self._signature.attributes
        if atom.name in attributes:
            return self._arguments(atom, attributes[atom.name].arguments)
        if atom.name not in self._unread:
            what = "an action" if atom.name in self._signature.actions else "no fluent or static"
            what = "a sort" if atom.name in self._signature.sorts else what
            self._problems.add(
                atom.place,
                f"'{atom.name}' is {what}; expected a fluent or a static"
                f"{nearest(atom.name, attributes)}",
            )
        return False

    def _action(self, atom: Atom) -> bool:
        actions = self._signature.actions
        if atom.name in actions:
            return self._arguments(atom, actions[atom.name].arguments)
        if atom.name not in self._unread:
            what = "a fluent" if atom.name in self._signature.attributes else "no action"
            self._problems.add(
                atom.place,
                f"'{atom.name}' is {what}; expected an action{nearest(atom.name, actions)}",
            )
        return False

    def _arguments(self, atom: Atom, sorts: Sequence[str]) -> bool:
        if atom.name in self._unread:
            return False
        if len(atom.arguments) != len(sorts):
            declared = f"{atom.name}({', '.join(sorts)})" if sorts else atom.name
            self._problems.add(
                atom.place,
                f"found {len(atom.arguments)} arguments of '{atom.name}', expected {len(sorts)}: "
                f"{declared}",
            )
            return False
        fit = [
            self._argument(term, sort, atom)
            for term, sort in zip(atom.arguments, sorts, strict=True)
        ]
        return all(fit)

    def _argument(self, term: Term, sort: str, atom: Atom) -> bool:
        place = term.place or atom.place
        if isinstance(term, Variable):
            return True
        if isinstance(term, Arithmetic):
            if Numbers(self._signature).within(sort) is not None:
                return True
            words = f"found {term} in {atom}, but sort '{sort}' has no numbers"
        elif any(True for _ in variables(term)):
            assert isinstance(term, Record)
            known = {
                (each.functor, len(each.arguments))
                for each in self._signature.members(sort)
                if isinstance(each, Record)
            }
            if (term.functor, len(term.arguments)) in known:
                return True
            words = (
                f"found {term} in {atom}, but sort '{sort}' has no such member {term.functor}(...)"
            )
        else:
            if self._signature.contains(sort, term):
                return True
            words = f"'{term}' in {atom} does not belong to sort '{sort}'" + self._members(
                term, sort
            )
        self._problems.add(place, words)
        return False

    def _members(self, term: Symbol, sort: str) -> str:
        bounds = [self._signature.sorts[each].bounds for each in self._signature.family(sort)]
        ranges = [f"{low}..{high}" for low, high in filter(None, bounds)]
        names = [
            str(member)
            for each in self._signature.family(sort)
            for member in self._signature.sorts[each].members
        ]
        if not names and not ranges:
            return f", which has no members: add some with 'sort {sort} += {{...}}.'"
        close = nearest(str(term), names)
        return f" ({listed([*ranges, *names])}){close}"

    def _kind(self, head: Literal, kinds: Sequence[AttributeKind], statement: str) -> None:
        attribute = self._signature.attributes.get(head.atom.name)
        if attribute is None or attribute.kind in kinds:
            return
        wanted = " or ".join(kinds)
        hint = ""
        if attribute.kind is AttributeKind.INERTIAL and statement == "normally":
            hint = "; a default about its first value is written 'initially normally ...'"
        self._problems.add(
            head.atom.place,
            f"'{attribute.name}' is {_kind_words(attribute.kind)}; "
            f"expected {_article(wanted)} fluent with '{statement}'{hint}",
        )

    def _constraint(self, axiom: StateConstraint) -> None:
        attributes = self._signature.attributes
        attribute = attributes.get(axiom.head.atom.name)
        if attribute is None:
            return
        if attribute.kind is AttributeKind.DEFINED and not axiom.head.positive:
            self._problems.add(
                axiom.head.atom.place,
                f"'{attribute.name}' is defined, and false wherever nothing derives it; expected "
                f"no law for {axiom.head}",
            )
        if attribute.kind is AttributeKind.STATIC:
            for premise in axiom.body:
                if isinstance(premise, Belief):
                    other = attributes.get(premise.literal.atom.name)
                    if other is not None and other.kind is not AttributeKind.STATIC:
                        self._problems.add(
                            premise.literal.atom.place,
                            f"'{other.name}' is {_kind_words(other.kind)}; expected statics "
                            f"alone in the definition of the static '{attribute.name}'",
                        )

    def _ground(self, atom: Atom, what: str) -> None:
        for variable in list(variables_of(atom))[:1]:
            self._problems.add(
                variable.place, f"found the variable {variable} in {what}, expected a constant"
            )

    def _step(self, step: int, place: Place | None) -> None:
        if step < 0:
            self._problems.add(place, f"found step {step}, expected 0 or more")

    def _variables(
        self, heads: Iterable[Head], premises: Sequence[Condition], place: Place | None
    ) -> None:
        """Variables have sorts that fit together, and what is computed fits 32 bits."""
        heads = tuple(heads)
        local = local_variables(heads, premises)
        sorts: dict[Variable, tuple[str, ...]] = {}
        occurring = [each for part in (*heads, *premises) for each in variables_of(part)]
        sound = True
        for variable in dict.fromkeys(occurring):
            sorts[variable] = sorts_of(variable, heads, premises, self._signature)
            where = next(each.place for each in occurring if each == variable) or place
            words = self._problem_of(variable, sorts[variable], heads, premises, local)
            if words:
                self._problems.add(where, words)
                sound = False
        if sound:
            Numbers(self._signature, sorts).check(heads, premises, self._problems, place)

    def _problem_of(
        self,
        variable: Variable,
        sorts: Sequence[str],
        heads: Sequence[Head],
        premises: Sequence[Condition],
        local: Collection[Variable],
    ) -> str:
        if not sorts:
            return (
                f"{variable} is unsafe: nothing says which values it has; expected it as an "
                "argument of a fluent, or in a condition such as "
                f"'{next(iter(self._signature.sorts), 'sort')}({variable})'"
            )
        for index, sort in enumerate(sorts):
            for other in sorts[:index]:
                if not self._overlap(sort, other):
                    return (
                        f"{variable} would belong to sort '{other}' and to sort '{sort}', which "
                        "have no member in common"
                    )
        bound = any(variable in variables_of(head) for head in heads) or any(
            variable in variables_of(each)
            for each in premises
            if not (isinstance(each, Belief | Membership) and each.negated)
        )
        if not bound and variable not in local:
            return (
                f"{variable} occurs in several conditions with 'not' and nowhere else; expected "
                f"'_' in each for \"no value at all\", or '{sorts[0]}({variable})' for \"some "
                'value"'
            )
        return ""

    def _overlap(self, one: str, other: str) -> bool:
        family = set(self._signature.family(one))
        if family.intersection(self._signature.family(other)):
            return True
        numbers = Numbers(self._signature)
        first, second = numbers.within(one), numbers.within(other)
        if first and second and first[0] <= second[1] and second[0] <= first[1]:
            return True
        return bool(self._names(one) & self._names(other))

    def _names(self, sort: str) -> set[Symbol]:
        return {
            member
            for each in self._signature.family(sort)
            for member in self._signature.sorts[each].members
            if not isinstance(member, Number)
        }


def _kind_words(kind: AttributeKind) -> str:
    return "a static" if kind is AttributeKind.STATIC else f"{_article(kind)} fluent"


def _article(words: str) -> str:
    return f"{'an' if words[0] in 'aeiou' else 'a'} {words}"
