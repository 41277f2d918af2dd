"""Our learner: short bodies out of many shallow trees, chosen one after the other.

It differs from Algorithm 1 in what becomes of a tree. Not only whole branches are candidates but
all short bodies made of their tests; purity and support are asked for on both halves; trees that
say nearly the same in other words vote together. From the candidates axioms are chosen one by one,
each by a lower confidence bound on its purity, and each literal beyond the first must pay for
itself. Normal axioms come first; defaults are about what these leave open.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.bodies import (
    Body,
    Candidate,
    Learned,
    holding,
    is_sayable,
    learned,
)
from ros_scenesense.learning.columns import Table, bits_of, columns_of
from ros_scenesense.learning.confidence import difference, lower_bound
from ros_scenesense.learning.examples import Example, checked, scenes_of
from ros_scenesense.learning.trees import Node, Test, branches, grow

_ALIKE = 0.9
"""Two bodies are the same in other words if they share so much of the examples they hold of."""


class CoveringLearner:
    """Learns the axioms about one fluent.

    Attributes:
        axioms_: The axioms, normal ones first, each in the order of choice.
        table_: The columns that were asked about.
        tree_: The first tree.

    Args:
        description: The domain.
        fluent: What is learned about.
        relevant: Perceived relations that may bear on it; None = all.
        purity: Share of the examples that a normal axiom must be true of.
        default_purity: The same for a default, of what normal axioms leave open; None = none.
        slack: By so much labels or relations are known to err: taken off the purities of normal
            axioms. An estimate, such as how often people disagree with the grounding.
        support: Share of the open examples that an axiom must speak of.
        fewest: Number of the open examples that it must speak of.
        tree_support: Share of the trees that must agree.
        literals: Of a body at most.
        z: Standard deviations of the lower confidence bounds.
        margin: By so much the bound of a purity may be below the purity asked for.
        pay: Standard deviations by which each literal must raise the purity.
        trees: Size of the ensemble.
        depth: Tests on a branch at most.
        random_state: Seed; same examples, same axioms.
    """

    def __init__(
        self,
        description: SystemDescription,
        fluent: str,
        relevant: Collection[str] | None = None,
        *,
        purity: float = 0.95,
        default_purity: float | None = 0.70,
        slack: float = 0.0,
        support: float = 0.05,
        fewest: int = 4,
        tree_support: float = 0.40,
        literals: int = 2,
        z: float = 1.0,
        margin: float = 0.10,
        pay: float = 3.0,
        trees: int = 100,
        depth: int = 4,
        random_state: int = 0,
    ) -> None:
        self.description = description
        self.fluent = fluent
        self.relevant = relevant
        self.purity = purity
        self.default_purity = default_purity
        self.slack = slack
        self.support = support
        self.fewest = fewest
        self.tree_support = tree_support
        self.literals = literals
        self.z = z
        self.margin = margin
        self.pay = pay
        self.trees = trees
        self.depth = depth
        self.random_state = random_state

    def fit(self, examples: Iterable[Example]) -> CoveringLearner:
        """Learns from labelled examples.

        Raises:
            LearningError: If they are none, of one label only, or of another domain.
        """
        used = checked(examples, self.description)
        (sort,) = self.description.signature.argument_sorts(self.fluent)
        self.table_ = Table.of(columns_of(self.description, sort, self.relevant), used)
        self._generator = np.random.default_rng(self.random_state)
        self._scenes = _scenes_as_bits(used)
        self.tree_: Node = grow(self.table_, self.table_.everything, self.depth)
        everything = self.table_.everything
        normal = self._chosen((everything,), self.purity - self.slack, everything, ())
        rest = everything
        for each in normal:
            rest &= ~holding(self.table_, each.body, everything)
        self.axioms_: list[Learned] = learned(self.table_, normal, self.fluent, "normal")
        if self.default_purity is not None and rest:
            # What normal axioms leave open is what the negations of their bodies say.
            left = tuple(
                (column, not answer)
                for each in normal
                if len(each.body) == 1
                for column, answer in each.body
            )
            # A default must be true of what is left to it, and also by itself: it should not be
            # wrong where a normal axiom that it counts on is forgotten.
            defaults = self._chosen((rest, everything), self.default_purity, rest, left)
            self.axioms_ += learned(self.table_, defaults, self.fluent, "default")
        return self

    def _chosen(
        self, domains: Sequence[int], purity: float, open_: int, left: Sequence[Test]
    ) -> list[Candidate]:
        """Chooses axioms until none is left that says something of what is open.

        Args:
            domains: Sets of examples of each of which they must be true.
            purity: How true.
            open_: Examples that they should speak of.
            left: Tests that hold of all of them.
        """
        bodies = self._grown(domains, left)
        chosen: list[Candidate] = []
        while open_:
            best = self._best(bodies, domains, purity, open_)
            if best is None:
                break
            chosen.append(best)
            open_ &= ~holding(self.table_, best.body, self.table_.everything)
        return chosen

    def _grown(
        self, domains: Sequence[int], left: Sequence[Test]
    ) -> list[tuple[int, frozenset[Body]]]:
        """Per tree, the half of the examples that it was grown on, and the bodies it suggests."""
        table = self.table_
        given = [frozenset(each) for size in (1, 2) for each in combinations(left, size)]
        grown = []
        for _ in range(self.trees):
            half = self._half()
            bodies: set[Body] = set(given)
            for path, _leaf in branches(grow(table, domains[0] & half, self.depth)):
                for size in range(1, self.literals + 1):
                    bodies.update(map(frozenset, combinations(path, size)))
            bodies |= {body | more for body in bodies for more in given}
            fit = (body for body in bodies if len(body) <= self.literals)
            grown.append((half, frozenset(body for body in fit if is_sayable(table, body))))
        return grown

    def _best(
        self,
        grown: Sequence[tuple[int, frozenset[Body]]],
        domains: Sequence[int],
        purity: float,
        open_: int,
    ) -> Candidate | None:
        ranked: list[tuple[float, Candidate]] = []
        for candidate in self._voted(grown, domains, purity, open_):
            tallies = [self._tally(candidate.label, candidate.body, each) for each in domains]
            bound = min(lower_bound(hits, held, self.z) for held, hits in tallies)
            pure = all(hits >= purity * held for held, hits in tallies)
            if not pure or bound < purity - self.margin or not self._pays(candidate):
                continue
            held, hits = tallies[0]
            found = replace(candidate, purity=hits / held, support=held / self.table_.count)
            ranked.append((bound - _PER_LITERAL * len(candidate.body), found))
        if not ranked:
            return None
        return max(ranked, key=lambda each: (each[0], each[1].support, _order(each[1])))[1]

    def _voted(
        self,
        grown: Sequence[tuple[int, frozenset[Body]]],
        domains: Sequence[int],
        purity: float,
        open_: int,
    ) -> list[Candidate]:
        """The candidates on which enough trees agree."""
        votes: Counter[tuple[bool, Body]] = Counter()
        for half, bodies in grown:
            halves = (half, self.table_.everything & ~half)
            for body in bodies:
                spoken = holding(self.table_, body, open_)
                if any(
                    (spoken & part).bit_count()
                    < max(self.support * (open_ & part).bit_count(), self.fewest / 2)
                    for part in halves
                ):
                    continue
                for label in (True, False):
                    if all(
                        self._is_pure(label, body, domain & part, purity)
                        for part in halves
                        for domain in domains
                    ):
                        votes[label, body] += 1
        return self._pooled(votes)

    def _is_pure(self, label: bool, body: Body, members: int, purity: float) -> bool:
        held, hits = self._tally(label, body, members)
        return hits >= purity * held

    def _pooled(self, votes: Counter[tuple[bool, Body]]) -> list[Candidate]:
        """Bodies that hold of nearly the same examples share their votes."""
        everything = self.table_.everything
        held = {each: holding(self.table_, each[1], everything) for each in votes}
        found = []
        for each, own in votes.items():
            pooled = sum(
                number
                for other, number in votes.items()
                if other[0] == each[0] and other != each and _alike(held[other], held[each])
            )
            share = min(1.0, (own + pooled) / self.trees)
            if share >= self.tree_support:
                found.append(Candidate(each[0], each[1], votes=share))
        return found

    def _pays(self, candidate: Candidate) -> bool:
        """Whether each literal raises the purity of the others significantly."""
        if len(candidate.body) == 1:
            return True
        everything = self.table_.everything
        held, hits = self._tally(candidate.label, candidate.body, everything)
        for test in candidate.body:
            others = candidate.body - {test}
            without, without_hits = self._tally(candidate.label, others, everything)
            if difference(hits, held, without_hits - hits, without - held) < self.pay:
                return False
        return True

    def _tally(self, label: bool, body: Body, members: int) -> tuple[int, int]:
        """How many of these examples a body holds of, and how many of those have the label."""
        held = holding(self.table_, body, members)
        labelled = self.table_.positive if label else ~self.table_.positive
        return held.bit_count(), (held & labelled).bit_count()

    def _half(self) -> int:
        """The examples of half of the scenes, chosen at random."""
        count = len(self._scenes)
        order = self._generator.permutation(count)[: (count + 1) // 2]
        return sum(self._scenes[int(index)] for index in order)


_PER_LITERAL = 0.05


def _order(candidate: Candidate) -> tuple[tuple[int, bool], ...]:
    return tuple(sorted((-column, answer) for column, answer in candidate.body))


def _alike(first: int, second: int) -> bool:
    return (first & second).bit_count() >= _ALIKE * (first | second).bit_count()


def _scenes_as_bits(examples: Sequence[Example]) -> list[int]:
    return [
        bits_of(example.scene_id == scene_id for example in examples)
        for scene_id in scenes_of(examples)
    ]
