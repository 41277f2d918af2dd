"""Short bodies that tell when a label is true: what is common to trees grown on halves of it all.

A body is a conjunction of tests of columns. It must be pure in both halves of the examples for
enough trees, be true almost surely by a lower confidence bound, and each test of it must pay.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ros_scenesense.learning.bodies import Body, holding, is_sayable
from ros_scenesense.learning.columns import Table
from ros_scenesense.learning.confidence import difference, lower_bound
from ros_scenesense.learning.trees import branches, grow


@dataclass(frozen=True)
class BodySearch:
    """How bodies are looked for.

    Attributes:
        purity: Share of the examples that a body holds of and whose label must be true.
        margin: By so much the lower confidence bound of that share may be below it.
        fewest: Number of the open examples that it must hold of.
        tree_support: Share of the trees that must suggest it.
        tests: Of a body at most.
        z: Standard deviations of the lower confidence bound.
        pay: Standard deviations by which each test must raise the purity.
        trees: Size of the ensemble.
        depth: Tests on a branch at most.
        seed: Same examples, same bodies.
    """

    purity: float = 0.95
    margin: float = 0.10
    fewest: int = 4
    tree_support: float = 0.40
    tests: int = 2
    z: float = 1.0
    pay: float = 3.0
    trees: int = 100
    depth: int = 4
    seed: int = 0

    def is_enough(self, hits: int, count: int) -> bool:
        """Whether so many true labels of so many make a law."""
        bound = lower_bound(hits, count, self.z)
        return hits >= self.purity * count and bound >= self.purity - self.margin

    def run(self, table: Table, scenes: Sequence[int]) -> Iterator[tuple[Body, int, int]]:
        """Finds bodies, each for some of what those before left open.

        Args:
            table: The examples with their labels.
            scenes: The examples of each scene, as bits; those of one are never parted.

        Yields:
            A body, how many of the examples that it holds of have a true label, and how many it
            holds of.
        """
        grown = self._grown(table, scenes)
        open_ = table.everything
        while open_ & table.positive:
            ranked = []
            for body in self._suggested(table, grown, open_):
                held, hits = _tally(table, body, table.everything)
                if self.is_enough(hits, held) and self._pays(table, body):
                    bound = lower_bound(hits, held, self.z) - _PER_TEST * len(body)
                    ranked.append((bound, held, _order(body), body, hits))
            if not ranked:
                return
            _, held, _, best, hits = max(ranked, key=lambda each: each[:3])
            yield best, hits, held
            open_ &= ~holding(table, best, table.everything)

    def _grown(self, table: Table, scenes: Sequence[int]) -> list[tuple[int, frozenset[Body]]]:
        """Per tree, the half of the examples that it grew on, and the bodies it suggests."""
        generator = np.random.default_rng(self.seed)
        grown = []
        for _ in range(self.trees):
            order = generator.permutation(len(scenes))[: (len(scenes) + 1) // 2]
            half = sum(scenes[int(index)] for index in order)
            bodies = {
                frozenset(tests)
                for path, _leaf in branches(grow(table, half, self.depth))
                for size in range(1, self.tests + 1)
                for tests in combinations(path, size)
            }
            grown.append((half, frozenset(body for body in bodies if is_sayable(table, body))))
        return grown

    def _suggested(
        self, table: Table, grown: Sequence[tuple[int, frozenset[Body]]], open_: int
    ) -> list[Body]:
        """The bodies on which enough trees agree."""
        votes: Counter[Body] = Counter()
        for half, bodies in grown:
            halves = (half, table.everything & ~half)
            for body in bodies:
                tallies = [_tally(table, body, part) for part in halves]
                spoken = [_tally(table, body, part & open_)[0] for part in halves]
                if min(spoken) >= self.fewest / 2 and all(
                    hits >= self.purity * held for held, hits in tallies
                ):
                    votes[body] += 1
        return [body for body, count in votes.items() if count >= self.tree_support * self.trees]

    def _pays(self, table: Table, body: Body) -> bool:
        """Whether each test raises the purity of the others significantly."""
        held, hits = _tally(table, body, table.everything)
        for test in body if len(body) > 1 else ():
            without, without_hits = _tally(table, body - {test}, table.everything)
            if difference(hits, held, without_hits - hits, without - held) < self.pay:
                return False
        return True


_PER_TEST = 0.05


def _tally(table: Table, body: Body, members: int) -> tuple[int, int]:
    """How many of these examples a body holds of, and how many of those have a true label."""
    held = holding(table, body, members)
    return held.bit_count(), (held & table.positive).bit_count()


def _order(body: Body) -> tuple[tuple[int, bool], ...]:
    return tuple(sorted((-column, answer) for column, answer in body))
