"""A scene in the words of the robot's domain: what planning and diagnosis start from.

The robot assistant's domain gives the words; objects become constants and are mapped back, so that
no name from outside enters a program.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from functools import cache

from ros_scenesense.errors import LanguageError, ReasoningError
from ros_scenesense.knowledge.action_language import load, parse_goal
from ros_scenesense.knowledge.description import Goal, SystemDescription
from ros_scenesense.knowledge.literals import Atom, Literal
from ros_scenesense.knowledge.names import Names
from ros_scenesense.knowledge.terms import Constant, Symbol, Variable
from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.reasoning.described_scenes import TABLE, KnownScene
from ros_scenesense.reasoning.facts import SceneObject
from ros_scenesense.reasoning.planning import PlanningTask
from ros_scenesense.resources import resource
from ros_scenesense.scene import Size

AVOIDED = Literal(Atom("stable", (Variable("X"),)), False)
"""What no action of the robot may bring about."""

PREFERRED = Literal(Atom("on", (Variable("X"), Constant(TABLE))))
"""Of what there are to be few among equally good plans: objects directly on the table.

Among plans that are as good in this, too, few are to stand on what is not large.
"""


@cache
def robot_domain() -> SystemDescription:
    """The domain that comes with SceneSense, `asp/robot_assistant.al`.

    Raises:
        SceneSenseError: If it is missing or broken.
    """
    return load(resource("asp", "robot_assistant.al")).description


class Situation:
    """A scene, and the domain about it.

    Args:
        domain: The robot's domain, without objects.
        scene: What is known. Objects that are not located are left out: nothing can be planned
            with what may be anywhere.
        withheld: Ids of axioms that are switched off.
        called: Names of objects of earlier scenes, which keep their constants.

    Attributes:
        description: The domain with the objects of the scene and what is known of them.
        initial: What is true in the scene.
        names: Constants of the objects.
        robot: Whose hand it is.
        objects: The constants of those that are located.
    """

    def __init__(
        self,
        domain: SystemDescription,
        scene: KnownScene,
        withheld: Collection[str] = (),
        called: Iterable[str] = (),
    ) -> None:
        self._scene = scene
        located = [each for each in scene.facts.objects if each.located]
        objects = located if scene.held is None else [*located, scene.held]
        taken = {
            symbol.name
            for sort in domain.signature.sorts
            for symbol in domain.signature.members(sort)
            if isinstance(symbol, Constant)
        }
        self.names = Names([*called, *(each.name for each in objects)], taken)
        self.objects = tuple(self.names.constant(each.name) for each in located)
        self.robot = next(iter(domain.signature.members("robot")))
        self.description = (
            domain.without(withheld)
            .with_members("object", (self.names.constant(each.name) for each in objects))
            .with_facts(fact for each in objects for fact in self._attributes(each))
        )
        self.initial = tuple(self._relations({each.name for each in located}))

    @property
    def renamed(self) -> dict[str, str]:
        """The objects that are called otherwise in the domain: name there -> own name."""
        return {
            constant.name: self.names.name(constant)
            for constant in self.names.constants
            if self.names.name(constant) != constant.name
        }

    def goal(self, text: str) -> Goal:
        """Reads a goal such as `on(red_can, white_cube), no occluded(X)`, or the name of one.

        Raises:
            LanguageError: If it says something wrong, or speaks of what is not in the scene.
        """
        try:
            return parse_goal(text, self.description)
        except LanguageError as error:
            raise LanguageError(f"{error}{self._hint(text)}") from error

    def task(self, goal: Goal) -> PlanningTask:
        """The task of achieving a goal from here."""
        narrow = (
            Literal(Atom("on", (Variable("X"), self.names.constant(each.name))))
            for each in self._scene.facts.objects
            if each.located and each.size is not Size.LARGE
        )
        return PlanningTask(
            self.description,
            self.initial,
            goal,
            avoided=(AVOIDED,),
            preferred=((PREFERRED,), tuple(narrow)),
        )

    def planned(self, action: Atom) -> PlannedAction:
        """An action of the domain as the robot is told to do it.

        Raises:
            ReasoningError: If the robot has no such action.
        """
        arguments = [self.name(symbol) for symbol in action.arguments[1:]]
        if action.name == "pickup" and len(arguments) == 1:
            return PlannedAction(kind="pickup", object=arguments[0])
        if action.name == "putdown" and len(arguments) == 2:
            return PlannedAction(kind="putdown", object=arguments[0], location=arguments[1])
        raise ReasoningError(f"the robot cannot do {action}: it can pickup and putdown")

    def action(self, planned: PlannedAction) -> Atom:
        """What the robot was told to do, as an action of the domain.

        Raises:
            KeyError: If it is about an object that is not here.
        """
        arguments: list[Symbol] = [self.robot, self.names.constant(planned.object)]
        if planned.kind == "putdown":
            location = planned.location or TABLE
            arguments.append(
                Constant(TABLE) if location == TABLE else self.names.constant(location)
            )
        return Atom(planned.kind, tuple(arguments))

    def name(self, symbol: object) -> str:
        """The name of an object, or what else a constant is called."""
        if isinstance(symbol, Constant) and symbol in self.names.constants:
            return self.names.name(symbol)
        return str(symbol)

    def _attributes(self, each: SceneObject) -> Iterator[Literal]:
        constant = self.names.constant(each.name)
        if each.size is not None:
            yield Literal(Atom("obj_size", (constant, Constant(each.size.value))))
        if each.surface is not None:
            yield Literal(Atom("obj_surface", (constant, Constant(each.surface.value))))

    def _relations(self, located: Collection[str]) -> Iterator[Literal]:
        for each in self._scene.facts.relations:
            if each.object in located and each.reference in located:
                pair = (self.names.constant(each.object), self.names.constant(each.reference))
                yield Literal(Atom(each.position.value, pair))
                yield Literal(Atom(each.distance.value, pair))
        if self._scene.held is not None:
            held = self.names.constant(self._scene.held.name)
            yield Literal(Atom("in_hand", (self.robot, held)))

    def _hint(self, text: str) -> str:
        """What may help somebody whose goal could not be read."""
        hints = [
            f"{each.name} is not located in this scene"
            for each in self._scene.facts.objects
            if not each.located and each.name in text
        ]
        renamed = [f"{name!r} is called {constant}" for constant, name in self.renamed.items()]
        words = "; ".join([*hints, *renamed[:5]])
        return f" ({words})" if words else ""
