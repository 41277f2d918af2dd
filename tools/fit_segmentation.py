"""Fits the score that puts pieces together, and prints the module `perception/merge_weights.py`.

    python tools/fit_segmentation.py > ros_scenesense/perception/merge_weights.py

It looks at simulated frames of the seeds 1000 to 1004, with and without noise, on some of which
objects wear random prints, cuts them into pieces, and asks of all neighbouring pieces whether they
are of one object: a logistic regression on the features and their products.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from joblib import Parallel, delayed
from scipy.optimize import minimize

from ros_scenesense.bench.crowds import HEIGHT, WIDTH, Studio
from ros_scenesense.geometry import Float
from ros_scenesense.perception.merging import Borders, expanded
from ros_scenesense.perception.plane import find_table
from ros_scenesense.perception.points import points_of
from ros_scenesense.perception.regions import Pieces
from ros_scenesense.perception.segmentation import look
from ros_scenesense.perception.tabletop import measure_tabletop
from ros_scenesense.scene import Frame
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.noise import PRESETS, noisy

# Seed, what stands there, how many frames.
SERIES = (
    (1002, "mixed", 100),
    (1000, "mixed", 60),
    (1003, "relations", 40),
    (1004, "studio", 50),
    (1000, "studio", 30),
    (1001, "relations", 24),
)
PRINTED = 1000
CROWDS = (5, 10, 20)
CROWDS_OF_EACH = 4
FEATURES = (
    *("step", "concave", "convex", "shifted", "color", "strong_color", "local_color"),
    *("enclosed", "hollow"),
)
PENALTY = 3e-4
PUREST, LARGEST_WEIGHT = 0.75, 80.0


def frames(series: int) -> Iterator[Frame]:
    """The frames of a series."""
    seed, arrangement, count = SERIES[series]
    rng = np.random.default_rng([seed, series])
    shown = studio_frames(seed, count)
    if arrangement != "studio":
        shown = simulated_frames(seed, arrangement, count)
    for index, frame in enumerate(shown):
        yield frame
        of_one_color = arrangement == "studio" and index < count
        if seed == PRINTED and not of_one_color:
            yield printed(frame, rng)


def simulated_frames(seed: int, arrangement: str, count: int) -> Iterator[Frame]:
    """Frames of the simulated camera."""
    size = SimulationConfiguration(width=WIDTH, height=HEIGHT, arrangement=arrangement)
    engine = SimulationEngine(size)
    for index in range(count):
        yield engine.scene(seed, index).frame
    engine.close()


def studio_frames(seed: int, count: int) -> Iterator[Frame]:
    """Stacks of one colour, then crowds."""
    studio = Studio()
    for index in range(count):
        yield studio.stack_of_one_color(np.random.default_rng([seed, index])).frame
    for number in CROWDS:
        for index in range(CROWDS_OF_EACH):
            yield studio.crowd(number, np.random.default_rng([seed, number, index])).frame
    studio.close()


def printed(frame: Frame, rng: np.random.Generator) -> Frame:
    """The frame with random prints on most objects, shaded as these are."""
    assert frame.instances is not None
    color = frame.color.copy()
    for number in range(1, int(frame.instances.max()) + 1):
        mine = frame.instances == number
        if rng.random() < 0.4 or np.count_nonzero(mine) < 300:
            continue
        y, x = np.nonzero(mine)
        shade = color.mean(axis=2) / max(float(np.median(color[mine], axis=0).mean()), 1.0)
        marks = np.zeros(mine.shape, dtype=np.int32)
        for mark in range(1, int(rng.integers(2, 6))):
            middle = rng.uniform([x.min(), y.min()], [x.max(), y.max()])
            half = rng.uniform(0.05, 0.25, 2) * [np.ptp(x), np.ptp(y)]
            if rng.random() < 0.5:
                corners = np.rint([middle - half, middle + half]).astype(int).tolist()
                cv2.rectangle(marks, corners[0], corners[1], mark, -1)
            else:
                angle = float(rng.uniform(0.0, 180.0))
                axes = np.rint(half).astype(int).tolist()
                cv2.ellipse(
                    marks, np.rint(middle).astype(int).tolist(), axes, angle, 0, 360, mark, -1
                )
        inks = rng.integers(20, 240, (6, 3))
        chosen = mine & (marks > 0)
        inked = inks[marks[chosen]] * np.clip(shade[chosen], 0.4, 1.2)[:, None]
        color[chosen] = np.clip(inked, 0, 255).astype(np.uint8)
    return replace(frame, color=color)


def samples(series: int) -> tuple[list[Float], list[bool], list[float]]:
    """Features of pairs of neighbours, whether they are of one object, and how much they count."""
    features: list[Float] = []
    same: list[bool] = []
    weights: list[float] = []
    for number, frame in enumerate(frames(series)):
        for noise in PRESETS.values():
            depth = noisy(frame.depth, frame.intrinsics, noise, np.random.default_rng(number))
            rng = np.random.default_rng(0)
            points = points_of(depth, frame.intrinsics)
            flat = points.reshape(-1, 3)
            read = np.flatnonzero(np.isfinite(flat[:, 2]))
            plane = find_table(flat[rng.choice(read, 4000)].astype(np.float64), rng)
            if plane is None:
                continue
            tabletop = measure_tabletop(points, plane, rng)
            outlook = look(frame.color, depth, frame.intrinsics, tabletop)
            if outlook is None:
                continue
            assert frame.instances is not None
            truth = frame.instances[outlook.window]
            for share in (0.0, 0.3, 0.6, 0.9):
                pieces = partly_joined(outlook.pieces, truth, share, np.random.default_rng(number))
                borders = Borders(pieces, outlook.surface)
                owner, purity = owners(pieces, truth)
                for one, others in enumerate(borders.borders):
                    for other in others:
                        pure = min(purity[one], purity[other]) > PUREST
                        if one < other and pure and owner[one] and owner[other]:
                            features.append(expanded(borders.features(one, other)))
                            same.append(bool(owner[one] == owner[other]))
                            area = min(borders.area[one], borders.area[other])
                            weights.append(min(float(np.sqrt(area)), LARGEST_WEIGHT))
    return features, same, weights


def owners(pieces: Pieces, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The object of each piece, and which share of the piece is of it."""
    columns = int(truth.max()) + 1
    codes = pieces.labels.astype(np.int64) * columns + truth
    counts = np.bincount(codes.ravel(), minlength=(pieces.count + 1) * columns)
    counts = counts.reshape(pieces.count + 1, columns)
    return counts.argmax(axis=1), counts.max(axis=1) / np.maximum(counts.sum(axis=1), 1)


def partly_joined(
    pieces: Pieces, truth: np.ndarray, share: float, rng: np.random.Generator
) -> Pieces:
    """Pieces of which some are joined rightly, as they are while the score is in use."""
    owner, _ = owners(pieces, truth)
    root = np.arange(pieces.count + 1, dtype=np.int32)
    for one in range(1, pieces.count + 1):
        before = [other for other in range(1, one) if owner[other] == owner[one]]
        if before and rng.random() < share:
            root[one] = root[before[0]]
    return Pieces(root[pieces.labels], pieces.count)


def fit(features: Float, same: np.ndarray, weights: Float) -> Float:
    """Weights of a logistic regression."""
    scale = features.std(axis=0)
    scale[scale == 0.0] = 1.0
    scaled = features / scale
    penalised = np.ones(scaled.shape[1])
    penalised[0] = 0.0

    def loss(w: Float) -> tuple[float, Float]:
        score = scaled @ w
        wrong = np.logaddexp(0.0, np.where(same, -score, score))
        slope = scaled.T @ (weights * (1.0 / (1.0 + np.exp(-score)) - same)) / weights.sum()
        value = (weights @ wrong) / weights.sum() + PENALTY * (penalised @ w**2)
        return float(value), slope + 2.0 * PENALTY * penalised * w

    start = np.zeros(scaled.shape[1])
    return np.asarray(minimize(loss, start, jac=True, options={"maxiter": 2000}).x / scale)


def module(weights: Float) -> str:
    """The Python module with these weights."""
    count = len(FEATURES)
    first, _ = np.triu_indices(count)
    lines = [
        '"""Weights of the score that joins pieces, as `tools/fit_segmentation.py` prints them."""',
        "",
        "from __future__ import annotations",
        "",
        "import numpy as np",
        "",
        "# The constant; each feature; the products of each with itself and those after it.",
        f"CONSTANT = {weights[0]:.3g}",
        "LINEAR = (",
        *(
            f"    {value:.3g},  # {name}"
            for name, value in zip(FEATURES, weights[1:], strict=False)
        ),
        ")",
        "PRODUCTS = (",
    ]
    for index, name in enumerate(FEATURES):
        row = ", ".join(f"{value:.3g}" for value in weights[1 + count :][first == index])
        lines.append(f"    ({row}{',' if index == count - 1 else ''}),  # {name}")
    return "\n".join([*lines, ")", "WEIGHTS = np.concatenate([[CONSTANT], LINEAR, *PRODUCTS])", ""])


def main() -> int:
    """Fits in two processes, some minutes."""
    parts = Parallel(n_jobs=2)(delayed(samples)(series) for series in range(len(SERIES)))
    features = np.array([one for part in parts for one in part[0]])
    same = np.array([one for part in parts for one in part[1]])
    weights = np.array([one for part in parts for one in part[2]])
    found = fit(features, same, weights)
    right = float(np.average((features @ found > 0) == same, weights=weights))
    print(f"{len(same)} pairs, {right:.1%} right", file=sys.stderr)
    print(module(found), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
