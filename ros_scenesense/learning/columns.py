"""The relational description of an object, from the signature of the domain alone.

Each column is a question about an object A: a static or unary fluent of A, whether A stands in a
relation to some B, whether to some B of a certain kind, whether a number exceeds a threshold. Its
answers over all examples are the bits of one integer, so trees are grown by counting bits.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from ros_scenesense.knowledge.axioms import StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Comparison, Condition, Literal
from ros_scenesense.knowledge.signature import Attribute, AttributeKind, Signature
from ros_scenesense.knowledge.terms import Constant, Number, Variable
from ros_scenesense.learning.examples import Example, SceneState

OBJECT = Variable("A")
"""The object that is described: the argument of the head."""

OTHER = Variable("B")
"""Stands in a column for what else it speaks of; every column of a body gets its own."""

_PERCEIVED = (AttributeKind.INERTIAL,)
_OTHERS = (AttributeKind.STATIC, AttributeKind.INERTIAL, AttributeKind.DEFINED)


@dataclass(frozen=True)
class Column:
    """A question about an object.

    Attributes:
        name: The attribute that it asks about.
        place: Which argument the object is.
        value: The other argument, if the question names it.
        threshold: The other argument, a number, exceeds it.
        join: A static and its value that the other object must have.
        if_true: What holds where the answer is yes.
        if_false: What holds where it is no; None if no conjunction of literals says that.
    """

    name: str
    if_true: tuple[Condition, ...]
    if_false: tuple[Condition, ...] | None
    place: int = 0
    value: str | None = None
    threshold: int | None = None
    join: tuple[str, str] | None = None

    def holds(self, state: SceneState, target: int) -> bool:
        """The answer for an object of a scene."""
        for arguments in state.by_name.get(self.name, ()):
            if arguments[self.place] != target:
                continue
            if len(arguments) == 1:
                return True
            other = arguments[1 - self.place]
            if self.value is not None:
                if other == self.value:
                    return True
            elif self.threshold is not None:
                if isinstance(other, int) and other > self.threshold:
                    return True
            elif isinstance(other, int) and (
                self.join is None or (self.join[0], (other, self.join[1])) in state.facts
            ):
                return True
        return False

    @property
    def is_about_any(self) -> bool:
        """Whether it asks for a B in a relation to A, whatever that B is."""
        return self.value is None and self.threshold is None and self.join is None

    def __str__(self) -> str:
        return ", ".join(map(str, self.if_true))


def columns_of(
    description: SystemDescription, sort: str, relevant: Collection[str] | None = None
) -> list[Column]:
    """The columns for objects of a sort; the plainest first.

    Args:
        description: The domain.
        sort: The sort of what is described.
        relevant: Perceived relations that may bear on the label; with them go their converses, and
            what is defined from them alone. None = all.
    """
    signature = description.signature
    allowed = None if relevant is None else _allowed(description, relevant)
    attributes = [
        each
        for each in signature.attributes_of(*_OTHERS)
        if allowed is None or each.kind is AttributeKind.STATIC or each.name in allowed
    ]
    perceived = [each for each in attributes if each.kind in _PERCEIVED]
    defined = [each for each in attributes if each.kind is AttributeKind.DEFINED]
    statics = [each for each in attributes if each.kind is AttributeKind.STATIC]
    plain = [
        column
        for group in (perceived, defined, statics)
        for each in group
        for column in _plain(each, sort, signature)
    ]
    # One argument before two: `irregular_below(A)` rather than what it stands for.
    plain.sort(key=lambda column: column.place)
    pairs = [each for each in (*perceived, *defined) if _relates(each, sort, signature)]
    return plain + [
        column
        for place in (0, 1)
        for each in pairs
        if _is_object(each.arguments[1 - place], sort, signature)
        for static in statics
        if len(static.arguments) == 2 and _is_object(static.arguments[0], sort, signature)
        for column in _joins(each, place, static, signature)
    ]


@dataclass(frozen=True)
class Table:
    """The answers of columns for examples, bit i for example i; columns that tell nothing are out.

    Attributes:
        columns: Those that tell examples apart, each answered differently.
        bits: Their answers.
        positive: The labels.
        count: Number of examples.
        general: Of a column that asks for a B of a certain kind, the number of the one that asks
            for any B, if that is among them.
    """

    columns: tuple[Column, ...]
    bits: tuple[int, ...]
    positive: int
    count: int
    general: Mapping[int, int] = field(default_factory=dict)

    @classmethod
    def of(cls, columns: Iterable[Column], examples: Sequence[Example]) -> Table:
        """Asks every column about every example. Of columns with equal answers the first stays."""
        whole = (1 << len(examples)) - 1
        kept: dict[int, Column] = {}
        of_any: dict[tuple[str, int], int] = {}
        for column in columns:
            answers = bits_of(column.holds(each.state, each.target) for each in examples)
            if column.is_about_any:
                of_any[column.name, column.place] = answers
            if answers not in (0, whole):
                kept.setdefault(answers, column)
        number = {answers: index for index, answers in enumerate(kept)}
        return cls(
            columns=tuple(kept.values()),
            bits=tuple(kept),
            positive=bits_of(each.label for each in examples),
            count=len(examples),
            general={
                index: number[of_any[column.name, column.place]]
                for index, column in enumerate(kept.values())
                if column.join is not None and of_any.get((column.name, column.place)) in number
            },
        )

    @property
    def everything(self) -> int:
        """All examples."""
        return (1 << self.count) - 1


def bits_of(answers: Iterable[bool]) -> int:
    """An integer with bit i set where answer i is true."""
    text = "".join("1" if answer else "0" for answer in answers)
    return int(text[::-1], 2) if text else 0


def _plain(attribute: Attribute, sort: str, signature: Signature) -> Iterator[Column]:
    name, sorts = attribute.name, attribute.arguments
    if not sorts or not _is_object(sorts[0], sort, signature):
        if len(sorts) == 2 and _is_object(sorts[1], sort, signature):
            yield _exists(name, 1)
        return
    if len(sorts) == 1:
        literal = Literal(Atom(name, (OBJECT,)))
        yield Column(name, (Belief(literal),), (_denied(literal, attribute),))
    elif len(sorts) == 2:
        bounds = signature.sorts[sorts[1]].bounds
        if bounds is not None:
            yield from (_exceeds(name, level) for level in range(bounds[0], bounds[1]))
            return
        for value in signature.members(sorts[1]):
            if isinstance(value, Constant):
                literal = Literal(Atom(name, (OBJECT, value)))
                denied = (_denied(literal, attribute),)
                yield Column(name, (Belief(literal),), denied, value=value.name)
        for place in (0, 1):
            if all(_is_object(each, sort, signature) for each in sorts):
                yield _exists(name, place)


def _exists(name: str, place: int) -> Column:
    literal = Literal(Atom(name, (OBJECT, OTHER) if place == 0 else (OTHER, OBJECT)))
    return Column(name, (Belief(literal),), (Belief(literal, negated=True),), place)


def _exceeds(name: str, level: int) -> Column:
    has = Belief(Literal(Atom(name, (OBJECT, OTHER))))
    return Column(
        name,
        (has, Comparison(">", OTHER, Number(level))),
        (has, Comparison("<=", OTHER, Number(level))),
        threshold=level,
    )


def _joins(
    attribute: Attribute, place: int, static: Attribute, signature: Signature
) -> Iterator[Column]:
    arguments = (OBJECT, OTHER) if place == 0 else (OTHER, OBJECT)
    stands = Belief(Literal(Atom(attribute.name, arguments)))
    for value in signature.members(static.arguments[1]):
        if isinstance(value, Constant):
            kind = Belief(Literal(Atom(static.name, (OTHER, value))))
            join = (static.name, value.name)
            # That no B is both is no conjunction of literals.
            yield Column(attribute.name, (stands, kind), None, place, join=join)


def _denied(literal: Literal, attribute: Attribute) -> Condition:
    if attribute.kind is AttributeKind.STATIC:
        return Belief(literal.complement)
    return Belief(literal, negated=True)


def _relates(attribute: Attribute, sort: str, signature: Signature) -> bool:
    return len(attribute.arguments) == 2 and all(
        _is_object(each, sort, signature) for each in attribute.arguments
    )


def _is_object(sort: str, described: str, signature: Signature) -> bool:
    return signature.is_subsort(described, sort)


def _allowed(description: SystemDescription, relevant: Collection[str]) -> frozenset[str]:
    """Relevant relations, their converses, and what rests on nothing but them and on statics."""
    attributes = description.signature.attributes
    rests: dict[str, set[str]] = {}
    for axiom in description.axioms:
        if isinstance(axiom, StateConstraint):
            rests.setdefault(axiom.head.atom.name, set()).update(
                each.literal.atom.name for each in axiom.body if isinstance(each, Belief)
            )
    allowed = set(relevant)
    for name in relevant:
        if name in attributes and attributes[name].kind in _PERCEIVED:
            # A perceived relation that a constraint derives from another is its converse.
            allowed |= {each for each in rests.get(name, ()) if attributes[each].kind in _PERCEIVED}

    def perceived(name: str, seen: set[str]) -> set[str]:
        if name in seen or name not in attributes:
            return set()
        seen.add(name)
        if attributes[name].kind in _PERCEIVED:
            # What is true of the hand is true of no object in the scene.
            about_objects = len(set(attributes[name].arguments)) == 1
            return {name} if about_objects else set()
        return set[str]().union(*(perceived(each, seen) for each in rests.get(name, ())))

    return frozenset(
        name
        for name, attribute in attributes.items()
        if name in allowed
        or (
            attribute.kind is AttributeKind.DEFINED
            and rests.get(name)
            and perceived(name, set()) <= allowed
            and perceived(name, set())
        )
    )
