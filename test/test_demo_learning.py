"""What a run that learns shows: shares per cycle, axioms with their strengths. No ROS."""

import demo_samples as samples
import pytest
from test_demo_view import console, printed, rendered

from ros_scenesense.demo import run as run_module
from ros_scenesense.demo.learning_curve import summarise_learning
from ros_scenesense.demo.report import render
from ros_scenesense.demo.run import Demo, DemoOptions
from ros_scenesense.demo.summary import RunEnd, read_summary, summarise, write_summary
from ros_scenesense.demo.tables import axioms_table, learning_table
from ros_scenesense.demo.view import make_view
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.learning import Axioms, LearnedAxiom
from ros_scenesense.parameters import build

DONE = RunEnd("complete", ready_s=2.5, scenes_s=4.0)
NOTHING = [samples.UNDECIDED] * 2


def axioms(cycle, **strengths):
    learned = [
        LearnedAxiom(
            id=id,
            text=f"<i>{id}</i>(A) if not above(A, B).",
            kind="normal",
            strength=strength,
            support=0.5,
            purity=1.0,
            age=0,
        )
        for id, strength in strengths.items()
    ]
    return Axioms(stamp=Stamp.of(9), revision=cycle, cycle=cycle, axioms=learned)


@pytest.fixture
def record():
    """Two scenes of which nothing is decided, a cycle, one of which much is, a cycle."""
    record = samples.run(samples.parts(0, stable=NOTHING), samples.parts(1, stable=NOTHING))
    record.take(axioms(0), 0)
    record.take(axioms(1, one=1.0, two=1.0), 0)
    for item in samples.parts(2):
        record.take(item, 10**9)
    record.take(axioms(1, one=1.0), 0)
    record.take(axioms(2, one=1.0, two=0.36788), 0)
    return record


def test_what_reasoning_decides_is_counted_per_cycle(record):
    learning = summarise_learning(record)
    assert [(e.cycle, e.scenes, e.axioms) for e in learning.cycles] == [
        (0, 2, 0),
        (1, 1, 2),
        (2, 0, 2),
    ]
    before, after, last = learning.cycles
    assert (before.decided_share, before.right_share, before.accuracy) == (0.0, 0.0, None)
    # Of two objects both are judged stable or not, one of them wrongly, and none as occluded.
    assert (after.decided_share, after.stability_share, after.occlusion_share) == (0.5, 1.0, 0.0)
    assert (after.right_share, after.accuracy) == (0.25, 0.5)
    assert last.decided_share is None


def test_strengths_are_told_for_the_cycles_in_which_an_axiom_was_in_force(record):
    one, two = summarise_learning(record).axioms
    assert one.strengths == {1: 1.0, 2: 1.0}
    assert two.strengths == {1: 1.0, 2: 0.3679}


def test_without_a_cycle_there_is_nothing_to_tell():
    assert summarise_learning(samples.run(samples.parts(0))) is None
    assert "What was learned" not in render(*_summarised(samples.run(samples.parts(0))))


def _summarised(record):
    return record, summarise(record, samples.INFO, DONE)


def test_the_figures_come_back_from_the_file(record, tmp_path):
    _, summary = _summarised(record)
    write_summary(summary, tmp_path / "summary.json")
    assert read_summary(tmp_path / "summary.json") == summary


def test_the_report_shows_cycles_and_strengths_and_escapes_axioms(record):
    page = render(*_summarised(record))
    assert "What was learned" in page
    assert "<i>one</i>" not in page
    assert "&lt;i&gt;one&lt;/i&gt;" in page
    assert "after 1" in page
    assert 'style="--strength: 37%">0.37<' in page


def test_the_tables_show_them_too(record):
    learning = summarise_learning(record)
    text = rendered(learning_table(learning))
    assert [line.split()[:2] for line in text.splitlines()[-2:]] == [
        ["before", "2"],
        ["after", "1"],
    ]
    assert "50.0 %" in text
    assert "0.37" in rendered(axioms_table(learning))


@pytest.mark.parametrize("options", [{}, {"force_terminal": True, "_environ": {"TERM": "xterm"}}])
def test_a_cycle_is_told_while_the_run_goes_on(record, options):
    target = console(height=60, **options)
    view = make_view(target, record, samples.INFO)
    view.open()
    view.update()
    view.close()
    expected = "after 1" if options else "learning cycle 2: nothing new"
    assert expected in printed(target)


def test_a_run_that_learns_starts_without_the_axioms_and_the_user_is_stronger(
    tmp_path, monkeypatch
):
    asked = []
    monkeypatch.setattr(run_module, "Graph", lambda options, **_: asked.append(options))
    overrides = {"attention": {"network": "lenet"}, "simulated_camera": {"width": "160"}}
    options = DemoOptions(out=str(tmp_path), domain_id=7, learn=True, overrides=overrides)
    Demo(options, console())
    (graph,) = asked
    assert graph.overrides["reasoner"] == {"withheld": "s1,s2,s3,o1,o2,o3"}
    assert graph.overrides["attention"] == {"network": "lenet"}
    camera = graph.overrides["simulated_camera"]
    assert (camera["mode"], camera["width"]) == ("training", "160")
    assert "--learn" in options.command
    Demo(build(DemoOptions, {"out": str(tmp_path), "domain_id": 7}), console())
    assert "reasoner" not in asked[1].overrides
