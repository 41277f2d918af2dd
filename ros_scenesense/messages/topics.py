"""The JSON topics: which message travels where, with which quality of service and size limit."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ros_scenesense.messages import (
    actions,
    attention,
    grounding,
    health,
    learning,
    reasoning,
    scenes,
)
from ros_scenesense.messages.base import AnyMessage

KIB = 1024


class QosClass(Enum):
    """Quality of service, by what a topic is for.

    - `frame`: images; reliable and volatile, depth 1 to 5.
    - `event`: reliable, transient local, depth 200; repeats are recognised by their id.
    - `state`: reliable, transient local, depth 1.
    - `request`: what a person or a timer sends once; reliable and volatile (a late joiner must not
      act on it again).
    """

    FRAME = "frame"
    EVENT = "event"
    STATE = "state"
    REQUEST = "request"


@dataclass(frozen=True)
class Topic:
    """A JSON topic: relative name, message type, quality of service, longest payload in bytes."""

    name: str
    message: type[AnyMessage]
    qos: QosClass
    limit: int


_ALL = [
    Topic("scene", scenes.Scene, QosClass.EVENT, 64 * KIB),
    Topic("scene_lost", scenes.SceneLost, QosClass.EVENT, 16 * KIB),
    Topic("labels", scenes.Labels, QosClass.EVENT, 64 * KIB),
    Topic("action", actions.Action, QosClass.EVENT, 4 * KIB),
    Topic("action_result", actions.ActionResult, QosClass.EVENT, 16 * KIB),
    Topic("goal", actions.Goal, QosClass.REQUEST, 16 * KIB),
    Topic("plan", actions.Plan, QosClass.EVENT, 64 * KIB),
    Topic("transitions", actions.Transition, QosClass.EVENT, 256 * KIB),
    Topic("groundings", grounding.Groundings, QosClass.EVENT, 2048 * KIB),
    Topic("objects", grounding.Objects, QosClass.EVENT, 256 * KIB),
    Topic("relations", grounding.Relations, QosClass.EVENT, 1024 * KIB),
    Topic("msr_update", grounding.MsrUpdate, QosClass.EVENT, 256 * KIB),
    Topic("trust", grounding.Trust, QosClass.STATE, 4 * KIB),
    Topic("feedback", grounding.Feedback, QosClass.REQUEST, 4 * KIB),
    Topic("feedback_result", grounding.FeedbackResult, QosClass.EVENT, 16 * KIB),
    Topic("beliefs", reasoning.Beliefs, QosClass.EVENT, 1024 * KIB),
    Topic("verdicts", reasoning.Verdicts, QosClass.EVENT, 256 * KIB),
    Topic("knowledge", reasoning.Knowledge, QosClass.STATE, 1024 * KIB),
    Topic("query", reasoning.Query, QosClass.REQUEST, 16 * KIB),
    Topic("explanation", reasoning.Explanation, QosClass.EVENT, 256 * KIB),
    Topic("rois", attention.Rois, QosClass.EVENT, 256 * KIB),
    Topic("estimates", attention.Estimates, QosClass.EVENT, 256 * KIB),
    Topic("examples", attention.Examples, QosClass.EVENT, 256 * KIB),
    Topic("axioms", learning.Axioms, QosClass.STATE, 1024 * KIB),
    Topic("axiom_request", learning.AxiomRequest, QosClass.REQUEST, 4 * KIB),
    Topic("axiom_result", learning.AxiomResult, QosClass.EVENT, 16 * KIB),
    Topic("job_progress", learning.JobProgress, QosClass.EVENT, 16 * KIB),
    Topic("heartbeat", health.Heartbeat, QosClass.REQUEST, 16 * KIB),
]

TOPICS: dict[type[AnyMessage], Topic] = {topic.message: topic for topic in _ALL}
