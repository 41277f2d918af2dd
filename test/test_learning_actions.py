"""Laws of actions, learned from attempts at them: when they are impossible, what comes of them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from learning_samples import DOMAIN, random_facts, state_of

from ros_scenesense.errors import LearningError
from ros_scenesense.learning.action_columns import (
    action_columns,
    binding_of,
    table_of,
    variables_of_action,
)
from ros_scenesense.learning.action_learner import ActionLearner
from ros_scenesense.learning.evaluation import satisfied
from ros_scenesense.learning.examples import SceneState
from ros_scenesense.learning.trials import Trial
from ros_scenesense.stages.law_learning import LawOrder, is_about_actions, learn_laws

OBSERVED = ("on", "in_hand")
IRREGULAR = "impossible putdown(R, A, B) if obj_surface(B, irregular)."
COVERED = "impossible pickup(R, A) if above(B, A)."


def tops(state):
    covered = {lower for upper, lower in state.by_name["on"] if lower != "table"}
    return [each for each in range(len(state.names)) if each not in covered]


@cache
def putdowns(count, seed=0, empties=True):
    """An object in the hand is put on another, or on the table; it slides off what is irregular.

    Args:
        count: How often.
        seed: Of the scenes.
        empties: Whether the robot knows that its hand is empty afterwards.
    """
    generator = np.random.default_rng(seed)
    trials = []
    for number in range(count):
        state = state_of(random_facts(generator))
        held = len(state.names)
        hand = ("in_hand", ("rob1", held))
        before = state.facts | {
            hand,
            ("held", (held,)),
            ("obj_size", (held, "medium")),
            ("obj_surface", (held, "flat")),
        }
        places = [*tops(state), "table"]
        place = places[int(generator.integers(len(places)))]
        slides = ("obj_surface", (place, "irregular")) in before
        stays = {("on", (held, place)), ("above", (held, place)), ("touching", (held, place))}
        expected = state.facts | (stays if place != "table" else {("on", (held, "table"))})
        after = state.facts | {("on", (held, "table"))} if slides else expected
        trial = Trial(
            id=f"a-{number}",
            scene_id=f"s-{number}",
            action="putdown",
            arguments=("rob1", held, place),
            state=SceneState((*state.names, "held"), before),
            executed=True,
            failed=slides,
            expected=frozenset(expected if empties else expected | {hand}),
            after=frozenset(after),
        )
        trials.append(trial)
    return tuple(trials)


def pickups(count, seed=0):
    """Any object is to be picked up; the world refuses what carries another."""
    generator = np.random.default_rng(seed)
    for number in range(count):
        state = state_of(random_facts(generator))
        target = int(generator.integers(len(state.names)))
        free = target in tops(state)
        held = frozenset({("in_hand", ("rob1", target))})
        yield Trial(
            id=f"p-{number}",
            scene_id=f"t-{number}",
            action="pickup",
            arguments=("rob1", target),
            state=state,
            executed=free,
            failed=not free,
            expected=held,
            after=held if free else state.facts,
        )


def texts(learner):
    return [str(each.axiom) for each in learner.laws_]


def without(*ids):
    return DOMAIN.without(ids)


def test_where_it_fails_an_action_becomes_impossible():
    learner = ActionLearner(DOMAIN, "putdown", OBSERVED, trees=20).fit(putdowns(60))
    assert texts(learner) == [IRREGULAR]
    (law,) = learner.laws_
    assert law.purity == 1.0
    assert 0.05 < law.support < 0.5


def test_what_the_world_refuses_becomes_impossible():
    learner = ActionLearner(without("pickup_under"), "pickup", OBSERVED, trees=20).fit(pickups(60))
    assert texts(learner) == [COVERED]


def test_few_failures_are_no_law():
    failures = [each for each in putdowns(60) if each.failed][:3]
    others = [each for each in putdowns(60) if not each.failed]
    learner = ActionLearner(DOMAIN, "putdown", OBSERVED, trees=20).fit([*others, *failures])
    assert texts(learner) == []


def test_failures_that_nothing_tells_apart_are_no_law():
    generator = np.random.default_rng(4)
    trials = [replace(each, failed=bool(generator.random() < 0.4)) for each in putdowns(60)]
    assert texts(ActionLearner(DOMAIN, "putdown", OBSERVED, trees=20).fit(trials)) == []


def test_an_effect_that_nothing_said_becomes_a_causal_law():
    learner = ActionLearner(without("putdown_empties"), "putdown", OBSERVED, trees=20)
    learner.fit(putdowns(40, empties=False))
    assert "putdown(R, A, B) causes -in_hand(R, A)." in texts(learner)


def test_an_effect_that_contradicts_a_law_in_force_is_reported_not_learned():
    trials = []
    for each in putdowns(60):
        # The hand seems to be empty before, and full afterwards.
        hand = ("in_hand", each.arguments[:2])
        state = SceneState(each.state.names, each.state.facts - {hand})
        trials.append(replace(each, state=state, after=each.after | {hand}))
    learner = ActionLearner(DOMAIN, "putdown", OBSERVED, trees=20).fit(trials)
    assert texts(learner) == [IRREGULAR]
    (problem,) = learner.problems_
    assert "putdown_empties" in problem


def test_an_action_that_nobody_tried_teaches_nothing():
    with pytest.raises(LearningError, match="nobody has tried 'putdown'"):
        ActionLearner(DOMAIN, "putdown", OBSERVED).fit(pickups(3))


def test_of_two_versions_the_more_general_one_that_tells_as_well_is_kept():
    special = "impossible putdown(R, A, B) if obj_surface(B, irregular), on(B, table)."
    order = LawOrder(
        description=DOMAIN,
        learned={"learned_1": special},
        pinned=frozenset(),
        vetoed=(),
        trials=putdowns(60),
        purity=0.95,
        trees=20,
        seed=0,
    )
    report = learn_laws(order)
    assert [(str(law.axiom), known) for law, known in report.found] == [(IRREGULAR, None)]
    assert report.lost == (("learned_1", IRREGULAR),)
    pinned = learn_laws(replace(order, pinned=frozenset({"learned_1"})))
    assert pinned.lost == ()
    again = learn_laws(replace(order, learned={"learned_4": IRREGULAR}))
    assert [known for _, known in again.found] == ["learned_4"]
    vetoed = learn_laws(replace(order, vetoed=[IRREGULAR], learned={}))
    assert vetoed.found == ()


@pytest.mark.parametrize(
    ("text", "about"),
    [
        (IRREGULAR, True),
        ("putdown(R, A, B) causes -in_hand(R, A).", True),
        ("stable(A) if not above(A, B).", False),
    ],
)
def test_laws_of_actions_are_told_from_axioms_about_states(text, about):
    assert is_about_actions(text) == about


def test_a_table_tells_what_the_conditions_of_its_columns_say():
    columns = action_columns(DOMAIN, "putdown")
    variables = variables_of_action(DOMAIN, "putdown")
    assert [each.name for each in variables] == ["R", "A", "B"]
    trials = putdowns(60)[:20]
    table = table_of(columns, variables, trials, [each.failed for each in trials])
    assert len(table.columns) > 10
    for column, bits in zip(table.columns, table.bits, strict=True):
        for number, each in enumerate(trials):
            binding = binding_of(variables, each)
            assert satisfied(column.if_true, each.state, binding) == bool(bits >> number & 1)
