"""What is missing in the knowledge of an action, learned from attempts at it.

Beyond the paper, after the authors' earlier work: where an action did not bring about what it
should, or was refused, executability conditions say when it is impossible; where something came of
it that nothing said, causal laws do. The machinery is that of the axioms about states: attributes
before the action, the outcome as label, bodies out of many shallow trees.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

from ros_scenesense.errors import LearningError
from ros_scenesense.knowledge.axioms import CausalLaw, ExecutabilityCondition, StateConstraint
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Atom, Belief, Condition, Literal
from ros_scenesense.knowledge.signature import AttributeKind
from ros_scenesense.knowledge.terms import Variable
from ros_scenesense.learning.action_columns import (
    action_columns,
    binding_of,
    conditions_of,
    table_of,
    variables_of_action,
)
from ros_scenesense.learning.bodies import UNNAMED
from ros_scenesense.learning.body_search import BodySearch
from ros_scenesense.learning.columns import bits_of
from ros_scenesense.learning.evaluation import satisfied
from ros_scenesense.learning.examples import SceneState
from ros_scenesense.learning.trials import Trial

Law = ExecutabilityCondition | CausalLaw
_Body = tuple[tuple[Condition, ...], float, float]


@dataclass(frozen=True)
class LearnedLaw:
    """A law of an action that was learned, without id, and how well it did on the trials."""

    axiom: Law
    purity: float
    support: float


class ActionLearner:
    """Learns what is missing in the knowledge of one action.

    Attributes:
        laws_: Executability conditions, then causal laws.
        problems_: What could not be learned, in words.

    Args:
        description: The domain with the laws that are in force.
        action: The name of the action.
        observed: Fluents that outcomes are compared by; effects are looked for among them, and
            among what they are defined from.
        purity: Share of the trials that a law must be true of.
        trees: Size of the ensemble.
        random_state: Seed; same trials, same laws.
    """

    def __init__(
        self,
        description: SystemDescription,
        action: str,
        observed: Collection[str],
        *,
        purity: float = 0.95,
        trees: int = 100,
        random_state: int = 0,
    ) -> None:
        self.description = description
        self.action = action
        self.observed = observed
        self.purity = purity
        self.trees = trees
        self.random_state = random_state

    def fit(self, trials: Iterable[Trial]) -> ActionLearner:
        """Learns from attempts; those at other actions are left out.

        Raises:
            LearningError: If there are none.
        """
        own = [each for each in trials if each.action == self.action]
        if not own:
            raise LearningError(f"nobody has tried {self.action!r} yet")
        self.problems_: list[str] = []
        self._search = BodySearch(purity=self.purity, trees=self.trees, seed=self.random_state)
        self._columns = action_columns(self.description, self.action)
        self._variables = variables_of_action(self.description, self.action)
        self._head = Atom(self.action, self._variables)
        self.laws_ = [*self._conditions(own), *self._causal_laws(own)]
        return self

    def _conditions(self, trials: Sequence[Trial]) -> Iterator[LearnedLaw]:
        """When the action is impossible."""
        for body, purity, support in self._bodies(trials, [each.failed for each in trials]):
            axiom = ExecutabilityCondition(id=UNNAMED, actions=(self._head,), body=body)
            yield LearnedLaw(axiom, purity, support)

    def _causal_laws(self, trials: Sequence[Trial]) -> Iterator[LearnedLaw]:
        """What comes of the action."""
        for effect in self._effects():
            open_ = [each for each in trials if each.executed and not self._before(effect, each)]
            seen = [self._after(effect, each) for each in open_]
            surprising = [
                each
                for each, was_seen in zip(open_, seen, strict=True)
                if was_seen and not self._expected(effect, each)
            ]
            if not surprising:
                continue
            opposite = self._opposite(effect)
            if opposite is not None:
                self.problems_.append(
                    f"{self.action} seems to cause {effect} at times, but {opposite.id} says: "
                    f"{opposite}"
                )
                continue
            hits = sum(seen)
            if self._search.is_enough(hits, len(open_)):
                found: Iterable[_Body] = [((), hits / len(open_), len(open_) / len(trials))]
            else:
                found = self._bodies(open_, seen)
            for body, purity, support in found:
                axiom = CausalLaw(id=UNNAMED, action=self._head, effect=effect, body=body)
                yield LearnedLaw(axiom, purity, support)

    def _bodies(self, trials: Sequence[Trial], labels: Sequence[bool]) -> Iterator[_Body]:
        """Bodies that tell when the label is true, each with its purity and support."""
        if all(labels) or not any(labels):
            return
        table = table_of(self._columns, self._variables, trials, labels)
        scenes = list(dict.fromkeys(each.scene_id for each in trials))
        bits = [bits_of(each.scene_id == scene for each in trials) for scene in scenes]
        for body, hits, held in self._search.run(table, bits):
            conditions = conditions_of(table, body, self._variables)
            yield conditions, hits / held, held / len(trials)

    def _effects(self) -> Iterator[Literal]:
        """What the action might bring about: literals of its arguments."""
        signature = self.description.signature
        sorts = dict(zip(self._variables, signature.actions[self.action].arguments, strict=True))
        names = self._basis()
        for attribute in signature.attributes_of(AttributeKind.INERTIAL):
            if attribute.name not in names:
                continue
            for arguments in permutations(self._variables, len(attribute.arguments)):
                if all(
                    signature.is_subsort(sorts[each], sort)
                    or signature.is_subsort(sort, sorts[each])
                    for each, sort in zip(arguments, attribute.arguments, strict=True)
                ):
                    atom = Atom(attribute.name, arguments)
                    yield Literal(atom)
                    yield Literal(atom, False)

    def _basis(self) -> set[str]:
        """Inertial fluents that are observed, or that observed ones are defined from."""
        names = set(self.observed)
        for axiom in self.description.axioms:
            if isinstance(axiom, StateConstraint) and axiom.head.atom.name in self.observed:
                names |= {
                    each.literal.atom.name
                    for each in axiom.body
                    if isinstance(each, Belief) and not each.negated
                }
        return names

    def _opposite(self, effect: Literal) -> CausalLaw | None:
        """A law in force by which the action causes the opposite."""
        return next(
            (
                each
                for each in self.description.axioms
                if isinstance(each, CausalLaw)
                and each.action.name == self.action
                and each.effect.atom.name == effect.atom.name
                and each.effect.positive != effect.positive
            ),
            None,
        )

    def _before(self, literal: Literal, trial: Trial) -> bool:
        return self._holds(literal, trial.state, trial)

    def _expected(self, literal: Literal, trial: Trial) -> bool:
        return self._holds(literal, SceneState(trial.state.names, trial.expected), trial)

    def _after(self, literal: Literal, trial: Trial) -> bool:
        return self._holds(literal, SceneState(trial.state.names, trial.after), trial)

    def _holds(self, literal: Literal, state: SceneState, trial: Trial) -> bool:
        return satisfied((Belief(literal),), state, binding_of(self._variables, trial))


def body_holds(law: Law, variables: Sequence[Variable], trial: Trial) -> bool:
    """Whether the body of a law held before an attempt at its action."""
    return satisfied(law.body, trial.state, binding_of(variables, trial))


def came_about(law: Law, variables: Sequence[Variable], trial: Trial) -> bool:
    """Whether what a law says, where its body holds, is what came of an attempt."""
    if isinstance(law, ExecutabilityCondition):
        return trial.failed
    after = SceneState(trial.state.names, trial.after)
    return satisfied((Belief(law.effect),), after, binding_of(variables, trial))
