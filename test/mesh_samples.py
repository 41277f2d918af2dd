"""Mesh files for tests: a cube, and a folder laid out as the YCB models are handed out."""

from pathlib import Path

import numpy as np

from ros_scenesense.simulation import meshes
from ros_scenesense.simulation.painting import write_png


def write_cube(path: Path, edge: float, corner: float = 0.0, header: str = "") -> None:
    """A cube from one corner to the other, as an OBJ of squares with places in a texture."""
    cube = meshes.box((edge, edge, edge))
    points = cube.vertices + edge / 2.0 + corner
    lines = [header, *(f"v {x:g} {y:g} {z:g}" for x, y, z in points)]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    lines += [
        " ".join(["f", *(f"{4 * side + k + 1}/{k + 1}" for k in range(4))]) for side in range(6)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines))


def write_ply(path: Path, edge: float, encoding: str) -> None:
    cube = meshes.box((edge, edge, edge))
    count = len(cube.vertices)
    header = f"ply\nformat {encoding} 1.0\nelement vertex {count}\nproperty float x\n"
    header += "property float y\nproperty float z\nproperty uchar red\n"
    header += "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
    if encoding == "ascii":
        rows = [f"{x} {y} {z} 9" for x, y, z in cube.vertices]
        rows += ["3 {} {} {}".format(*triangle) for triangle in cube.triangles]
        body = "\n".join(rows).encode()
    else:
        order = "<" if "little" in encoding else ">"
        vertex = np.dtype([("place", order + "f4", (3,)), ("red", "u1")])
        face = np.dtype([("count", "u1"), ("corners", order + "i4", (3,))])
        vertices, faces = np.zeros(count, vertex), np.zeros(12, face)
        vertices["place"], faces["count"], faces["corners"] = cube.vertices, 3, cube.triangles
        body = vertices.tobytes() + faces.tobytes()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(header.encode() + body)


def write_ycb(folder: Path) -> Path:
    """A YCB folder of cubes of 8 cm, far from the origin, in each of its layouts."""
    write_cube(folder / "013_apple/google_16k/textured.obj", 0.08, 0.3, "mtllib textured.mtl")
    (folder / "013_apple/google_16k/textured.mtl").write_text("newmtl a\nmap_Kd texture_map.png\n")
    image = np.zeros((600, 600, 3), np.uint8)
    image[..., 0] = 200
    write_png(folder / "013_apple/google_16k/texture_map.png", image)
    write_ply(folder / "019_pitcher_base/google_16k/nontextured.ply", 0.08, "binary_little_endian")
    write_ply(folder / "006_mustard_bottle/tsdf/nontextured.ply", 0.08, "binary_big_endian")
    write_ply(folder / "025_mug/google_16k/nontextured.ply", 0.08, "ascii")
    write_cube(folder / "003_cracker_box/textured.obj", 0.08, -0.1)
    return folder
