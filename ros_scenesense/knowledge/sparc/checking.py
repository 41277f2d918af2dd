"""Whether rules fit the signature; all that is wrong, with the nearest name."""

from __future__ import annotations

from ros_scenesense.knowledge.literals import Atom, Comparison, Literal, terms_of, variables_of
from ros_scenesense.knowledge.numbers import Interval, combined
from ros_scenesense.knowledge.problems import Problems, listed, nearest
from ros_scenesense.knowledge.sparc.declarations import Signature, is_unknown
from ros_scenesense.knowledge.sparc.guards import columns, demands
from ros_scenesense.knowledge.sparc.sorts import Extent, value_of, value_text
from ros_scenesense.knowledge.sparc.statements import (
    Atomic,
    Facts,
    Rule,
    SortTest,
    Text,
    is_anonymous,
)
from ros_scenesense.knowledge.sparc.walking import (
    atomic_variables,
    comparisons_of,
    computed_terms,
    element_occurrences,
    evaluated,
    global_variables,
    literals_of,
    memberships_of,
    occurrences,
)
from ros_scenesense.knowledge.terms import (
    LARGEST_NUMBER,
    Arithmetic,
    Constant,
    Number,
    Place,
    Record,
    Term,
    Variable,
    variables,
)

_MOST_NAMES = 2000
"""Of more members none is looked for as the nearest."""


class Checker:
    """Checks the rules and the display section of a program.

    Args:
        signature: Sorts and predicates.
        text: The program.
        problems: Where to note what is wrong.
    """

    def __init__(self, signature: Signature, text: Text, problems: Problems) -> None:
        self._signature = signature
        self._unread = text.unread
        self._problems = problems
        self._forms = {form for sort in signature.sorts.values() for form in sort.forms}
        self._vague = any(map(is_unknown, signature.sorts.values())) or bool(text.unread)
        self._labels: dict[str, Place] = {}

    def rule(self, rule: Rule | Facts) -> None:
        """Checks one rule."""
        if isinstance(rule, Facts):
            self._facts(rule)
            return
        if rule.label:
            if rule.label in self._labels:
                self._problems.add(
                    rule.place,
                    f"label '{rule.label}' is used already, at {self._labels[rule.label]}",
                )
            self._labels.setdefault(rule.label, rule.place)
        literals = [self.literal(literal) for literal, _ in literals_of(rule)]
        members = [
            self._membership(each.sort, each.term, each.place) for each in memberships_of(rule)
        ]
        for comparison in comparisons_of(rule):
            self._compared(comparison)
        if all(literals) and all(members) and self._variables(rule):
            self._numbers(rule)

    def shown(self, atom: Atomic) -> None:
        """Checks a line of the display section."""
        if isinstance(atom, SortTest):
            if self._sort(atom.sort, atom.place) and atom.term is not None:
                self._argument(self._signature.sorts[atom.sort], atom.term, atom.term)
        elif atom.atom.arguments or not self._predicate(atom):
            self.literal(atom)

    def _facts(self, facts: Facts) -> None:
        sorts = self._signature.predicates.get(facts.name)
        if sorts is None:
            self._undeclared(facts.name, facts.place)
        elif len(sorts) != 1:
            self._problems.add(
                facts.place, f"found 1 argument of '{facts.name}', expected {len(sorts)}"
            )
        elif facts.low > facts.high:
            self._problems.add(
                facts.place,
                f"range {facts.low}..{facts.high} is upside down, expected "
                f"{facts.high}..{facts.low}",
            )
        else:
            for number in range(facts.low, facts.high + 1):
                if number not in sorts[0]:
                    self._problems.add(facts.place, self._outside(sorts[0], str(number)))
                    break

    def _predicate(self, literal: Literal) -> bool:
        return literal.atom.name in self._signature.predicates

    def _undeclared(self, name: str, place: Place | None) -> None:
        if name in self._unread:
            return
        predicates = self._signature.predicates
        hint = nearest(name, predicates)
        if not hint and name in self._signature.sorts:
            hint = f"; did you mean the sort '#{name}'?"
        self._problems.add(place, f"predicate '{name}' is not declared{hint}")

    def literal(self, literal: Literal) -> bool:
        """Checks one literal, and tells whether it is sound."""
        atom = literal.atom
        sorts = self._signature.predicates.get(atom.name)
        if sorts is None:
            self._undeclared(atom.name, atom.place)
            return False
        if len(sorts) != len(atom.arguments):
            declared = ", ".join(f"#{sort.name}" for sort in sorts)
            self._problems.add(
                atom.place,
                f"found {len(atom.arguments)} arguments of '{atom.name}', expected {len(sorts)}: "
                f"{atom.name}({declared})",
            )
            return False
        fit = [
            self._argument(sort, term, atom)
            for sort, term in zip(sorts, atom.arguments, strict=True)
        ]
        return all(fit)

    def _sort(self, name: str, place: Place) -> bool:
        if name in self._signature.sorts:
            return True
        if name not in self._unread:
            hint = nearest(name, self._signature.sorts).replace("mean '", "mean '#")
            self._problems.add(place, f"sort '#{name}' is not defined{hint}")
        return False

    def _membership(self, name: str, term: Term, place: Place | None) -> bool:
        return self._sort(name, place or Place("", 1, 1)) and self._term(term)

    def _argument(self, sort: Extent, term: Term, inside: Atom | Term) -> bool:
        """An argument of a sort; only terms without variables and arithmetic can be outside."""
        if isinstance(term, Variable):
            return not is_unknown(sort)
        if is_unknown(sort) or not self._term(term):
            return False
        if isinstance(term, Arithmetic):
            if sort.interval is None:
                self._problems.add(
                    term.place,
                    f"found {term} in {inside}, but sort '{_name(sort)}' has no numbers",
                )
                return False
            value = evaluated(term)
            if value is not None and value not in sort:
                self._problems.add(term.place, self._outside(sort, str(value), inside))
                return False
            return True
        if _is_ground(term):
            if value_of(term) in sort:
                return True
            self._problems.add(term.place, self._outside(sort, value_text(value_of(term)), inside))
            return False
        assert isinstance(term, Record)
        for index, argument in enumerate(term.arguments):
            column = sort.column(term.functor, len(term.arguments), index)
            if column is not None and isinstance(argument, Arithmetic) and column.interval is None:
                self._problems.add(
                    argument.place,
                    f"found {argument} in {inside}, but sort '{_name(column)}' has no numbers",
                )
                return False
        return True

    def _term(self, term: Term) -> bool:
        """Functors and numbers of arguments, wherever a term stands."""
        if not isinstance(term, Record):
            return True
        form = term.functor, len(term.arguments)
        if form not in self._forms and not self._vague:
            arities = sorted({arity for functor, arity in self._forms if functor == term.functor})
            if arities:
                wanted = " or ".join(map(str, arities))
                words = f"found {form[1]} arguments of record '{form[0]}', expected {wanted}"
            else:
                functors = {functor for functor, _ in self._forms}
                words = f"no sort has a record '{form[0]}'{nearest(form[0], functors)}"
            self._problems.add(term.place, words)
            return False
        return all(map(self._term, term.arguments))

    def _outside(self, sort: Extent, value: str, inside: Atom | Term | None = None) -> str:
        where = f" in {inside}" if inside and str(inside) != value else ""
        words = f"'{value}'{where} does not belong to sort '{_name(sort)}'"
        if sort.size > _MOST_NAMES:
            return words
        names = [value_text(each) for each in sort]
        interval = sort.interval
        if interval is not None and len(names) == interval[1] - interval[0] + 1:
            return f"{words} ({interval[0]}..{interval[1]})"
        return f"{words} ({listed(names)}){nearest(value, names)}"

    def _compared(self, comparison: Comparison) -> None:
        for term in terms_of(comparison):
            self._term(term)
            if (
                isinstance(term, Constant)
                and not self._vague
                and not any(term.name in sort for sort in self._signature.sorts.values())
            ):
                names = [
                    each
                    for sort in self._signature.sorts.values()
                    if sort.size <= _MOST_NAMES
                    for each in sort
                    if isinstance(each, str)
                ]
                self._problems.add(
                    term.place,
                    f"'{term}' in {comparison} is no constant, and belongs to no sort"
                    f"{nearest(term.name, names)}",
                )

    def _variables(self, rule: Rule) -> bool:
        """Every variable occurs in an atom; a local one in an atom of its element."""
        outer = global_variables(rule)
        bound = {each for literal, _ in literals_of(rule) for each in variables_of(literal)}
        if not outer <= bound:
            bound |= {
                each
                for member in memberships_of(rule)
                if not member.negated
                for each in variables(member.term)
            }
        sound = outer <= bound
        if not sound:
            for variable in occurrences(rule):
                if variable in outer and variable not in bound:
                    self._unrestricted(variable)
        for element in (each for group in rule.groups for each in group.elements):
            inside = atomic_variables(element)
            for variable in element_occurrences(element):
                if variable not in outer and variable not in inside:
                    self._unrestricted(variable, "local ")
                    sound = False
        return sound

    def _unrestricted(self, variable: Variable, kind: str = "") -> None:
        name = "_" if is_anonymous(variable) else variable.name
        where = "in an atom of the same element" if kind else "in an atom"
        self._problems.add(
            variable.place,
            f"the {kind}variable {name} is unrestricted; expected it {where}, "
            f"such as '#{next(reversed(self._signature.sorts))}({name})'",
        )

    def _numbers(self, rule: Rule) -> None:
        """What is computed fits into 32 bits."""
        computed = computed_terms(rule)
        if not computed:
            return
        intervals: dict[Variable, Interval] = {}
        for guard in demands(rule, self._signature):
            for variable, extent in columns(guard):
                interval = extent.interval
                if interval is not None:
                    low, high = intervals.get(variable, interval)
                    intervals[variable] = max(low, interval[0]), min(high, interval[1])
        for arithmetic in computed:
            self._interval(arithmetic, intervals)

    def _interval(self, term: Term, intervals: dict[Variable, Interval]) -> Interval | None:
        if isinstance(term, Number):
            return term.value, term.value
        if isinstance(term, Variable):
            return intervals.get(term)
        if not isinstance(term, Arithmetic):
            return None
        left = self._interval(term.left, intervals)
        right = self._interval(term.right, intervals)
        if left is None or right is None:
            return None
        result = combined(term.operator, left, right)
        if max(map(abs, result)) > LARGEST_NUMBER:
            self._problems.add(
                term.place,
                f"{term} may be as large as {max(result, key=abs)}, expected at most "
                f"{LARGEST_NUMBER}: the solver computes with 32 bits; a smaller '#maxint' helps",
            )
            return None
        return result


def _name(extent: Extent) -> str:
    name = getattr(extent, "name", None)
    return f"#{name}" if name else f"{{{listed([value_text(each) for each in extent])}}}"


def _is_ground(term: Term) -> bool:
    if isinstance(term, Record):
        return all(map(_is_ground, term.arguments))
    return isinstance(term, Number | Constant)


def check(text: Text, signature: Signature, problems: Problems) -> None:
    """Checks all rules and the display section of a program."""
    checker = Checker(signature, text, problems)
    for rule in text.rules:
        checker.rule(rule)
    for atom in text.display or ():
        checker.shown(atom)
