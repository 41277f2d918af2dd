"""What is learned from what came of an action: attempts at it, and arrangements that did not hold.

A `transitions` message tells the state before, what should hold afterwards and what was seen. Only
states of which everything is known become attempts, for nothing may be concluded from what was
merely not seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from itertools import combinations

from ros_scenesense.errors import LearningError
from ros_scenesense.knowledge.description import SystemDescription
from ros_scenesense.knowledge.signature import Signature
from ros_scenesense.knowledge.terms import Number
from ros_scenesense.learning.examples import Fact, SceneState
from ros_scenesense.learning.trials import Trial
from ros_scenesense.messages.actions import StateLiteral, Transition
from ros_scenesense.reasoning.described_scenes import TABLE
from ros_scenesense.reasoning.facts import PairRelation, SceneFacts, SceneObject
from ros_scenesense.scene import Distance, Position, Size, Surface

OBSERVED = ("on", "in_hand")
"""Fluents that the outcome of an action is compared by."""

Holding = frozenset[tuple[str, tuple[str, ...]]]
"""Names and arguments of what holds in a state."""


class Outcome:
    """What came of an action.

    Args:
        transition: The message.
        description: The domain.

    Attributes:
        objects: What is known of the objects, the one in the hand among them.

    Raises:
        LearningError: If the message speaks of what the domain does not have.
    """

    def __init__(self, transition: Transition, description: SystemDescription) -> None:
        self._transition = transition
        self._description = description
        _check((*transition.before, *transition.expected, *transition.after), description)
        self._before = _holding(transition.before)
        self._expected = _holding(transition.expected)
        self._after = _holding(transition.after)
        self.objects = dict(_objects(self._before))

    @property
    def is_unexpected(self) -> bool:
        """Whether the action was refused, or something else was seen than was expected."""
        if self._transition.outcome == "refused":
            return True
        return any(
            all(name in self.objects or name == TABLE for name in self._things(each))
            and all(map(self._is_seen, set(each[1]) & set(self.objects)))
            for each in self._expected ^ self._after
            if each[0] in OBSERVED
        )

    def trial(self) -> Trial | None:
        """The attempt at the action; None if something is not known that bears on it.

        Raises:
            LearningError: If the message speaks of what is not there.
        """
        transition, signature = self._transition, self._description.signature
        action, executed = transition.action, transition.outcome == "executed"
        if not self._is_known() or (executed and not self._is_seen(action.object)):
            return None
        numbers = {name: index for index, name in enumerate(self.objects)}
        robot = next(iter(signature.members("robot")))
        names = [str(robot), action.object]
        if action.kind == "putdown":
            names.append(action.location or TABLE)
        facts = _Facts(signature, numbers)
        sorts = signature.actions[action.kind].arguments
        arguments = facts.values(sorts, names)

        def bearing(holding: Iterable[tuple[str, tuple[str, ...]]]) -> frozenset[Fact]:
            """Facts about the arguments of the action: no law speaks of anything else."""
            found = facts.of(holding)
            return frozenset(each for each in found if set(arguments) & set(each[1]))

        return Trial(
            id=transition.id,
            scene_id=transition.scene_before,
            action=action.kind,
            arguments=arguments,
            state=SceneState(tuple(numbers), bearing(self._before)),
            executed=executed,
            failed=not executed or bool(self._missed({action.object})),
            expected=bearing(self._expected),
            # What was hidden before may be seen now.
            after=bearing(each for each in self._after if facts.can_say(each)),
        )

    def unstable(self) -> tuple[SceneFacts, list[str]] | None:
        """The arrangement that was expected, and which objects of it were seen not to stay in it.

        Returns:
            None if all stayed, or not everything is known about the arrangement.
        """
        if self._transition.outcome != "executed":
            return None
        held = _held(self._expected)
        missed = [values for fluent, values in self._missed(set(self.objects)) if fluent == "on"]
        fallen = [
            upper
            for upper, lower in missed
            # A touch that was overlooked is no fall: who stays above has stayed.
            if lower != TABLE
            and not {upper, lower} & held
            and not {("above", (upper, lower)), ("in", (upper, lower))} & self._after
        ]
        standing = [each for name, each in self.objects.items() if name not in held]
        relations = list(self._expected_relations([each.name for each in standing]))
        if not fallen or len(relations) != len(standing) * (len(standing) - 1) // 2:
            return None
        facts, problems = SceneFacts.checked(standing, relations)
        return None if problems else (facts, fallen)

    def _missed(self, names: Set[str]) -> list[tuple[str, tuple[str, ...]]]:
        """What the action should have brought about for some objects, and was not seen."""
        return sorted(
            each
            for each in self._expected - self._after
            if each[0] in OBSERVED
            and names & set(each[1])
            and (each not in self._before or each[0] == "on")
            and all(map(self._is_seen, set(each[1]) & set(self.objects)))
        )

    def _things(self, each: tuple[str, tuple[str, ...]]) -> tuple[str, ...]:
        """The arguments of what is observed, without whose hand it is."""
        return each[1][-1:] if each[0] == "in_hand" else each[1]

    def _is_seen(self, name: str) -> bool:
        """Whether an object is seen, or in the hand, afterwards."""
        return any(fluent in OBSERVED and name in values for fluent, values in self._after)

    def _is_known(self) -> bool:
        """Whether every object's attributes and every pair's relations are known before."""
        held = _held(self._before)
        lying = [name for name in self.objects if name not in held]
        pairs = list(combinations(lying, 2))
        return (
            self._transition.action.object in self.objects
            and all(each.size and each.surface for each in self.objects.values())
            and len(list(_relations(self._before, pairs))) == len(pairs)
        )

    def _expected_relations(self, names: Sequence[str]) -> Iterator[PairRelation]:
        """Relations of the arrangement; what was put on an object is as far from others as that."""
        pairs = list(combinations(names, 2))
        distances = dict(_distances(self._expected))
        action = self._transition.action
        if action.kind == "putdown" and action.location in self.objects:
            for name in names:
                support = distances.get(frozenset((action.location, name)))
                apart = Distance.NOT_TOUCHING if support is Distance.TOUCHING else support
                if apart is not None:
                    distances.setdefault(frozenset((action.object, name)), apart)
        yield from _relations(self._expected, pairs, distances)


class _Facts:
    """Translates what holds into facts: objects become their numbers."""

    def __init__(self, signature: Signature, numbers: Mapping[str, int]) -> None:
        self._signature = signature
        self._numbers = numbers

    def of(self, holding: Iterable[tuple[str, tuple[str, ...]]]) -> frozenset[Fact]:
        attributes = self._signature.attributes
        return frozenset(
            (name, self.values(attributes[name].arguments, values)) for name, values in holding
        )

    def can_say(self, each: tuple[str, tuple[str, ...]]) -> bool:
        try:
            self.of([each])
        except LearningError:
            return False
        return True

    def values(self, sorts: Iterable[str], names: Iterable[str]) -> tuple[str | int, ...]:
        return tuple(map(self._value, sorts, names))

    def _value(self, sort: str, name: str) -> str | int:
        if name in self._numbers:
            return self._numbers[name]
        bounds = self._signature.sorts[sort].bounds
        if (
            bounds is not None
            and name.isdecimal()
            and self._signature.contains(sort, Number(int(name)))
        ):
            return int(name)
        if bounds is None and name in map(str, self._signature.members(sort)):
            return name
        raise LearningError(f"{name!r} is no {sort}")


def _check(literals: Iterable[StateLiteral], description: SystemDescription) -> None:
    attributes = description.signature.attributes
    for each in literals:
        known = attributes.get(each.fluent)
        if known is None or len(known.arguments) != len(each.arguments):
            raise LearningError(
                f"{each.fluent!r} with {len(each.arguments)} arguments is not in "
                f"{description.source}"
            )


def _holding(literals: Iterable[StateLiteral]) -> Holding:
    return frozenset((each.fluent, tuple(each.arguments)) for each in literals if each.holds)


def _objects(holding: Holding) -> Iterator[tuple[str, SceneObject]]:
    """The objects that something is known of, or that are somewhere."""
    sizes = {v[0]: Size(v[1]) for f, v in holding if f == "obj_size" and v[1] in tuple(Size)}
    surfaces = {
        v[0]: Surface(v[1]) for f, v in holding if f == "obj_surface" and v[1] in tuple(Surface)
    }
    placed = {v[0] for f, v in holding if f == "on"} | {v[1] for f, v in holding if f == "in_hand"}
    for name in sorted({*sizes, *surfaces, *placed}):
        yield name, SceneObject(name, size=sizes.get(name), surface=surfaces.get(name))


def _held(holding: Holding) -> set[str]:
    return {values[-1] for fluent, values in holding if fluent == "in_hand"}


def _distances(holding: Holding) -> Iterator[tuple[frozenset[str], Distance]]:
    for fluent, values in holding:
        if fluent in tuple(Distance):
            yield frozenset(values), Distance(fluent)


def _relations(
    holding: Holding,
    pairs: Iterable[tuple[str, str]],
    distances: Mapping[frozenset[str], Distance] | None = None,
) -> Iterator[PairRelation]:
    """The relations of those pairs of which position and distance are known."""
    known = dict(_distances(holding)) if distances is None else distances
    for one, other in pairs:
        distance = known.get(frozenset((one, other)))
        found = [
            (position, pair)
            for pair in ((one, other), (other, one))
            for position in Position
            if (position.value, pair) in holding
        ]
        if distance is not None and found:
            position, (name, reference) = found[0]
            yield PairRelation(name, reference, position, distance)
