"""Loads a user's copy of the Table Object Scene Database, with relation labels made for it.

The paper's first experiment takes its pairs of objects from this database of real scenes: 111 to
train, 131 to test (section *Incremental Grounding*). It has no relation labels; `scenesense label`
makes them. docs/real_cameras.md says which layouts of files are read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import DatasetError, FrameError
from ros_scenesense.experiments.pcd import CloudFile, read_pcd
from ros_scenesense.experiments.relation_labels import RelationLabel, read_labels
from ros_scenesense.geometry import Intrinsics
from ros_scenesense.perceive.frame_files import (
    FRAME_ID,
    MILLIMETRES,
    CameraFile,
    read_camera,
    read_color,
    read_depth,
    read_png,
)
from ros_scenesense.scene import Frame

LABEL_FILE = "relations.jsonl"
CAMERA_FILE = "camera.json"
KINECT = CameraFile(525.0, 525.0, 319.5, 239.5, width=640, height=480)
"""Nominal intrinsics of the first-generation Kinect, which took the scenes."""

_IMAGE_FOLDERS = ("image_color", "annotation")
_DEPTH_FOLDERS = ("disparity", "depth")
_DEEPEST = 3


class Split(StrEnum):
    """The paper's two sets of scenes."""

    TRAINING = "training"
    TEST = "test"


_PREFIXES = {"learn": Split.TRAINING, "train": Split.TRAINING, "test": Split.TEST}


@dataclass(frozen=True)
class _Files:
    """Where a scene is: in a cloud alone, or in images."""

    cloud: Path | None
    color: Path | None = None
    annotation: Path | None = None
    depth: Path | None = None


@dataclass(frozen=True, eq=False)
class TosdScene:
    """A real scene.

    Attributes:
        name: Of its files, with the folders between if there are any.
        split: The set it belongs to.
        frame: Colour, depth and instance ids of the annotated objects (0 = table and background).
        labels: What a person said of its pairs; without the unclear ones.
    """

    name: str
    split: Split
    frame: Frame
    labels: tuple[RelationLabel, ...]

    @property
    def objects(self) -> list[str]:
        """Names of the annotated objects: `object_<instance id>`."""
        return [f"object_{instance}" for instance in instances_in(self.frame)]


def instances_in(frame: Frame) -> list[int]:
    """The instance ids in a frame, without the background."""
    assert frame.instances is not None
    return [int(one) for one in np.unique(frame.instances) if one]


class Tosd:
    """A folder with the scenes of the database.

    Args:
        folder: The folder; its subfolders may hold the two sets.
        labels: File with the relation labels; None = `relations.jsonl` in the folder.

    Raises:
        DatasetError: If there are no scenes, a scene belongs to neither set, files of a scene are
            missing, or the labels are wrong or of scenes that are not there.
    """

    def __init__(self, folder: Path, labels: Path | None = None) -> None:
        self.folder = folder
        self.label_file = labels or folder / LABEL_FILE
        self._files = _discover(folder)
        self._splits = {name: _split_of(name) for name in self._files}
        self._labels = read_labels(self.label_file)
        for label in self._labels:
            if label.scene not in self._files:
                raise DatasetError(
                    f"'{self.label_file}' has labels of scene '{label.scene}', which is not in "
                    f"'{folder}'"
                )
        self._camera = self._read_camera()

    def names(self, split: Split | None = None) -> list[str]:
        """Names of the scenes of a set, or of both, in the order of the numbers in them."""
        chosen = [name for name in self._files if split in (None, self._splits[name])]
        return sorted(chosen, key=_natural)

    def load(self, name: str) -> TosdScene:
        """One scene.

        Raises:
            DatasetError: If a file of it is damaged, or labels name objects that it lacks.
        """
        files = self._files[name]
        try:
            frame = self._from_cloud(files.cloud) if files.cloud else self._from_images(files)
        except FrameError as error:
            raise DatasetError(f"scene '{name}': {error}") from error
        labels = tuple(
            label for label in self._labels if label.scene == name and label.relation != "unclear"
        )
        scene = TosdScene(name, self._splits[name], frame, labels)
        known = set(scene.objects)
        for label in labels:
            if not label.pair <= known:
                raise DatasetError(
                    f"'{self.label_file}': scene '{name}' has no "
                    f"{' and '.join(sorted(label.pair - known))}"
                )
        return scene

    def labelled(self, split: Split | None = None) -> Iterator[TosdScene]:
        """The scenes that have labels, loaded one after the other."""
        having = {label.scene for label in self._labels if label.relation != "unclear"}
        for name in self.names(split):
            if name in having:
                yield self.load(name)

    def _read_camera(self) -> CameraFile | None:
        path = self.folder / CAMERA_FILE
        try:
            return read_camera(path) if path.exists() else None
        except FrameError as error:
            raise DatasetError(str(error)) from error

    def _from_images(self, files: _Files) -> Frame:
        assert files.color is not None
        assert files.annotation is not None
        assert files.depth is not None
        camera = self._camera or KINECT
        color = read_color(files.color)
        height, width = color.shape[:2]
        return Frame(
            0,
            FRAME_ID,
            color,
            read_depth(files.depth, camera.units_per_metre or MILLIMETRES),
            camera.intrinsics(width, height),
            instances_of_annotation(read_png(files.annotation)),
        )

    def _from_cloud(self, path: Path) -> Frame:
        frame = frame_of_cloud(read_pcd(path), str(path))
        if self._camera is None:
            return frame
        height, width = frame.depth.shape
        return replace(frame, intrinsics=self._camera.intrinsics(width, height))


def instances_of_annotation(pixels: npt.NDArray[np.generic]) -> npt.NDArray[np.uint16]:
    """Instance ids (H, W) of an annotation image: grey values are ids, colours are numbered.

    Args:
        pixels: (H, W) or (H, W, 3 or 4), 8 or 16 bits. Of a coloured image every colour but black
            is an object; they are numbered from 1 in the order of their (blue, green, red) values.
    """
    if pixels.ndim == 2:
        return pixels.astype(np.uint16)
    channels = pixels[..., :3].astype(np.int64)
    packed = (channels[..., 0] << 32) + (channels[..., 1] << 16) + channels[..., 2]
    colors, numbers = np.unique(packed, return_inverse=True)
    offset = 0 if colors[0] == 0 else 1
    return (numbers.reshape(packed.shape) + offset).astype(np.uint16)


def frame_of_cloud(cloud: CloudFile, name: str) -> Frame:
    """The images that an organised, labelled cloud (x, y, z, rgb, label) was made of.

    The intrinsics are those that project every point to its pixel (least squares).

    Raises:
        DatasetError: If a field is missing, the cloud is no image, or too few points are finite.
    """
    missing = {"x", "y", "z", "label"} - set(cloud.fields)
    if missing:
        raise DatasetError(f"'{name}' has no field {', '.join(sorted(missing))}")
    if cloud.height < 2:
        raise DatasetError(f"'{name}' is not organised: its height is 1, so points have no pixels")
    shape = (cloud.height, cloud.width)
    with np.errstate(invalid="ignore"):  # NaN marks a pixel without a reading
        x, y, z = (cloud.fields[axis].astype(np.float64).reshape(shape) for axis in "xyz")
    seen = np.isfinite(x) & np.isfinite(y) & np.isfinite(z) & (z > 0.0)
    if np.count_nonzero(seen) < 100:
        raise DatasetError(f"'{name}' has fewer than 100 points with finite coordinates")
    depth = np.where(seen, z, 0.0).astype(np.float32)
    instances = cloud.fields["label"].reshape(shape).astype(np.int64)
    # PCL marks what nobody labelled with the largest 32-bit number.
    known = (instances > 0) & (instances < 65536)
    rows, columns = np.nonzero(seen)
    fx, cx = _fit(x[seen] / z[seen], columns)
    fy, cy = _fit(y[seen] / z[seen], rows)
    return Frame(
        0,
        FRAME_ID,
        _colors(cloud, shape),
        depth,
        Intrinsics(cloud.width, cloud.height, fx, fy, cx, cy),
        np.where(known, instances, 0).astype(np.uint16),
    )


def _fit(slopes: npt.NDArray[np.float64], pixels: npt.NDArray[np.intp]) -> tuple[float, float]:
    """Focal length and centre along one axis: pixel = focal length * slope + centre."""
    focal, centre = np.polynomial.polynomial.polyfit(slopes, pixels.astype(np.float64), 1)[::-1]
    return float(focal), float(centre)


def _colors(cloud: CloudFile, shape: tuple[int, int]) -> npt.NDArray[np.uint8]:
    """Colour as PCL packs it into one number; a cloud without colour is grey."""
    packed = next((cloud.fields[name] for name in ("rgb", "rgba") if name in cloud.fields), None)
    if packed is None:
        return np.full((*shape, 3), 128, np.uint8)
    bits = packed.astype(np.float32).view(np.uint32) if packed.dtype.kind == "f" else packed
    bits = bits.astype(np.uint32)
    colors = np.stack([bits >> 16, bits >> 8, bits], axis=-1) & 0xFF
    return colors.astype(np.uint8).reshape(*shape, 3)


def _discover(folder: Path) -> dict[str, _Files]:
    """The scenes of a folder and of the folders in it, by name."""
    if not folder.is_dir():
        raise DatasetError(f"'{folder}' is no folder: give the folder with the scenes of the TOSD")
    found: dict[str, _Files] = {}
    for place in _folders(folder, _DEEPEST):
        for name, files in (_image_scenes(place) or _cloud_scenes(place)).items():
            found["/".join([*place.relative_to(folder).parts, name])] = files
    if not found:
        raise DatasetError(
            f"'{folder}' holds no scenes: neither {' and '.join(_IMAGE_FOLDERS)} folders nor .pcd "
            "files are in it or in its folders"
        )
    return found


def _folders(folder: Path, depth: int) -> Iterator[Path]:
    """The folder and those in it, without the ones that hold the parts of scenes."""
    yield folder
    parts = {*_IMAGE_FOLDERS, *_DEPTH_FOLDERS}
    if (folder / _IMAGE_FOLDERS[0]).is_dir():
        parts.add("pcd")
    if depth > 0:
        for inner in sorted(path for path in folder.iterdir() if path.is_dir()):
            if inner.name not in parts and not inner.name.startswith("."):
                yield from _folders(inner, depth - 1)


def _image_scenes(place: Path) -> dict[str, _Files]:
    found = {}
    for color in sorted((place / _IMAGE_FOLDERS[0]).glob("*.png")):
        annotation = place / _IMAGE_FOLDERS[1] / color.name
        cloud = place / "pcd" / f"{color.stem}.pcd"
        depths = [place / kind / color.name for kind in _DEPTH_FOLDERS]
        depth = next((path for path in depths if path.exists()), None)
        if depth is not None and annotation.exists():
            found[color.stem] = _Files(None, color, annotation, depth)
        elif cloud.exists():
            found[color.stem] = _Files(cloud)
        else:
            lacking = annotation if depth is not None else depths[0]
            raise DatasetError(f"scene '{color.stem}' of '{place}' lacks '{lacking}'")
    return found


def _cloud_scenes(place: Path) -> dict[str, _Files]:
    return {path.stem: _Files(path) for path in sorted(place.glob("*.pcd"))}


def _split_of(name: str) -> Split:
    """The set of a scene: by its own name, or by the folder that it is in."""
    for word in reversed(name.split("/")):
        for prefix, split in _PREFIXES.items():
            if word.lower().startswith(prefix):
                return split
    raise DatasetError(
        f"scene '{name}' belongs to no set: its name, or that of a folder it is in, must begin "
        f"with one of {', '.join(_PREFIXES)}"
    )


def _natural(name: str) -> list[tuple[int, str]]:
    """A key that sorts `learn2` before `learn10`."""
    digits = "".join(sign if sign.isdecimal() else f" {sign} " for sign in name).split()
    return [(int(word), "") if word.isdecimal() else (-1, word) for word in digits]
