"""What is known of a scene, and its rendering as facts of the program.

Objects become integers and relations and attributes the values of our own enums, all in one batch
of text: a name from outside never enters program text.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from ros_scenesense.reasoning.program import Selection
from ros_scenesense.reasoning.syntax import Signature
from ros_scenesense.scene import Distance, Position, Size, Surface


@dataclass(frozen=True)
class SceneObject:
    """An object; None = unknown. Of an object that is not located, few relations are known.

    The sources say who gave or measured an attribute.
    """

    name: str
    located: bool = True
    size: Size | None = None
    surface: Surface | None = None
    size_source: str = ""
    surface_source: str = ""


@dataclass(frozen=True)
class PairRelation:
    """How `object` stands to `reference`; the converse is left to the program.

    Position and distance each have the confidence with which they were perceived, from 0 to 1, and
    a source: the grounding, or the person, that said so.
    """

    object: str
    reference: str
    position: Position
    distance: Distance
    position_confidence: float = 1.0
    distance_confidence: float = 1.0
    position_source: str = ""
    distance_source: str = ""

    @property
    def pair(self) -> frozenset[str]:
        """The two names, in no order."""
        return frozenset((self.object, self.reference))

    def agrees_with(self, other: PairRelation) -> bool:
        """Whether two relations of one pair say the same, perhaps in the other direction."""
        position = other.position if other.object == self.object else other.position.converse
        return (self.position, self.distance) == (position, other.distance)


@dataclass(frozen=True)
class PerceivedRelation:
    """One perceived relation, with its confidence from 0 to 1 and who said so."""

    relation: str
    object: str
    reference: str
    confidence: float = 1.0
    source: str = ""


@dataclass(frozen=True)
class SceneFact:
    """A fact of a scene: its atom as program text, words, and who said so, how confidently."""

    atom: str
    words: str
    source: str = ""
    confidence: float = 1.0


@dataclass(frozen=True)
class ContentProblem:
    """Something in the data of a scene that was ignored: a kind to count and words for people."""

    kind: str
    words: str


@dataclass(frozen=True)
class SceneFacts:
    """Objects with distinct names, and at most one relation for each pair of them."""

    objects: tuple[SceneObject, ...]
    relations: tuple[PairRelation, ...]

    @classmethod
    def checked(
        cls, objects: Iterable[SceneObject], relations: Iterable[PairRelation]
    ) -> tuple[SceneFacts, list[ContentProblem]]:
        """Facts from data that may be wrong; what is wrong is left out and so stays unknown.

        A name that several objects share stands for neither: one object of the name is kept,
        without location, attributes or relations. Of relations that contradict each other
        none is kept.

        Returns:
            The facts and what was ignored.
        """
        problems: list[ContentProblem] = []
        kept, ambiguous = _distinct(objects, problems)
        pairs: dict[frozenset[str], PairRelation | None] = {}
        for relation in relations:
            problem = _problem_of(relation, kept, ambiguous)
            known = pairs.get(relation.pair, relation)
            if problem is None and relation.pair in pairs:
                problem = ContentProblem("relation_repeated", f"{_words(relation)}: said twice")
                if known is None or not relation.agrees_with(known):
                    words = f"{_words(relation)}: another relation of the pair contradicts it"
                    problem = ContentProblem("relation_contradictory", words)
                    pairs[relation.pair] = None
            if problem is None:
                pairs[relation.pair] = relation
            else:
                problems.append(problem)
        relations = tuple(relation for relation in pairs.values() if relation is not None)
        return cls(tuple(kept.values()), relations), problems

    def contained(self) -> list[tuple[str, str]]:
        """Pairs (inner, outer) of which one is in the other."""
        return [
            (each.object, each.reference) for each in self.relations if each.position is Position.IN
        ]

    def perceived(self, used: Collection[Signature]) -> list[PerceivedRelation]:
        """The single relations that a program asks for, in the order of the pairs."""
        named = {member: name for member, name in RELATIONS.items() if (name, 2) in used}
        found = []
        for each in self.relations:
            pair = (each.object, each.reference)
            if each.position in named:
                trust, source = each.position_confidence, each.position_source
                found.append(PerceivedRelation(named[each.position], *pair, trust, source))
            if each.distance in named:
                trust, source = each.distance_confidence, each.distance_source
                found.append(PerceivedRelation(named[each.distance], *pair, trust, source))
        return found

    def statements(self, asked: Selection) -> list[SceneFact]:
        """The attributes and perceived relations that a program asks for, one by one."""
        number = self._number()
        found = []
        for attribute in ATTRIBUTES:
            if (attribute.predicate, 2) in asked.used:
                for index, each in enumerate(self.objects):
                    value = attribute.of(each)
                    if value is not None:
                        words = f"the {attribute.name} of {each.name!r} is {value}"
                        source = getattr(each, f"{attribute.name}_source")
                        found.append(SceneFact(attribute.atom(index, value), words, source))
        for relation in self.perceived(asked.used):
            pair = f"({number[relation.object]},{number[relation.reference]})"
            words = f"{relation.object!r} is {relation.relation} {relation.reference!r}"
            atom = f"{relation.relation}{pair}"
            found.append(SceneFact(atom, words, relation.source, relation.confidence))
        return found

    def render(self, asked: Selection, retractable: bool = False) -> str:
        """The facts as program text, object i of `objects` as the integer i.

        Args:
            asked: What the program asks for; nothing else is written.
            retractable: Whether each perceived relation k holds only `not retracted(k)`, for the
                program `retraction.lp`.
        """
        number = self._number()
        facts = [self.render_frame(asked), *self._attributes(asked)]
        if retractable:
            facts.extend(self._retractable(asked, number))
            return "".join(facts)
        # Looking values up, rather than writing what was given, keeps foreign text out even if a
        # caller passes strings for enum members.
        named = {member: name for member, name in RELATIONS.items() if (name, 2) in asked.used}
        for each in self.relations:
            pair = f"({number[each.object]},{number[each.reference]})."
            position, distance = named.get(each.position), named.get(each.distance)
            if position is not None:
                facts.append(position + pair)
            if distance is not None:
                facts.append(distance + pair)
        return "".join(facts)

    def render_frame(self, asked: Selection) -> str:
        """The part of the facts that says which objects there are and what of them is unknown."""
        objects = f"object(0..{len(self.objects) - 1})." if self.objects else ""
        return objects + "".join(f"unknown({atom})." for atom in self._unknown(asked))

    def _number(self) -> dict[str, int]:
        return {each.name: index for index, each in enumerate(self.objects)}

    def is_complete(self, asked: Selection) -> bool:
        """Whether everything is known that a program may conclude something from the absence of."""
        return next(self._unknown(asked), None) is None

    def _attributes(self, asked: Selection) -> Iterator[str]:
        for attribute in ATTRIBUTES:
            signature = (attribute.predicate, 2)
            if signature not in asked.used:
                continue
            for index, each in enumerate(self.objects):
                value = attribute.of(each)
                if value is None:
                    continue
                yield f"{attribute.atom(index, value)}."
                if signature in asked.denied:
                    others = (other.value for other in attribute.values if other.value != value)
                    yield from (f"-{attribute.atom(index, other)}." for other in others)

    def _retractable(self, asked: Selection, number: Mapping[str, int]) -> Iterator[str]:
        unknown = _asked_relations(asked)
        for index, each in enumerate(self.perceived(asked.used)):
            one, other = number[each.object], number[each.reference]
            yield f"perceived({index},{round(1000 * each.confidence)})."
            yield f"{each.relation}({one},{other}):-not retracted({index})."
            alike = Distance if each.relation in _DISTANCES else Position
            for name in unknown:
                if name in list(alike):
                    for pair in (f"({one},{other})", f"({other},{one})"):
                        yield f"unknown({name}{pair}):-retracted({index})."

    def _unknown(self, asked: Selection) -> Iterator[str]:
        """Atoms of which nobody knows whether they hold.

        An object that is not located may be anywhere, also under one that is seen. But what nobody
        sees is hidden by what is seen: no object that is seen is behind it.
        """
        for attribute in ATTRIBUTES:
            if attribute.predicate in asked.uncertain:
                for index, each in enumerate(self.objects):
                    if attribute.of(each) is None:
                        yield from (attribute.atom(index, one.value) for one in attribute.values)
        relations = _asked_relations(asked)
        count = len(self.objects)
        if not relations or len(self.relations) == count * (count - 1) // 2:
            return
        known, number = {each.pair for each in self.relations}, self._number()
        for one, other in itertools.permutations(self.objects, 2):
            if frozenset((one.name, other.name)) in known:
                continue
            pair = f"({number[one.name]},{number[other.name]})"
            for name in relations:
                seen_behind = name == Position.BEHIND and one.located and not other.located
                hidden_front = name == Position.FRONT and other.located and not one.located
                if not seen_behind and not hidden_front:
                    yield name + pair


def _asked_relations(asked: Selection) -> list[str]:
    return [name for name in RELATIONS.values() if name in asked.uncertain]


RELATIONS: dict[str, str] = {member: member.value for member in (*Position, *Distance)}
"""The relations that scenes tell of pairs of objects, by their predicates in the domain."""

_DISTANCES = frozenset(member.value for member in Distance)


@dataclass(frozen=True)
class SceneAttribute:
    """An attribute of objects: its name here, its predicate in the domain, its values."""

    name: str
    predicate: str
    values: type[Size] | type[Surface]

    def of(self, each: SceneObject) -> str | None:
        """The value for an object, always one of our own words; None if it is not known."""
        value = getattr(each, self.name)
        return None if value is None else self.values(value).value

    def atom(self, index: int, value: str) -> str:
        """The atom that says so, as program text."""
        return f"{self.predicate}({index},{value})"


ATTRIBUTES = (
    SceneAttribute("size", "obj_size", Size),
    SceneAttribute("surface", "obj_surface", Surface),
)
"""The attributes that scenes tell of objects."""


def cyclic_pairs(edges: Iterable[tuple[str, str]]) -> set[frozenset[str]]:
    """The pairs whose edge lies on a directed cycle."""
    edges = list(edges)
    bit = {name: 1 << index for index, name in enumerate(sorted({n for e in edges for n in e}))}
    reach = dict.fromkeys(bit, 0)  # name -> the names that it leads to, as a set of bits
    for start, end in edges:
        reach[start] |= bit[end]
    for middle in bit:
        for start in bit:
            if reach[start] & bit[middle]:
                reach[start] |= reach[middle]
    return {frozenset((start, end)) for start, end in edges if reach[end] & bit[start]}


def _distinct(
    objects: Iterable[SceneObject], problems: list[ContentProblem]
) -> tuple[dict[str, SceneObject], set[str]]:
    kept: dict[str, SceneObject] = {}
    ambiguous: set[str] = set()
    for object_ in objects:
        if object_.name in kept:
            if object_.name not in ambiguous:
                words = f"several objects are called {object_.name!r}: nothing is concluded of them"
                problems.append(ContentProblem("object_repeated", words))
            ambiguous.add(object_.name)
            object_ = SceneObject(object_.name, located=False)
        kept[object_.name] = object_
    return kept, ambiguous


def _problem_of(
    relation: PairRelation, objects: Collection[str], ambiguous: Collection[str]
) -> ContentProblem | None:
    for name in (relation.object, relation.reference):
        if name not in objects:
            words = f"{_words(relation)}: the scene has no object {name!r}"
            return ContentProblem("relation_of_unknown_object", words)
        if name in ambiguous:
            words = f"{_words(relation)}: several objects are called {name!r}"
            return ContentProblem("relation_of_repeated_object", words)
    if relation.object == relation.reference:
        words = f"{_words(relation)}: an object stands in no relation to itself"
        return ContentProblem("relation_to_itself", words)
    return None


def _words(relation: PairRelation) -> str:
    return (
        f"relation {relation.position}, {relation.distance} of {relation.object!r} to "
        f"{relation.reference!r} is ignored"
    )
