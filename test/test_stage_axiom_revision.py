"""What the axiom learner makes of experience with axioms: refuted, restored, used rightly."""

import itertools
from collections import Counter
from dataclasses import replace

from axiom_learner_samples import O1, chain, learner, order
from learning_samples import DOMAIN, examples, scenes

from ros_scenesense.messages.reasoning import Beliefs, Verdicts
from ros_scenesense.stages.axiom_keeper import changes_of_cycle
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.learner_store import LearnerStore
from ros_scenesense.stages.learning_engine import (
    Found,
    LearningEngine,
    LearningReport,
)
from ros_scenesense.stages.state_file import IN_MEMORY


def relabelled(task, label, recent=None):
    """A task whose examples have other labels; of recent scenes alone if they are named."""

    def of(items):
        return [
            replace(each, label=label(each)) if recent is None or each.scene_id in recent else each
            for each in items
        ]

    return replace(
        task, examples=of(task.examples), judging=of(task.judging), recent=frozenset(recent or ())
    )


def is_behind(example):
    return any(args[0] == example.target for args in example.state.by_name.get("behind", ()))


AND_ABOVE = next(each for each in DOMAIN.axioms if each.id == "o2").body[1:]
WRONG = "occluded(A) if not behind(A, B)."


def test_a_learned_axiom_that_labels_refute_is_dropped_unless_it_is_pinned():
    learned_before = {"learned_1": WRONG, "learned_2": O1}
    report = LearningEngine().learn(order(learned=learned_before))
    assert set(report.refuted) == {"learned_1"}
    assert report.changed == []
    pinned = replace(order(learned=learned_before), pinned=frozenset({"learned_1"}))
    assert LearningEngine().learn(pinned).refuted == {}
    store = LearnerStore(IN_MEMORY, Health(), 10)
    found = [Found(WRONG, "normal", 1.0, 0.5, None), Found(O1, "normal", 1.0, 0.5, None)]
    store.finish_cycle(changes_of_cycle(LearningReport(found), store, ()), ())
    store.finish_cycle(changes_of_cycle(report, store, ()), ())
    active = {each.text for each in store.axioms("active")}
    assert O1 in active
    assert WRONG not in active
    # It was learned: nobody has to hear that something given is out of force.
    assert store.refuted() == {}
    *_, last_event = store.history("learned_1")
    assert last_event.what == "refuted"
    assert last_event.words.startswith("true of 0 of ")
    store.close()


def test_where_the_world_has_changed_older_scenes_teach_nothing():
    (task,) = order().tasks
    ids = list(dict.fromkeys(each.scene_id for each in task.examples))
    # In the newest scenes what is behind nothing is occluded, and nothing else.
    changed = relabelled(task, lambda each: not is_behind(each), ids[20:])
    known = replace(order(learned={"learned_1": O1}), tasks=(changed,))
    report = LearningEngine().learn(known)
    assert "learned_1" in report.refuted
    assert "though it was true before" in report.refuted["learned_1"]
    assert report.changed == ["occluded"]
    assert WRONG in {each.text for each in report.found}
    # Without a word about which scenes are new, nothing so clear comes of the mixture.
    mixed = LearningEngine().learn(replace(known, tasks=(replace(changed, recent=frozenset()),)))
    assert mixed.changed == []
    assert WRONG not in {each.text for each in mixed.found}


def test_labels_of_before_a_change_are_left_aside_for_good():
    found = examples("occluded", 4)
    states = {each.scene_id: each.state for each in found}
    store = LearnerStore(IN_MEMORY, Health(), 10)
    for name, state in states.items():
        literals = [(fluent, 0, False, "undecided") for fluent in ("occluded", "stable")]
        assert store.add_scene(name, state, literals, ())
    report = LearningReport(changed=["occluded"])
    store.finish_cycle(changes_of_cycle(report, store, ()), [3, 4])
    left = {fluent: store.examples(fluent, store.scenes()) for fluent in ("occluded", "stable")}
    assert {fluent: len(several) for fluent, several in left.items()} == {
        "occluded": 2,
        "stable": 4,
    }
    assert {each.scene_id for each in left["occluded"]} == set(list(states)[2:])
    store.close()


def given_o1():
    (axiom,) = [each for each in DOMAIN.axioms if each.id == "o1"]
    return axiom


def test_a_given_axiom_comes_back_when_experience_supports_it_again():
    report = LearningEngine().learn(
        replace(order(learned={"learned_1": O1}), suspended=[given_o1()])
    )
    assert set(report.restored) == {"o1"}
    # What was learned in its stead is not needed any more.
    assert [(each.axiom, "o1" in each.words) for each in report.lost] == [("learned_1", True)]
    assert O1 not in {each.text for each in report.found}
    store = LearnerStore(IN_MEMORY, Health(), 10)
    refutation = LearningReport(refuted={"o1": "true of 2 of 20 labelled objects only"})
    store.finish_cycle(changes_of_cycle(refutation, store, {"o1"}), ())
    assert set(store.refuted()) == {"o1"}
    store.finish_cycle(changes_of_cycle(report, store, {"o1"}), ())
    assert store.refuted() == {}
    assert [each.what for each in store.history("o1")] == ["refuted", "restored"]
    store.close()


def test_a_given_axiom_stays_out_of_force_while_experience_denies_it_or_says_more():
    (task,) = order().tasks
    denied = replace(
        order(), suspended=[given_o1()], tasks=(relabelled(task, lambda each: not is_behind(each)),)
    )
    assert LearningEngine().learn(denied).restored == {}
    narrow = replace(given_o1(), body=(*given_o1().body, *AND_ABOVE), id="narrow")
    wider = replace(order(learned={"learned_1": O1}), suspended=[narrow])
    assert LearningEngine().learn(wider).restored == {}


def test_a_cycle_tells_what_it_refuted_and_restored():
    stage = learner(cycle_scenes=0)
    chain(stage, scenes(20))
    stage.learn(1)
    (job,) = stage.jobs()
    report = LearningReport(
        refuted={"large_on_small": "true of 1 of 9 labelled objects only"}, changed=["stable"]
    )
    progress, axioms, _ = stage.finish(job, report, 2)
    assert "large_on_small refuted: true of 1 of 9" in progress.text
    assert "the world has changed: what 'stable' follows from is learned anew" in progress.text
    assert axioms.refuted == ["large_on_small"]
    stage.learn(3)
    (job,) = stage.jobs()
    (order_given,) = job.arguments
    assert [each.id for each in order_given.suspended] == ["large_on_small"]
    report = LearningReport(restored={"large_on_small": "true of 30 of 30 labelled objects"})
    progress, axioms, _ = stage.finish(job, report, 4)
    assert "large_on_small restored" in progress.text
    assert axioms.refuted == []
    stage.close()


def test_the_newest_scenes_are_told_from_those_of_earlier_cycles():
    stage = learner(cycle_scenes=0)
    chain(stage, scenes(12))
    stage.learn(1)
    (job,) = stage.jobs()
    stage.finish(job, LearningReport(), 2)
    chain(stage, scenes(5, seed=8, first=50))
    stage.learn(3)
    (job,) = stage.jobs()
    (given_order,) = job.arguments
    for task in given_order.tasks:
        assert task.recent == {f"s-{number}" for number in range(50, 55)}
    stage.close()


def test_right_use_counts_only_where_nobody_else_decides_the_same():
    published = chain(learner(cycle_scenes=0), scenes(15), withheld="")
    verdicts = {each.scene_id: each for each in published if isinstance(each, Verdicts)}
    kinds = {name: learner(cycle_scenes=0, reinforce=name) for name in ("used", "used_right")}
    shared = 0
    for beliefs in (each for each in published if isinstance(each, Beliefs)):
        judged = {
            (one.subject[0], str(one.task))
            for one in verdicts[beliefs.scene_id].verdicts
            if one.kind == "object" and one.verdict in ("right", "wrong")
        }
        deciding = [
            belief.axioms
            for one in beliefs.objects
            for task, belief in (("stability", one.stable), ("occlusion", one.occluded))
            if (one.name, task) in judged
        ]
        used = {k: stage._used(beliefs, verdicts[beliefs.scene_id]) for k, stage in kinds.items()}
        alone = Counter(axioms[0] for axioms in deciding if len(axioms) == 1)
        assert Counter(name for name, _ in used["used_right"]) == alone
        assert Counter(name for name, _ in used["used"]) == Counter(itertools.chain(*deciding))
        assert all(right for _, right in used["used"])
        shared += sum(len(axioms) > 1 for axioms in deciding)
    assert shared > 0
