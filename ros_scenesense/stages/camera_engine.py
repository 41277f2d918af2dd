"""What the camera stage lets its worker do: make scenes, act in them, read recorded ones."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ros_scenesense.messages.actions import PlannedAction
from ros_scenesense.parameters import parameter
from ros_scenesense.simulation.engine import SimulatedScene, SimulationConfiguration
from ros_scenesense.simulation.episodes import EpisodeEngine, Story
from ros_scenesense.simulation.noise import NONE, PRESETS, noisy_frame
from ros_scenesense.simulation.scene_files import read_scenes

if TYPE_CHECKING:
    from ros_scenesense.simulation.actions import ActionOutcome


@dataclass(frozen=True)
class SimulatedCameraConfiguration(SimulationConfiguration):
    """Parameters of the camera node: those of the simulation, where scenes are from, and pacing."""

    seed: int = parameter(0, "seed of all scenes; same seed, same scenes", minimum=0)
    scenes: int = parameter(0, "scenes to show in a session; 0 = without end", minimum=0)
    mode: str = parameter(
        "testing",
        "training: labels may be learned from; testing: they only evaluate",
        choices=("training", "testing"),
    )
    autostart: bool = parameter(
        True, "show scenes by itself; else one for each call of the service next_scene"
    )
    in_flight: int = parameter(
        2, "scenes that may wait for their estimates at once", minimum=1, maximum=32
    )
    resend_s: float = parameter(
        5.0, "seconds without an estimate after which a scene is shown again", minimum=0.1
    )
    attempts: int = parameter(4, "times a scene is shown before it is lost", minimum=1)
    episode_timeout_s: float = parameter(
        60.0,
        "seconds without an action of the robot after which the camera goes on by itself",
        minimum=0.1,
    )
    dataset: str = parameter(
        "", "folder of a dataset whose scenes are shown; empty = they are simulated"
    )
    scene_files: str = parameter(
        "",
        "scene file, or folder of scene files, whose scenes are shown in order and can be acted "
        "in; empty = they are drawn",
    )
    withheld_attributes: float = parameter(
        0.0,
        "share of the objects' attributes (size, surface, shape, colour) that `scene` leaves out",
        minimum=0.0,
        maximum=1.0,
    )
    noise: str = parameter(
        NONE,
        "how the depth camera errs: not at all, or as the first Kinect does",
        choices=tuple(PRESETS),
    )
    session: str = parameter(
        "", "first part of every scene_id; a session that exists is continued, empty = a new one"
    )
    state_dir: str = parameter("", "folder of camera.db; empty = nothing is remembered")


class CameraEngine:
    """The simulation, with the time that everything took in seconds.

    Args:
        configuration: Parameters of all scenes.

    Raises:
        SceneSenseError: If the simulation cannot be started.
    """

    # Bullet loses 1 to 11 KiB with every body that it makes and removes, about 18 KiB a scene.
    jobs_per_life = 500

    def __init__(self, configuration: SimulatedCameraConfiguration) -> None:
        files = configuration.scene_files
        scenes = read_scenes(Path(files).expanduser()) if files else []
        self._simulation = EpisodeEngine(configuration, scenes)
        self._noise = configuration.noise

    def scene(self, seed: int, number: int) -> tuple[SimulatedScene, float]:
        """Renders and labels a scene."""
        start = time.perf_counter()
        scene = self._seen(self._simulation.scene(seed, number), Story(seed, number))
        return scene, time.perf_counter() - start

    def act(
        self, story: Story, action: PlannedAction
    ) -> tuple[ActionOutcome, SimulatedScene | None, float]:
        """Executes an action after a story; the scene is None if it was refused."""
        start = time.perf_counter()
        outcome, scene = self._simulation.act(story, action)
        if scene is not None:
            scene = self._seen(scene, story.then(action))
        return outcome, scene, time.perf_counter() - start

    def replay(self, story: Story) -> tuple[SimulatedScene, float]:
        """Makes the last scene of a story again."""
        start = time.perf_counter()
        scene = self._seen(self._simulation.replay(story), story)
        return scene, time.perf_counter() - start

    def close(self) -> None:
        """Disconnects from the physics engine."""
        self._simulation.close()

    def _seen(self, scene: SimulatedScene, story: Story) -> SimulatedScene:
        return _seen(scene, self._noise, story)


class PlayingEngine:
    """A dataset in place of the simulation.

    Args:
        folder: Of the dataset.
        noise: How the depth camera errs.

    Raises:
        DatasetError: If it is no complete dataset.
    """

    def __init__(self, folder: Path, noise: str = NONE) -> None:
        from ros_scenesense.simulation.dataset.reader import DatasetReader

        self._scenes = DatasetReader(folder)
        self._noise = noise

    def scene(self, seed: int, number: int) -> tuple[SimulatedScene, float]:
        """Reads a scene, which is that of the dataset whatever the seed; noise depends on both."""
        start = time.perf_counter()
        scene = _seen(self._scenes[number], self._noise, Story(seed, number))
        return scene, time.perf_counter() - start


def _seen(scene: SimulatedScene, noise: str, story: Story) -> SimulatedScene:
    """The scene as the depth camera reads it; the same story always gives the same readings."""
    if noise == NONE:
        return scene
    rng = np.random.default_rng([story.seed, story.index, len(story.actions), *b"noise"])
    return replace(scene, frame=noisy_frame(scene.frame, PRESETS[noise], rng))
