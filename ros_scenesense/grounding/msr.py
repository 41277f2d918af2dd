"""The metric spatial representation: what prepositions mean, learned from examples.

Paper, section *Metric Spatial Representation*. Every preposition is grounded in a histogram, the
normalised mean of its examples. A new pair gets the prepositions whose histograms are most similar
to its own: by the chi-squared measure for positions, by intersection for distances. Examples are
merged continuously, and counted apart by who named them: the qualitative model, this model itself,
or a person.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.histograms import (
    DISTANCE_BINS,
    POSITION_BINS,
    PairHistograms,
    SceneHistograms,
)
from ros_scenesense.messages.grounding import Grounding
from ros_scenesense.scene import Distance, Position


class Source(StrEnum):
    """Who named the relation of an example."""

    QSR = "qsr"
    MSR = "msr"
    HUMAN = "human"


@dataclass(frozen=True)
class MetricSettings:
    """How examples are weighted against each other.

    Attributes:
        human_weight: One example from a person counts as much as so many from the QSR.
        own_weight: One that the model named itself counts as much as so many from the QSR.
        most_own_share: Yet all of these together count at most this share of the others: a model
            must not convince itself.
        memory: So many examples of a relation and source are remembered with equal weight; from
            then on older ones fade.
    """

    human_weight: float = 5.0
    own_weight: float = 0.2
    most_own_share: float = 0.5
    memory: float = 200.0


class MetricModel:
    """The learned meaning of the ten prepositions.

    Attributes:
        settings: How examples are weighted.
        counts: (10, 3) int64, examples merged so far, by preposition (positions, then distances,
            in the order of their enums) and source.
    """

    def __init__(self, settings: MetricSettings | None = None) -> None:
        self.settings = settings or MetricSettings()
        self.counts = np.zeros((len(_RELATIONS), len(_SOURCES)), dtype=np.int64)
        # Means of the examples by source, and how much of them is still remembered.
        self._position = np.zeros((len(_POSITIONS), len(_SOURCES), POSITION_BINS))
        self._distance = np.zeros((len(_DISTANCES), len(_SOURCES), DISTANCE_BINS))
        self._weights = np.zeros((len(_RELATIONS), len(_SOURCES)))

    def learn(self, relation: Position | Distance, pair: PairHistograms, source: Source) -> None:
        """Merges an example: this pair stands in this relation.

        The converse is an example of its own: the caller gives it with the pair's other direction.
        """
        row, column = _RELATIONS.index(relation), _SOURCES.index(source)
        self.counts[row, column] += 1
        weight = min(self._weights[row, column] + 1.0, self.settings.memory)
        self._weights[row, column] = weight
        if isinstance(relation, Position):
            mean, example = self._position[row, column], pair.position
        else:
            mean, example = self._distance[row - len(_POSITIONS), column], pair.distance
        mean += (example - mean) / weight

    def fade(self, weight: float = 1.0, sources: tuple[Source, ...] = tuple(Source)) -> None:
        """Lets what was learned count no more than so many examples per relation and source.

        For a new viewpoint, from which new examples are to go before the old ones.
        """
        for source in sources:
            column = _SOURCES.index(source)
            self._weights[:, column] = np.minimum(self._weights[:, column], weight)

    def ground(self, scene: SceneHistograms) -> dict[tuple[int, int], Grounding]:
        """Both relations of every directed pair (i, j).

        Returns:
            Nothing unless at least one position and one distance relation are known. The
            confidence is 1 for a pair that is like one preposition and unlike all others, and
            nears 0.5 where two are equally alike; of prepositions without examples, a pair is as
            unlike as can be.
        """
        positions, distances = self._known(scene)
        if positions is None or distances is None:
            return {}
        count = len(scene.position)
        nearest, second = np.sort(positions, axis=-1)[..., :2].transpose(2, 0, 1)
        named = positions.argmin(axis=-1)
        position_confidence = _share(second, nearest)
        second, nearest = np.sort(distances, axis=-1)[..., -2:].transpose(2, 0, 1)
        distance = distances.argmax(axis=-1)
        distance_confidence = _share(nearest, second)
        return {
            (i, j): Grounding(
                position=_POSITIONS[named[i, j]],
                position_confidence=float(position_confidence[i, j]),
                distance=_DISTANCES[distance[i, j]],
                distance_confidence=float(distance_confidence[i, j]),
            )
            for i in range(count)
            for j in range(count)
            if i != j
        }

    def position_histogram(self, relation: Position) -> Float | None:
        """The (POSITION_BINS,) meaning of a position relation; None without examples."""
        row = _POSITIONS.index(relation)
        return self._mean(self._position[row], self._influences()[row])

    def distance_histogram(self, relation: Distance) -> Float | None:
        """The (DISTANCE_BINS,) meaning of a distance relation; None without examples."""
        row = _DISTANCES.index(relation)
        return self._mean(self._distance[row], self._influences()[len(_POSITIONS) + row])

    def to_arrays(self) -> dict[str, np.ndarray]:
        """What was learned, as plain arrays: for a file."""
        return {
            "counts": self.counts.copy(),
            "weights": self._weights.copy(),
            "position": self._position.copy(),
            "distance": self._distance.copy(),
        }

    @classmethod
    def from_arrays(
        cls, arrays: Mapping[str, np.ndarray], settings: MetricSettings | None = None
    ) -> MetricModel:
        """The model that `to_arrays` described.

        Raises:
            ValueError: If an array is missing, or of another shape, or holds what no model can.
        """
        model = cls(settings)
        for name, kept in model.to_arrays().items():
            array = arrays.get(name)
            if array is None or array.shape != kept.shape:
                shape = "missing" if array is None else f"of shape {array.shape}"
                raise ValueError(f"array '{name}' is {shape}, must be of shape {kept.shape}")
            if not np.isfinite(array).all() or (array < 0).any():
                raise ValueError(f"array '{name}' holds negative numbers or none at all")
        model.counts = np.array(arrays["counts"], dtype=np.int64)
        model._weights = np.array(arrays["weights"], dtype=np.float64)
        model._position = np.array(arrays["position"], dtype=np.float64)
        model._distance = np.array(arrays["distance"], dtype=np.float64)
        return model

    def _influences(self) -> Float:
        """How much the examples of each source count, (10, 3)."""
        settings = self.settings
        influences = self._weights * [1.0, settings.own_weight, settings.human_weight]
        qsr, own, human = (_SOURCES.index(one) for one in (Source.QSR, Source.MSR, Source.HUMAN))
        others = influences[:, qsr] + influences[:, human]
        most = np.where(others > 0.0, settings.most_own_share * others, np.inf)
        influences[:, own] = np.minimum(influences[:, own], most)
        return influences

    def _mean(self, means: Float, influences: Float) -> Float | None:
        total = influences.sum()
        return np.asarray(influences @ means / total) if total > 0.0 else None

    def _known(self, scene: SceneHistograms) -> tuple[Float | None, Float | None]:
        """Chi-squared distances (n, n, 7), and intersections (n, n, 3); None if none is known."""
        positions = np.ones((*scene.position.shape[:2], len(_POSITIONS)))
        distances = np.zeros((*scene.distance.shape[:2], len(_DISTANCES)))
        position_known = distance_known = False
        for index, position in enumerate(_POSITIONS):
            meaning = self.position_histogram(position)
            if meaning is not None:
                position_known = True
                positions[..., index] = chi_squared(scene.position, meaning)
        for index, distance in enumerate(_DISTANCES):
            meaning = self.distance_histogram(distance)
            if meaning is not None:
                distance_known = True
                distances[..., index] = np.minimum(scene.distance, meaning).sum(axis=-1)
        return (positions if position_known else None, distances if distance_known else None)


def chi_squared(histograms: Float, meaning: Float) -> Float:
    """The paper's measure for position histograms: 0 for equal ones, 1 for disjoint ones.

    Args:
        histograms: (..., B), each sums to 1.
        meaning: (B,), sums to 1.
    """
    total = histograms + meaning
    squares = (histograms - meaning) ** 2
    return np.asarray((squares / np.where(total > 0.0, 2.0 * total, 1.0)).sum(axis=-1))


def converse(relation: Position | Distance) -> Position | Distance | None:
    """The relation of the reference to the object; None where it has no name."""
    return relation.converse if isinstance(relation, Position) else relation


_POSITIONS = tuple(Position)
_DISTANCES = tuple(Distance)
_RELATIONS: tuple[Position | Distance, ...] = (*_POSITIONS, *_DISTANCES)
_SOURCES = tuple(Source)


def _share(larger: Float, smaller: Float) -> Float:
    """The larger one's share of both, from 0.5 to 1."""
    total = larger + smaller
    return np.asarray(np.where(total > 0.0, larger / np.where(total > 0.0, total, 1.0), 0.5))
