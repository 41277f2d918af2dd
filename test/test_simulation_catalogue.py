"""The catalogue: what data files may say, what is wrong with bad ones, and the bodies they make."""

import math
import re
from pathlib import Path

import numpy as np
import platformdirs
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_samples import write_cube, write_ycb

from ros_scenesense.errors import SimulationError
from ros_scenesense.scene import Surface
from ros_scenesense.simulation import convex, meshes
from ros_scenesense.simulation.catalogue import Catalogue, load_catalogue
from ros_scenesense.simulation.engine import SimulationConfiguration, SimulationEngine
from ros_scenesense.simulation.forms import make_form
from ros_scenesense.simulation.mesh_files import read_groups
from ros_scenesense.simulation.object_files import Color, MarkSpec, RevolvedSpec, TubeSpec
from ros_scenesense.simulation.painting import HEIGHT, WIDTH, paint, read_texture
from ros_scenesense.simulation.revolved import revolved_mesh, revolved_parts

CATALOGUE = load_catalogue()
# Width, depth, height in metres and mass in kilograms of the YCB objects.
YCB = {
    "apple": (0.075, 0.075, 0.077, 0.068),
    "pitcher": (0.1825, 0.133, 0.235, 0.178),
    "mustard_bottle": (0.095, 0.058, 0.190, 0.603),
    "mug": (0.1175, 0.080, 0.082, 0.118),
    "cracker_box": (0.06, 0.16, 0.23, 0.411),
}
TIN = """
- name: tin
  shape: tin
  size: small
  surface: flat
  mass_kg: 0.2
  cylinder: {diameter_m: 0.06, height_m: 0.08}
"""
STRIP = WIDTH // 8


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda *_, **__: folder)
    return folder


def load_file(tmp_path: Path, text: str) -> Catalogue:
    (tmp_path / "mine.yaml").write_text(text)
    return load_catalogue(str(tmp_path))


def volume(mesh: meshes.Mesh) -> float:
    corners = mesh.vertices[mesh.triangles]
    cross = np.cross(corners[:, 1], corners[:, 2])
    return float(np.einsum("ij,ij->", corners[:, 0], cross) / 6.0)


def test_the_papers_nine_kinds_are_there() -> None:
    kinds = {item.shape for item in CATALOGUE.values() if not item.relations_only}
    assert kinds == {"cube", "cylinder", "sphere", "duck", *YCB}
    containers = {item.shape for item in CATALOGUE.values() if item.relations_only}
    assert containers == {"box", "tray"}


def test_items_have_sensible_sizes_and_masses() -> None:
    for item in CATALOGUE.values():
        assert 0.03 < item.width_m <= item.height_m * (4.0 if item.is_open else 2.0)
        assert item.height_m < 0.25
        assert 0.01 < item.mass_kg < 1.0
        assert item.radius_m >= item.width_m / 2.0 - 1e-9


@pytest.mark.parametrize("name", YCB)
def test_stand_ins_have_the_size_and_the_mass_of_the_real_thing(name: str) -> None:
    *size, mass = YCB[name]
    item = CATALOGUE[name]
    extent = np.ptp(CATALOGUE.form(item).mesh.vertices, axis=0)
    assert extent == pytest.approx(size, abs=0.002)
    assert item.mass_kg == mass


def test_what_is_seen_fills_what_collides_and_is_centred() -> None:
    for item in CATALOGUE.values():
        form = CATALOGUE.form(item)
        assert np.allclose(np.linalg.norm(form.mesh.normals, axis=1), 1.0, atol=1e-6)
        if form.parts:
            points = np.concatenate(form.parts)
            assert np.allclose(points.min(axis=0), form.mesh.vertices.min(axis=0), atol=0.004)
            assert np.allclose(points.max(axis=0), form.mesh.vertices.max(axis=0), atol=0.004)
            properties = convex.mass_properties(form.parts)
            assert np.allclose(properties.centre, 0.0, atol=1e-9)
            assert volume(form.mesh) == pytest.approx(properties.volume_m3, rel=0.12)


def test_slender_things_and_balls_are_not_steady() -> None:
    unsteady = {item.shape for item in CATALOGUE.values() if not item.is_steady}
    assert unsteady == {"sphere", "apple", "mustard_bottle", "cracker_box", "pitcher"}


@settings(deadline=None, max_examples=40)
@given(
    st.lists(st.tuples(st.floats(0.01, 0.1), st.floats(0.005, 0.05)), min_size=2, max_size=6),
    st.floats(0.3, 1.0),
    st.floats(0.2, 0.9),
    st.booleans(),
)
def test_parts_fill_any_surface_of_revolution(
    steps: list[tuple[float, float]], flatten: float, thickness: float, hollow: bool
) -> None:
    heights = np.cumsum([0.0, *(rise for _, rise in steps[1:])])
    outside = tuple((r, float(z)) for (r, _), z in zip(steps, heights, strict=True))
    inside = tuple((thickness * r, z) for r, z in outside)
    if hollow:
        inside = ((inside[0][0], outside[1][1] / 2.0), *inside[1:])
    spec = RevolvedSpec(outside_m=outside, inside_m=inside if hollow else (), flatten=flatten)
    if hollow:  # the wall between floor and first point may otherwise cut through the outside
        wall = [(r, z) for r, z in outside]
        if inside[0][0] >= np.interp(inside[0][1], [z for _, z in wall], [r for r, _ in wall]):
            return
    seen = volume(revolved_mesh(spec))
    assert seen > 0.0
    felt = convex.mass_properties(revolved_parts(spec)).volume_m3
    # Circles of 48, 24 and 16 corners.
    assert felt == pytest.approx(seen, rel=0.12 if hollow else 0.03)


def test_mass_properties_of_a_box_and_of_a_mug_with_its_handle() -> None:
    box = convex.mass_properties([meshes.box((0.1, 0.2, 0.3)).vertices + 1.0])
    assert box.volume_m3 == pytest.approx(0.006)
    assert np.allclose(box.centre, 1.0)
    assert np.allclose(box.inertia * 12.0, [0.13, 0.10, 0.05])
    tube = TubeSpec(
        path_m=((0.04, 0.02), (0.07, 0.04), (0.04, 0.06)), width_m=0.01, thickness_m=0.01
    )
    mug = RevolvedSpec(outside_m=((0.04, 0.0), (0.04, 0.08)), tubes=(tube,))
    assert convex.mass_properties(revolved_parts(mug)).centre[0] > 0.0
    with pytest.raises(SimulationError, match="flat"):
        convex.mass_properties([np.eye(4)[:, :3] * [1.0, 1.0, 0.0]])


def test_a_folder_adds_objects_and_replaces_shipped_ones(tmp_path: Path) -> None:
    text = TIN + TIN.replace("name: tin", "name: small_cube")
    catalogue = load_file(tmp_path, text.replace("name: small_cube", "name: mug"))
    assert len(catalogue) == len(CATALOGUE) + 1
    assert catalogue["tin"].height_m == pytest.approx(0.08)
    assert catalogue["mug"].shape == "tin"
    assert catalogue["pitcher"] == CATALOGUE["pitcher"]
    engine = SimulationEngine(
        SimulationConfiguration(arrangement="spread", objects_dir=str(tmp_path))
    )
    shapes = {known.shape for index in range(8) for known in engine.scene(0, index).objects}
    engine.close()
    assert "tin" in shapes
    assert "mug" not in shapes


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("size: small", "size: tiny", r"`\$\[0\].size`; allowed are small, medium, large"),
        ("surface: flat", "surface: wet", r"\.surface`; allowed are flat, irregular"),
        ("mass_kg: 0.2", "mass_kg: -1", r"> 0.0 - at `\$\[0\].mass_kg`"),
        ("mass_kg: 0.2", "mass_kg: .nan", "mass_kg"),
        ("diameter_m: 0.06", "diameter_m: -0.06", r"\[0\].cylinder.diameter_m"),
        ("height_m: 0.08", "hight_m: 0.08", "hight_m.*known fields are diameter_m, height_m"),
        ("mass_kg: 0.2", "weight: 0.2", "weight.*known fields are name, shape"),
        ("size: small", "colors: [red, pink]", r"colors\[1\]`; allowed are red, green"),
        ("  size: small\n", "", "missing required field `size`.*known fields"),
        ("name: tin", "name: A tin", r"\.name"),
        ("cylinder:", "sphere: {diameter_m: 0.1}\n  cylinder:", "exactly one of box, cylinder"),
        ("  cylinder: {diameter_m: 0.06, height_m: 0.08}\n", "", "has no form"),
        ("cylinder: {.*", "mesh: {file: gone.obj}", r"'tin': mesh .*gone\.obj is missing"),
        ("cylinder: {.*", "mesh: {file: mine.yaml}", r"mine\.yaml cannot be read"),
        ("cylinder: {.*", "mesh: {file: duck.obj}", "set `scale`"),
        ("cylinder: {.*", "mesh: {file: duck.obj, up: x}", "must be one of y, z"),
        ("size: small", "size: small\n  texture: a.png", r"\.texture needs a mesh"),
        ("size: small", "size: small\n  marks: [{color: '#ffffff'}]", r"\.marks are painted"),
        ("size: small", "size: small\n  ycb: 013_apple", "ycb_color is missing"),
        ("cylinder: {.*", "revolved: {outside_m: [[0.1, 0.2], [0.1, 0.1]]}", "may not decrease"),
        ("- name: tin", "- name: [", "is no YAML"),
        ("(?s)^.*$", "name: tin", "Expected `array`"),
        ("(?s)^.*$", TIN + TIN, "has already"),
    ],
)
def test_a_wrong_data_file_is_named_with_its_field(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(SimulationError, match=r"mine\.yaml") as caught:
        load_file(tmp_path, re.sub(old, lambda _: new, TIN, count=1))
    assert re.search(words, str(caught.value)), caught.value


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ("[[0.06, 0.01], [0.02, 0.1]]", "must lie inside"),
        ("[[0.02, 0.01], [0.02, 0.05]]", "must end at the height"),
        ("[[0.02, 0.0], [0.02, 0.1]]", "all above the bottom"),
        ("[[0.02, 0.1]]", "at least two points"),
    ],
)
def test_a_cavity_must_fit(tmp_path: Path, inside: str, words: str) -> None:
    form = f"revolved: {{outside_m: [[0.05, 0.0], [0.05, 0.1]], inside_m: {inside}}}"
    with pytest.raises(SimulationError, match=rf"inside_m.*{words}"):
        load_file(tmp_path, TIN.replace("cylinder: {diameter_m: 0.06, height_m: 0.08}", form))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("box: {size_m: [0.1, 0.1, 0.02], wall_m: 0.01}", r"wall_m must be less than half"),
        (
            "marks: [{color: '#ffffff'}]\n  box: {size_m: [0.1, 0.1, 0.1], wall_m: 0.01}",
            r"marks are painted on massive boxes",
        ),
    ],
)
def test_an_open_box_must_have_room_and_no_marks(tmp_path: Path, more: str, words: str) -> None:
    with pytest.raises(SimulationError, match=words):
        load_file(tmp_path, TIN.replace("cylinder: {diameter_m: 0.06, height_m: 0.08}", more))


def test_missing_folders_are_named(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"gone is not there"):
        load_catalogue(str(tmp_path / "gone"))
    with pytest.raises(SimulationError, match=r"holds no \*\.yaml"):
        load_catalogue(str(tmp_path))
    with pytest.raises(SimulationError, match=r"ycb_dir .*gone is not there"):
        load_catalogue(ycb_dir=str(tmp_path / "gone"))


def test_stacks_must_have_something_to_begin_with(tmp_path: Path) -> None:
    ball = TIN.replace("cylinder: {diameter_m: 0.06, height_m: 0.08}", "sphere: {diameter_m: 0.06}")
    text = "".join(
        ball.replace("name: tin", f"name: small_{shape}") for shape in ("cube", "cylinder")
    )
    with pytest.raises(SimulationError, match="no small object with a flat surface"):
        load_file(tmp_path, text)


def test_ycb_meshes_take_the_place_of_their_stand_ins(tmp_path: Path, cache: Path) -> None:
    folder = write_ycb(tmp_path / "ycb")
    catalogue = load_catalogue(ycb_dir=str(folder))
    assert set(catalogue) == set(CATALOGUE)
    for name in YCB:
        item, form = catalogue[name], catalogue.form(catalogue[name])
        assert (item.mass_kg, item.surface) == (CATALOGUE[name].mass_kg, CATALOGUE[name].surface)
        assert len(item.colors) == 1
        # Centred although the file is not; as large as its mesh.
        assert np.allclose(form.mesh.vertices.mean(axis=0), 0.0, atol=0.002)
        assert np.allclose(np.ptp(form.mesh.vertices, axis=0), 0.08, atol=1e-6)
        assert np.allclose(np.ptp(np.concatenate(form.parts), axis=0), 0.08, atol=0.004)
    texture = catalogue.looks(catalogue["apple"]).texture
    assert read_texture(texture).shape == (512, 512, 3)
    assert read_texture(texture)[0, 0].tolist() == [200, 0, 0]
    assert catalogue.looks(catalogue["cracker_box"]).texture is None
    # Cubes from one corner and about the origin are two meshes; equal content is kept once.
    assert len(list(cache.rglob("*.obj"))) < len(YCB) + 1
    configuration = SimulationConfiguration(arrangement="spread", ycb_dir=str(folder))
    engine = SimulationEngine(configuration)
    scenes = [engine.scene(0, index) for index in range(6)]
    engine.close()
    apples = [
        scene.frame.color[scene.frame.instances == known.instance].mean(axis=0)
        for scene in scenes
        for known in scene.objects
        if known.shape == "apple"
    ]
    assert apples
    assert all(red > 3.0 * max(green, blue) for red, green, blue in apples)


def test_a_decomposition_is_made_once_and_again_if_it_is_damaged(
    tmp_path: Path, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_cube(tmp_path / "cube.obj", 0.1)
    text = TIN.replace("cylinder: {diameter_m: 0.06, height_m: 0.08}", "mesh: {file: cube.obj}")
    load_file(tmp_path, text)
    (kept,) = cache.rglob("*.obj")
    content = kept.read_bytes()
    monkeypatch.setattr(convex, "_decompose", None)
    load_file(tmp_path, text)
    monkeypatch.undo()
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda *_, **__: cache)
    kept.write_bytes(content[: len(content) // 2].replace(b"v", b"#"))
    load_file(tmp_path, text)
    assert kept.read_bytes() == content
    assert [path for path in kept.parent.iterdir() if path != kept] == []
    # Another mesh under the same name is another decomposition.
    write_cube(tmp_path / "cube.obj", 0.09)
    load_file(tmp_path, text)
    assert len(list(cache.rglob("*.obj"))) == 2


@pytest.mark.usefixtures("cache")
def test_what_is_wrong_in_a_ycb_folder_is_named(tmp_path: Path) -> None:
    folder = write_ycb(tmp_path)
    apple = folder / "013_apple/google_16k"
    (apple / "texture_map.png").write_text("no image")
    engine_of = SimulationConfiguration(arrangement="spread", ycb_dir=str(folder))
    (apple / "textured.obj").write_text("v 0 0 0\nf 1 2 3\n")
    with pytest.raises(SimulationError, match=r"textured\.obj cannot be read"):
        SimulationEngine(engine_of)
    write_cube(apple / "textured.obj", 0.08, 0.0, "mtllib textured.mtl")
    with pytest.raises(SimulationError, match=r"texture_map\.png cannot be read"):
        read_texture(load_catalogue(ycb_dir=str(folder)).looks(CATALOGUE["apple"]).texture)
    (apple / "texture_map.png").unlink()
    with pytest.raises(SimulationError, match=r"texture_map\.png of mesh .* is missing"):
        load_catalogue(ycb_dir=str(folder))
    (apple / "textured.obj").unlink()
    with pytest.raises(SimulationError, match=r"013_apple/google_16k/textured\.obj is missing"):
        load_catalogue(ycb_dir=str(folder))


def test_a_folder_as_it_is_handed_out_is_read(tmp_path: Path, cache: Path) -> None:
    """Windows line ends, comments, groups, normals, and files that are not needed."""
    folder = write_ycb(tmp_path / "ycb")
    apple = folder / "013_apple/google_16k"
    text = (apple / "textured.obj").read_text()
    faces = re.sub(r"(\d+)/(\d+)", r"\1/\2/1", text).replace("f ", "usemtl material_0\nf ", 1)
    faces = faces.replace("vt 0 0", "vn 0 0 1\nvt 0 0", 1)
    (apple / "textured.obj").write_text("# made elsewhere\n" + faces, newline="\r\n")
    (apple / "textured.mtl").write_text(
        "# Blender\n\nnewmtl material_0\nNs 0.0\nKd 0.8 0.8 0.8\nillum 2\nmap_Kd texture_map.png\n",
        newline="\r\n",
    )
    for name in ("nontextured.stl", "nontextured.ply", "textured.dae", "kinbody.xml"):
        (apple / name).write_bytes(b"not read")
    (folder / "077_rubiks_cube").mkdir()
    catalogue = load_catalogue(ycb_dir=str(folder))
    item = catalogue["apple"]
    assert item.measures.width_m == pytest.approx(0.08, abs=1e-6)
    assert catalogue.looks(item).texture == (apple / "texture_map.png").resolve()
    assert item.mass_kg == CATALOGUE["apple"].mass_kg
    # The second time the decomposition is there.
    kept = {path: path.stat().st_mtime_ns for path in cache.rglob("*.obj")}
    load_catalogue(ycb_dir=str(folder))
    assert {path: path.stat().st_mtime_ns for path in cache.rglob("*.obj")} == kept


@pytest.mark.usefixtures("cache")
@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("013_apple/google_16k/textured.mtl", None, r"material of mesh .*textured\.obj cannot be"),
        ("013_apple/google_16k/textured.obj", b"\xff\xfe\x00", r"apple.*textured\.obj cannot be"),
        ("025_mug/google_16k/nontextured.ply", b"ply\nformat ascii", r"mug.*nontextured\.ply"),
        (
            "025_mug/google_16k/nontextured.ply",
            None,
            r"025_mug/google_16k/textured\.obj is missing",
        ),
        ("003_cracker_box/textured.obj", b"", r"cracker_box.*textured\.obj cannot be read"),
    ],
)
def test_a_missing_or_broken_ycb_file_is_one_line(
    tmp_path: Path, name: str, content: bytes | None, words: str
) -> None:
    folder = write_ycb(tmp_path)
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    with pytest.raises(SimulationError, match=words) as caught:
        load_catalogue(ycb_dir=str(folder))
    assert "\n" not in str(caught.value)


def test_a_truncated_mesh_is_named(tmp_path: Path) -> None:
    folder = write_ycb(tmp_path)
    pitcher = folder / "019_pitcher_base/google_16k/nontextured.ply"
    pitcher.write_bytes(pitcher.read_bytes()[:-30])
    with pytest.raises(SimulationError, match=r"nontextured\.ply cannot be read"):
        load_catalogue(ycb_dir=str(folder))


def test_a_mesh_without_volume_is_named(tmp_path: Path, cache: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n")
    with pytest.raises(SimulationError, match=r"flat\.obj"):
        load_file(
            tmp_path,
            TIN.replace("cylinder: {diameter_m: 0.06, height_m: 0.08}", "mesh: {file: flat.obj}"),
        )
    assert list(cache.rglob("*.obj")) == []


def test_parts_survive_their_file(tmp_path: Path) -> None:
    form = CATALOGUE.form(CATALOGUE["mug"])
    path = tmp_path / "parts.obj"
    path.write_text(convex.parts_file_text(form.parts))
    for part, read in zip(form.parts, read_groups(path), strict=True):
        assert np.allclose(part, read, atol=1e-7)


def test_textures_have_the_colour_of_the_scene_and_their_own_marks() -> None:
    marks = [MarkSpec(color="#0000ff", around=(0.0, 0.5), up=(0.5, 1.0))]
    image = paint((1.0, 0.0, 0.0), marks, [None, "#00ff00"])
    red, green, blue = [255, 0, 0], [0, 255, 0], [0, 0, 255]
    assert image[HEIGHT - 1, 0].tolist() == red
    assert image[HEIGHT - 1 - 2 * (HEIGHT // meshes.CELLS), 0].tolist() == green
    assert image[0, STRIP + 1].tolist() == blue
    assert image[0, WIDTH - 1].tolist() == red
    assert image[HEIGHT - 1, STRIP + 1].tolist() == red


def test_every_object_comes_in_the_colours_that_drawing_needs() -> None:
    for surface in Surface:
        carriers = [item for item in CATALOGUE.values() if item.surface is surface]
        assert {color for item in carriers for color in item.colors} == set(Color)


def test_y_up_meshes_are_turned_upright(tmp_path: Path) -> None:
    duck = CATALOGUE.form(CATALOGUE["large_duck"]).mesh
    length, width, height = np.ptp(duck.vertices, axis=0)
    assert length == pytest.approx(0.12, rel=0.02)
    assert math.isclose(height, 0.1117, abs_tol=0.001)
    assert width < height
    assert make_form(RevolvedSpec(outside_m=((0.1, 0.0), (0.1, 0.1))), tmp_path).parts
