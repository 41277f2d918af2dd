"""From the declarations of a text to a signature."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.problems import Problems, nearest
from ros_scenesense.knowledge.signature import Action, Attribute, Signature, Sort
from ros_scenesense.knowledge.statements import (
    ActionsStatement,
    AttributesStatement,
    ConstStatement,
    Declaration,
    Expression,
    MembersStatement,
    Name,
    Range,
    SortStatement,
    Statement,
)
from ros_scenesense.knowledge.terms import (
    LARGEST_NUMBER,
    Arithmetic,
    Constant,
    Number,
    Place,
    Record,
    Symbol,
    Term,
    Variable,
)
from ros_scenesense.knowledge.trees import plain_term

RESERVED = frozenset(
    (
        *("action", "applied", "assumed", "axiom", "enabled", "exception", "fluent", "goal"),
        *("holds", "hpd", "neg", "obs", "occurs", "pos", "query", "restore", "step", "steps"),
        *("something_happened", "success", "surveyed", "unknown"),
    )
)
"""Names that the translations use for themselves."""


class Declarations:
    """Collects declarations; the signature comes out at the end.

    Args:
        signature: What is declared already.
        unread: Names in statements that could not be read; nothing is said about them.
        problems: Where to note what is wrong.
    """

    def __init__(self, signature: Signature, unread: Collection[str], problems: Problems) -> None:
        self._sorts = dict(signature.sorts)
        self._attributes = dict(signature.attributes)
        self._actions = dict(signature.actions)
        self._constants: dict[str, Symbol] = {}
        self._unread = unread
        self._problems = problems
        self._places: dict[str, Place | None] = {
            each.name: each.place
            for group in (self._sorts, self._attributes, self._actions)
            for each in group.values()
        }

    def signature(self, statements: Iterable[Statement]) -> Signature:
        """Reads the declarations among the statements, in whatever order they stand."""
        statements = tuple(statements)
        for statement in statements:
            if isinstance(statement, ConstStatement) and self._is_new(statement.name):
                value = self.symbol(statement.value)
                if value is not None:
                    self._constants[statement.name.text] = value
        sorts = [each for each in statements if isinstance(each, SortStatement)]
        for sort in sorts:
            if self._is_new(sort.name):
                self._sorts[sort.name.text] = Sort(sort.name.text, place=sort.name.place)
        for sort in sorts:
            self._fill(sort)
        for statement in statements:
            if isinstance(statement, MembersStatement) and self._is_sort(statement.name):
                self._add(statement.name.text, self._symbols(statement.members))
        self._check_hierarchy()
        for statement in statements:
            if isinstance(statement, AttributesStatement):
                for each in statement.declarations:
                    if self._is_new(each.name):
                        name, place = each.name.text, each.name.place
                        self._attributes[name] = Attribute(
                            name, statement.kind, self._arguments(each), place
                        )
            elif isinstance(statement, ActionsStatement):
                for each in statement.declarations:
                    if self._is_new(each.name):
                        name, place = each.name.text, each.name.place
                        self._actions[name] = Action(
                            name, self._arguments(each), statement.exogenous, place
                        )
        return Signature(self._sorts, self._attributes, self._actions)

    def term(self, expression: Expression) -> Term:
        """The term that was written, with declared constants replaced by their values."""
        return self._resolved(plain_term(expression))

    def symbol(self, expression: Expression) -> Symbol | None:
        """The term without variables that was written, computed; None if it is none."""
        return self._computed(self.term(expression), expression.place)

    def _resolved(self, term: Term) -> Term:
        match term:
            case Constant(name):
                value = self._constants.get(name)
                return term if value is None else replace(value, place=term.place)
            case Record():
                return replace(term, arguments=tuple(map(self._resolved, term.arguments)))
            case Arithmetic():
                return replace(
                    term, left=self._resolved(term.left), right=self._resolved(term.right)
                )
        return term

    def _computed(self, term: Term, place: Place | None) -> Symbol | None:
        match term:
            case Variable():
                self._problems.add(
                    place, f"found the variable {term}, expected a constant or a number"
                )
                return None
            case Record():
                arguments = [self._computed(each, place) for each in term.arguments]
                known = tuple(each for each in arguments if each is not None)
                return replace(term, arguments=known) if len(known) == len(arguments) else None
            case Arithmetic():
                return self._calculated(term, place)
        return term

    def _calculated(self, term: Arithmetic, place: Place | None) -> Symbol | None:
        left, right = (self._computed(side, place) for side in (term.left, term.right))
        if left is None or right is None:
            return None
        if not (isinstance(left, Number) and isinstance(right, Number)):
            self._problems.add(place, f"found {term}, expected numbers on both sides")
            return None
        try:
            return Number(calculated(term.operator, left.value, right.value), place)
        except (LanguageError, ZeroDivisionError):
            self._problems.add(place, f"{term} has no value of at most {LARGEST_NUMBER}")
            return None

    def _is_new(self, name: Name) -> bool:
        if name.text in RESERVED:
            self._problems.add(
                name.place,
                f"'{name.text}' means something in every translated program; expected another name",
            )
            return False
        if name.text in self._places:
            first = self._places[name.text]
            where = f" at {first}" if first else ""
            self._problems.add(
                name.place, f"'{name.text}' is declared twice; it was declared{where} already"
            )
            return False
        self._places[name.text] = name.place
        return True

    def _is_sort(self, name: Name) -> bool:
        if name.text in self._sorts:
            return True
        if name.text not in self._unread:
            self._problems.add(
                name.place, f"'{name.text}' is no sort{nearest(name.text, self._sorts)}"
            )
        return False

    def _fill(self, statement: SortStatement) -> None:
        name = statement.name.text
        if self._places.get(name) != statement.name.place:
            return  # declared twice
        for upper in statement.supersorts:
            if self._is_sort(upper):
                self._put_below(name, upper.text)
        for part in statement.parts:
            if isinstance(part, Name):
                if self._is_sort(part):
                    self._put_below(part.text, name)
            elif isinstance(part, Range):
                self._bound(name, part)
            else:
                if not part:
                    self._problems.add(
                        statement.name.place,
                        f"the set of sort '{name}' is empty; expected members, or no '= {{}}' "
                        "where they are added later",
                    )
                self._add(name, self._symbols(part))

    def _put_below(self, lower: str, upper: str) -> None:
        old = self._sorts[lower]
        self._sorts[lower] = replace(old, supersorts=tuple(dict.fromkeys((*old.supersorts, upper))))

    def _add(self, name: str, symbols: tuple[Symbol, ...]) -> None:
        old = self._sorts[name]
        members = tuple(dict.fromkeys((*old.members, *symbols)))
        self._sorts[name] = replace(old, members=members)

    def _symbols(self, expressions: Iterable[Expression]) -> tuple[Symbol, ...]:
        found = (self.symbol(each) for each in expressions)
        return tuple(each for each in found if each is not None)

    def _bound(self, name: str, part: Range) -> None:
        bounds = []
        for side in (part.low, part.high):
            number = self.symbol(side)
            if isinstance(number, Number):
                bounds.append(number.value)
            elif number is not None:
                hint = nearest(str(number), self._constants)
                self._problems.add(
                    side.place, f"found '{number}', expected a number or a const{hint}"
                )
        if len(bounds) < 2:
            return
        low, high = bounds
        if low > high:
            self._problems.add(part.place, f"the range {low}..{high} is upside down")
        elif self._sorts[name].bounds is not None:
            self._problems.add(
                part.place, f"sort '{name}' has two ranges; expected one, the other in a subsort"
            )
        else:
            self._sorts[name] = replace(self._sorts[name], bounds=(low, high))

    def _check_hierarchy(self) -> None:
        for start, sort in self._sorts.items():
            path, found = [start], {start}
            fresh = [(upper, [start, upper]) for upper in sort.supersorts]
            while fresh:
                name, path = fresh.pop()
                if name == start:
                    self._problems.add(
                        sort.place, f"sort '{start}' is below itself: {' < '.join(path)}"
                    )
                    break
                if name not in found:
                    found.add(name)
                    above = self._sorts[name].supersorts
                    fresh.extend((upper, [*path, upper]) for upper in above)

    def _arguments(self, declaration: Declaration) -> tuple[str, ...]:
        for sort in declaration.sorts:
            self._is_sort(sort)
        return tuple(sort.text for sort in declaration.sorts)


def calculated(operator: str, left: int, right: int) -> int:
    """What clingo computes; whole division rounds towards zero.

    Raises:
        ZeroDivisionError: When dividing by 0.
    """
    if operator == "+":
        return left + right
    if operator == "-":
        return left - right
    if operator == "*":
        return left * right
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)
