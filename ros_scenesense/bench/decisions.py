"""How much reasoning decides, and how often physics agrees: the stages of the graph."""

from __future__ import annotations

from ros_scenesense.bench.figure import BenchOptions, Figure, Measured
from ros_scenesense.demo.record import RunRecord, Subject
from ros_scenesense.demo.summary import TaskSummary, summarise_tasks
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.pipeline import Pipeline
from ros_scenesense.results import Table
from ros_scenesense.stages.attention import AttentionConfiguration, AttentionStage
from ros_scenesense.stages.grounding import GroundingConfiguration, GroundingStage
from ros_scenesense.stages.grounding_control import (
    GroundingControlConfiguration,
    GroundingControlStage,
)
from ros_scenesense.stages.reasoner import ReasonerConfiguration, ReasonerStage
from ros_scenesense.stages.simulated_camera import (
    SimulatedCameraConfiguration,
    SimulatedCameraStage,
)

_SESSION = "bench"
_STRICT_TARGET = 0.95

FIGURES = tuple(
    figure
    for subject in Subject
    for figure in (
        Figure(
            f"{subject}_strict_accuracy",
            f"{subject}: share of the strict decisions that physics confirms",
            at_least=_STRICT_TARGET,
        ),
        Figure(f"{subject}_strict_share", f"{subject}: share decided strictly"),
        Figure(f"{subject}_decided_share", f"{subject}: share decided strictly or by default"),
    )
)


def measure(options: BenchOptions) -> Measured:
    """Lets the stages decide about simulated scenes of all arrangements."""
    scenes = 20 if options.quick else 200
    tasks = summarise_tasks(_run(scenes, options.seed).decisions())
    figures = {}
    for subject, task in tasks.items():
        for name in ("strict_accuracy", "strict_share", "decided_share"):
            value = getattr(task, name)
            if value is not None:
                figures[f"{subject}_{name}"] = value
    return Measured(figures, {f"Decisions, {scenes} scenes": _table(tasks)})


def _run(scenes: int, seed: int) -> RunRecord:
    record = RunRecord(_SESSION)
    camera = SimulatedCameraConfiguration(scenes=scenes, seed=seed, session=_SESSION)
    pipeline = Pipeline(
        [
            SimulatedCameraStage(camera),
            GroundingStage(GroundingConfiguration()),
            GroundingControlStage(GroundingControlConfiguration()),
            ReasonerStage(ReasonerConfiguration()),
            AttentionStage(AttentionConfiguration(network="none")),
        ]
    )
    try:
        for item in pipeline.run():
            if isinstance(item, AnyMessage):
                record.take(item, 0)
    finally:
        pipeline.close()
    return record


def _table(tasks: dict[str, TaskSummary]) -> Table:
    columns = {
        "strict": "strict",
        "right": "right",
        "wrong": "wrong",
        "by_default": "by default",
        "default_right": "default right",
        "default_wrong": "default wrong",
        "undecided": "undecided",
        "inconsistent": "inconsistent",
        "timed_out": "timed out",
    }
    return Table(
        columns=["task", *columns.values()],
        rows=[
            [task, *(getattr(counts, name) for name in columns)] for task, counts in tasks.items()
        ],
    )
