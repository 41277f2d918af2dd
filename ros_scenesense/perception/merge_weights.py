"""Weights of the score that joins pieces, as `tools/fit_segmentation.py` prints them."""

from __future__ import annotations

import numpy as np

# The constant; each feature; the products of each with itself and those after it.
CONSTANT = -0.0261
LINEAR = (
    0.748,  # step
    -8.21,  # concave
    -1.16,  # convex
    -7.85,  # shifted
    1.62,  # color
    -0.383,  # strong_color
    2.14,  # local_color
    5.41,  # enclosed
    2.78,  # hollow
)
PRODUCTS = (
    (0.164, -3.26, -8.09, 7.82, -2.24, -6.12, -0.504, -3.06, -6.05),  # step
    (7.23, 21.9, 7.37, -2.75, -0.28, 1.23, -7.59, -7.95),  # concave
    (4.4, 7.77, -1.1, -1.56, 1.25, 1.25, -11.4),  # convex
    (6.81, -7.24, -2.59, -0.272, 3.4, 1.32),  # shifted
    (1.52, -0.258, -3.25, 1.5, 0.473),  # color
    (1.94, -1.99, -2.84, 8.33),  # strong_color
    (-0.778, 0.419, -2.92),  # local_color
    (2.42, 1.83),  # enclosed
    (0.022,),  # hollow
)
WEIGHTS = np.concatenate([[CONSTANT], LINEAR, *PRODUCTS])
