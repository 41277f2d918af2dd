"""Settles on one position and one distance relation per pair of objects.

Paper, section *Combined QSR-MSR Model*: of the two groundings, the more trusted one names the
relations. That is the mode `switch`. In the mode `arbiter` it counts, by kind of relation, which of
them was right when they disagreed, and how sure each is of this pair. Both directions of a pair are
grounded; the reasoner gets one of them and infers the converse.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Generic, TypeVar

from ros_scenesense.grounding.trust import (
    Kind,
    Model,
    TrustSettings,
    TrustState,
    odds_for_msr,
    trust_in,
    with_feedback,
)
from ros_scenesense.messages.grounding import Grounding, PairGrounding, Relation
from ros_scenesense.scene import Distance, Position

SWITCH = "switch"
ARBITER = "arbiter"


@dataclass(frozen=True)
class Settled:
    """The relations of a scene, and how many pairs had directions that disagreed."""

    relations: list[Relation]
    disagreements: int


@dataclass(frozen=True)
class Learned:
    """What a feedback taught.

    Attributes:
        agreed: Whether each grounding had named the pair so, if it named anything.
        dropped: Whether agreement is now thought to have dropped: as if the viewpoint had changed.
    """

    agreed: dict[Model, bool]
    dropped: bool


class Control:
    """Chooses between the groundings, and learns from feedback how far to trust them.

    Attributes:
        mode: `switch` or `arbiter`.
        settings: Where trust starts and how it moves.
        state: All that was learned; may be kept and given again.
    """

    def __init__(
        self,
        mode: str = ARBITER,
        settings: TrustSettings | None = None,
        state: TrustState | None = None,
    ) -> None:
        self.mode = mode
        self.settings = settings or TrustSettings()
        self.state = state or TrustState()

    def trust(self, model: Model, kind: Kind | None = None) -> float:
        """Trust in a grounding from 0 to 1, on a kind of relation or overall."""
        return trust_in(self.state, model, self.settings, kind)

    def settle(self, pairs: Iterable[PairGrounding]) -> Settled:
        """One relation per unordered pair, in the direction that `Relation` documents.

        A grounding whose two directions do not name converse relations is taken at its more
        confident word; with equal confidence, at that in the order of the names. A container may
        stand in any relation to what is *in* it, so `in` wins, and disagrees only with `in`.

        Args:
            pairs: Directed pairs, none twice and none of an object with itself. Those that no
                model says anything of are left out.
        """
        said = {(pair.object, pair.reference): pair for pair in pairs}
        relations, disagreements = [], 0
        for first, second in sorted({(min(key), max(key)) for key in said}):
            claims = _claims(said.get((first, second)), said.get((second, first)))
            if not claims:
                continue
            position = self._choose({model: one.position for model, one in claims.items()})
            distance = self._choose({model: one.distance for model, one in claims.items()})
            relations.append(_relation(claims, position, distance))
            disagreements += claims[position].disagree
        return Settled(relations, disagreements)

    def learn(
        self,
        relation: Position | Distance,
        forward: PairGrounding | None,
        backward: PairGrounding | None,
    ) -> Learned:
        """Takes a person's word: the object of `forward` stands in this relation to its reference.

        Args:
            relation: What the person named.
            forward: What was said of (object, reference) before the word was known.
            backward: What was said of (reference, object).
        """
        claims = _claims(forward, backward)
        if isinstance(relation, Distance):
            near = {model: one.distance for model, one in claims.items()}
            agreed = {model: word.relation is relation for model, word in near.items()}
            charge, named = self._choose(near), Kind.DISTANCE
        else:
            places = {model: one.position for model, one in claims.items()}
            agreed = {model: _same(word, relation) for model, word in places.items()}
            charge, named = self._choose(places), Kind.of(relation)
            if Model.QSR in places:
                named = Kind.of(places[Model.QSR].relation)
        self.state, dropped = with_feedback(
            self.state, Kind.of(relation), agreed, charge, named, self.settings
        )
        return Learned(agreed, dropped)

    def _choose(self, words: dict[Model, _Word[Word]]) -> Model:
        """Whose word is passed on; that of the qualitative grounding if nobody says anything."""
        if len(words) < 2:
            return next(iter(words), Model.QSR)
        qsr, msr = words[Model.QSR], words[Model.MSR]
        if self.mode == SWITCH:
            return Model.MSR if self.trust(Model.MSR) > self.trust(Model.QSR) else Model.QSR
        if (qsr.relation, qsr.swapped) == (msr.relation, msr.swapped):
            return Model.QSR
        # By what the qualitative grounding says of a pair, that is how feedback on it is kept.
        odds = odds_for_msr(self.state, self.settings, Kind.of(qsr.relation))
        surer = _log_odds(msr.confidence) - _log_odds(qsr.confidence)
        return Model.MSR if odds + _SURENESS * surer > 0.0 else Model.QSR


Word = TypeVar("Word", Position, Distance)


@dataclass(frozen=True)
class _Word(Generic[Word]):
    """A relation of the first object of a pair to the second, or of the second to the first."""

    relation: Word
    confidence: float
    swapped: bool = False


@dataclass(frozen=True)
class _Claims:
    """What a grounding says of an unordered pair, both directions considered."""

    names: tuple[str, str]
    position: _Word[Position]
    distance: _Word[Distance]
    disagree: bool


def _claims(forward: PairGrounding | None, backward: PairGrounding | None) -> dict[Model, _Claims]:
    """The claims of both groundings; of the groundings that say nothing, none."""
    if forward is not None:
        names = forward.object, forward.reference
    elif backward is not None:
        names = backward.reference, backward.object
    else:
        return {}
    found = {}
    for model in Model:
        said = [None if pair is None else getattr(pair, model) for pair in (forward, backward)]
        if any(one is not None for one in said):
            found[model] = _claim(names, *said)
    return found


def _claim(
    names: tuple[str, str], forward: Grounding | None, backward: Grounding | None
) -> _Claims:
    said = [(one, swapped) for one, swapped in ((forward, False), (backward, True)) if one]
    containing = [pair for pair in said if pair[0].position is Position.IN]
    chosen, swapped = max(containing or said, key=lambda pair: pair[0].position_confidence)
    nearest, _ = max(said, key=lambda pair: pair[0].distance_confidence)
    position = chosen.position
    if swapped and position.converse is not None:
        position, swapped = position.converse, False
    return _Claims(
        names=names,
        position=_Word(position, chosen.position_confidence, swapped),
        distance=_Word(nearest.distance, nearest.distance_confidence),
        disagree=forward is not None and backward is not None and _disagree(forward, backward),
    )


def _relation(claims: dict[Model, _Claims], position: Model, distance: Model) -> Relation:
    where, near = claims[position].position, claims[distance].distance
    names = claims[position].names
    return Relation(
        object=names[where.swapped],
        reference=names[not where.swapped],
        position=where.relation,
        position_confidence=where.confidence,
        position_source=position.value,
        distance=near.relation,
        distance_confidence=near.confidence,
        distance_source=distance.value,
    )


def _same(word: _Word[Position], relation: Position) -> bool:
    """Whether a word about a pair is what a person says of its first direction."""
    return word.relation is relation and not word.swapped


def _log_odds(share: float) -> float:
    kept = min(1.0 - _SUREST, max(_SUREST, share))
    return math.log(kept / (1.0 - kept))


# Nothing is surer than this, whatever it says of itself.
_SUREST = 0.02
# How sure the groundings are of a pair counts so much beside how often they were right.
_SURENESS = 0.5


def _disagree(forward: Grounding, backward: Grounding) -> bool:
    if forward.distance is not backward.distance:
        return True
    positions = (forward.position, backward.position)
    if Position.IN in positions:
        return positions[0] is positions[1]
    return positions[0].converse is not positions[1]
