"""What the experiments on estimation try: ways, sizes of the training set, repetitions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from ros_scenesense.experiments.estimation_trials import Trial


@dataclass(frozen=True)
class Plan:
    """The grid of an experiment.

    Attributes:
        sizes: For each way, the numbers of training images, with incomplete knowledge.
        complete: The same with complete knowledge.
        scenes: Of the dataset that is made where none is given.
        most_scenes: How many of a dataset are looked at; the first ones.
        test_share: Share of them, the last ones, that is tested on.
        repeats: Trainings of each, with other images and weights.
        shortened: Few iterations, to see that it runs.
    """

    sizes: Mapping[str, tuple[int, ...]]
    complete: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    scenes: int = 6000
    most_scenes: int = 6000
    test_share: float = 1 / 3
    repeats: int = 3
    shortened: bool = False

    def trials(self, scenes: int, seed: int, schedule: str, device: str) -> Iterator[Trial]:
        """The trials, the longest first; those with more images than there are left out.

        Args:
            scenes: How many were looked at.
            seed: Of the first repetition.
            schedule: `validated` or `paper`.
            device: Where to train.
        """
        tests = self.tests(scenes)
        grid = [
            (size, way, knowledge)
            for knowledge, ways in (("incomplete", self.sizes), ("complete", self.complete))
            for way, sizes in ways.items()
            for size in sizes
            if size <= scenes - tests
        ]
        grid.sort(key=lambda one: -one[0])
        for size, way, knowledge in grid:
            for number in range(self.repeats):
                yield Trial(
                    way=way,
                    knowledge=knowledge,
                    images=size,
                    seed=seed + number,
                    tests=tests,
                    schedule=schedule,
                    device=device,
                    shortened=self.shortened,
                )
        # Reasoning needs no training; the most frequent answers are those of a training set.
        largest = min(1000, scenes - tests)
        for knowledge in ("incomplete", "complete"):
            for number in range(self.repeats):
                yield Trial("reasoning", knowledge, largest, seed + number, tests)

    def tests(self, scenes: int) -> int:
        """How many of so many scenes are tested on."""
        return max(1, round(self.test_share * scenes))


_FEW = (100, 200, 1000, 5000)
_ALL = (25, 50, *_FEW)
ESTIMATION = Plan(
    sizes={
        "query": _ALL,
        "lenet": _ALL,
        "lenet_att": _ALL,
        "same_channels": _FEW,
        "alexnet": _FEW,
        "alexnet_att": _FEW,
        "query_pixels": (100, 1000),
        "query_geometry": (100,),
    },
    complete={"query": (100, 1000)},
)
_STEPS = (25, 50, *range(100, 1001, 100))
SAMPLES = Plan(
    sizes={
        "lenet": tuple(range(100, 1001, 100)),
        "lenet_att": tuple(range(100, 1001, 100)),
        "alexnet": tuple(range(100, 1001, 100)),
        "alexnet_att": tuple(range(100, 1001, 100)),
        "query": _STEPS,
    },
    scenes=1500,
)
BACKGROUNDS = Plan(
    sizes={"query": (100, 5000), "lenet": (100, 5000), "lenet_att": (100, 5000)},
)
QUICK_BACKGROUNDS = Plan(
    sizes={"query": (16,), "lenet": (16,)},
    scenes=24,
    most_scenes=24,
    repeats=2,
    shortened=True,
)
QUICK = Plan(
    sizes={
        "query": (8, 16),
        "lenet": (16,),
        "lenet_att": (16,),
        "same_channels": (16,),
        "alexnet": (16,),
    },
    complete={"query": (16,)},
    scenes=24,
    most_scenes=24,
    repeats=2,
    shortened=True,
)
