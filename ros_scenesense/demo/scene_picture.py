"""A scene as a picture for the eye: outlines coloured by stability, names, who is hidden."""

from __future__ import annotations

from ros_scenesense.demo.annotation import Image, Note, annotate
from ros_scenesense.messages.scenes import ObjectLabel
from ros_scenesense.scene import Truth
from ros_scenesense.simulation.engine import SimulatedScene

_COLORS = {Truth.TRUE: (0, 150, 0), Truth.FALSE: (210, 0, 0), Truth.AMBIGUOUS: (90, 90, 90)}


def draw_scene(scene: SimulatedScene) -> Image:
    """The colour image, enlarged, with what is known; RGB.

    Outline and name of a stable object are green, of an unstable one red, of an ambiguous one grey.
    Behind the name of an object that is not fully visible stands how much of it is hidden.
    """
    assert scene.frame.instances is not None
    notes = [
        Note(known.instance, _words(label), _COLORS[label.stable])
        for known, label in zip(scene.objects, scene.object_labels, strict=True)
    ]
    return annotate(scene.frame.color, scene.frame.instances, notes)


def _words(label: ObjectLabel) -> str:
    if label.occluded is Truth.FALSE or label.visible_fraction is None:
        return label.name
    return f"{label.name} -{round(100 * (1 - label.visible_fraction))}%"
