"""What lark does for each rule of the grammar: from words to statements, without trees between."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.literals import Atom, Belief, Comparison, Literal, Membership
from ros_scenesense.knowledge.sparc.statements import (
    Aggregate,
    Atomic,
    Bound,
    Choice,
    Combined,
    Concatenation,
    Condition,
    Element,
    Expression,
    Facts,
    Form,
    Members,
    Named,
    Predicate,
    Range,
    Records,
    Related,
    Rule,
    SortDefinition,
    SortTest,
)
from ros_scenesense.knowledge.terms import Arithmetic, Constant, Number, Place, Record, Variable

Parts = list[Any]
"""What the parts of a rule became: words, terms, statements; None for what is not there."""


class MisplacedError(LanguageError):
    """The grammar allows it, the language does not; words and place."""

    def __init__(self, place: Place | None, words: str) -> None:
        super().__init__(words)
        self.place = place


def reader() -> Any:
    """What lark calls for each alternative of `sparc.lark`."""
    return _Reader()


class _Reader:
    """A method for each alternative of the grammar; each takes its parts."""

    listed = tuple
    begun = list

    def continued(self, parts: Parts) -> list[Any]:
        parts[0].append(parts[1])
        return parts[0]  # type: ignore[no-any-return]

    def number(self, parts: Parts) -> Number:
        return Number(int(parts[0].text), parts[0].place)

    def name(self, parts: Parts) -> Constant:
        return Constant(parts[0].text, parts[0].place)

    def variable(self, parts: Parts) -> Variable:
        return Variable(parts[0].text, parts[0].place)

    def anonymous(self, parts: Parts) -> Variable:
        place = parts[0].place
        return Variable(f"_V{place.line}_{place.column}", place)

    def applied(self, parts: Parts) -> Constant | Record:
        word, arguments = parts
        if arguments is None:
            return Constant(word.text, word.place)
        return Record(word.text, tuple(map(_term, arguments)), word.place)

    def sort_atom(self, parts: Parts) -> SortTest:
        word, terms = parts
        if terms is not None and len(terms) != 1:
            raise MisplacedError(
                word.place, f"found {len(terms)} terms of '{word.text}', expected one"
            )
        return SortTest(word.text[1:], None if terms is None else _term(terms[0]), word.place)

    def computed(self, parts: Parts) -> Arithmetic:
        sums, signs = [_summand(parts[0])], []
        for operator, factor in parts[1:]:
            if operator.text in ("*", "/"):
                sums[-1] = Arithmetic(operator.text, sums[-1], _summand(factor), sums[-1].place)
            else:
                signs.append(operator.text)
                sums.append(_summand(factor))
        total: Arithmetic = sums[0]
        for sign, part in zip(signs, sums[1:], strict=True):
            total = Arithmetic(sign, total, part, total.place)
        return total

    def literal(self, parts: Parts) -> Atomic:
        return _literal(parts[0], True)

    def negative(self, parts: Parts) -> Atomic:
        return _literal(parts[1], False)

    def absent(self, parts: Parts) -> Condition:
        return _condition(parts[0], True)  # type: ignore[no-any-return]

    def compared(self, parts: Parts) -> Comparison:
        left, operator, right = parts
        return Comparison(_operator(operator), _term(left), _term(right), _place(left))

    def bound(self, parts: Parts) -> Bound:
        term, operator = (*parts, None)[:2]
        return Bound("<=" if operator is None else _operator(operator), _term(term))

    def bound_after(self, parts: Parts) -> Bound:
        return self.bound(parts[::-1])

    def element(self, parts: Parts) -> Element:
        terms, conditions = parts
        return Element(tuple(map(_term, terms)), None, _conditions(conditions), _place(terms[0]))

    def option(self, parts: Parts) -> Element:
        literal, conditions = parts
        return Element((), _head(literal), _conditions(conditions), _place(literal))

    def aggregate(self, parts: Parts) -> Aggregate:
        left, function, elements, right = parts
        if left is None and right is None:
            raise MisplacedError(
                function.place, f"'{function.text}' has no bound; expected a comparison beside it"
            )
        return Aggregate(function.text, elements, left, right, function.place)

    def choice(self, parts: Parts) -> Choice:
        left, elements, right = parts
        return Choice(elements or (), left, right)

    def fact(self, parts: Parts) -> Rule:
        return _rule(Form.RULE, parts[0], ())

    def rule(self, parts: Parts) -> Rule:
        return _rule(Form.RULE, *parts)

    def constraint(self, parts: Parts) -> Rule:
        return _rule(Form.RULE, (), parts[0])

    def facts(self, parts: Parts) -> Facts:
        name, low, high = parts
        return Facts(name.text, _whole(low), _whole(high), name.place)

    def cr_rule(self, parts: Parts) -> Rule:
        head, body = parts
        return _rule(Form.CR, head, body or ())

    def labelled(self, parts: Parts) -> Rule:
        label, head, body = parts
        return _rule(Form.CR, head, body or (), label=label.text, place=label.place)

    def cr_constraint(self, parts: Parts) -> Rule:
        return _rule(Form.CR, (), parts[0])

    def weak(self, parts: Parts) -> Rule:
        body, weight = parts
        cost, level = weight or (None, None)
        one = Number(1)
        return _rule(Form.WEAK, (), body, weight=cost or one, level=level or one)

    def weight(self, parts: Parts) -> tuple[Any, Any]:
        weight, level = (None if each is None else _term(each) for each in parts)
        return weight, level

    def cost(self, parts: Parts) -> Rule:
        weight, level, *terms, conditions = parts
        return Rule(
            Form.MINIMIZE,
            body=_conditions(conditions),
            weight=_term(weight),
            level=Number(0) if level is None else _term(level),
            terms=tuple(map(_term, terms)),
            place=_place(weight),
        )

    def optimize(self, parts: Parts) -> tuple[Rule, ...]:
        word, costs = parts
        if word.text == Form.MINIMIZE:
            return tuple(costs)
        return tuple(
            Rule(Form.MAXIMIZE, (), each.body, "", each.weight, each.level, each.terms, each.place)
            for each in costs
        )

    def const(self, parts: Parts) -> tuple[Any, Any]:
        return parts[0], parts[2]

    def maxint(self, parts: Parts) -> tuple[Any, Any]:
        return None, parts[1]

    def sort(self, parts: Parts) -> SortDefinition:
        name, _, expression = parts
        return SortDefinition(name.text[1:], expression, name.place)

    def reference(self, parts: Parts) -> Named:
        return Named(parts[0].text[1:], parts[0].place)

    def members(self, parts: Parts) -> Members | Named:
        terms: list[Any] = parts[0] or []
        if len(terms) == 1 and isinstance(terms[0], SortTest) and terms[0].term is None:
            return Named(terms[0].sort, terms[0].place)  # `[#s]`
        places = [_place(each) for each in terms]
        return Members(tuple(map(_term, terms)), places[0] if places else _NOWHERE)

    def range(self, parts: Parts) -> Range:
        ends = [int(each.text) if each.type == "NUMBER" else each.text for each in parts]
        return Range(ends[0], ends[1], parts[0].place)

    def field(self, parts: Parts) -> tuple[Named, Variable | None]:
        word, variable = parts
        sort = Named(word.text[1:], word.place)
        return sort, None if variable is None else Variable(variable.text, variable.place)

    def records(self, parts: Parts) -> Records:
        functor, fields, condition = parts
        sorts, variables = zip(*fields, strict=True)
        return Records(functor.text, sorts, variables, condition, functor.place)

    def related(self, parts: Parts) -> Related:
        left, operator, right = parts
        sides = tuple(Variable(each.text, each.place) for each in (left, right))
        return Related(_operator(operator), sides)

    def either(self, parts: Parts) -> Related:
        return Related("or", tuple(parts))

    def both(self, parts: Parts) -> Related:
        return Related("and", tuple(parts))

    def contrary(self, parts: Parts) -> Related:
        return Related("not", tuple(parts))

    def piece(self, parts: Parts) -> Any:
        return parts[0]

    def concatenation(self, parts: Parts) -> Concatenation:
        return Concatenation(tuple(parts), parts[0].place)

    def union(self, parts: Parts) -> Combined:
        one, _, other = parts
        before = one.parts if isinstance(one, Combined) and one.operator == "+" else (one,)
        return Combined("+", (*before, other), _expression_place(one))

    def difference(self, parts: Parts) -> Combined:
        return Combined("-", tuple(parts[::2]), _expression_place(parts[0]))

    def intersection(self, parts: Parts) -> Combined:
        return Combined("*", tuple(parts[::2]), _expression_place(parts[0]))

    def predicate(self, parts: Parts) -> Predicate:
        name, sorts = parts
        named = tuple(Named(each.text[1:], each.place) for each in sorts or ())
        return Predicate(name.text, named, name.place)

    def display(self, parts: Parts) -> Atomic:
        return parts[0]  # type: ignore[no-any-return]

    def query(self, parts: Parts) -> Atomic:
        return parts[0]  # type: ignore[no-any-return]


_NOWHERE = Place("", 1, 1)


def _expression_place(expression: Expression) -> Place:
    return expression.place


def _place(part: Any) -> Place:
    if isinstance(part, Literal):
        part = part.atom
    if isinstance(part, Belief):
        part = part.literal.atom
    return part.place or _NOWHERE


def _operator(word: Any) -> str:
    return "=" if word.text == "==" else str(word.text)


def _term(part: Any) -> Any:
    """A term; a sort is none."""
    if isinstance(part, SortTest):
        raise MisplacedError(part.place, f"found '#{part.sort}', expected a term")
    return part


def _summand(part: Any) -> Any:
    """A part of arithmetic."""
    if isinstance(part, Constant):
        raise MisplacedError(
            part.place, f"found '{part}' in arithmetic, expected a number: it is no constant"
        )
    if isinstance(part, Record):
        raise MisplacedError(part.place, f"found '{part}' in arithmetic, expected a number")
    return _term(part)


def _literal(part: Any, positive: bool) -> Atomic:
    match part:
        case SortTest():
            if not positive:
                raise MisplacedError(
                    part.place, f"found '-#{part.sort}', expected 'not #{part.sort}(...)'"
                )
            return part
        case Constant(name, place):
            return Literal(Atom(name, (), place), positive)
        case Record(functor, arguments, place):
            return Literal(Atom(functor, arguments, place), positive)
    raise MisplacedError(_place(part), f"found {part}, expected a literal")


def _condition(part: Any, negated: bool) -> Any:
    """A condition or, as it is, an aggregate."""
    if isinstance(part, Literal):
        return Belief(part, negated)
    if isinstance(part, SortTest):
        if part.term is None:
            raise MisplacedError(part.place, f"found '#{part.sort}', expected '#{part.sort}(...)'")
        return Membership(part.sort, part.term, negated, part.place)
    return part


def _conditions(parts: tuple[Any, ...] | None) -> tuple[Condition, ...]:
    return tuple(_condition(each, False) for each in parts or ())


def _head(part: Any) -> Literal:
    if isinstance(part, SortTest):
        raise MisplacedError(
            part.place, f"sort '#{part.sort}' stands in a head, expected a predicate"
        )
    return part  # type: ignore[no-any-return]


def _rule(form: Form, head: Any, body: Sequence[Any], **more: Any) -> Rule:
    if not isinstance(head, Choice):
        head = tuple(map(_head, head))
    parts = tuple(_condition(each, False) for each in body)
    if "place" not in more:
        first = (head.elements if isinstance(head, Choice) else head) or parts
        more["place"] = _place(first[0]) if first else _NOWHERE
    return Rule(form, head, parts, **more)


def _whole(word: Any) -> int:
    if word.type != "NUMBER":
        raise MisplacedError(word.place, f"'{word.text}' is no constant; expected a number")
    return int(word.text)
