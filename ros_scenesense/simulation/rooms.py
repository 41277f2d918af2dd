"""The room inside open containers: where an object of some size can be put in.

Found by plumb lines through what collides, so that it holds for any mesh, the user's too.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ros_scenesense.geometry import Float
from ros_scenesense.simulation.forms import Form


@dataclass(frozen=True, eq=False)
class Room:
    """Heights of a container over a grid.

    Attributes:
        places: (R, C, 2) x and y of the grid, from the centre of mass, metres.
        depths: (R, C) how far the first thing met from above is below the rim, metres; negative
            beside the container.
    """

    places: Float
    depths: Float

    def fitting(self, radius_m: float, depth_m: float) -> Float:
        """Places (N, 2) where an upright cylinder can be lowered so far below the rim."""
        from scipy.ndimage import distance_transform_edt  # only a few scenes ask

        free = np.pad(self.depths >= depth_m, 1)
        distances = distance_transform_edt(free)[1:-1, 1:-1] * _CELL_M
        return np.asarray(self.places[distances >= radius_m + _CELL_M])


def measure_room(form: Form) -> Room:
    """Measures a form of convex parts; what is massive has no room."""
    vertices = np.concatenate(form.parts) if form.parts else form.mesh.vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    x, y = (np.arange(low[axis], high[axis], _CELL_M) for axis in (0, 1))
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    heights = _heights(form.parts, places.reshape(-1, 2)).reshape(places.shape[:2])
    depths = np.where(np.isfinite(heights), high[2] - heights, -1.0)
    return Room(places, depths)


_CELL_M = 0.002
_VERTICAL = 1e-6


def _heights(parts: Iterable[Float], places: npt.NDArray[np.float64]) -> Float:
    """Height (N,) of the topmost part over each place, -inf where there is none."""
    from scipy.spatial import ConvexHull

    top = np.full(len(places), -np.inf)
    for part in parts:
        faces = ConvexHull(part).equations
        level = places @ faces[:, :2].T + faces[:, 3]  # (N, F)
        rise = faces[:, 2]
        roof, floor = rise > _VERTICAL, rise < -_VERTICAL
        highest = (-level[:, roof] / rise[roof]).min(axis=1)
        lowest = (-level[:, floor] / rise[floor]).max(axis=1)
        meets = (level[:, ~roof & ~floor] <= 0.0).all(axis=1) & (lowest <= highest)
        top = np.maximum(top, np.where(meets, highest, -np.inf))
    return top
