"""Tables, plot and words of the experiment on forgetting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ros_scenesense.experiments.outcome import Outcome
from ros_scenesense.plots import Panel, Series
from ros_scenesense.provenance import machine, versions
from ros_scenesense.results import Result, Table

ENDS = ("forgotten", "refuted", "dropped in merging")
"""What becomes of an axiom that is not in force any more."""

_TITLES = {
    "normal": "ours, normal axioms (th1 = 95 %)",
    "both": "ours, and defaults (th1 = 70 %)",
    "any_use": "ours, and defaults, any use reinforces",
    "paper_normal": "Algorithm 1, normal axioms (th1 = 95 %)",
    "paper_both": "Algorithm 1, and defaults (th1 = 70 %)",
    "bad_given": "ours, two bad given axioms",
    "changing": "ours, the world changes half way",
    "returning": "ours, s2 given, the world changes and changes back",
}
_DRAWN = ("both", "paper_both", "changing")
_MOST_ROWS = 14


@dataclass(frozen=True)
class Life:
    """What became of one axiom.

    Attributes:
        text: Its statement.
        kind: normal or default.
        born: The cycle in which it was learned.
        ended: What ended it, and when; None if it is in force in the end.
        strengths: At the end of each cycle; None where it was not in force.
        true: Whether it is right, in the world as it is in the end.
        truth: How often it is true there.
        equals: Id of the withheld axiom that it equals; None if it equals none.
    """

    text: str
    kind: str
    born: int
    ended: str | None
    strengths: tuple[float | None, ...]
    true: bool
    truth: float | None
    equals: str | None


@dataclass(frozen=True)
class Lives:
    """All axioms of one run.

    Attributes:
        way: Name of the way to live.
        number: Of the run.
        axioms: All that ever were learned.
        refuted: The given ones that are out of force in the end, with why.
        restored: Those that were out of force, and came back.
    """

    way: str
    number: int
    axioms: tuple[Life, ...]
    refuted: Mapping[str, str]
    restored: tuple[str, ...] = ()

    @property
    def wrong_left(self) -> int:
        """Wrong axioms that are in force in the end."""
        return sum(each.ended is None and not each.true for each in self.axioms)

    @property
    def right_lost(self) -> int:
        """Withheld axioms that were found once and are not in force in the end."""
        found = {each.equals for each in self.axioms if each.equals}
        kept = {each.equals for each in self.axioms if each.equals and each.ended is None}
        return len(found - kept)

    @property
    def known(self) -> int:
        """Withheld axioms that are in force in the end."""
        return len({each.equals for each in self.axioms if each.equals and each.ended is None})


def report_on(lives: Sequence[Lives], command: str, seed: int, cycles: int) -> Outcome:
    """Summarises the runs.

    Args:
        lives: Of all ways, all runs.
        command: The command line.
        seed: Of everything that was drawn.
        cycles: Cycles of a run.
    """
    ways = list(dict.fromkeys(each.way for each in lives))
    figures: dict[str, float] = {}
    rows: list[list[str | int | float | None]] = []
    for way in ways:
        mine = [each for each in lives if each.way == way]
        wrong = [sum(not a.true for a in each.axioms) for each in mine]
        means = [
            sum(values) / len(mine)
            for values in (
                [len(each.axioms) for each in mine],
                wrong,
                [each.wrong_left for each in mine],
                [each.right_lost for each in mine],
                [each.known for each in mine],
            )
        ]
        rows.append([_TITLES[way], *means])
        suffix = "" if way == "both" else f"_{way}"
        figures[f"wrong_learned{suffix}"] = round(means[1], 4)
        figures[f"wrong_left_after_{cycles}{suffix}"] = round(means[2], 4)
        figures[f"right_lost_after_{cycles}{suffix}"] = round(means[3], 4)
        figures[f"known_after_{cycles}{suffix}"] = round(means[4], 4)
    bad = [each for each in lives if each.way == "bad_given"]
    for name in ("given_wrong", "given_overspecified"):
        if bad:
            figures[f"{name}_refuted"] = round(sum(name in e.refuted for e in bad) / len(bad), 4)
    back = [each for each in lives if each.way == "returning"]
    if back:
        restored = sum("s2" in each.restored and "s2" not in each.refuted for each in back)
        figures["given_restored_returning"] = round(restored / len(back), 4)
    tables = {
        "Axioms, mean over the runs": Table(
            columns=[
                "way",
                "learned",
                "of these wrong",
                "wrong left",
                "right lost",
                "of six known",
            ],
            rows=rows,
        ),
    }
    for way in ways:
        first = next(each for each in lives if each.way == way)
        tables[f"First run: {_TITLES[way]}"] = _life_table(first)
    result = Result(
        name="forgetting",
        command=command,
        seed=seed,
        versions=versions(),
        machine=machine(),
        figures=figures,
        notes=_NOTES,
        tables=tables,
    )
    panels = [
        _panel(next(each for each in lives if each.way == way), cycles)
        for way in _DRAWN
        if way in ways
    ]
    return Outcome(result, panels)


def _life_table(lives: Lives) -> Table:
    rows: list[list[str | int | float | None]] = [
        [
            each.text,
            each.equals or "-",
            "right" if each.true else "wrong",
            each.truth,
            each.born,
            " ".join("-" if value is None else f"{value:.2f}" for value in each.strengths),
            each.ended or "in force",
        ]
        for each in sorted(lives.axioms, key=lambda each: (each.born, each.text))
    ]
    rows += [[name, "-", "given", None, 0, "-", words] for name, words in lives.refuted.items()]
    columns = ["axiom", "equal to", "verdict", "truth", "born", "strength per cycle", "end"]
    return Table(columns=columns, rows=rows)


def _panel(lives: Lives, cycles: int) -> Panel:
    ranked = sorted(lives.axioms, key=lambda each: (each.equals is None, each.born, each.text))
    return Panel(
        f"Strength of each axiom, from 0 to 1: {_TITLES[lives.way]}",
        [str(number) for number in range(1, cycles + 1)],
        [Series(_line(each), each.strengths) for each in ranked[:_MOST_ROWS]],
        x_label="cycle",
        rows=True,
    )


def _line(life: Life) -> str:
    """A line of the plot: the axiom, and what it equals or that it is wrong."""
    remark = life.equals or ("" if life.true else "wrong")
    return f"{life.text}  ({remark})" if remark else life.text


_NOTES = [
    "Each cycle brings new scenes to learn from, and others that choose between versions of "
    "axioms. Ours learns from the newest 200 scenes, Algorithm 1 from those of the cycle. An axiom "
    "is reinforced when it is learned again, or when it was used and right as often as is asked of "
    "its kind (`reinforce: used_right`, ours); with *any use*, and for Algorithm 1, whenever it "
    "was used (`reinforce: used`, the paper's). Relations are exact, labels those of physics and "
    "visible pixels.",
    "Besides fading, an axiom is *refuted*, given or learned, when even the upper bound of its "
    "truth, of the newest labelled objects or of all, is below what is asked of its kind. If it "
    "was true of earlier ones, the world has changed, and labels of before are left aside. What is "
    "*dropped in merging* is named with the version that is kept instead.",
    "*Wrong*: true too seldom of the objects of other scenes (below 95 %; defaults, of what s1, s2 "
    "and o1 leave open, below 70 %). *Lost*: an axiom equal to one of the six was in force once "
    "and none is in the end. In the world that changes, nothing falls off irregular surfaces in "
    "the second half, so that s2 becomes wrong and is rightly lost. In the world that changes "
    "back, the same is so in cycles 4 to 6 alone, and s2 is given: it is put out of force and "
    "comes back.",
]
