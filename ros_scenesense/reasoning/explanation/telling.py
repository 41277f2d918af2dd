"""Proofs and refutations told in a domain's words.

What the solver's program needs beside the domain, such as sorts as predicates and the tags of
axioms, is left out on the way: a vocabulary says what atoms mean, and which mean nothing to people.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Protocol

import clingo

from ros_scenesense.reasoning.explanation.proof import Proof, Proofs
from ros_scenesense.reasoning.explanation.reason import Reason, Role
from ros_scenesense.reasoning.explanation.refutation import Attempt, Refutation
from ros_scenesense.reasoning.explanation.support import GroundLiteral, Instance, Sign


class Vocabulary(Protocol):
    """What atoms and rules mean to people."""

    def literal(self, atom: clingo.Symbol, negated: bool = False) -> str | None:
        """The literal in the domain's language, without `not`; None if it means nothing to people.

        Args:
            atom: The atom; the string `_` in it stands for any value.
            negated: Whether it stands under `not`.
        """

    def axiom(self, rule: int) -> tuple[str | None, str]:
        """Id of the axiom that a rule says, and what it says; (None, "") for what is technical."""

    def known(self, atom: clingo.Symbol) -> Reason | None:
        """What is known of a literal that is a fact of the scene, not concluded."""

    def condition(self, rule: int, words: str) -> str | None:
        """A comparison in a rule, that is true; None if it means nothing to people."""

    def absent(self, atom: clingo.Symbol) -> str:
        """Why a literal under `not` may be taken not to hold, in words."""

    def mismatch(self, atom: clingo.Symbol) -> str:
        """Why an atom that means nothing to people means nothing."""

    def lacking(self, atom: clingo.Symbol) -> str:
        """Why a perceived or given literal does not hold; empty where axioms conclude it."""


class Teller:
    """Tells proofs and refutations; each reason in full once, then only mentioned.

    Args:
        vocabulary: What atoms and rules mean.
        proofs: Proofs of what holds.
    """

    def __init__(self, vocabulary: Vocabulary, proofs: Proofs) -> None:
        self._vocabulary = vocabulary
        self._proofs = proofs
        self._told: set[clingo.Symbol] = set()

    def proof(self, proof: Proof) -> Reason:
        """Why a literal holds."""
        words = self._literal(proof.atom)
        if proof.by is None or self._is_fact(proof.by):
            return self._vocabulary.known(proof.atom) or Reason(words, Role.KNOWN)
        inner = self._only_same(proof, words)
        if inner is not None:
            return self.proof(inner)
        axiom, says = self._vocabulary.axiom(proof.by.rule)
        role = Role.ASSUMED if proof.by.chosen else Role.CONCLUDED
        reason = Reason(words, role, axiom, says)
        if proof.atom in self._told and proof.premises:
            return replace(reason, repeated=True)
        self._told.add(proof.atom)
        return replace(reason, reasons=tuple(self._premises(proof)))

    def refutation(self, refutation: Refutation) -> Reason:
        """Why a literal does not hold."""
        words = self._literal(refutation.atom)
        note = self._vocabulary.lacking(refutation.atom)
        if note:
            return Reason(words, Role.MISSING, words=note)
        attempts = tuple(self._attempts(refutation, words))
        return Reason(words, Role.MISSING, reasons=attempts, repeated=refutation.cut)

    def _literal(self, atom: clingo.Symbol) -> str:
        return self._vocabulary.literal(atom) or str(atom)

    def _is_fact(self, instance: Instance) -> bool:
        """Whether a rule is a fact that no axiom says."""
        return not instance.body and self._vocabulary.axiom(instance.rule)[0] is None

    def _only_same(self, proof: Proof, words: str) -> Proof | None:
        """The one premise of a technical rule that says the same as its head."""
        assert proof.by is not None
        if self._vocabulary.axiom(proof.by.rule)[0] is not None or len(proof.premises) != 1:
            return None
        (premise,) = proof.premises
        same = isinstance(premise, Proof) and self._literal(premise.atom) == words
        return premise if same else None  # type: ignore[return-value]

    def _premises(self, proof: Proof) -> Iterator[Reason]:
        assert proof.by is not None
        for premise in proof.premises:
            if isinstance(premise, Proof):
                if self._vocabulary.literal(premise.atom) is not None:
                    yield self.proof(premise)
            else:
                yield from self._satisfied(premise, proof.by.rule)

    def _satisfied(self, literal: GroundLiteral, rule: int) -> Iterator[Reason]:
        if literal.atom is None:
            condition = self._vocabulary.condition(rule, literal.words)
            if condition is not None:
                yield Reason(condition, Role.CONDITION)
            return
        fails = literal.sign is Sign.FAILS
        words = self._vocabulary.literal(literal.atom, fails)
        if words is None:
            return
        if fails:
            says = self._vocabulary.absent(literal.atom)
            yield Reason(f"not {words}", Role.ABSENT, words=says)
            return
        proof = self._proofs.of(literal.atom)
        yield self.proof(proof) if proof is not None else Reason(words, Role.KNOWN)

    def _attempts(self, refutation: Refutation, words: str) -> Iterator[Reason]:
        for attempt in refutation.attempts:
            axiom, says = self._vocabulary.axiom(attempt.rule)
            inner = self._same_inside(attempt, words) if axiom is None else None
            if inner is not None:
                yield from self._attempts(inner, words)
                continue
            reasons = tuple(self._attempt(attempt))
            if reasons:
                yield Reason(words, Role.ATTEMPT, axiom, says, reasons=reasons)

    def _same_inside(self, attempt: Attempt, words: str) -> Refutation | None:
        for each in attempt.because:
            if isinstance(each, Refutation) and self._literal(each.atom) == words:
                return each
        return None

    def _attempt(self, attempt: Attempt) -> Iterator[Reason]:
        for literal in attempt.holds:
            for reason in self._satisfied(literal, attempt.rule):
                # That it holds is enough here; why it holds would hide what fails.
                yield Reason(reason.literal, Role.HOLDS)
        fails = attempt.fails
        if fails is None:
            yield Reason("it was not chosen", Role.UNTRUE)
        elif fails.atom is None:
            yield Reason(fails.words, Role.UNTRUE)
        elif fails.sign is Sign.FAILS:
            blockers = [each for each in attempt.because if isinstance(each, clingo.Symbol)]
            proofs = [proof for proof in map(self._proofs.of, blockers) if proof is not None]
            reasons = tuple(self.proof(each) for each in proofs)
            words = self._vocabulary.literal(fails.atom, negated=True) or str(fails.atom)
            yield Reason(f"not {words}", Role.BLOCKED, reasons=reasons)
        elif self._vocabulary.literal(fails.atom) is None:
            yield Reason(self._vocabulary.mismatch(fails.atom), Role.CONDITION)
        else:
            for each in attempt.because:
                if isinstance(each, Refutation):
                    yield self.refutation(each)
