"""Answers what people ask about the scenes that were decided: why, and why not?"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Collection
from dataclasses import dataclass

from ros_scenesense.errors import LanguageError, SceneSenseError
from ros_scenesense.messages.base import Stamp
from ros_scenesense.messages.reasoning import Explanation, ExplanationStep, Query
from ros_scenesense.reasoning.explanation.reason import Reason
from ros_scenesense.reasoning.explanation.scenes import SceneExplainer, SceneExplanation
from ros_scenesense.reasoning.explanation.text import outline
from ros_scenesense.reasoning.facts import SceneFacts
from ros_scenesense.reasoning.program import Program

_MOST_STEPS = 400
_LONGEST_TEXT = 4096
_REMEMBERED_QUERIES = 1000


@dataclass(frozen=True)
class DecidedScene:
    """A scene as it was decided: what was known of it, and the knowledge that was in force."""

    facts: SceneFacts
    program: Program
    withheld: frozenset[str]


class QueryDesk:
    """Remembers the last scenes and explains what was decided about them.

    Args:
        scenes: How many scenes to remember.
    """

    def __init__(self, scenes: int) -> None:
        self._most = scenes
        self._scenes: OrderedDict[str, DecidedScene] = OrderedDict()
        self._answered: OrderedDict[str, None] = OrderedDict()

    def remember(
        self, scene_id: str, facts: SceneFacts, program: Program, withheld: Collection[str]
    ) -> None:
        """Keeps a scene that was just decided, and forgets the oldest."""
        self._scenes[scene_id] = DecidedScene(facts, program, frozenset(withheld))
        while len(self._scenes) > self._most:
            self._scenes.popitem(last=False)

    def answer(self, query: Query, now_ns: int) -> Explanation | None:
        """The explanation, or the reason why there is none; None if the id was answered before."""
        scene_id = query.scene_id or next(reversed(self._scenes), None)
        identifier = query.id or _content_id(query, scene_id, now_ns)
        if identifier in self._answered:
            return None
        self._answered[identifier] = None
        while len(self._answered) > _REMEMBERED_QUERIES:
            self._answered.popitem(last=False)
        stamp = Stamp.of(now_ns)
        try:
            explained = self._explain(query, scene_id)
        except SceneSenseError as error:
            return Explanation(
                stamp=stamp,
                id=identifier,
                scene_id=scene_id,
                literal=query.literal,
                outcome="refused",
                holds=None,
                steps=[],
                text=_shortened(str(error)),
            )
        steps = steps_of(explained.reason)
        return Explanation(
            stamp=stamp,
            id=identifier,
            scene_id=scene_id,
            literal=_shortened(explained.literal),
            outcome="explained",
            holds=explained.holds,
            steps=steps[:_MOST_STEPS],
            text=_shortened(words_of(explained, query.why)),
            truncated=len(steps) > _MOST_STEPS,
        )

    def _explain(self, query: Query, scene_id: str | None) -> SceneExplanation:
        if scene_id is None:
            raise LanguageError("no scene was decided yet")
        scene = self._scenes.get(scene_id)
        if scene is None:
            known = ", ".join(list(self._scenes)[-5:]) or "none"
            raise LanguageError(
                f"scene {scene_id} is not among the last {self._most} that were decided; the "
                f"newest are {known}"
            )
        explainer = SceneExplainer(scene.program, scene.facts, scene.withheld)
        return explainer.explain(explainer.literal(query.literal))


def words_of(explained: SceneExplanation, asked: str = "why") -> str:
    """An explanation as text: what was asked, then the outline, then what must be known of it."""
    lines = []
    if asked == "why_not" and explained.holds:
        lines.append(f"{explained.literal} does hold:")
    lines.append(outline(explained.reason))
    for each in explained.withdrawn:
        lines.append(
            f"The scene contradicts itself: not believed is that {each.object} is {each.relation} "
            f"{each.reference}, confidence {each.confidence:.2f}."
        )
    lines.extend(f"{constant} is {name!r}." for constant, name in explained.renamed)
    return "\n".join(lines)


def steps_of(reason: Reason) -> list[ExplanationStep]:
    """The tree in pre-order."""
    return [
        ExplanationStep(
            depth=depth,
            literal=_shortened(each.literal),
            role=str(each.role),
            axiom=each.axiom,
            source=each.source or None,
            confidence=each.confidence,
            words=_shortened(each.words),
            repeated=each.repeated,
        )
        for depth, each in reason.walk()
    ]


def _content_id(query: Query, scene_id: str | None, now_ns: int) -> str:
    """An id for a question without one: asked again later, it is another question."""
    words = "\n".join([scene_id or "", query.why, query.literal, str(now_ns)])
    return f"content-{hashlib.sha256(words.encode()).hexdigest()[:32]}"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"
