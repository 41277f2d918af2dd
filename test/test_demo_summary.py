"""What the demo saw, joined per scene, and the figures it makes of it."""

import dataclasses
import random

import demo_samples as samples
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ros_scenesense.demo.finals import FinalSummary, summarise_final
from ros_scenesense.demo.learning_curve import AxiomSummary, CycleSummary, LearningSummary
from ros_scenesense.demo.record import Decision, RunRecord, Subject
from ros_scenesense.demo.summary import (
    RunEnd,
    Summary,
    TaskSummary,
    read_summary,
    summarise,
    summarise_latency,
    summarise_task,
    write_summary,
)
from ros_scenesense.messages.reasoning import Belief
from ros_scenesense.resources import resource
from ros_scenesense.scene import DecisionStatus, Truth

DONE = RunEnd("complete", ready_s=2.5, scenes_s=4.0)


def test_a_scene_is_complete_when_every_part_came_in_any_order():
    parts = samples.parts(0)
    for seed in range(20):
        random.Random(seed).shuffle(parts)
        record = RunRecord(samples.SESSION)
        for item in parts[:-1]:
            record.take(item, 10)
        assert not record.has_all(1)
        record.take(parts[-1], 10)
        assert record.has_all(1)
        assert not record.has_all(2)
        (scene,) = record.in_order()
        assert record.image(scene, color=True).pixels.shape == (24, 32, 3)
        assert record.image(scene, color=False).pixels.max() == 2


def test_the_first_message_wins_and_a_second_showing_changes_nothing():
    record = samples.run(samples.parts(0))
    before = summarise(record, samples.INFO, DONE)
    changed = samples.parts(0, stable=[samples.UNDECIDED] * 2)
    for item in changed:
        record.take(item, 99)
    assert summarise(record, samples.INFO, DONE) == before


def test_a_scene_shown_again_under_a_new_stamp_keeps_its_image():
    record = RunRecord(samples.SESSION)
    scene, image = samples.parts(0)[:2]
    record.take(scene, 0)
    record.take(msgspec.structs.replace(scene, stamp=samples.Stamp.of(77)), 1)
    record.take(dataclasses.replace(image, stamp_ns=77), 1)
    assert record.image(record.in_order()[0], color=True).stamp_ns == 77


def test_scenes_of_others_are_counted_and_ignored():
    record = samples.run(samples.parts(0))
    foreign = msgspec.structs.replace(samples.lost(0), scene_id="other-0001")
    nameless = msgspec.structs.replace(samples.lost(0), scene_id="noise")
    record.take(foreign, 0)
    record.take(nameless, 0)
    assert record.foreign == 2
    assert len(record.scenes) == 1


def test_a_lost_scene_is_settled_but_not_counted_as_a_scene():
    record = samples.run(samples.parts(0), [samples.lost(1)])
    summary = summarise(record, samples.INFO, DONE)
    assert (summary.scenes, summary.lost) == (1, 1)
    assert record.has_all(2)


def test_estimates_that_come_after_all_count_more_than_lost():
    record = samples.run([samples.lost(0)], samples.parts(0))
    summary = summarise(record, samples.INFO, DONE)
    assert (summary.scenes, summary.lost) == (1, 0)


def test_a_restarted_node_is_told_by_its_process():
    record = RunRecord(samples.SESSION)
    for process_id in (7, 7, 8):
        record.take(samples.heartbeat(process_id, problems=process_id), 0)
    node = summarise(record, samples.INFO, DONE).nodes["reasoner"]
    assert (node.processes, node.counters) == (2, {"problems": 8})


def test_figures_of_a_run():
    summary = summarise(samples.run(samples.parts(0), samples.parts(1)), samples.INFO, DONE)
    stability = summary.tasks["stability"]
    assert (stability.strict, stability.right, stability.wrong) == (2, 2, 0)
    assert (stability.by_default, stability.default_wrong) == (2, 2)
    assert stability.strict_accuracy == 1.0
    assert summary.tasks["occlusion"].undecided == 4
    assert summary.tasks["occlusion"].strict_accuracy is None
    assert summary.tasks["structure_stability"] == summary.tasks["stack_stability"]
    assert summary.scenes_per_s == 0.5
    assert summary.end_to_end.p50_ms == 5.0
    assert summary.latency["reasoner/classify"].p95_ms == 1.5
    assert summary.knowledge.axioms == ["s1", "s2", "s3"]


def test_figures_of_the_final_decisions():
    summary = summarise(samples.run(samples.parts(0), samples.parts(1)), samples.INFO, DONE)
    stability, occlusion = summary.finals["stability"], summary.finals["occlusion"]
    counts = {name: (each.right, each.wrong) for name, each in stability.by_source.items()}
    assert counts == {"reasoning": (2, 0), "default": (0, 2), "network": (0, 0)}
    assert (stability.decided_share, stability.accuracy) == (1.0, 0.5)
    assert (stability.reasoning_decided_share, stability.reasoning_accuracy) == (1.0, 0.5)
    assert occlusion.by_source["network"].right == 2
    assert (occlusion.undecided, occlusion.decided_share, occlusion.accuracy) == (2, 0.5, 1.0)
    assert (occlusion.reasoning_decided_share, occlusion.reasoning_accuracy) == (0.0, None)
    assert (occlusion.right_share, occlusion.reasoning_right_share) == (0.5, 0.0)
    stack = summary.finals["stack_stability"]
    assert stack.by_source["default"].wrong == stack.total == 2


def test_without_estimates_nobody_decided_in_the_end():
    record = samples.run(samples.parts(0)[:-1], [samples.lost(0)])
    (scene,) = record.in_order()
    assert {decision.estimate.source for decision in scene.decisions()} == {"none"}
    assert {decision.final_right for decision in scene.decisions()} == {None}


def test_an_ambiguous_label_leaves_decisions_unjudged():
    record = samples.run(samples.parts(0, label=Truth.AMBIGUOUS))
    stability = summarise(record, samples.INFO, DONE).tasks["stability"]
    assert (stability.unjudged, stability.default_unjudged) == (1, 1)
    assert stability.right + stability.wrong + stability.default_right == 0
    final = summarise(record, samples.INFO, DONE).finals["stability"]
    assert (final.judged, final.accuracy, final.decided_share) == (0, None, 1.0)


def test_nothing_seen_still_gives_a_summary(tmp_path):
    end = RunEnd("failed", error="the grounding node cannot start")
    summary = summarise(RunRecord(samples.SESSION), samples.INFO, end)
    write_summary(summary, tmp_path / "summary.json")
    assert read_summary(tmp_path / "summary.json") == summary
    assert summary.scenes == 0
    assert summary.end_to_end is None


def test_summary_json_follows_its_schema_and_leaves_no_other_file(tmp_path):
    summary = summarise(samples.run(samples.parts(0)), samples.INFO, DONE)
    write_summary(summary, tmp_path / "summary.json")
    assert read_summary(tmp_path / "summary.json") == summary
    assert [path.name for path in tmp_path.iterdir()] == ["summary.json"]
    content = msgspec.json.decode((tmp_path / "summary.json").read_bytes())
    content["extra"] = 1
    (tmp_path / "summary.json").write_bytes(msgspec.json.encode(content))
    with pytest.raises(msgspec.ValidationError, match="extra"):
        read_summary(tmp_path / "summary.json")


@pytest.mark.parametrize(
    "struct",
    [Summary, FinalSummary, TaskSummary, LearningSummary, CycleSummary, AxiomSummary],
)
def test_every_field_is_documented(struct):
    documented = (resource("config").parent / "docs" / "summary.md").read_text(encoding="utf-8")
    missing = [name for name in struct.__struct_fields__ if f"`{name}`" not in documented]
    assert not missing


DECISIONS = st.lists(
    st.builds(
        Decision,
        subject=st.sampled_from(Subject),
        names=st.just(("a",)),
        belief=st.builds(Belief, status=st.sampled_from(DecisionStatus)),
        label=st.none(),
        right=st.sampled_from([True, False, None]),
        estimate=st.sampled_from(
            [samples.NOBODY, samples.NETWORK_VISIBLE, samples.estimate(samples.STRICT_STABLE)]
        ),
        final_right=st.sampled_from([True, False, None]),
    )
)


@given(DECISIONS)
def test_counts_add_up_and_shares_are_shares(decisions):
    task = summarise_task(decisions)
    assert task.total == len(decisions)
    assert task.strict == task.right + task.wrong + task.unjudged
    assert task.by_default == task.default_right + task.default_wrong + task.default_unjudged
    final = summarise_final(decisions)
    assert final.total == len(decisions)
    shares = (task.strict_accuracy, task.default_accuracy, task.strict_share, task.decided_share)
    shares += (final.accuracy, final.decided_share, final.reasoning_decided_share)
    assert all(share is None or 0.0 <= share <= 1.0 for share in shares)


@given(st.lists(st.floats(0.0, 1e6), min_size=1))
def test_percentiles_lie_between_the_extremes(milliseconds):
    latency = summarise_latency(milliseconds)
    assert min(milliseconds) - 1e-3 <= latency.p50_ms <= latency.p95_ms
    assert latency.p95_ms <= max(milliseconds) + 1e-3
