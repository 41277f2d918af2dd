"""The discussion of the experiment on grounding, in plain words and with the figures found."""

from __future__ import annotations

from collections.abc import Mapping

from ros_scenesense.experiments.comparison import Comparison

_REACHED = 0.5
"""Percent: the combination is not to fall further below the better grounding than this."""


def notes_of(
    figures: Mapping[str, float],
    claims: Mapping[str, Comparison],
    sets: int,
    pairs: int,
    simulated: bool,
) -> list[str]:
    """Paragraphs of Markdown.

    Args:
        figures: Means over the sets, in percent.
        claims: What was compared, by what is claimed.
        sets: How many sets there are.
        pairs: Test pairs of each, at most.
        simulated: Whether the scenes were simulated.
    """
    notes = [_where_from(sets, pairs, simulated), _geometry(figures), _learning(figures)]
    notes.append(_arbiter(figures))
    if "yaw40_feedback7" in figures:
        notes += [_turns(figures), _errors(figures)]
    shown = [words for words, one in claims.items() if one.verdict == "shown"]
    opposite = [words for words, one in claims.items() if one.verdict == "the opposite is shown"]
    others = [words for words, one in claims.items() if one.verdict == "not shown"]
    for title, several in (
        ("Shown at 95 %", shown),
        ("The opposite is shown at 95 %", opposite),
        ("Not shown", others),
    ):
        if several:
            notes.append(f"{title}: {'; '.join(several)}.")
    return notes


def _where_from(sets: int, pairs: int, simulated: bool) -> str:
    if simulated:
        source = (
            "These figures are from simulation, not from real scenes. A simulated Kinect with its "
            "noise looks down by 25 to 55 degrees at scenes in which every preposition occurs and "
            "at towers and scattered objects; the truth comes from meshes and contacts, never from "
            "what the estimators see. All settings were chosen on other scenes."
        )
    else:
        source = (
            "These figures are from a copy of the Table Object Scene Database, with the relation "
            "labels that are in its folder."
        )
    return (
        f"{source} {sets} disjoint sets were made as in the paper's experiment: of each, seven "
        "pairs with human feedback, one for every position relation, and 200 pairs labelled by the "
        f"qualitative model (QSR) teach the metric one (MSR); up to {pairs} other pairs test. "
        "A pair is unambiguous unless even a careful person may doubt its name. The paper's "
        "column is quoted from its text: it was found on real scenes and hand-made labels, so it "
        "tells what to expect, not how far one beats the other."
    )


def _geometry(figures: Mapping[str, float]) -> str:
    return (
        "**What came from geometry.** Nearly all of it. The same pyramids name "
        f"{figures['qsr_pyramids']:.1f} % rightly along the tilted camera's axes and "
        f"{figures['qsr_pyramids_gravity']:.1f} % along gravity-up ones; the improved rule "
        f"(containment, what is over what, then the widest gap) {figures['qsr_improved']:.1f} %, "
        f"but along the camera's axes only {figures['qsr_improved_camera']:.1f} %. Its idea of a "
        "direction is that of the truth, measured on one-sided noisy clouds instead of meshes. "
        "Leaving out readings that mix two surfaces helps every way alike."
    )


def _learning(figures: Mapping[str, float]) -> str:
    text = (
        f"**What came from learning.** MSR alone reaches {figures['msr_feedback']:.1f} % from "
        "seven pairs, each of which also teaches the converse of its relation, and "
        f"{figures['msr_qsr_feedback']:.1f} % from QSR labels and the same seven. It learns what "
        "QSR knows and hardly more: from one viewpoint and with a good QSR, learning adds nothing "
        "that QSR lacks."
    )
    if "combined_switch_paper_method" in figures:
        text += (
            " In the paper's own method (camera axes, pyramids, one switch) MSR reaches "
            f"{figures['msr_feedback_paper_method']:.1f} and "
            f"{figures['msr_qsr_feedback_paper_method']:.1f} %, the combination "
            f"{figures['combined_switch_paper_method']:.1f} % (QSR alone "
            f"{figures['qsr_pyramids']:.1f} %): seven words are few to prove which is better."
        )
    return text


def _arbiter(figures: Mapping[str, float]) -> str:
    below = figures["combined_below_better"]
    kept = "is kept" if below <= _REACHED else "is not kept"
    text = (
        f"**What came from the arbiter.** The combination reaches {figures['combined']:.1f} % "
        f"({figures['combined_unambiguous']:.1f} % of the unambiguous pairs), one switch "
        f"{figures['combined_switch']:.1f} %, QSR alone {figures['qsr_improved']:.1f} %. The "
        "promise not to fall more than half a percent below the better of the two groundings "
        f"{kept}: it is {below:.2f} below. A switch can never beat the better one, and as long as "
        "nothing changes the arbiter has little to correct."
    )
    if "distance_combined" in figures:
        text += (
            f" Distances: QSR alone {figures['distance_qsr']:.1f} %, combined "
            f"{figures['distance_combined']:.1f} %, the paper's 1 cm between clouds "
            f"{figures['distance_qsr_pyramids_gravity']:.1f} %."
        )
    return text


def _turns(figures: Mapping[str, float]) -> str:
    return (
        "**Where learning and control matter: the viewpoint changes.** The camera goes round the "
        "table by 40 degrees, people go on naming along the old axes. QSR alone falls to "
        f"{figures['yaw40_qsr_improved']:.1f} %. With 7 words, one for every relation, "
        f"{figures['yaw40_feedback7']:.1f} % are right, with 28 "
        f"{figures['yaw40_feedback28']:.1f} %, if the robot knows that its camera moved (though "
        "not how people name things now). If it does not, the words must also prove the change: "
        f"7 reach {figures['yaw40_feedback7_unannounced']:.1f} % (four of them say something about "
        "left, right, front and behind, and about two of these contradict the old axes), 28 reach "
        f"{figures['yaw40_feedback28_unannounced']:.1f} %. More trust in few words would find it "
        "sooner, but also turn the axes after a few wrong ones. What "
        "helps is the one angle that is estimated from the words; new histograms and trust alone "
        f"come to {figures['yaw40_feedback7_learning_alone']:.1f} and "
        f"{figures['yaw40_feedback28_learning_alone']:.1f} %."
    )


def _errors(figures: Mapping[str, float]) -> str:
    return (
        "**Wrong feedback.** With 28 words of which 0, 20 and 40 % name any other relation, the "
        f"combination is right in {figures['combined_wrong0']:.1f}, "
        f"{figures['combined_wrong20']:.1f} and {figures['combined_wrong40']:.1f} %, MSR alone in "
        f"{figures['msr_wrong0']:.1f}, {figures['msr_wrong20']:.1f} and "
        f"{figures['msr_wrong40']:.1f} %. {_harm(figures)}"
    )


def _harm(figures: Mapping[str, float]) -> str:
    worst = min(figures[f"combined_wrong{share}"] for share in (10, 20, 30, 40))
    lost = figures["combined_wrong0"] - worst
    if lost <= _REACHED:
        return (
            "The histograms suffer, the combination does not: control sees that people agree less "
            "with both groundings, not that one of them became worse than the other."
        )
    return (
        f"The combination loses up to {lost:.1f} %: a few wrong words may happen to agree on "
        "turned axes."
    )
