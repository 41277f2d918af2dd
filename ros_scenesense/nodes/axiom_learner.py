"""The node `axiom_learner`: learns axioms from labelled scenes, strengthens and forgets them."""

from __future__ import annotations

import sys
from typing import Any

from std_srvs.srv import Trigger

from ros_scenesense.messages.actions import Transition
from ros_scenesense.messages.grounding import Objects, Relations, Trust
from ros_scenesense.messages.learning import AxiomRequest, AxiomResult, Axioms, JobProgress
from ros_scenesense.messages.reasoning import Beliefs, Knowledge, Verdicts
from ros_scenesense.nodes.base import StageNode
from ros_scenesense.nodes.running import run
from ros_scenesense.stages.axiom_learner import AxiomLearnerConfiguration, AxiomLearnerStage
from ros_scenesense.stages.protocol import Outgoing


class AxiomLearnerNode(StageNode):
    """Gives `AxiomLearnerStage` its topics and its service."""

    stage: AxiomLearnerStage

    def __init__(self, **node_options: Any) -> None:
        super().__init__(
            "axiom_learner",
            AxiomLearnerConfiguration,
            AxiomLearnerStage,
            subscribes=(
                Objects,
                Relations,
                Beliefs,
                Verdicts,
                Knowledge,
                Trust,
                Transition,
                AxiomRequest,
            ),
            publishes=(Axioms, AxiomResult, JobProgress),
            **node_options,
        )

    def connect(self) -> None:
        """Adds the service that begins a cycle at once."""
        super().connect()
        self.create_service(Trigger, "axiom_learner/learn", self._learn)

    def _learn(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        answers: list[tuple[str | None, str]] = []

        def learn(now_ns: int) -> list[Outgoing]:
            answers.append(self.stage.learn(now_ns))
            return []

        self.call(learn)
        job_id, words = answers[0] if answers else (None, "failed: see the node's log")
        response.success, response.message = job_id is not None, words
        return response


def main() -> int:
    """Runs the node; returns its exit code."""
    return run("axiom_learner", AxiomLearnerNode)


if __name__ == "__main__":
    sys.exit(main())
