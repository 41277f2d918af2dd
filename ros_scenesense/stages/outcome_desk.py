"""Takes what came of the robot's actions into the memory of the axiom learner, each once."""

from __future__ import annotations

from ros_scenesense.errors import LearningError, ReasoningError
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.learning.examples import Reason, SceneState
from ros_scenesense.messages.actions import Transition
from ros_scenesense.reasoning.scene_states import SceneStates
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.outcomes import Outcome

_UNEXPECTED: Reason = "unexpected_outcome"


class OutcomeDesk:
    """Keeps attempts at actions, and what did not stay where the robot put it.

    Args:
        store: Where.
        domain: The domain.
        states: Computes states of scenes.
        health: Counts them.
    """

    def __init__(
        self, store: LearnerStore, domain: SystemDescription, states: SceneStates, health: Health
    ) -> None:
        self._store = store
        self._domain = domain
        self._states = states
        self._health = health

    def take(self, transition: Transition) -> bool:
        """Takes what came of an action; returns whether that was unexpected.

        An arrangement that was expected and in which something did not stay is an example of what
        is unstable.
        """
        key = f"{transition.episode_id} {transition.id}"
        if self._store.trials.knows(key):
            self._health.count("transitions_repeated")
            return False
        try:
            outcome = Outcome(transition, self._domain)
            trial, unstable = outcome.trial(), outcome.unstable()
            state = None if unstable is None else self._states.of(unstable[0])
        except (LearningError, ReasoningError) as error:
            self._health.problem("transition_ignored", f"action {transition.id}: {error}")
            return False
        if unstable is not None and state is not None:
            facts, fallen = unstable
            names = tuple(each.name for each in facts.objects)
            labels = [("stable", names.index(each), False, _UNEXPECTED) for each in fallen]
            scene_id = f"expected after {transition.id} in {transition.scene_before}"
            if self._store.add_scene(scene_id, SceneState(names, state), labels, ()):
                self._health.count("examples_of_outcomes")
        self._store.trials.add(key, trial)
        known = "outcomes_not_known_completely" if trial is None else "outcomes_kept"
        self._health.count(known)
        return outcome.is_unexpected
