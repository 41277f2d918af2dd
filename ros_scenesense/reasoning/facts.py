"""What is known of a scene, and its rendering as facts of the program.

Objects become integers and relations and attributes the values of our own enums, all in one batch
of text: a name from outside never enters program text.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from ros_scenesense.reasoning.syntax import Signature
from ros_scenesense.scene import Distance, Position, Size, Surface


@dataclass(frozen=True)
class SceneObject:
    """An object; None = unknown. Of an object that is not located, few relations are known."""

    name: str
    located: bool = True
    size: Size | None = None
    surface: Surface | None = None


@dataclass(frozen=True)
class PairRelation:
    """How `object` stands to `reference`; the converse is left to the program."""

    object: str
    reference: str
    position: Position
    distance: Distance

    @property
    def pair(self) -> frozenset[str]:
        """The two names, in no order."""
        return frozenset((self.object, self.reference))

    def agrees_with(self, other: PairRelation) -> bool:
        """Whether two relations of one pair say the same, perhaps in the other direction."""
        position = other.position if other.object == self.object else other.position.converse
        return (self.position, self.distance) == (position, other.distance)


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

    def without_pairs(self, pairs: Collection[frozenset[str]]) -> SceneFacts:
        """The same scene with nothing known of how these pairs stand to each other."""
        kept = tuple(relation for relation in self.relations if relation.pair not in pairs)
        return SceneFacts(self.objects, kept)

    def render(self, enabled: Iterable[str], used: Collection[Signature]) -> str:
        """The facts as program text, object i of `objects` as the integer i.

        Args:
            enabled: Ids of the axioms in force, as the program itself declares them.
            used: Predicates that the program asks for; no others are written.
        """
        number = {object_.name: index for index, object_ in enumerate(self.objects)}
        # Looking values up here, rather than writing what was given, keeps foreign text out even
        # if a caller passes strings for enum members.
        named = {name: name for name in _RELATIONS if (name, 2) in used}
        facts = [f"enabled({axiom})." for axiom in enabled]
        facts.extend(f"surveyed({number[name]})." for name in self._surveyed())
        for predicate, vocabulary in (("size", Size), ("surface", Surface)):
            if (predicate, 2) in used:
                for index, object_ in enumerate(self.objects):
                    value = getattr(object_, predicate)
                    if value is not None:
                        facts.append(f"{predicate}({index},{vocabulary(value).value}).")
        for relation in self.relations:
            arguments = f"({number[relation.object]},{number[relation.reference]})."
            for value in (relation.position, relation.distance):
                if value in named:
                    facts.append(named[value] + arguments)
        return "".join(facts)

    def _surveyed(self) -> Sequence[str]:
        """Located objects whose relation to every other located object is known.

        Objects that are not located do not count among the others: an object that nobody sees is
        hidden by objects that are seen, and those tell whether something is occluded.
        """
        located = {object_.name for object_ in self.objects if object_.located}
        partners = dict.fromkeys(located, 0)
        for relation in self.relations:
            if relation.object in located and relation.reference in located:
                partners[relation.object] += 1
                partners[relation.reference] += 1
        return sorted(name for name, count in partners.items() if count == len(located) - 1)


_RELATIONS: dict[str, str] = {member: member.value for member in (*Position, *Distance)}


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
