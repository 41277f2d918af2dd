"""Settles on one position and one distance relation per pair of objects.

Paper, section *Combined QSR-MSR Model*: of the two groundings, the more trusted one names the
relations. Both directions of a pair are grounded; the reasoner gets one of them and infers the
converse.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ros_scenesense.messages.grounding import (
    Grounding,
    PairGrounding,
    Relation,
    RelationSource,
    Trust,
)
from ros_scenesense.scene import Position


@dataclass(frozen=True)
class Settled:
    """The relations of a scene, and how many pairs had directions that disagreed."""

    relations: list[Relation]
    disagreements: int


def settle(pairs: Iterable[PairGrounding], trust: Trust) -> Settled:
    """One relation per unordered pair, in the direction that `Relation` documents.

    Where the two directions do not name converse relations the more confident one wins; with
    equal confidence, the one in the order of the names. A container may stand in any relation to
    what is *in* it, so `in` wins, and disagrees only with `in`.

    Args:
        pairs: Directed pairs, none twice and none of an object with itself. Those that no model
            says anything of are left out.
        trust: Which model is trusted more.
    """
    said = {}
    for pair in pairs:
        claim = _most_trusted(pair, trust)
        if claim is not None:
            said[pair.object, pair.reference] = claim
    relations, disagreements = [], 0
    for first, second in sorted({(min(key), max(key)) for key in said}):
        both = said.get((first, second)), said.get((second, first))
        claims = [claim for claim in both if claim is not None]
        relations.append(_relation(claims))
        disagreements += len(claims) == 2 and _disagree(claims[0].grounding, claims[1].grounding)
    return Settled(relations, disagreements)


@dataclass(frozen=True)
class _Claim:
    """What the trusted model says of a directed pair."""

    object: str
    reference: str
    grounding: Grounding
    source: RelationSource


def _most_trusted(pair: PairGrounding, trust: Trust) -> _Claim | None:
    def claim(grounding: Grounding | None, source: RelationSource) -> _Claim | None:
        if grounding is None:
            return None
        return _Claim(pair.object, pair.reference, grounding, source)

    qsr, msr = claim(pair.qsr, "qsr"), claim(pair.msr, "msr")
    return (msr or qsr) if trust.msr > trust.qsr else (qsr or msr)


def _relation(claims: list[_Claim]) -> Relation:
    """The relation of a pair from the claims of one or both directions, name order first."""
    containing = [claim for claim in claims if claim.grounding.position is Position.IN]
    chosen = max(containing or claims, key=lambda claim: claim.grounding.position_confidence)
    nearest = max(claims, key=lambda claim: claim.grounding.distance_confidence)
    names = (chosen.object, chosen.reference)
    position = chosen.grounding.position
    if position.converse is not None and names[0] > names[1]:
        names, position = names[::-1], position.converse
    return Relation(
        object=names[0],
        reference=names[1],
        position=position,
        position_confidence=chosen.grounding.position_confidence,
        position_source=chosen.source,
        distance=nearest.grounding.distance,
        distance_confidence=nearest.grounding.distance_confidence,
        distance_source=nearest.source,
    )


def _disagree(forward: Grounding, backward: Grounding) -> bool:
    if forward.distance is not backward.distance:
        return True
    positions = (forward.position, backward.position)
    if Position.IN in positions:
        return positions[0] is positions[1]
    return positions[0].converse is not positions[1]
