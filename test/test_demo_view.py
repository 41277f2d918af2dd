"""The terminal: a live view where there is a terminal, plain lines where there is none."""

import io

import demo_samples as samples
import pytest
from rich.console import Console

from ros_scenesense.demo.record import RunRecord
from ros_scenesense.demo.summary import RunEnd, summarise
from ros_scenesense.demo.tables import final_words, scene_line, scenes_table, totals_table
from ros_scenesense.demo.view import LiveView, PlainView, make_view


def console(**options) -> Console:
    return Console(file=io.StringIO(), width=100, **options)


def printed(of: Console) -> str:
    return of.file.getvalue()


def rendered(thing) -> str:
    target = console()
    target.print(thing)
    return printed(target)


@pytest.mark.parametrize(
    ("options", "kind"),
    [
        ({}, PlainView),
        ({"force_terminal": True, "_environ": {"TERM": "dumb"}}, PlainView),
        ({"force_terminal": True, "_environ": {"TERM": "xterm"}}, LiveView),
    ],
)
def test_the_view_fits_the_terminal(options, kind):
    assert type(make_view(console(**options), RunRecord("s"), samples.INFO)) is kind


def test_plain_view_prints_each_scene_once():
    target = console()
    record = samples.run(samples.parts(0))
    view = PlainView(target, record, samples.INFO)
    view.open()
    view.event("all nodes are ready [s]")
    view.update()
    for part in samples.parts(1)[:-1]:
        record.take(part, 9)
    view.update()
    record.take(samples.lost(2), 9)
    view.update()
    record.take(samples.parts(1)[-1], 9)
    view.close()
    lines = printed(target).splitlines()
    assert lines[0] == "all nodes are ready [s]"
    starts = [line.split(":")[0] for line in lines[1:]]
    assert starts == ["scene 1/3", "scene 3/3", "scene 2/3"]
    assert "\x1b" not in printed(target)


def test_a_scene_in_words():
    (scene,) = samples.run(samples.parts(0)).settled()
    assert scene_line(scene, 20) == (
        "scene 1/20: 2 objects; stable? 1 strict (1 right, 0 wrong), 1 by default (0 right, "
        "1 wrong); occluded? 1 by the network (1 right, 0 wrong), 1 open; 5 ms"
    )


def test_a_lost_scene_in_words_and_in_the_table():
    (scene,) = samples.run([samples.lost(0)]).settled()
    assert scene_line(scene, 20) == "scene 1/20: lost, no estimate came"
    assert "lost" in rendered(scenes_table([scene]))


def test_tables_tell_right_from_wrong_without_colours():
    record = samples.run(samples.parts(0), samples.parts(1))
    (row,) = rendered(scenes_table(record.settled()[:1])).splitlines()[3:]
    assert row.split() == ["1", "2", "1✓", "1✗", "·", "·", "·", "·", "1✓", "1", "5"]
    summary = summarise(record, samples.INFO, RunEnd("complete"))
    totals = rendered(totals_table(summary.finals)).splitlines()
    stable = "object is stable 2✓ 2✗ · · 100.0 % 50.0 % 100.0 % 50.0 %"
    occluded = "object is occluded · · 2✓ 2 50.0 % 50.0 % 0.0 % 0.0 %"
    assert [" ".join(line.split()) for line in totals[3:5]] == [stable, occluded]


def test_live_view_shows_progress_nodes_and_totals():
    target = console(force_terminal=True, height=40, _environ={"TERM": "xterm"})
    record = samples.run(samples.parts(0))
    view = make_view(target, record, samples.INFO)
    view.open()
    view.event("grounding died")
    view.update()
    view.close()
    text = printed(target)
    assert "1 of 3 scenes" in text
    assert "reasoner" in text
    assert "grounding died" in text
    assert "object is occluded" in text


@pytest.mark.parametrize("height", [10, 24, 60])
def test_live_view_survives_any_size(height):
    target = Console(
        file=io.StringIO(), width=40, height=height, force_terminal=True, _environ={"TERM": "xterm"}
    )
    record = samples.run(*(samples.parts(number) for number in range(30)))
    view = make_view(target, record, samples.INFO)
    view.open()
    view.update()
    view.close()
    assert "scenes" in printed(target)


def test_final_words_name_what_was_lost():
    record = samples.run(samples.parts(0), [samples.lost(1)])
    summary = summarise(record, samples.INFO, RunEnd("complete", ready_s=2.0, scenes_s=0.5))
    assert final_words(summary).plain == (
        "1 of 3 scenes, 1 lost in 0.5 s, 2.0 per second; nodes ready after 2.0 s"
    )
