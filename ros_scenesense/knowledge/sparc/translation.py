"""From a checked SPARC program to clingo's text.

Each rule keeps its form and gets the guards that make its instances well-sorted. A CR rule becomes
a choice whether an instance is applied, and applied instances are minimised above everything else:
`clingo FILE 0 --opt-mode=optN` computes the answer sets. A solver may first assume that none is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from ros_scenesense.knowledge.literals import (
    Atom,
    Belief,
    Comparison,
    Literal,
    Membership,
    variables_of,
)
from ros_scenesense.knowledge.rendering import WIDTH, atom_text, rule_text, term_text
from ros_scenesense.knowledge.sparc.guards import Guard, Guarding, Guards
from ros_scenesense.knowledge.sparc.language import Program
from ros_scenesense.knowledge.sparc.sorts import (
    Extent,
    Numbers,
    Recorded,
    Sort,
    Union,
    Value,
    value_text,
)
from ros_scenesense.knowledge.sparc.statements import (
    Aggregate,
    Bound,
    Choice,
    Condition,
    Element,
    Facts,
    Form,
    Rule,
    SortTest,
)
from ros_scenesense.knowledge.sparc.walking import (
    evaluated,
    global_variables,
    projected_variables,
)
from ros_scenesense.knowledge.terms import (
    LARGEST_NUMBER,
    Arithmetic,
    Record,
    Term,
    Variable,
)


@dataclass(frozen=True)
class Translation:
    """A program for clingo.

    Attributes:
        text: The program.
        applied: The unary predicate of the instances of CR rules; empty if there are none.
        shown: Sort atoms that every answer set shows.
    """

    text: str
    applied: str
    shown: tuple[str, ...]


def translated(program: Program, show: Sequence[str] = (), optimize: bool = True) -> Translation:
    """Translates.

    Args:
        program: What to translate.
        show: Names of predicates to show instead of what the program displays.
        optimize: Whether answer sets have to be optimal; as few CR rules as can be are applied
            in any case.
    """
    return _Translator(program).translation(show, optimize)


class _Translator:
    def __init__(self, program: Program) -> None:
        self._program = program
        self._signature = program.signature
        self._guarding = Guarding(program.signature)
        self._taken = {*program.signature.predicates, *program.text.names}
        self._sort_names = {
            name: self._free(name, program.signature.predicates) for name in program.signature.sorts
        }
        self._taken.update(self._sort_names.values())
        self._applied = self._free("applied", self._taken)
        self._weak = self._free("weak", self._taken)
        self._known = self._free("known", self._taken)
        self._used: dict[str, None] = {}
        self._helpers: list[str] = []
        self._cr_rules = 0

    def translation(self, show: Sequence[str], optimize: bool) -> Translation:
        rules = [
            text
            for number, rule in enumerate(self._program.text.rules, start=1)
            if optimize or not isinstance(rule, Rule) or rule.form in (Form.RULE, Form.CR)
            for text in self._rule(rule, number)
        ]
        if self._cr_rules:
            rules.append(f"#minimize {{ 1@{LARGEST_NUMBER}, R : {self._applied}(R) }}.")
        shown = (
            self._show_all(show) if show or self._program.text.display is None else self._display()
        )
        # What nothing derives is no mistake, and no reason for clingo to say so.
        derived = {
            (literal.atom.name, literal.positive)
            for rule in self._program.text.rules
            for literal in _derived(rule)
        }
        defined = [
            f"#defined {'' if positive else '-'}{name}/{len(sorts)}."
            for name, sorts in self._signature.predicates.items()
            for positive in (True, False)
            if (name, positive) not in derived
        ]
        sorts = [text for name in self._all_used() for text in self._sort(name)]
        sections = [
            ("% sorts", sorts),
            ("% rules", [*rules, *self._helpers]),
            ("% what answers show", ["#show.", *shown]),
            ("", defined),
        ]
        lines = [
            line for title, texts in sections if texts for line in (*filter(None, [title]), *texts)
        ]
        always = () if show else tuple(self._always_shown())
        return Translation("\n".join(lines) + "\n", self._applied if self._cr_rules else "", always)

    def _rule(self, rule: Rule | Facts, number: int) -> Iterator[str]:
        if isinstance(rule, Facts):
            yield f"{rule.name}({rule.low}..{rule.high})."
            return
        local = projected_variables(rule)
        guards = self._guarding.guards(rule)
        body = self._body(rule, guards, local)
        head = self._head(rule, guards, local)
        match rule.form:
            case Form.RULE:
                yield rule_text(head, body)
            case Form.CR:
                self._cr_rules += 1
                label = rule.label or f"cr_{number}"
                instance = _applied(label, _instance_variables(rule, local))
                yield rule_text(f"{{ {self._applied}({instance}) }}", body)
                yield rule_text(head, [f"{self._applied}({instance})"])
            case Form.WEAK:
                own = [f"{self._weak}({number})", *_instance_variables(rule, local)]
                yield f"{rule_text('', body).replace(':-', ':~', 1)} [{_cost(rule, own)}]"
            case Form.MINIMIZE | Form.MAXIMIZE:
                cost = _cost(rule, [term_text(each) for each in rule.terms])
                conditions = f" : {', '.join(body)}" if body else ""
                yield f"{rule.form} {{ {cost}{conditions} }}."

    def _head(self, rule: Rule, guards: Guards, local: frozenset[Variable]) -> str:
        if not isinstance(rule.head, Choice):
            return " | ".join(map(_literal_text, rule.head))
        choice = rule.head
        elements = [
            self._element(element, own, local)
            for element, own in zip(choice.elements, guards.elements, strict=False)
        ]
        inside = f"{{ {'; '.join(elements)} }}" if elements else "{ }"
        return _bounded(inside, choice.left, choice.right)

    def _body(self, rule: Rule, guards: Guards, local: frozenset[Variable]) -> list[str]:
        own = list(guards.elements)
        if isinstance(rule.head, Choice):
            del own[: len(rule.head.elements)]
        texts = []
        for part in rule.body:
            if isinstance(part, Aggregate):
                texts.append(self._aggregate(part, own[: len(part.elements)], local))
                del own[: len(part.elements)]
            else:
                texts.append(self._condition(part, local))
        return [*texts, *map(self._guard, guards.body)]

    def _aggregate(
        self,
        aggregate: Aggregate,
        guards: Sequence[tuple[Guard, ...]],
        local: frozenset[Variable],
    ) -> str:
        elements = [
            self._element(element, own, local)
            for element, own in zip(aggregate.elements, guards, strict=True)
        ]
        inside = f"{aggregate.function} {{ {'; '.join(elements)} }}"
        return _bounded(inside, aggregate.left, aggregate.right)

    def _element(
        self, element: Element, guards: Sequence[Guard], local: frozenset[Variable]
    ) -> str:
        if element.literal is None:
            text = ", ".join(term_text(each) for each in element.terms)
        else:
            text = _literal_text(element.literal)
        conditions = [
            *(self._condition(each, local) for each in element.conditions),
            *map(self._guard, guards),
        ]
        return f"{text} : {', '.join(conditions)}" if conditions else text

    def _condition(self, condition: Condition, local: frozenset[Variable]) -> str:
        match condition:
            case Comparison():
                left, right = term_text(condition.left), term_text(condition.right)
                return f"{left} {condition.operator} {right}"
            case Membership():
                sort = self._signature.sorts[condition.sort]
                if not condition.negated:
                    return self._guard(Guard(sort, condition.term))
                return f"not {self._sort_predicate(sort)}({term_text(condition.term)})"
            case Belief(literal, negated):
                projected = any(each in local for each in variables_of(literal))
                if negated and projected and not literal.positive:
                    return f"not {self._projection(literal, local)}"
                text = _literal_text(literal, local)
                return f"not {text}" if negated else text

    def _projection(self, literal: Literal, local: frozenset[Variable]) -> str:
        """A helper that says the same as a negated literal with `_`, which clingo has not."""
        kept = dict.fromkeys(each for each in variables_of(literal) if each not in local)
        name = f"{self._known}_{len(self._helpers) + 1}"
        helper = _applied(name, map(str, kept))
        # `kept` is bound here by whatever is derived, and there by the rule.
        self._helpers.append(rule_text(helper, [_literal_text(literal, local)]))
        return helper

    def _guard(self, guard: Guard) -> str:
        numbers = guard.sort.numbers
        if numbers is not None:
            return f"{term_text(guard.term)} = {numbers.low}..{numbers.high}"
        return f"{self._sort_predicate(guard.sort)}({term_text(guard.term)})"

    def _sort_predicate(self, sort: Sort) -> str:
        self._used[sort.name] = None
        return self._sort_names[sort.name]

    def _all_used(self) -> list[str]:
        """The sorts that rules use and those that these are made of, in the order of the text."""
        found = dict(self._used)
        fresh = list(found)
        while fresh:
            for sort in _made_of(self._signature.sorts[fresh.pop()].extent):
                if sort.name not in found:
                    found[sort.name] = None
                    fresh.append(sort.name)
        return [name for name in self._signature.sorts if name in found]

    def _sort(self, name: str) -> Iterator[str]:
        extent = self._signature.sorts[name].extent
        predicate = self._sort_names[name]
        for part in extent.parts if isinstance(extent, Union) else (extent,):
            match part:
                case Numbers(low, high):
                    yield f"{predicate}({low}..{high})."
                case Sort():
                    yield f"{predicate}(X) :- {self._sort_names[part.name]}(X)."
                case Recorded(functor, parts, None):
                    names = [f"X{number}" for number in range(1, len(parts) + 1)]
                    body = [
                        f"{self._sort_names[each.name]}({variable})"
                        for each, variable in zip(parts, names, strict=True)
                    ]
                    yield rule_text(f"{predicate}({_applied(functor, names)})", body)
                case _:
                    yield from _facts(predicate, map(value_text, dict.fromkeys(part)))

    def _show_all(self, names: Sequence[str]) -> Iterator[str]:
        for name, sorts in self._signature.predicates.items():
            if not names or name in names:
                yield f"#show {name}/{len(sorts)}."
                yield f"#show -{name}/{len(sorts)}."

    def _display(self) -> Iterator[str]:
        whole = set()
        lines = self._program.text.display or ()
        for each in lines:
            if isinstance(each, Literal):
                arity = len(self._signature.predicates[each.atom.name])
                if not each.atom.arguments:
                    whole.add((each.atom.name, each.positive))
                    yield f"#show {'' if each.positive else '-'}{each.atom.name}/{arity}."
        for each in lines:
            if not isinstance(each, Literal) or (each.atom.name, each.positive) in whole:
                continue
            if each.atom.arguments:
                text = _literal_text(each)
                yield f"#show {text} : {text}."

    def _always_shown(self) -> Iterator[str]:
        for each in self._program.text.display or ():
            if isinstance(each, SortTest):
                for value in dict.fromkeys(self._signature.sorts[each.sort]):
                    if each.term is None or matches(each.term, value, {}):
                        yield f"#{each.sort}({value_text(value)})"

    @staticmethod
    def _free(name: str, taken: Iterable[str]) -> str:
        taken = set(taken)
        while name in taken:
            name += "_"
        return name


def matches(term: Term, value: Value, binding: dict[Variable, Value]) -> bool:
    """Whether a value is an instance of a term; notes the values of its variables."""
    if isinstance(term, Variable):
        return binding.setdefault(term, value) == value
    if isinstance(term, Record):
        return (
            isinstance(value, tuple)
            and value[0] == term.functor
            and len(value) == len(term.arguments) + 1
            and all(
                matches(argument, each, binding)
                for argument, each in zip(term.arguments, value[1:], strict=True)
            )
        )
    if isinstance(term, Arithmetic):
        return value == evaluated(term)
    return value_text(value) == str(term)


def _derived(rule: Rule | Facts) -> Iterator[Literal]:
    """The literals that a rule may derive."""
    if isinstance(rule, Facts):
        yield Literal(Atom(rule.name))
    elif isinstance(rule.head, Choice):
        yield from (each.literal for each in rule.head.elements if each.literal is not None)
    else:
        yield from rule.head


def _literal_text(literal: Literal, local: frozenset[Variable] = frozenset()) -> str:
    text = atom_text(literal.atom, local)
    return text if literal.positive else f"-{text}"


def _applied(name: str, arguments: Iterable[str]) -> str:
    inside = ", ".join(arguments)
    return f"{name}({inside})" if inside else name


def _bounded(inside: str, left: Bound | None, right: Bound | None) -> str:
    before = f"{term_text(left.term)} {left.operator} " if left else ""
    after = f" {right.operator} {term_text(right.term)}" if right else ""
    return before + inside + after


def _instance_variables(rule: Rule, local: frozenset[Variable]) -> list[str]:
    """The variables whose values make an instance, in a fixed order."""
    return sorted(each.name for each in global_variables(rule) if each not in local)


def _cost(rule: Rule, terms: Sequence[str]) -> str:
    assert rule.weight is not None
    assert rule.level is not None
    weight, level = term_text(rule.weight), term_text(rule.level)
    return ", ".join((f"{weight}@{level}", *terms))


def _made_of(extent: Extent) -> Iterator[Sort]:
    """The sorts that the rules for a sort speak of."""
    for part in extent.parts if isinstance(extent, Union) else (extent,):
        if isinstance(part, Sort):
            yield part
        elif isinstance(part, Recorded) and part.condition is None:
            yield from part.parts


def _facts(predicate: str, values: Iterable[str]) -> Iterator[str]:
    """Facts for many values, some on each line."""
    line = ""
    for value in values:
        if line and len(predicate) + len(line) + len(value) + 6 > WIDTH:
            yield f"{predicate}({line})."
            line = ""
        line += f"; {value}" if line else value
    if line:
        yield f"{predicate}({line})."
