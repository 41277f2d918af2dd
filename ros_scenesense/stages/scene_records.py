"""The histograms of scenes as they are kept in a file: small, and read back pair by pair."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.grounding.histograms import (
    DISTANCE_BINS,
    POSITION_BINS,
    PairHistograms,
    SceneHistograms,
)
from ros_scenesense.grounding.memory import Example
from ros_scenesense.grounding.msr import Source
from ros_scenesense.messages.grounding import MsrSample
from ros_scenesense.stages.statements import relation_named

_COLUMNS = POSITION_BINS + DISTANCE_BINS + 1


@dataclass(frozen=True)
class SceneRecord:
    """What is remembered of a scene.

    Attributes:
        scene_id: The scene.
        names: The located objects.
        yaw_rad: As in the histograms.
        packed: The histograms of all pairs, in half precision and compressed.
    """

    scene_id: str
    names: tuple[str, ...]
    yaw_rad: float
    packed: bytes

    @classmethod
    def of(cls, scene_id: str, names: Sequence[str], seen: SceneHistograms) -> SceneRecord:
        """The record of a scene."""
        parts = (seen.position, seen.distance, seen.azimuth_rad[..., None])
        return cls(scene_id, tuple(names), seen.yaw_rad, _pack(np.concatenate(parts, axis=-1)))

    def example(self, sample: MsrSample) -> Example | None:
        """The example that a sample about this scene gives; None if it has no such pair."""
        if sample.object == sample.reference:
            return None
        try:
            i, j = self.names.index(sample.object), self.names.index(sample.reference)
        except ValueError:
            return None
        rows = (self._rows[i, j], self._rows[j, i])
        forward, backward = (_pair(row, self.yaw_rad) for row in rows)
        return Example(relation_named(sample.relation), forward, backward, Source(sample.source))

    @cached_property
    def _rows(self) -> Float:
        return _unpack(self.packed).reshape(len(self.names), len(self.names), _COLUMNS)


def pack_pair(example: Example) -> bytes:
    """Both directions of a pair; exactly what was unpacked."""
    return _pack(np.stack([_row(example.forward), _row(example.backward)]))


def unpack_pair(packed: bytes, yaw_rad: float) -> tuple[PairHistograms, PairHistograms]:
    """Both directions of a pair."""
    forward, backward = (_pair(row, yaw_rad) for row in _unpack(packed).reshape(2, _COLUMNS))
    return forward, backward


def _row(pair: PairHistograms) -> Float:
    return np.concatenate([pair.position, pair.distance, [pair.azimuth_rad]])


def _pair(row: Float, yaw_rad: float) -> PairHistograms:
    return PairHistograms(row[:POSITION_BINS], row[POSITION_BINS:-1], float(row[-1]), yaw_rad)


def _pack(rows: npt.NDArray[np.floating]) -> bytes:
    return zlib.compress(rows.astype(np.float16).tobytes(), 1)


def _unpack(packed: bytes) -> Float:
    return np.frombuffer(zlib.decompress(packed), np.float16).astype(np.float64)
