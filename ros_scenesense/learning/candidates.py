"""Which bodies our learner chooses from, and whether each of their literals earns its place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ros_scenesense.learning.bodies import Body, holding, is_sayable, tally
from ros_scenesense.learning.columns import Table
from ros_scenesense.learning.confidence import belief, difference
from ros_scenesense.learning.trees import Test, branches, grow

_LIKELY = 0.7
"""With this probability a body that looks like a law is taken for one."""

_FEWEST_IN_A_HALF = 2
"""Examples that a tree must see a body hold of, in either half."""


@dataclass(frozen=True)
class Option:
    """A label and a body that it may follow from.

    Attributes:
        label: The label.
        body: The tests.
        held: The examples that the body holds of.
        excepted: Those of the tests that leave out exceptions which are known from elsewhere.
    """

    label: bool
    body: Body
    held: int
    excepted: Body = frozenset()

    @classmethod
    def of(cls, table: Table, label: bool, body: Body, excepted: Body = frozenset()) -> Option:
        """An option; a test that leaves out exceptions belongs to the body too."""
        return cls(label, body, holding(table, body, table.everything), excepted)


@dataclass(frozen=True)
class Forest:
    """Halves of the scenes, drawn at random, and for each of them the bodies that a tree suggests.

    Attributes:
        halves: The examples of the scenes that each tree was grown on.
        suggested: Per tree, bodies of two tests or more that are among the tests of a branch.
    """

    halves: Sequence[int]
    suggested: Sequence[frozenset[Body]]

    @classmethod
    def of(
        cls,
        table: Table,
        scenes: Sequence[int],
        domain: int,
        generator: np.random.Generator,
        trees: int,
        depth: int,
        literals: int,
    ) -> Forest:
        """Grows trees by ID3, each on half of the scenes.

        Args:
            table: The columns.
            scenes: The examples of each scene, as bits: those of one scene stay together.
            domain: The examples that the trees are about.
            generator: Draws the halves.
            trees: How many.
            depth: Tests on a branch at most.
            literals: Tests of a body at most.
        """
        halves, suggested = [], []
        for _ in range(trees):
            order = generator.permutation(len(scenes))[: (len(scenes) + 1) // 2]
            half = sum(scenes[int(index)] for index in order)
            bodies: set[Body] = set()
            for path, _leaf in branches(grow(table, domain & half, depth)):
                for size in range(2, literals + 1):
                    bodies.update(map(frozenset, combinations(path, size)))
            halves.append(half)
            suggested.append(frozenset(body for body in bodies if is_sayable(table, body)))
        return cls(halves, suggested)


class Candidates:
    """All bodies that are worth a look, whoever chooses among them.

    A body of one test always is; one of more tests is if enough trees suggest it and it is pure in
    both halves of these.

    Args:
        table: The columns and labels.
        forest: The trees.
        domain: The examples that axioms are sought for.
        purity: How true they must be of them.
        tree_support: Share of the trees that must suggest a body of several tests.
        pay: Standard deviations by which each test must raise the purity.
    """

    def __init__(
        self,
        table: Table,
        forest: Forest,
        domain: int,
        purity: float,
        tree_support: float,
        pay: float,
    ) -> None:
        self.table = table
        self.domain = domain
        self.pay = pay
        self._forest = forest
        self._purity = purity
        found = [(label, body) for body in self._single() for label in (True, False)]
        for (label, body), votes in self._voted().items():
            if votes >= tree_support * len(forest.halves):
                found.append((label, body))
        self._paying: dict[tuple[Option, int], bool] = {}
        self.options = [
            option
            for option in (Option.of(table, label, body) for label, body in found)
            if option.held and (self.pays(option, domain) or self.pays(option, table.everything))
        ]

    def pays(self, option: Option, domain: int) -> bool:
        """Whether each test raises the purity of the rest of the body significantly.

        That A stands in a relation to a B of a certain kind must pay beyond that it stands in it to
        any B. A test that all of the domain passes is judged by all examples.
        """
        key = (option, domain)
        if key not in self._paying:
            self._paying[key] = self._pays(option, domain)
        return self._paying[key]

    def laws(self, purity: float) -> list[Option]:
        """Single tests that a label most likely follows from by law, the surest first."""
        found = []
        for body in self._single():
            for label in (True, False):
                option = Option.of(self.table, label, body)
                hits, count = tally(self.table, label, option.held)
                sure = belief(hits, count, purity)
                if sure >= _LIKELY:
                    found.append((sure, count, option))
        found.sort(key=lambda each: each[:2], reverse=True)
        return [option for _, _, option in found]

    def is_law(self, option: Option, purity: float) -> bool:
        """Whether an option most likely is a law, by all examples, and each of its tests pays."""
        hits, count = tally(self.table, option.label, option.held)
        return belief(hits, count, purity) >= _LIKELY and self.pays(option, self.table.everything)

    def votes(self, option: Option) -> float:
        """The share of the trees in both halves of which an option is supported and pure."""
        agreed = sum(self._is_pure(option, half) for half in self._forest.halves)
        return agreed / len(self._forest.halves)

    def length(self, option: Option) -> int:
        """The number of its conditions, without those that leave out exceptions."""
        return sum(
            len((self.table.columns[column].if_true if answer else None) or (None,))
            for column, answer in option.body - option.excepted
        )

    def _pays(self, option: Option, domain: int) -> bool:
        for general in self._generalised(option.body - option.excepted):
            body = general | option.excepted
            held = holding(self.table, body, self.table.everything)
            within = domain if held & ~option.held & domain else self.table.everything
            hits, count = tally(self.table, option.label, option.held & within)
            other_hits, other = tally(self.table, option.label, held & ~option.held & within)
            if difference(hits, count, other_hits, other) < self.pay:
                return False
        return True

    def _single(self) -> list[Body]:
        tests = ((column, a) for column in range(len(self.table.columns)) for a in (True, False))
        return [frozenset((test,)) for test in tests if is_sayable(self.table, (test,))]

    def _voted(self) -> Counter[tuple[bool, Body]]:
        votes: Counter[tuple[bool, Body]] = Counter()
        for half, bodies in zip(self._forest.halves, self._forest.suggested, strict=True):
            for body in bodies:
                for label in (True, False):
                    votes[label, body] += self._is_pure(Option.of(self.table, label, body), half)
        return votes

    def _is_pure(self, option: Option, half: int) -> bool:
        for part in (half, ~half):
            hits, count = tally(self.table, option.label, option.held & self.domain & part)
            if count < _FEWEST_IN_A_HALF or hits < self._purity * count:
                return False
        return True

    def _generalised(self, body: Body) -> Iterator[Body]:
        """The bodies that lack one of its conditions."""
        for test in body:
            yield body - {test}
            general = self.table.general.get(test[0])
            if test[1] and general is not None:
                plain: Test = (general, True)
                yield body - {test} | {plain}
