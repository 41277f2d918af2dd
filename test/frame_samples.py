"""Writes frames as the files that cameras and databases leave behind."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import cv2
import numpy as np

from ros_scenesense.scene import Frame


def write_color(path: Path, frame: Frame) -> Path:
    return _write(path, frame.color[..., ::-1])


def write_depth(path: Path, frame: Frame, units_per_metre: float = 1000.0) -> Path:
    return _write(path, np.round(frame.depth * units_per_metre).astype(np.uint16))


def write_annotation(path: Path, frame: Frame) -> Path:
    return _write(path, frame.instances.astype(np.uint8))


def write_camera(path: Path, frame: Frame, **more: object) -> Path:
    camera = frame.intrinsics
    names = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy", "width", "height")}
    path.write_text(json.dumps(names | more))
    return path


def write_pcd(path: Path, frame: Frame, encoding: str = "binary", label: bool = True) -> Path:
    """The organised cloud of a frame, with labels, as PCL writes it."""
    height, width = frame.depth.shape
    table = np.zeros(
        height * width,
        [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4"), ("label", "<u4")],
    )
    points = frame.intrinsics.back_project(frame.depth).reshape(-1, 3)
    for axis, name in enumerate("xyz"):
        table[name] = points[:, axis]
    red, green, blue = frame.color.reshape(-1, 3).astype(np.uint32).T
    table["rgb"] = ((red << 16) | (green << 8) | blue).view(np.float32)
    table["label"] = frame.instances.reshape(-1)
    names = list(table.dtype.names)[: None if label else -1]
    kinds = ["F", "F", "F", "F", "U"][: len(names)]
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
        f"FIELDS {' '.join(names)}\nSIZE{' 4' * len(names)}\nTYPE {' '.join(kinds)}\n"
        f"COUNT{' 1' * len(names)}\nWIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS {width * height}\nDATA {encoding}\n"
    )
    table = table[names]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + _data(np.array(table.tolist(), table.dtype), encoding))
    return path


def compress_lzf(content: bytes) -> bytes:
    """The simplest LZF: runs of literals, and a reference where a byte repeats."""
    out = bytearray()
    at = 0
    while at < len(content):
        run = 1
        while at + run < len(content) and run < 264 and content[at + run] == content[at]:
            run += 1
        if run > 3:
            out += bytes([0, content[at]])  # the byte itself, then a reference one byte back
            size = run - 1 - 2
            out += bytes([size << 5, 0]) if size < 7 else bytes([7 << 5, size - 7, 0])
            at += run
        else:
            piece = content[at : at + min(run, 32)]
            out += bytes([len(piece) - 1]) + piece
            at += len(piece)
    return bytes(out)


def _data(table: np.ndarray, encoding: str) -> bytes:
    if encoding == "ascii":
        rows = (" ".join(repr(value.item()) for value in row) for row in table)
        return "\n".join(rows).encode() + b"\n"
    if encoding == "binary":
        return table.tobytes()
    columns = b"".join(np.ascontiguousarray(table[name]).tobytes() for name in table.dtype.names)
    packed = compress_lzf(columns)
    return struct.pack("<II", len(packed), len(columns)) + packed


def _write(path: Path, pixels: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), pixels)
    return path
