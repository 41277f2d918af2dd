"""What a dataset is: everything that decides about its bytes, and what its labels mean."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from importlib import metadata as distributions

import cv2
import msgspec

import ros_scenesense
from ros_scenesense.parameters import parameter, parameters_of
from ros_scenesense.simulation.dataset.images import DEPTH_UNIT_M
from ros_scenesense.simulation.dataset.plan import Draw
from ros_scenesense.simulation.engine import SimulationConfiguration
from ros_scenesense.simulation.object_sources import objects_fingerprint
from ros_scenesense.simulation.occlusion import NOT_OCCLUDED_FROM, OCCLUDED_BELOW
from ros_scenesense.simulation.relations import FAR_M, TOUCHING_M
from ros_scenesense.simulation.stability import JITTER_M, REPETITIONS, UNSTABLE_DISPLACEMENT_M

DEFINITIONS = {
    "depth": f"metres along the optical axis = value * {DEPTH_UNIT_M:g}; 0 = nothing was read",
    "instances": "number of the object in `objects`, from 1; 0 = background",
    "pose": "of an object: its centre of mass in the world; of the camera: its optical frame",
    "stable": f"true if the object's centre of mass moves at most {UNSTABLE_DISPLACEMENT_M:g} m "
    f"in two seconds in each of {REPETITIONS} repetitions, false if it moves farther in each, else "
    f"ambiguous; all but the first repetition start with every object displaced by {JITTER_M:g} m; "
    "structures are judged far apart from each other, what stands alone once for its kind",
    "visible_fraction": "visible pixels / pixels that would be visible if only the object and "
    "what it carries were there",
    "occluded": f"true if visible_fraction < {OCCLUDED_BELOW:g}, false from "
    f"{NOT_OCCLUDED_FROM:g} on, else ambiguous",
    "hidden": "share of the pixels, visible if only the object and what it carries were there, "
    "that another object covers",
    "relations": "of every pair, by hulls and contacts, in the viewer's gravity-up frame; the "
    f"meshes of touching objects are at most {TOUCHING_M:g} m apart, those of far ones at least "
    f"{FAR_M:g} m; ambiguous where a careful person may doubt",
    "background": "number of the images on table and wall; 0 = plain",
    "structure": "maximal stack; unstable if one member surely is, stable if all surely are, "
    "else ambiguous",
}


OTHER_OBJECTS = (
    "its objects were others (the files of objects_dir, ycb_dir or config/objects, or meshes or "
    "textures that they name, have changed)"
)


class Metadata(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    kw_only=True,
    tag_field="schema",
    tag="dataset/1",
):
    """Describes a dataset; all but `count` decides what each of its scenes is.

    `versions` are those of the programs that decide about bytes, `objects` is the fingerprint of
    what the object files and meshes say. `source` is the fingerprint of
    the dataset whose scenes these are before other backgrounds; it is left out where there is
    none. A dataset may grow: scenes do not depend on `count`.
    """

    seed: int
    count: int
    draw: Draw
    configuration: SimulationConfiguration
    renderer: str = "TinyRenderer, the table computed"
    depth_unit_m: float = DEPTH_UNIT_M
    objects: str
    versions: dict[str, str]
    definitions: dict[str, str]
    source: str | msgspec.UnsetType = msgspec.UNSET

    def fingerprint(self) -> str:
        """Text that is equal if and only if the scenes of the same numbers are."""
        same = msgspec.structs.replace(self, count=0, definitions={})
        content = msgspec.json.encode(same, order="sorted")
        return hashlib.sha256(content).hexdigest()[:16]

    def differences(self, other: Metadata) -> list[str]:
        """In words, what is not the same in another dataset; the count may differ."""
        mine, theirs = _flat(self), _flat(other)
        return [
            OTHER_OBJECTS
            if name == "objects"
            else f"{name} is {mine.get(name)!r}, not {theirs.get(name)!r}"
            for name in [*mine, *(name for name in theirs if name not in mine)]
            if mine.get(name) != theirs.get(name)
        ]


@dataclass(frozen=True)
class DatasetOptions:
    """Parameters of a dataset besides those of its scenes."""

    count: int = parameter(6000, "number of scenes", minimum=1, maximum=1_000_000)
    seed: int = parameter(0, "seed of all that is random", minimum=0, maximum=2**53 - 1)
    draw: str = parameter(
        "balanced",
        "balanced: unstable stacks have a fixed share for every number of objects in the stack; "
        "natural: scenes are taken as the arrangement gives them",
        choices=tuple(str(draw) for draw in Draw),
    )


def describe(configuration: SimulationConfiguration, options: DatasetOptions) -> Metadata:
    """The dataset of these parameters, as this installation makes it.

    Raises:
        ParameterError: If a parameter is out of its range.
        SimulationError: If a file of an object is missing or wrong.
    """
    for part in (configuration, options):
        for declared in parameters_of(type(part)):
            declared.check(getattr(part, declared.name))
    return Metadata(
        seed=options.seed,
        count=options.count,
        draw=Draw(options.draw),
        configuration=configuration,
        objects=objects_fingerprint(configuration.objects_dir, configuration.ycb_dir),
        versions=installed_versions(),
        definitions=DEFINITIONS,
    )


def installed_versions() -> dict[str, str]:
    """Versions of the programs here that decide about the bytes of a dataset."""
    return {
        "ros_scenesense": ros_scenesense.__version__,
        **{name: distributions.version(name) for name in ("numpy", "pybullet")},
        "opencv": cv2.__version__,
    }


def _flat(metadata: Metadata) -> dict[str, object]:
    plain = msgspec.to_builtins(metadata)
    del plain["count"], plain["definitions"]
    flat: dict[str, object] = {}
    for name, value in plain.items():
        flat |= value if isinstance(value, dict) and name == "configuration" else {name: value}
    return flat
