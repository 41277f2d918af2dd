"""Reads organised point clouds in the PCD format: ascii, binary and binary_compressed.

Open3D reads them too, but forgets that a cloud is an image: width and height are what projects a
label back to its pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ros_scenesense.errors import DatasetError

_LARGEST = 64_000_000
_KINDS = {"F": "f", "I": "i", "U": "u"}


@dataclass(frozen=True, eq=False)
class CloudFile:
    """The columns of a cloud.

    Attributes:
        width: Pixels in a row of the image that the cloud was.
        height: Rows; 1 if the cloud is not organised.
        fields: The columns by name, each of width * height values.
    """

    width: int
    height: int
    fields: dict[str, npt.NDArray[Any]]


def read_pcd(path: Path) -> CloudFile:
    """Reads a cloud whose fields hold one number per point each.

    Raises:
        DatasetError: If the file is missing, damaged, or uses what is not read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DatasetError(f"'{path}' cannot be read: {error.strerror}") from error
    try:
        header, data = _split(content)
        width, height = int(header["WIDTH"][0]), int(header["HEIGHT"][0])
        if width < 1 or height < 1 or width * height > _LARGEST:
            raise ValueError(f"a cloud of {width}x{height} points is not read")
        dtype = _dtype(header)
        rows = _rows(header["DATA"][0], data, dtype, width * height)
    except (KeyError, IndexError, ValueError, OverflowError) as error:
        words = f"it says no {error}" if isinstance(error, KeyError) else str(error)
        raise DatasetError(f"'{path}' is no readable PCD file: {words}") from error
    return CloudFile(width, height, rows)


def _split(content: bytes) -> tuple[dict[str, list[str]], bytes]:
    """Header lines by keyword, and what follows the line DATA."""
    header: dict[str, list[str]] = {}
    at = 0
    while "DATA" not in header:
        end = content.find(b"\n", at)
        if end < 0 or end - at > 4096:
            raise ValueError("its header has no line DATA")
        words = content[at:end].decode("ascii", "replace").split()
        at = end + 1
        if words and not words[0].startswith("#"):
            header[words[0].upper()] = words[1:]
    return header, content[at:]


def _dtype(header: dict[str, list[str]]) -> np.dtype[Any]:
    names, sizes, types = header["FIELDS"], header["SIZE"], header["TYPE"]
    counts = header.get("COUNT", ["1"] * len(names))
    columns: list[tuple[str, str, tuple[int]]] = []
    for name, size, kind, count in zip(names, sizes, types, counts, strict=True):
        if kind not in _KINDS or size not in ("1", "2", "4", "8"):
            raise ValueError(f"field '{name}' has type {kind}{size}")
        # Padding is called '_' and may stand in several places.
        label = name if name != "_" else f"_{len(columns)}"
        columns.append((label, f"<{_KINDS[kind]}{size}", (int(count),)))
    return np.dtype(columns)


def _rows(
    encoding: str, data: bytes, dtype: np.dtype[Any], count: int
) -> dict[str, npt.NDArray[Any]]:
    names = dtype.names or ()
    if encoding == "ascii":
        return _from_text(data, dtype, count)
    if encoding == "binary":
        table = np.frombuffer(data, dtype, count)
        return {name: np.ascontiguousarray(table[name][:, 0]) for name in names}
    if encoding != "binary_compressed":
        raise ValueError(f"its data are '{encoding[:20]}'")
    packed, unpacked = (int(value) for value in np.frombuffer(data[:8], "<u4"))
    if unpacked != count * dtype.itemsize or len(data) < 8 + packed:
        raise ValueError("its compressed data have another length than the header says")
    # Compressed clouds are stored column by column.
    content = decompress_lzf(data[8 : 8 + packed], unpacked)
    found, at = {}, 0
    for name in names:
        column = dtype[name]
        size = column.itemsize * count
        found[name] = np.frombuffer(content[at : at + size], column.base).reshape(count, -1)[:, 0]
        at += size
    return found


def _from_text(data: bytes, dtype: np.dtype[Any], count: int) -> dict[str, npt.NDArray[Any]]:
    values = data.split()
    names = dtype.names or ()
    widths = [dtype[name].shape[0] for name in names]
    if len(values) < count * sum(widths):
        raise ValueError(f"it holds {len(values)} numbers for {count} points")
    table = np.array(values[: count * sum(widths)]).reshape(count, -1)
    columns = np.cumsum([0, *widths[:-1]])
    found = {}
    for name, column in zip(names, columns, strict=True):
        kind = dtype[name].base
        # An unsigned integer in text may be larger than what a float holds exactly.
        parse = np.float64 if kind.kind == "f" else np.int64
        found[name] = table[:, column].astype(parse).astype(kind)
    return found


def decompress_lzf(packed: bytes, length: int) -> bytes:
    """The bytes that were compressed with LZF (literal runs and references into what was read).

    Args:
        packed: The compressed bytes.
        length: How many there must be.

    Raises:
        ValueError: If the bytes are damaged.
    """
    out = bytearray()
    at, end = 0, len(packed)
    try:
        while at < end:
            control = packed[at]
            at += 1
            if control < 32:  # a run of literal bytes
                out += packed[at : at + control + 1]
                at += control + 1
                continue
            size = control >> 5
            if size == 7:
                size += packed[at]
                at += 1
            start = len(out) - ((control & 31) << 8) - packed[at] - 1
            at += 1
            size += 2
            if start < 0 or len(out) + size > length:
                raise ValueError("its compressed data are damaged")
            if start + size <= len(out):
                out += out[start : start + size]
            else:  # the reference reaches into what it writes: the piece repeats
                piece = bytes(out[start:])
                out += (piece * (size // len(piece) + 1))[:size]
    except IndexError as error:
        raise ValueError("its compressed data end too early") from error
    if len(out) != length:
        raise ValueError("its compressed data are damaged")
    return bytes(out)
