"""Explanations as text: an outline that is read from top to bottom."""

from __future__ import annotations

from collections.abc import Iterator

from ros_scenesense.reasoning.explanation.reason import Reason, Role

_SOURCES = {
    "qsr": "perceived by QSR",
    "msr": "perceived by MSR",
    "human": "said by a person",
    "given": "given",
    "measured": "measured",
}


def outline(reason: Reason) -> str:
    """The tree as an outline, one reason per line."""
    return "\n".join([sentence(reason), *_below(reason, "")])


def short(reason: Reason) -> str:
    """The first step alone, in one line: what the literal rests on, or what it lacks."""
    by = f" by {reason.axiom}" if reason.axiom else ""
    if reason.role is not Role.MISSING:
        parts = ", ".join(each.literal for each in reason.reasons)
        return f"{reason.literal}{by}{': ' if parts else ''}{parts}"
    lacks = [
        f"{attempt.axiom or 'a rule'} lacks {attempt.reasons[-1].literal}"
        for attempt in reason.reasons
        if attempt.role is Role.ATTEMPT and attempt.reasons
    ]
    return f"{reason.literal} does not hold{': ' if lacks else ''}{'; '.join(lacks)}"


def sentence(reason: Reason) -> str:
    """A node in one line."""
    title, says = remark(reason)
    return f"{title}: {says}" if says else title


def remark(reason: Reason) -> tuple[str, str]:
    """A node as what it is about, and what there is to say about it."""
    axiom = f" by {reason.axiom}" if reason.axiom else ""
    says = reason.words
    match reason.role:
        case Role.CONCLUDED:
            title = f"{reason.literal}{axiom}"
        case Role.KNOWN:
            title, says = reason.literal, _source(reason) or says
        case Role.ASSUMED:
            title = f"{reason.literal}, assumed{axiom}"
        case Role.ABSENT | Role.CONDITION:
            title = reason.literal
        case Role.HOLDS:
            title = f"{reason.literal} holds"
        case Role.MISSING:
            title = f"{reason.literal} does not hold"
        case Role.ATTEMPT:
            title = f"not{axiom}"
        case Role.BLOCKED:
            title = f"{reason.literal} fails"
        case Role.UNTRUE:
            title, says = reason.literal, "this is not so"
    return (f"{title} (see above)" if reason.repeated else title), says


def _source(reason: Reason) -> str:
    if not reason.source:
        return ""
    words = _SOURCES.get(reason.source, reason.source)
    sure = "" if reason.confidence is None else f", confidence {reason.confidence:.2f}"
    return f"{words}{sure}"


def _below(reason: Reason, indent: str) -> Iterator[str]:
    for index, each in enumerate(reason.reasons):
        last = index + 1 == len(reason.reasons)
        yield f"{indent}{'└─ ' if last else '├─ '}{sentence(each)}"
        yield from _below(each, f"{indent}{'   ' if last else '│  '}")
