"""Weights of the score that joins pieces, as `tools/fit_segmentation.py` prints them."""

from __future__ import annotations

import numpy as np

# The constant; each feature; the products of each with itself and those after it.
CONSTANT = -0.0522
LINEAR = (
    1.39,  # step
    -6.96,  # concave
    -1.18,  # convex
    -7.33,  # shifted
    1.64,  # color
    -0.46,  # strong_color
    1.77,  # local_color
    5.5,  # enclosed
    -3.09,  # hollow
)
PRODUCTS = (
    (1.32, -1.64, -7.31, 6.89, -1.56, -5.56, -1.2, -7.17, -17.5),  # step
    (6.78, 22.5, 6.35, -1.71, -1.22, 0.894, -9.92, -10.1),  # concave
    (3.62, 6.23, 0.644, -1.02, 0.0354, 2.66, -14.3),  # convex
    (7.4, -6.84, -2.54, 0.349, 0.485, 1.93),  # shifted
    (1.13, -0.459, -3.07, 0.242, -2.59),  # color
    (1.82, -2.13, -3.23, 11),  # strong_color
    (-0.154, 0.915, -6.49),  # local_color
    (4.67, 15.3),  # enclosed
    (46.6,),  # hollow
)
WEIGHTS = np.concatenate([[CONSTANT], LINEAR, *PRODUCTS])
