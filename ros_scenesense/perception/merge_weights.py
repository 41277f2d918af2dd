"""Weights of the score that joins pieces, as `tools/fit_segmentation.py` prints them."""

from __future__ import annotations

import numpy as np

# The constant; each feature; the products of each feature with itself and those after it.
CONSTANT = -0.24
LINEAR = (
    2.06,  # step
    -6.92,  # concave
    -1.37,  # convex
    -6.5,  # shifted
    1.37,  # color
    0.124,  # strong_color
    1.71,  # local_color
    5.93,  # enclosed
    -8.03,  # hollow
)
PRODUCTS = (
    (0.598, -1.94, -7.04, 5.58, -1.36, -7.27, -0.801, -7.24, -15.6),  # step
    (7.25, 25.5, 6.23, -1.62, -2.03, 1.1, -11.8, -14.6),  # concave
    (5.22, 6.38, 0.161, -2.41, 0.774, 0.198, -17.1),  # convex
    (6.16, -5.72, -4.44, -0.0114, 1.73, -1.67),  # shifted
    (1.1, 0.137, -3.32, 0.624, -3.14),  # color
    (2.73, -2.7, -2.67, 7.21),  # strong_color
    (-0.191, 0.139, -2.22),  # local_color
    (5.28, 27.9),  # enclosed
    (66.3,),  # hollow
)
WEIGHTS = np.concatenate([[CONSTANT], LINEAR, *PRODUCTS])
