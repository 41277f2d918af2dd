"""The part of a learning cycle that is about actions: induce laws, keep of versions the best."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.action_language import parse
from ros_scenesense.knowledge.axioms import CausalLaw, ExecutabilityCondition
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.literals import Condition, variables_of
from ros_scenesense.learning.action_columns import variables_of_action
from ros_scenesense.learning.action_learner import (
    ActionLearner,
    Law,
    LearnedLaw,
    body_holds,
    came_about,
)
from ros_scenesense.learning.trials import Trial
from ros_scenesense.reasoning.selection import Version, select
from ros_scenesense.stages.outcomes import OBSERVED


@dataclass(frozen=True)
class LawOrder:
    """All that is needed to learn about actions.

    Attributes:
        description: The domain with the laws that are in force.
        learned: Learned laws in force: statement by id.
        pinned: Ids of those that people want to stay.
        vetoed: Statements that people do not want.
        trials: Attempts at actions.
        purity: Share of trials that a law must be true of.
        trees: Size of the ensemble.
        seed: Of everything random.
    """

    description: SystemDescription
    learned: Mapping[str, str]
    pinned: frozenset[str]
    vetoed: Sequence[str]
    trials: Sequence[Trial]
    purity: float
    trees: int
    seed: int


@dataclass(frozen=True)
class LawReport:
    """What was found.

    Attributes:
        found: Laws that are kept, each with the id of the learned one that says the same, if any.
        lost: Versions that are not, with the one kept instead: ids, or statements of new ones.
        problems: What could not be learned.
    """

    found: tuple[tuple[LearnedLaw, str | None], ...]
    lost: tuple[tuple[str, str], ...]
    problems: tuple[str, ...]


def is_about_actions(statement: str) -> bool:
    """Whether a learned axiom, in the action language, is a law of an action."""
    return statement.startswith("impossible ") or " causes " in statement


def learn_laws(order: LawOrder) -> LawReport:
    """Learns what is missing in the knowledge of every action that was tried.

    Raises:
        ReasoningError: If the solver fails.
        LanguageError: If a statement is broken.
    """
    found: list[tuple[LearnedLaw, str | None]] = []
    lost: list[tuple[str, str]] = []
    problems: list[str] = []
    known = {name: _read(text, name, order.description) for name, text in order.learned.items()}
    for action in sorted({each.action for each in order.trials}):
        learner = ActionLearner(
            order.description,
            action,
            OBSERVED,
            purity=order.purity,
            trees=order.trees,
            random_state=order.seed,
        ).fit(order.trials)
        problems += learner.problems_
        own = {name: law for name, law in known.items() if _action(law) == action}
        induced = [each for each in learner.laws_ if str(each.axiom) not in order.vetoed]
        same = {str(law): name for name, law in own.items()}
        fresh = {
            f"new_{number}": each.axiom
            for number, each in enumerate(induced)
            if str(each.axiom) not in same
        }
        instead = _dropped({**own, **fresh}, order, action)
        words = {**{name: name for name in own}, **{name: str(law) for name, law in fresh.items()}}
        lost += [(words[name], words[better]) for name, better in instead.items()]
        gone = {str({**own, **fresh}[name]) for name in instead}
        found += [
            (each, same.get(str(each.axiom))) for each in induced if str(each.axiom) not in gone
        ]
    return LawReport(tuple(found), tuple(lost), tuple(problems))


def _dropped(laws: Mapping[str, Law], order: LawOrder, action: str) -> dict[str, str]:
    """Of versions of one law those that are not kept, each with the one that is."""
    variables = variables_of_action(order.description, action)
    trials = [each for each in order.trials if each.action == action]
    free = [replace(law, id=name) for name, law in laws.items() if name not in order.pinned]
    instead: dict[str, str] = {}
    for group in _grouped(free):
        versions = [
            Version(
                law.id,
                value=True,
                strict=True,
                length=len(law.body),
                fires=frozenset(
                    number for number, each in enumerate(trials) if body_holds(law, variables, each)
                ),
            )
            for law in group
        ]
        labels = [came_about(group[0], variables, each) for each in trials]
        selected = select([versions], [], labels)
        instead |= {each.id: each.instead for each in selected.dropped if each.instead}
    return instead


def _grouped(laws: Sequence[Law]) -> list[list[Law]]:
    """Groups of two or more laws of which one is the most general: it has the fewest conditions."""
    said = {law.id: (_head(law), frozenset(_plain(each, law) for each in law.body)) for law in laws}

    def generalises(one: Law, other: Law) -> bool:
        (head, body), (other_head, other_body) = said[one.id], said[other.id]
        return head == other_head and body < other_body

    general = [law for law in laws if not any(generalises(other, law) for other in laws)]
    # A special case of several belongs to the first.
    homes: dict[str, list[Law]] = {law.id: [law] for law in general}
    for law in laws:
        home = next((each for each in general if generalises(each, law)), None)
        if home is not None:
            homes[home.id].append(law)
    return [group for group in homes.values() if len(group) > 1]


def _head(law: Law) -> str:
    effect = law.effect if isinstance(law, CausalLaw) else "impossible"
    return f"{_action(law)} {effect}"


def _action(law: Law) -> str:
    return law.action.name if isinstance(law, CausalLaw) else law.actions[0].name


def _plain(condition: Condition, law: Law) -> str:
    """A condition, whatever its local variables are called."""
    atom = law.action if isinstance(law, CausalLaw) else law.actions[0]
    own = set(variables_of(atom))
    words = str(condition)
    for variable in variables_of(condition):
        if variable not in own:
            words = re.sub(rf"\b{variable.name}\b", "_", words)
    return words


def _read(text: str, name: str, description: SystemDescription) -> Law:
    axiom = parse(f"{name}: {text}", f"axiom {name}", description).description.axioms[-1]
    if not isinstance(axiom, CausalLaw | ExecutabilityCondition):
        raise LanguageError(f"axiom {name}: {text} is no law of an action")
    return axiom
