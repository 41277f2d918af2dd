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
        most_tests: The last scenes are tested on, so many, but at most a third of them.
        repeats: Trainings of each, with other images and weights.
        shortened: Few iterations, to see that it runs.
        knowledge: What reasoning alone is tried with.
    """

    sizes: Mapping[str, tuple[int, ...]]
    complete: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    scenes: int = 6000
    most_scenes: int = 6000
    most_tests: int = 1000
    repeats: int = 3
    shortened: bool = False
    knowledge: tuple[str, ...] = ("incomplete", "complete")

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
        for knowledge in self.knowledge:
            for number in range(self.repeats):
                yield Trial("reasoning", knowledge, largest, seed + number, tests)

    def tests(self, scenes: int) -> int:
        """How many of so many scenes are tested on."""
        return max(1, min(self.most_tests, round(scenes / 3)))


_SIZES = (25, 50, 100, 200, 1000, 5000)
ESTIMATION = Plan(
    sizes={
        "query": _SIZES,
        "lenet": _SIZES,
        "lenet_att": _SIZES,
        "same_channels": _SIZES,
        "alexnet": _SIZES,
        "alexnet_att": _SIZES,
        "query_pixels": (100,),
        "query_geometry": (100,),
        "query_segmented": (100,),
    },
    complete={"query": (100, 1000), "lenet_att": (100,), "alexnet_att": (100,)},
)
_STEPS = tuple(range(100, 1001, 100))
SAMPLES = Plan(
    sizes={
        "lenet": _STEPS,
        "lenet_att": _STEPS,
        "alexnet": _STEPS,
        "alexnet_att": _STEPS,
        "query": (25, 50, *_STEPS),
    },
    scenes=2000,
)
_FEW_AND_MANY = (100, 1000, 5000)
BACKGROUNDS = Plan(
    sizes={"query": _FEW_AND_MANY, "lenet": _FEW_AND_MANY, "lenet_att": _FEW_AND_MANY}, knowledge=()
)
QUICK_BACKGROUNDS = Plan(
    sizes={"query": (16,), "lenet": (16,)},
    knowledge=(),
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
        "query_segmented": (16,),
    },
    complete={"query": (16,), "lenet_att": (16,)},
    scenes=24,
    most_scenes=24,
    repeats=2,
    shortened=True,
)
