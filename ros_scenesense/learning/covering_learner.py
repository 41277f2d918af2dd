"""Our learner: short bodies, weighed as a whole and chosen one after the other.

It differs from Algorithm 1 in what becomes of a tree. Not whole branches are candidates but all
short bodies made of their tests, and every single test besides. What counts is how probable it is
that an axiom is true often enough, of all it speaks of and of what it adds to those chosen before;
each literal must pay for itself, and of bodies that say nearly the same the most general is taken.
Normal axioms come first; defaults are about what these leave open. What the domain has as a default
is not learned: that it has exceptions was known to whoever wrote it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ros_scenesense.knowledge.axioms import Default, Kind
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.bodies import Candidate, Learned, is_sayable, learned, tally
from ros_scenesense.learning.candidates import Candidates, Forest, Option
from ros_scenesense.learning.columns import Table, bits_of, columns_of
from ros_scenesense.learning.confidence import belief, difference, lower_bound
from ros_scenesense.learning.evaluation import can_be_evaluated, holds
from ros_scenesense.learning.examples import Example, checked, scenes_of
from ros_scenesense.learning.trees import Node, grow

_PER_CONDITION = 0.05
"""So much higher must the bound of a purity be for each further condition."""

_NEARLY_ALL = 0.9
"""What holds of so much of what a body holds of, and of more, is more general than it."""

_SURELY = 2.0
"""Standard deviations of the bound above which a default needs no exceptions."""


@dataclass(frozen=True)
class _Ranked:
    """An option that may be chosen, and its rank: bound, examples of its own, order of columns."""

    rank: tuple[float, int, tuple[tuple[int, bool], ...]]
    option: Option
    length: int


class CoveringLearner:
    """Learns the axioms about one fluent.

    Attributes:
        axioms_: The axioms, normal ones first, each in the order of choice.
        table_: The columns that were asked about.
        tree_: The tree of all examples.

    Args:
        description: The domain.
        fluent: What is learned about.
        relevant: Perceived relations that may bear on it; None = all.
        purity: Share of the examples that a normal axiom must be true of.
        default_purity: The same for a default, of what normal axioms leave open; None = none.
        slack: By so much labels or relations are known to err: taken off the purities of normal
            axioms. An estimate, such as how often people disagree with the grounding.
        sure: Probability, after the examples, that a normal axiom is as true as it must be.
        default_sure: The same of a default.
        support: Share of the open examples that an axiom must speak of.
        fewest: Number of the open examples that it must speak of.
        fewest_of_law: The same of one that, by all examples, most likely is a law.
        tree_support: Share of the trees that must suggest a body of several tests.
        literals: Tests of a body at most, exceptions aside.
        z: Standard deviations of the lower confidence bounds by which axioms are ranked.
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
        sure: float = 0.30,
        default_sure: float = 0.25,
        support: float = 0.05,
        fewest: int = 4,
        fewest_of_law: int = 2,
        tree_support: float = 0.40,
        literals: int = 2,
        z: float = 1.0,
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
        self.sure = sure
        self.default_sure = default_sure
        self.support = support
        self.fewest = fewest
        self.fewest_of_law = fewest_of_law
        self.tree_support = tree_support
        self.literals = literals
        self.z = z
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
        self._given = {
            (axiom.head.positive, bits_of(holds(axiom, each.state, each.target) for each in used))
            for axiom in self.description.axioms
            if isinstance(axiom, Default)
            and axiom.head.atom.name == self.fluent
            and can_be_evaluated(axiom)
        }
        everything = self.table_.everything
        self.tree_: Node = grow(self.table_, everything, self.depth)
        normal = self._chosen("normal", everything, ())
        self.axioms_: list[Learned] = learned(self.table_, normal, self.fluent, "normal")
        known = [Option.of(self.table_, each.label, each.body) for each in normal]
        rest = everything
        for each in known:
            rest &= ~each.held
        if self.default_purity is not None and rest:
            defaults = self._chosen("default", rest, known)
            self.axioms_ += learned(self.table_, defaults, self.fluent, "default")
        return self

    def _chosen(self, kind: Kind, domain: int, opposed: Sequence[Option]) -> list[Candidate]:
        """Chooses axioms until none is left that says something of what is open.

        Args:
            kind: Of the axioms.
            domain: The examples that they are for.
            opposed: Axioms chosen before, whose negations are exceptions.
        """
        forest = Forest.of(
            self.table_,
            self._scenes,
            domain,
            self._generator,
            self.trees,
            self.depth,
            self.literals,
        )
        purity, everything = self._purity(kind), self.table_.everything
        candidates = Candidates(self.table_, forest, domain, purity, self.tree_support, self.pay)
        known = list(opposed)
        laws = [] if kind == "normal" else candidates.laws(self._purity("normal"))
        open_, chosen = domain, list[Candidate]()
        while open_:
            options = [each for each in candidates.options if not self._is_given(each)]
            if kind == "default":
                options = [self._with_exception(each, [*known, *laws]) for each in options]
            ranked = [
                found
                for each in dict.fromkeys(options)
                if (found := self._ranked(candidates, each, kind, open_)) is not None
            ]
            if not ranked:
                break
            first = max(ranked, key=lambda each: each.rank)
            best = self._most_general(first, ranked, candidates).option
            hits, count = self._tally(best, everything)
            chosen.append(
                Candidate(
                    best.label,
                    best.body,
                    purity=hits / count,
                    support=count / self.table_.count,
                    votes=candidates.votes(best),
                )
            )
            known.append(best)
            open_ &= ~best.held
        return chosen

    def _ranked(
        self, candidates: Candidates, option: Option, kind: Kind, open_: int
    ) -> _Ranked | None:
        """The rank of an option; None if it may not be chosen."""
        purity = self._purity(kind)
        hits, count = self._tally(option, open_)
        sure = self.sure if kind == "normal" else self.default_sure
        if not count or self._belief(option, self.table_.everything, purity) < sure:
            return None
        is_law = candidates.is_law(option, self._purity("normal"))
        if kind == "normal":
            # What was explained before must not hide that it is wrong about the rest.
            whole, whole_count = self._tally(option, self.table_.everything)
            enough = hits >= purity * count and whole >= purity * whole_count
        else:
            parts = (candidates.domain, open_)
            enough = all(self._belief(option, each, purity) >= sure for each in parts)
        least = max(self.fewest, self.support * open_.bit_count())
        if not enough or count < (self.fewest_of_law if is_law else least):
            return None
        if not is_law and not candidates.pays(option, candidates.domain):
            return None
        bound = lower_bound(*self._tally(option, candidates.domain), self.z)
        length = candidates.length(option)
        order = tuple(sorted((-column, answer) for column, answer in option.body))
        return _Ranked((bound - _PER_CONDITION * length, count, order), option, length)

    def _most_general(
        self, best: _Ranked, ranked: Sequence[_Ranked], candidates: Candidates
    ) -> _Ranked:
        """Of the options that hold of nearly all that the best one holds of, the most general.

        What is more general is left aside if it has more conditions, or if the best one is true of
        significantly more.
        """
        while True:
            own = best.option.held & candidates.domain
            hits, count = self._tally(best.option, own)
            wider = []
            for each in ranked:
                held = each.option.held & candidates.domain
                if (
                    each.option.label == best.option.label
                    and each.length <= best.length
                    and held.bit_count() > count
                    and (held & own).bit_count() >= _NEARLY_ALL * count
                ):
                    more, others = self._tally(each.option, candidates.domain & ~own)
                    if difference(hits, count, more, others) < self.pay:
                        wider.append(each)
            if not wider:
                return best
            best = max(wider, key=lambda each: each.rank)

    def _with_exception(self, option: Option, opposed: Sequence[Option]) -> Option:
        """Leaves out of a default what is known to be otherwise, where it is not true without.

        A default that is overruled by other axioms should not be wrong where these are forgotten.
        """
        assert self.default_purity is not None
        hits, count = self._tally(option, self.table_.everything)
        if lower_bound(hits, count, _SURELY) >= self.default_purity:
            return option
        for other in opposed:
            if other.label == option.label or len(other.body) != 1:
                continue
            ((column, answer),) = other.body
            exception = (column, not answer)
            asked = {each for each, _ in option.body}
            if column in asked or not is_sayable(self.table_, (exception,)):
                continue
            right, left_out = self._tally(option, other.held)
            if 2 * right < left_out < count:
                body = option.body | {exception}
                return Option.of(self.table_, option.label, body, frozenset((exception,)))
        return option

    def _is_given(self, option: Option) -> bool:
        """Whether the domain has a default that says this of the same examples."""
        return (option.label, option.held) in self._given

    def _purity(self, kind: Kind) -> float:
        if kind == "default":
            assert self.default_purity is not None
            return self.default_purity
        return self.purity - self.slack

    def _belief(self, option: Option, members: int, purity: float) -> float:
        return belief(*self._tally(option, members), purity)

    def _tally(self, option: Option, members: int) -> tuple[int, int]:
        """Of how many of these examples an option is true, and how many it speaks of."""
        return tally(self.table_, option.label, option.held & members)


def _scenes_as_bits(examples: Sequence[Example]) -> list[int]:
    return [
        bits_of(example.scene_id == scene_id for example in examples)
        for scene_id in scenes_of(examples)
    ]
