"""Labelling by a scripted person: answers, undo, quitting and going on."""

import cv2
import frame_samples as samples
import pytest
from box_scenes import Block, render

from ros_scenesense.cli import main as cli
from ros_scenesense.experiments.labelling import HELP, HOW_NEAR, Labelling, LabellingOptions
from ros_scenesense.experiments.relation_labels import read_labels
from ros_scenesense.experiments.tosd import Split, Tosd

FRAME = render(
    [
        Block("one", (0.0, 0.0, 0.0)),
        Block("two", (0.0, -0.15, 0.0)),
        Block("three", (0.25, 0.1, 0.0), (0.08, 0.08, 0.15)),
    ]
)


@pytest.fixture
def folder(tmp_path):
    for name in ("learn0", "test0"):
        samples.write_pcd(tmp_path / f"{name}.pcd", FRAME)
    return tmp_path


class Person:
    """Answers in order, then is gone; cannot say how near things are, or says it in `near`."""

    def __init__(self, folder, *answers, pairs=9, split=None, near=()):
        self.answers = list(answers)
        self.near = list(near)
        self.asked, self.told = [], []
        options = LabellingOptions(pairs, split, folder / "overlays")
        self.count = Labelling(Tosd(folder), options, self.ask, self.told.append).run()
        self.said = [
            (label.scene, label.object[-1], label.relation, label.reference[-1])
            for label in read_labels(folder / "relations.jsonl")
        ]

    def ask(self, words):
        if words == HOW_NEAR:
            return self.near.pop(0) if self.near else ""
        self.asked.append(words)
        if not self.answers:
            raise EOFError
        return self.answers.pop(0)


def test_every_answer_is_kept_in_the_words_of_the_file(folder):
    person = Person(folder, "l", "Right t", "contains touching", "?", "f n", "in d")
    assert person.count == 6
    assert person.said == [
        ("learn0", "1", "left", "2"),
        ("learn0", "1", "right", "3"),
        ("learn0", "1", "touching", "3"),
        ("learn0", "3", "in", "2"),
        ("learn0", "3", "touching", "2"),
        ("test0", "1", "unclear", "2"),
        ("test0", "1", "front", "3"),
        ("test0", "1", "not_touching", "3"),
        ("test0", "2", "in", "3"),
        ("test0", "2", "far", "3"),
    ]
    assert len(person.asked) == 6


def test_a_second_session_goes_on_where_the_first_ended(folder):
    first = Person(folder, "l", "r", "q")
    assert first.count == 2
    second = Person(folder, "a", "b")
    assert second.count == 2
    assert [each[2] for each in second.said] == ["left", "right", "above", "below"]
    assert "object_2 is ... of/to object_3" in second.asked[0]
    Person(folder, "l", "l")
    assert Person(folder).asked == []


def test_undo_takes_the_last_pair_back_with_its_distance(folder):
    person = Person(folder, "u", "l t", "u", "r", "q")
    assert "nothing to undo in this session" in person.told
    assert [each[2] for each in person.said] == ["right"]
    assert person.asked[1] == person.asked[3]


def test_undo_across_scenes_asks_again_in_the_next_session(folder):
    person = Person(folder, "l", "l", "l", "u", "q")
    assert len(person.said) == 2
    assert any("scene learn0 will be asked about" in line for line in person.told)
    again = Person(folder, "h", "q")
    assert again.said[-1] == ("learn0", "2", "behind", "3")


@pytest.mark.parametrize("words", ["x", "left right", "? t", "l t t", "t", "l x"])
def test_what_is_no_answer_is_asked_again(folder, words):
    person = Person(folder, words, "l", "q")
    assert any(f"'{words}' is no answer" in line for line in person.told)
    assert person.count == 1


def test_how_near_is_asked_for_where_it_was_not_said(folder):
    near = ["x", "n n", "n", "Touching"]
    person = Person(folder, "l", "?", "r d", "f", "h", near=near)
    assert person.near == []
    assert [each[2] for each in person.said] == [
        *("left", "not_touching", "unclear", "right", "far", "front", "touching", "behind")
    ]


def test_quitting_at_how_near_leaves_the_pair_for_the_next_session(folder):
    assert Person(folder, "l", "r", near=["", "q"]).count == 1
    assert "object_1 is ... of/to object_3" in Person(folder, "q").asked[0]


def test_enter_shows_the_help_again(folder):
    assert Person(folder, "", "q").told.count(HELP) == 2


def test_of_many_pairs_the_same_few_are_drawn_each_time(folder):
    first = Person(folder, "l", "l", pairs=1)
    assert len(first.said) == 2
    assert Person(folder, pairs=1).asked == []
    assert len(Person(folder, "l", pairs=2).said) == 3


def test_one_set_alone_can_be_asked_about(folder):
    assert {each[0] for each in Person(folder, *"lll", split=Split.TEST).said} == {"test0"}


def test_the_picture_of_a_scene_is_there_before_the_first_question(folder):
    Person(folder, "q")
    picture = cv2.imread(str(folder / "overlays" / "learn0.png"))
    assert picture.shape == (720, 960, 3)
    colors = {tuple(color) for color in picture.reshape(-1, 3)[::7]}
    assert {(30, 30, 200), (200, 110, 20), (60, 130, 0)} <= colors


def test_the_command_reads_answers_from_the_terminal(folder, monkeypatch, capsys):
    answers = iter(["l n", "q"])
    monkeypatch.setattr("builtins.input", lambda _words: next(answers))
    assert cli.main(["label", str(folder), "--pairs", "2", "--labels", str(folder / "mine")]) == 0
    assert "pairs answered: 1" in capsys.readouterr().out
    assert len(read_labels(folder / "mine")) == 2
    assert cli.main(["label", str(folder), "--pairs", "0"]) == 2
    assert cli.main(["label", str(folder / "gone")]) == 1
    assert "is no folder" in capsys.readouterr().err
