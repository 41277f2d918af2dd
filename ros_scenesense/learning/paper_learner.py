"""Algorithm 1 of the paper: an ensemble of ID3 trees whose pure branches become axioms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Sequence

import numpy as np

from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.bodies import Candidate, Learned, holding, is_sayable, learned
from ros_scenesense.learning.columns import Table, bits_of, columns_of
from ros_scenesense.learning.examples import Example, checked, lacking
from ros_scenesense.learning.trees import Node, branches, grow


class PaperLearner:
    """Lines 2 to 9 of Algorithm 1, for one fluent.

    Per tree the examples are split at random into halves for learning and for validation. A node
    that is pure enough (`purity`) is a leaf. Branches from root to leaf are candidates if the leaf
    is that pure and has enough of the training examples (`support`); they are valid if they have
    that much support among the validation examples. Axioms are those that are valid in enough
    trees (`tree_support`). Trained again with the lower purity, on the same halves, it gives
    defaults; what is a normal axiom already is none.

    The paper trains "using thresholds of 95% and 70% at the leaf nodes". If trees were grown until
    no column tells examples apart, hardly any leaf would be impure, and no default be found.

    Attributes:
        axioms_: The axioms, normal ones first.
        table_: The columns that the trees split.
        tree_: The tree of the first split, for normal axioms.

    Args:
        description: The domain.
        fluent: What is learned about.
        relevant: Perceived relations that may bear on it; None = all.
        purity: Threshold th1 for normal axioms.
        default_purity: The same for defaults; None = no defaults.
        support: Threshold th2.
        tree_support: Threshold th3.
        trees: Size of the ensemble.
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
        support: float = 0.05,
        tree_support: float = 0.40,
        trees: int = 100,
        random_state: int = 0,
    ) -> None:
        self.description = description
        self.fluent = fluent
        self.relevant = relevant
        self.purity = purity
        self.default_purity = default_purity
        self.support = support
        self.tree_support = tree_support
        self.trees = trees
        self.random_state = random_state

    def fit(self, examples: Iterable[Example]) -> PaperLearner:
        """Learns from the examples that reasoning left undecided or got wrong.

        Raises:
            LearningError: If they are none, of one label only, or of another domain.
        """
        used = checked(lacking(list(examples)), self.description)
        (sort,) = self.description.signature.argument_sorts(self.fluent)
        self.table_ = Table.of(columns_of(self.description, sort, self.relevant), used)
        generator = np.random.default_rng(self.random_state)
        halves = []
        for _ in range(self.trees):
            order = generator.permutation(len(used))
            chosen = np.zeros(len(used), bool)
            chosen[order[: (len(used) + 1) // 2]] = True
            halves.append(bits_of(chosen.tolist()))
        self.tree_: Node = grow(self.table_, halves[0], pure=self.purity)
        normal = self._selected(halves, self.purity)
        self.axioms_: list[Learned] = learned(self.table_, normal, self.fluent, "normal")
        if self.default_purity is not None:
            known = set(normal)
            defaults = [
                each for each in self._selected(halves, self.default_purity) if each not in known
            ]
            self.axioms_ += learned(self.table_, defaults, self.fluent, "default")
        return self

    def _selected(self, halves: Sequence[int], purity: float) -> list[Candidate]:
        table = self.table_
        votes: Counter[Candidate] = Counter()
        for members in halves:
            rest = table.everything & ~members
            for path, leaf in branches(grow(table, members, pure=purity)):
                candidate = Candidate(leaf.label, frozenset(path))
                if (
                    path
                    and leaf.purity >= purity
                    and leaf.count >= self.support * members.bit_count()
                    and is_sayable(table, path)
                    and self._agreeing(candidate, rest) >= self.support * rest.bit_count()
                ):
                    votes[candidate] += 1
        found = []
        for candidate, number in votes.items():
            if number >= self.tree_support * self.trees:
                held = holding(table, candidate.body, table.everything).bit_count()
                agreeing = self._agreeing(candidate, table.everything)
                found.append(
                    Candidate(
                        candidate.label,
                        candidate.body,
                        agreeing / held,
                        held / table.count,
                        number / self.trees,
                    )
                )
        return sorted(found, key=lambda each: (-each.votes, len(each.body), sorted(each.body)))

    def _agreeing(self, candidate: Candidate, members: int) -> int:
        held = holding(self.table_, candidate.body, members)
        labelled = self.table_.positive if candidate.label else ~self.table_.positive
        return (held & labelled).bit_count()
