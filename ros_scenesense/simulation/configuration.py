"""Parameters of the simulated world and its camera, read everywhere: no Bullet is needed."""

from __future__ import annotations

from dataclasses import dataclass

from ros_scenesense.errors import SimulationError
from ros_scenesense.parameters import parameter, parameters_of
from ros_scenesense.simulation.arrangements import Arrangement
from ros_scenesense.simulation.backgrounds import MOST_BACKGROUNDS


@dataclass(frozen=True)
class SimulationConfiguration:
    """Parameters of the simulated world and its camera."""

    arrangement: str = parameter(
        "mixed",
        "how objects are arranged; mixed takes towers, spread and intersection in turn",
        choices=tuple(str(arrangement) for arrangement in Arrangement),
    )
    width: int = parameter(320, "width of the images in pixels", minimum=64, maximum=1920)
    height: int = parameter(240, "height of the images in pixels", minimum=64, maximum=1080)
    field_of_view_deg: float = parameter(
        40.0, "vertical field of view of the camera in degrees", minimum=20.0, maximum=90.0
    )
    pitch_min_deg: float = parameter(
        15.0, "least angle in degrees at which the camera looks down", minimum=5.0, maximum=60.0
    )
    pitch_max_deg: float = parameter(
        30.0, "largest angle in degrees at which the camera looks down", minimum=5.0, maximum=60.0
    )
    yaw_deg: float = parameter(
        30.0,
        "the camera stands behind the table's centre, turned about it by up to this many degrees",
        minimum=0.0,
        maximum=180.0,
    )
    roll_deg: float = parameter(
        0.0,
        "the camera is turned about its optical axis by up to this many degrees",
        minimum=0.0,
        maximum=20.0,
    )
    distance_max: float = parameter(
        1.3,
        "the camera stands at most this many times as far as it must to see everything",
        minimum=1.0,
        maximum=4.0,
    )
    shadows: bool = parameter(True, "whether objects cast shadows")
    textures: bool = parameter(True, "whether objects have textures")
    backgrounds: int = parameter(
        8, "number of different tables and walls; 0 = plain", minimum=0, maximum=MOST_BACKGROUNDS
    )
    objects_dir: str = parameter(
        "", "folder of *.yaml files with objects that are added or replace shipped ones"
    )
    ycb_dir: str = parameter(
        "", "folder of the YCB models that replace their stand-ins; empty = stand-ins"
    )


def check(configuration: SimulationConfiguration) -> None:
    """Looks at every parameter.

    Raises:
        ParameterError: If one is out of its range.
        SimulationError: If two contradict each other.
    """
    for declared in parameters_of(type(configuration)):
        declared.check(getattr(configuration, declared.name))
    low, high = configuration.pitch_min_deg, configuration.pitch_max_deg
    if low > high:
        raise SimulationError(
            f"pitch_min_deg is {low:g}, pitch_max_deg is {high:g}: the first must not be larger"
        )
