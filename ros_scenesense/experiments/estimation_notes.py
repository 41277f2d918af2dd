"""The discussion of the experiments on estimation, in plain words and with the figures found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ros_scenesense.experiments.comparison import Comparison
from ros_scenesense.experiments.estimation_trials import ITERATIONS

if TYPE_CHECKING:
    from ros_scenesense.experiments.estimation_report import Setting


def notes_of(
    figures: Mapping[str, float], claims: Mapping[str, Comparison], setting: Setting
) -> list[str]:
    """Paragraphs of Markdown.

    Args:
        figures: Means over the repetitions, from 0 to 1.
        claims: What was compared, by what is claimed.
        setting: Of the run.
    """
    notes = [_where_from(setting, any(name.startswith("alexnet") for name in figures))]
    parts = (_reasoning, _attention, _network, _overruling, _aims)
    notes += [text for part in parts for text in [part(figures)] if text]
    for title, verdict in (
        ("Shown at 95 %", "shown"),
        ("The opposite is shown at 95 %", "the opposite is shown"),
        ("Not shown", "not shown"),
    ):
        several = [words for words, one in claims.items() if one.verdict == verdict]
        if several:
            notes.append(f"{title}: {'; '.join(several)}.")
    return notes


def _where_from(setting: Setting, alexnet: bool) -> str:
    text = (
        "These figures are from simulation, not from real scenes. Depth has the noise of a Kinect; "
        "objects are told apart by the simulator's instance ids, but masks, depth and geometry are "
        "of perceived pixels, and relations come from SceneSense's own grounding. "
        f"{setting.scenes} scenes were used: {setting.tests} of them, the last ones, test, the "
        f"others are drawn from to train, {setting.repeats} times each with other images, weights "
        "and batches; a fifth of the training images only says when to stop. **Incomplete "
        "knowledge** lacks the six axioms that are to be learned, **complete** has them. "
        "**Accuracy** counts the occlusion of every object and the stability of every structure, "
        "what all ways estimate; no decision counts as a wrong one, ambiguous labels do not count. "
        "A stack is a structure of two objects or more. The slots of LeNet and AlexNet are those "
        "of the true structures, in their favour."
    )
    if alexnet:
        text += (
            " AlexNet is reduced to 115 pixels and an eighth of its filters, and learns faster "
            "(0.0005), to fit a CPU."
        )
    if setting.schedule == "validated":
        text += (
            f" Training takes {ITERATIONS} batches at most (of 32; of 64 for our network), fewer "
            "where held-out images gain nothing; the paper trains LeNet and AlexNet for 8,000 to "
            "40,000."
        )
    else:
        text += " LeNet and AlexNet are trained for the paper's numbers of iterations."
    if setting.experiment == "estimation" and setting.scenes < _PAPERS_SCENES:
        text += (
            f" The paper has {_PAPERS_SCENES} scenes and up to 5000 training images: "
            "`scenesense dataset generate DIR --count 6000 --seed 1`, then `scenesense experiment "
            "estimation --dataset DIR --work WORK`, does all of that, and takes hours on two cores."
            " The first of these scenes, by `--scenes`, are those of this run."
        )
    return text


_PAPERS_SCENES = 6000


def _reasoning(figures: Mapping[str, float]) -> str:
    if "reasoning_alone" not in figures:
        return ""
    text = (
        "**What reasoning contributed.** With incomplete knowledge little: it decides "
        f"{_share(figures, 'reasoning_decided')} of the labels, and the most frequent answer "
        f"for the others comes to {_share(figures, 'reasoning_majority')} (everywhere: "
        f"{_share(figures, 'majority')})."
    )
    if "reasoning_alone_complete" in figures:
        text += (
            " With complete knowledge it decides "
            f"{_share(figures, 'reasoning_decided_complete')} and has "
            f"{_share(figures, 'reasoning_alone_complete')} of all labels right without any "
            "network."
        )
    for kind, title in (("lenet", "LeNet"), ("alexnet", "AlexNet")):
        if f"{kind}_att_100_complete" in figures:
            text += (
                f" With {title} on regions for the rest, trained on 100 images, it is "
                f"{_share(figures, f'{kind}_att_100_complete')} right."
            )
    if "architecture_100_complete" in figures:
        text += (
            " With our network for the rest, trained on 100 images, it is "
            f"{_share(figures, 'architecture_100_complete')} right, with incomplete knowledge "
            f"{_share(figures, 'architecture_100')}."
        )
        if figures["architecture_100_complete"] < figures["architecture_100"]:
            text += (
                " Complete knowledge is the worse of the two: what defaults conclude wrongly "
                "stands, where the network would have been asked otherwise."
            )
    return text


def _attention(figures: Mapping[str, float]) -> str:
    parts = []
    for kind, title in (("lenet", "LeNet"), ("alexnet", "AlexNet")):
        changes = [
            f"{_change(figures, kind, f'{size}')} ({size} images"
            + (f"; stacks {_change(figures, kind, f'stack_{size}')})" if stacks else ")")
            for size in _SIZES
            if {f"{kind}_{size}", f"{kind}_att_{size}"} <= figures.keys()
            for stacks in [f"{kind}_stack_{size}" in figures]
        ]
        if changes:
            parts.append(f"{title} changes from {', '.join(changes)}")
    text = ""
    if parts:
        text = (
            "**What attention contributed.** On regions of interest after reasoning instead of "
            f"whole images {'; '.join(parts)}."
        )
    sizes = [size for size in _SIZES if f"lenet_{size}" in figures]
    best = max(
        (figures.get(f"{kind}_{size}", 0.0) for kind in _PAPERS_WAYS for size in sizes), default=0.0
    )
    if text and best <= figures.get("reasoning_majority", 0.0):
        text += (
            f" With {' or '.join(map(str, sizes))} images none of them is "
            f"better than the most frequent answer ({_share(figures, 'reasoning_majority')}): how "
            "many images one needs to be as good as the other says little."
        )
    for kind, title in (("lenet", "LeNet"), ("alexnet", "AlexNet")):
        ratio = f"images_ratio_{kind}_balanced"
        if ratio in figures:
            text += (
                f" By balanced accuracy {title} needs on regions {_share(figures, ratio)} of the "
                "images, at most, for what it reaches on whole ones with 1000."
            )
    pairs = [
        f"{_share(figures, f'same_channels_{size}')} and {_share(figures, f'query_{size}')} "
        f"({size} images)"
        for size in _SIZES
        if {f"same_channels_{size}", f"query_{size}"} <= figures.keys()
    ]
    if pairs:
        text += (
            " Our network, with the same channels and numbers, has on whole images without "
            f"reasoning, and on regions with it, {', '.join(pairs)}: the difference is what "
            f"reasoning and attention add to it{_little(figures)}. What is marked as related, and "
            "so what its numbers tell, is attention's choice in both."
        )
    elif "query_100" in figures:
        text += (
            " What our network does on whole images without reasoning (`same_channels`) was not "
            "tried in this run, so its gain is not divided into that of attention and its own."
        )
    return text


def _change(figures: Mapping[str, float], kind: str, end: str) -> str:
    """What a network of the paper has on whole images, and led by attention."""
    return f"{_share(figures, f'{kind}_{end}')} to {_share(figures, f'{kind}_att_{end}')}"


def _little(figures: Mapping[str, float]) -> str:
    """Says so if our network is as good without reasoning and attention as with them, or better."""
    gains = [
        figures[f"query_{size}"] - figures[f"same_channels_{size}"]
        for size in _SIZES
        if {f"same_channels_{size}", f"query_{size}"} <= figures.keys()
    ]
    if max(gains) < 0.0:
        return ", and it is the better without them"
    return ", hardly anything" if max(gains) < _HARDLY else ""


_HARDLY = 0.005
"""Less than half a point."""
_SIZES = (100, 1000, 5000)
_PAPERS_WAYS = ("lenet", "lenet_att", "alexnet", "alexnet_att")


def _network(figures: Mapping[str, float]) -> str:
    if "query_100" not in figures:
        return ""
    text = (
        "**What the network contributed.** One question about one object, which is marked, instead "
        f"of all answers at once: {_share(figures, 'query_100')} with 100 images"
    )
    if "query_1000" in figures:
        text += f", {_share(figures, 'query_1000')} with 1000"
    text += "."
    if "reasoning_majority" in figures and "stability_stacks_100" in figures:
        text += (
            " With the most frequent answer in place of the network it would be "
            f"{_share(figures, 'reasoning_majority')}. Of stacks alone, which fall about as "
            f"often as they stand, {_share(figures, 'stability_stacks_100')} are right instead of "
            f"{_share(figures, 'reasoning_majority_stack')}."
        )
    for size in _SIZES:
        ways = [f"query_{each}_{size}" for each in ("pixels", "geometry")]
        if all(way in figures for way in ways):
            stacks = f" (stacks {_share(figures, f'query_pixels_stack_{size}')})"
            text += (
                f" With {size} images it is {_share(figures, f'query_{size}')} (stacks "
                f"{_share(figures, f'query_stack_{size}')}), without the numbers from geometry "
                f"{_share(figures, ways[0])}{stacks}, with them alone "
                f"{_share(figures, ways[1])} (stacks "
                f"{_share(figures, f'query_geometry_stack_{size}')})."
            )
    if "query_geometry_100" in figures:
        if figures["query_geometry_100"] > figures["query_100"] - _HARDLY:
            text += " With few images the numbers do all of it, pixels add nothing to them."
        text += (
            " The numbers (how far the weight that rests on an object lies beyond its support, and "
            "along which part of its outline something nearer begins) are measured in the depth "
            "image between objects that attention relates to each other."
        )
    if "query_segmented_100" in figures:
        text += (
            " Where segmentation finds the objects instead of being given them, 100 images make "
            f"{_share(figures, 'query_segmented_100')}; what it does not find counts as wrong."
        )
    if "images_ratio_query" in figures:
        text += (
            " For what LeNet reaches on whole images with 1000 images at most, it needs at most "
            f"{_share(figures, 'images_ratio_query')} of the images."
        )
    if "images_ratio_query_balanced" in figures:
        text += (
            " By balanced accuracy, which the most frequent answer does not raise, that is "
            f"{_share(figures, 'images_ratio_query_balanced')}."
        )
    return text


def _overruling(figures: Mapping[str, float]) -> str:
    if "query_overrule_100_complete" not in figures:
        return ""
    several = [
        f"{_share(figures, f'query_overrule_{size}_complete')} instead of "
        f"{_share(figures, f'query_{size}_complete')} ({size} images)"
        for size in _SIZES
        if f"query_overrule_{size}_complete" in figures
    ]
    text = (
        "**Who may overrule whom.** Where the network may overrule defaults, accuracy with "
        f"complete knowledge is {', '.join(several)}."
    )
    if figures["query_overrule_100_complete"] < figures["query_100_complete"]:
        text += (
            " With 100 images that is no gain: the network learned only from what reasoning left "
            "open or got wrong, so of what defaults usually get right it has seen the exceptions "
            "alone."
        )
    return text


_GOALS = {
    "architecture_100": 0.95,
    "occlusion_100": 0.93,
    "stability_100": 0.93,
    "stability_structures_100": 0.93,
    "stability_stacks_100": 0.85,
}


def _aims(figures: Mapping[str, float]) -> str:
    """Aims that were set beforehand, and whether they are reached."""
    known = {name: goal for name, goal in _GOALS.items() if name in figures}
    if not known:
        return ""
    several = "; ".join(
        f"`{name}` {_share(figures, name)} ({'reached' if figures[name] >= goal else 'missed'}: "
        f"{100 * goal:.0f} %)"
        for name, goal in known.items()
    )
    return f"**Aims set beforehand**, 100 training images, incomplete knowledge: {several}."


def _share(figures: Mapping[str, float], name: str) -> str:
    return f"{100.0 * figures[name]:.1f} %"
