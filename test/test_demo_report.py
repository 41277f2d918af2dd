"""The report: self-contained, complete, and safe whatever objects are called."""

import re
from html.parser import HTMLParser

import demo_samples as samples
import msgspec
import numpy as np
import pytest

from ros_scenesense.demo import report as report_module
from ros_scenesense.demo.annotation import Note, Rectangle, annotate
from ros_scenesense.demo.overlay import outline, place_tags
from ros_scenesense.demo.report import render, write_report
from ros_scenesense.demo.summary import RunEnd, summarise
from ros_scenesense.messages.attention import Estimate

VOID = {"meta", "br", "image", "path", "rect", "wbr"}


def page(record, end=None):
    return render(record, summarise(record, samples.INFO, end or RunEnd("complete")))


class Tree(HTMLParser):
    """Checks that elements are closed in order, and collects texts and references."""

    def __init__(self):
        super().__init__()
        self.open, self.texts, self.references, self.ids = [], [], [], set()

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            if name in ("href", "src", "srcset", "data"):
                self.references.append(value)
            if name == "id":
                self.ids.add(value)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data.strip())


def parse(text):
    tree = Tree()
    tree.feed(text)
    tree.close()
    assert tree.open == []
    return tree


def test_shows_every_scene_with_names_decisions_and_verdicts():
    text = page(samples.run(samples.parts(0), samples.parts(1), [samples.lost(2)]))
    tree = parse(text)
    assert {"scene-1", "scene-2", "scene-3", "axiom-s1"} <= tree.ids
    assert tree.texts.count("red_cube") >= 4
    assert "above" in tree.texts
    assert "✓ physics agrees" in text
    assert "✗ physics: stable" in text
    assert "lost: no estimate came" in tree.texts
    assert "not located: too little of it is visible" in tree.texts


def test_decisions_are_explained_in_short_where_they_are():
    assert '<span class="why">small_base(&lt;b&gt;)</span>' in page(samples.run(samples.parts(0)))


def test_who_decided_is_told_of_every_decision():
    text = page(samples.run(samples.parts(0)))
    tree = parse(text)
    assert tree.texts.count("network 87%") == 1
    assert '<span class="word no">not occluded</span> <span class="badge network">' in text
    assert '<span class="word open">—</span> <span class="badge undecided">' in text
    assert text.count('<span class="badge strict">strict</span></span>') == 1
    assert "Who decided" in tree.texts


def test_a_network_that_contradicts_says_what_reasoning_said():
    parts = samples.parts(0)
    estimates = parts[-1]
    first = msgspec.structs.replace(
        estimates.objects[1], stable=Estimate(value=True, source="network", probability=0.998)
    )
    objects = [estimates.objects[0], first]
    text = page(samples.run([*parts[:-1], msgspec.structs.replace(estimates, objects=objects)]))
    assert "network &gt;99%" in text
    assert "reasoning: unstable by default" in text
    assert "✓ physics agrees" in text


def test_regions_of_interest_are_drawn_with_their_reason():
    text = page(samples.run(samples.parts(0)))
    assert '<rect class="region occlusion" x="12" y="6" width="6" height="12">' in text
    assert "<title>occlusion of red_cube, duck; relations behind; axioms o1</title>" in text


def test_needs_no_other_file_and_no_network():
    tree = parse(page(samples.run(samples.parts(0))))
    outside = [r for r in tree.references if not r.startswith(("#", "data:image/png;base64,"))]
    assert outside == []
    images = [r for r in tree.references if r.startswith("data:")]
    assert len(images) == 1


def test_links_lead_somewhere():
    tree = parse(page(samples.run(samples.parts(0, stable=[samples.STRICT_STABLE] * 2))))
    targets = {r[1:] for r in tree.references if r.startswith("#")}
    assert targets
    assert targets <= tree.ids


def test_names_from_outside_stay_text():
    evil = '<script>alert("x")</script>'
    record = samples.run(samples.parts(0, names=(evil, "'\"><img src=x>")))
    record.knowledge = samples.knowledge(text="a <b> & c")
    text = page(record, RunEnd("failed", error="<i>broken</i>"))
    tree = parse(text)
    assert "<script" not in text
    assert "<img" not in text
    assert "<i>broken" not in text
    assert evil in tree.texts


def test_a_run_without_anything_says_so():
    text = page(samples.run(), RunEnd("timed_out", error="no scene came within 60 s"))
    assert "no scene came within 60 s" in text
    parse(text)


def test_parts_that_did_not_come_leave_gaps_not_errors():
    parts = samples.parts(0)
    for left_out in range(1, len(parts) - 1):
        record = samples.run([part for i, part in enumerate(parts) if i != left_out])
        assert "scene-1" in parse(page(record)).ids


def test_long_runs_are_cut_and_say_so(monkeypatch):
    monkeypatch.setattr(report_module, "MAX_FRAMES", 2)
    text = page(samples.run(*(samples.parts(number) for number in range(5))))
    assert "3 more scenes" in text
    assert "scene-3" not in parse(text).ids


def test_write_report_writes_one_file(tmp_path):
    record = samples.run(samples.parts(0))
    summary = summarise(record, samples.INFO, RunEnd("complete"))
    write_report(record, summary, tmp_path / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_an_outline_runs_around_the_object():
    instances = np.zeros((20, 30), np.uint16)
    instances[5:10, 8:20] = 3
    found = outline(instances, 3)
    assert (found.left, found.top, found.right, found.bottom) == pytest.approx(
        (8, 5, 20, 10), abs=0.2
    )
    numbers = [float(n) for n in re.findall(r"[\d.]+", found.path)]
    assert max(numbers) == pytest.approx(20, abs=0.2)
    assert outline(instances, 4) is None


@pytest.mark.parametrize("seed", range(5))
def test_names_do_not_cover_each_other(seed):
    random = np.random.default_rng(seed)
    instances = np.zeros((240, 320), np.uint16)
    for instance in range(1, 6):
        left, top = int(random.integers(60, 240)), int(random.integers(60, 170))
        instances[top : top + 30, left : left + 30] = instance
    outlines = {
        f"object_{i}": found for i in range(1, 6) if (found := outline(instances, i)) is not None
    }
    tags = place_tags(outlines, instances)
    for name, tag in tags.items():
        assert tag.left >= 0.0
        assert tag.left + tag.width <= 320.0
        assert tag.top >= 0.0
        assert tag.top + tag.height <= 240.0
        assert all(tag.overlap(other) < 8.0 for key, other in tags.items() if key != name)


def test_in_a_crowd_a_name_stands_on_its_own_object():
    instances = np.repeat(np.repeat(np.arange(1, 10).reshape(3, 3), 60, 0), 90, 1)
    instances = np.pad(instances, 40).astype(np.uint16)
    outlines = {f"object_{i}": outline(instances, i) for i in range(1, 10)}
    tag = place_tags(outlines, instances)["object_5"]
    assert tag.left >= 130
    assert tag.left + tag.width <= 220
    assert tag.top >= 100
    assert tag.top + tag.height <= 160


def test_rectangles_are_drawn_below_the_words():
    color = np.full((240, 320, 3), 90, np.uint8)
    instances = np.zeros((240, 320), np.uint16)
    instances[100:140, 140:180] = 1
    note, orange = Note(1, "red_cube, stable 94%, visible", (0, 130, 0)), (255, 140, 0)
    around = Rectangle(130, 60, 60, 120, orange)
    plain, framed = annotate(color, instances, [note]), annotate(color, instances, [note], [around])
    assert (framed[300, 390] == orange).all()
    words = (plain == 255).all(axis=-1) | (plain == (0, 130, 0)).all(axis=-1)
    assert words.sum() > 5000
    assert (framed[words] == plain[words]).all()
