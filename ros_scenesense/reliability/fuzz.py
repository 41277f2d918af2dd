"""The fuzz: nonsense on every topic of the running graph, and good scenes in between.

Every message that no node should take must be counted by all nodes that listen, none may die or
grow, and the good scenes get the decisions that they get without the fuzz. Messages that are well
formed but false come afterwards: of these nobody can say what follows from them, but that the nodes
live on, do not grow, and decide good scenes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import msgspec

from ros_scenesense.errors import LaunchError
from ros_scenesense.messages.attention import Estimates
from ros_scenesense.messages.base import AnyMessage
from ros_scenesense.messages.codec import encode
from ros_scenesense.messages.grounding import MsrUpdate
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.reliability.attack import Attack, Sent
from ros_scenesense.reliability.hostile_texts import made_up_texts
from ros_scenesense.reliability.memory import tree_mib
from ros_scenesense.reliability.outcome import Outcome
from ros_scenesense.reliability.trial import SESSION, Trial, TrialOptions, running
from ros_scenesense.results import Table
from ros_scenesense.stages.grounding_store import look_into

_FALSE_SHARE = 0.1
_FALSE_FRAMES = 20
_WARM_SCENES = 3
_WARM_UP = 1 / 6
_SCENE_S = 180.0
_FIXED: dict[str, dict[str, object]] = {
    # The same scenes get the same decisions only where nothing else is learned.
    "simulated_camera": {"mode": "testing"},
    "attention": {"train_every": 0},
    "axiom_learner": {"cycle_scenes": 0},
}


@dataclass(frozen=True)
class _Attacked:
    """What a session under attack gave; memory in MiB by node."""

    decisions: dict[str, Estimates]
    sent: Sent
    dead: int
    dead_of_false: int
    before_mib: dict[str, float]
    after_mib: dict[str, float]
    false_mib: dict[str, float]


def fuzz(options: TrialOptions, messages: int, report: Callable[[str], None]) -> Outcome:
    """Runs two sessions on the same scenes, one with the fuzz and one without, and compares.

    Args:
        options: Of the session; its learning is switched off here.
        messages: How many invalid messages; a tenth as many false ones follow.
        report: Takes lines for people.

    Raises:
        LaunchError: If a node does not come back, or a good scene is not decided.
    """
    values = options.parameters()
    overrides = {name: {**values[name], **more} for name, more in _FIXED.items()}
    options = replace(options, feedback_share=0.0, keep=tuple(TOPICS), overrides=overrides)
    made_up = made_up_texts(messages // 2, options.seed)
    attacked = _attacked(_within(options, "fuzzed"), messages, made_up, report)
    report(f"the same {len(attacked.decisions)} scenes without the fuzz ...")
    plain = _plain(_within(options, "plain"), len(attacked.decisions), report)
    different = [
        scene_id
        for scene_id, decision in plain.items()
        if _decided(attacked.decisions[scene_id]) != _decided(decision)
    ]
    return _outcome(attacked, different)


def _attacked(
    options: TrialOptions, messages: int, made_up: list[str], report: Callable[[str], None]
) -> _Attacked:
    before: dict[str, float] = {}
    with running(options, report) as trial:
        for _ in range(_WARM_SCENES):
            _show_scene(trial, options)
        attack = Attack(trial, messages, _texts(trial), made_up, options.seed)
        while attack.share_done < 1.0:
            attack.send_invalid()
            _show_scene(trial, options)
            missing = attack.wait_until_counted()
            if missing:
                report(f"not counted so far: {', '.join(missing)}")
            if not before and attack.share_done >= _WARM_UP:
                before = _memory(trial)
        after, dead = _memory(trial), trial.restarts
        decisions = _decisions(trial)
        report(f"{attack.sent.invalid.total()} invalid messages sent")
        attack.send_false(round(_FALSE_SHARE * messages), _FALSE_FRAMES)
        report(f"{attack.sent.false} false messages sent")
        _show_scene(trial, options, merged=False)
        return _Attacked(
            decisions, attack.sent, dead, trial.restarts - dead, before, after, _memory(trial)
        )


def _plain(
    options: TrialOptions, scenes: int, report: Callable[[str], None]
) -> dict[str, Estimates]:
    with running(options, report) as trial:
        for _ in range(scenes):
            _show_scene(trial, options)
        return _decisions(trial)


def _show_scene(trial: Trial, options: TrialOptions, *, merged: bool = True) -> None:
    """Shows one scene; waits for its decision, and until grounding has learned from it."""
    before = len(_decisions(trial))
    updates = trial.companion.account.kept[MsrUpdate]
    database = options.folder / "state" / "grounding.db"
    steps: tuple[tuple[str, Callable[[], bool]], ...] = (
        ("the camera is not there", trial.companion.ask_for_scene),
        ("a good scene was not decided", lambda: len(_decisions(trial)) > before),
        (
            "evidence was not merged",
            lambda: (
                not (updates and merged) or look_into(database).updates >= max(map(int, updates))
            ),
        ),
    )
    for words, condition in steps:
        if not trial.graph.spin_until(condition, _SCENE_S):
            raise LaunchError(f"{words} within {_SCENE_S:g} s")


def _decisions(trial: Trial) -> dict[str, Estimates]:
    """The decisions on the camera's own scenes."""
    shown = trial.companion.account.shown
    return {
        name: decided
        for name, decided in trial.companion.account.kept[Estimates].items()
        if name in shown and name.startswith(f"{SESSION}-") and isinstance(decided, Estimates)
    }


def _decided(estimates: Estimates) -> Estimates:
    """What of a decision does not depend on the time at which the scene was shown."""
    return msgspec.structs.replace(estimates, stamp=None)


def _texts(trial: Trial) -> dict[type[AnyMessage], list[str]]:
    return {
        kind: [encode(message).decode() for message in list(kept.values())[-20:]]
        for kind, kept in trial.companion.account.kept.items()
    }


def _memory(trial: Trial) -> dict[str, float]:
    nodes = trial.graph.nodes.items()
    return {name: tree_mib(process.pid) for name, process in nodes if process.pid is not None}


def _within(options: TrialOptions, name: str) -> TrialOptions:
    folder = options.folder / name
    folder.mkdir(parents=True, exist_ok=True)
    return replace(options, folder=folder)


def _outcome(attacked: _Attacked, different: list[str]) -> Outcome:
    sent = attacked.sent
    grown = {
        name: 100.0 * (attacked.after_mib[name] / before - 1.0)
        for name, before in attacked.before_mib.items()
    }
    memory: list[list[str | int | float | None]] = [
        [
            name,
            round(before, 1),
            round(attacked.after_mib[name], 1),
            round(grown[name], 2),
            round(attacked.false_mib[name], 1),
        ]
        for name, before in attacked.before_mib.items()
    ]
    counts: list[list[str | int | float | None]] = [
        [*key.split(" "), expected, sent.counted[key]] for key, expected in sent.expected.items()
    ]
    return Outcome(
        figures={
            "fuzz_messages": sent.invalid.total(),
            "fuzz_dead_nodes": attacked.dead,
            "fuzz_not_counted": sent.expected.total() - sent.counted.total(),
            "fuzz_different_decisions": len(different),
            "fuzz_good_scenes": len(attacked.decisions),
            "fuzz_growth_pct": round(max(grown.values()), 2),
            "fuzz_false_messages": sent.false,
            "fuzz_false_dead_nodes": attacked.dead_of_false,
        },
        tables={
            "Fuzz: what the nodes counted": Table(
                columns=["node", "counter", "sent to it", "counted"], rows=counts
            ),
            "Fuzz: memory of the nodes": Table(
                columns=["node", "before, MiB", "after, MiB", "growth, %", "after false ones, MiB"],
                rows=memory,
            ),
        },
    )
