"""What the packaging files promise agrees with the code: names, versions, modules, data."""

import ast
import itertools
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

import ros_scenesense
from ros_scenesense import resources
from ros_scenesense.cli import examination
from ros_scenesense.nodes.registry import NODES

SOURCE = Path(__file__).resolve().parents[1]
PACKAGE = SOURCE / "ros_scenesense"
ROS_MODULES = {name.partition(".")[0] for name in examination.ROS_PACKAGES} | {"rclpy"}
# Comes with a full ROS 2 only; everything works without it.
OPTIONAL_MODULES = {"tf2_msgs"}
# Distributions of the optional extras, of the same name as their modules.
EXTRAS = ("cluster",)


@pytest.fixture(scope="module")
def setup_words():
    """The literal keyword arguments of `setup(...)`, by name."""
    tree = ast.parse((SOURCE / "setup.py").read_text())
    (call,) = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "setup"
    ]
    literal = {}
    for keyword in call.keywords:
        try:
            literal[keyword.arg] = ast.literal_eval(keyword.value)
        except ValueError:
            literal[keyword.arg] = ast.unparse(keyword.value)
    return literal


@pytest.fixture(scope="module")
def manifest():
    return ElementTree.parse(SOURCE / "package.xml").getroot()


@pytest.fixture(scope="module")
def locked():
    """Pinned version by normalized name."""
    lines = (SOURCE / "requirements.lock").read_text().splitlines()
    pins = [line.partition(";")[0].strip() for line in lines if line and line[0] != "#"]
    return {normalized(pin.partition("==")[0]): pin.partition("==")[2] for pin in pins}


def normalized(distribution):
    return re.sub(r"[-_.]+", "-", distribution).lower()


def name_of(requirement):
    return re.match(r"[\w.-]+", requirement)[0]


def modules_imported_by_the_package():
    """Top-level modules, also those imported inside functions."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                found.add(node.module.partition(".")[0])
    return found - set(sys.stdlib_module_names) - {"ros_scenesense", "__future__"}


def test_both_manifests_say_the_same_version_and_license(manifest, setup_words):
    assert manifest.findtext("version") == ros_scenesense.__version__
    assert manifest.findtext("license") == setup_words["license"] == "Apache-2.0"
    assert "Apache License" in (SOURCE / "LICENSE").read_text()


def test_every_folder_with_code_is_a_package():
    folders = {path.parent for path in PACKAGE.rglob("*.py")}
    assert [folder for folder in folders if not (folder / "__init__.py").is_file()] == []


def test_everything_imported_is_declared(setup_words):
    declared = set(examination.DEPENDENCIES.values()) | {"torch"} | ROS_MODULES | OPTIONAL_MODULES
    declared |= {module for extra in EXTRAS for module in setup_words["extras_require"][extra]}
    # Of the extra `test`: the fuzz alone needs it, and says so where it is missing.
    assert "hypothesis" in setup_words["extras_require"]["test"]
    declared.add("hypothesis")
    # Comes with pybullet.
    assert modules_imported_by_the_package() - declared - {"pybullet_data"} == set()


def test_setup_requires_what_the_doctor_examines(setup_words):
    required = setup_words["install_requires"]
    torch = f"torch=={examination.TORCH_VERSION}"
    assert sorted(required) == sorted([*examination.DEPENDENCIES, torch])


def test_ros_modules_are_dependencies_of_the_ros_package(manifest):
    declared = {element.text for element in manifest.iter("exec_depend")}
    assert declared >= ROS_MODULES | OPTIONAL_MODULES


def test_lock_holds_every_direct_dependency(locked, setup_words):
    extras = setup_words["extras_require"].values()
    direct = [*setup_words["install_requires"], *itertools.chain.from_iterable(extras)]
    assert {normalized(name_of(requirement)) for requirement in direct} <= set(locked)
    for requirement in direct:
        if "==" in requirement:
            assert locked[normalized(name_of(requirement))] == requirement.partition("==")[2]


def test_lock_is_exact_and_fits_every_machine(locked):
    assert all(re.fullmatch(r"[\w.]+", version) for version in locked.values()), (
        "a version is loose"
    )
    assert locked["torch"] == examination.TORCH_VERSION
    assert [name for name in locked if name.startswith("nvidia")] == []
    text = (SOURCE / "requirements.lock").read_text()
    assert "://" not in text
    assert "--" not in text


def test_console_scripts_have_their_modules():
    text = (SOURCE / "setup.py").read_text()
    nodes = ast.literal_eval(re.search(r"^NODES = (\(.*?\))$", text, re.MULTILINE | re.DOTALL)[1])
    assert nodes == tuple(NODES)
    modules = re.findall(r"= ([\w.]+):main", text) + [
        f"ros_scenesense.nodes.{node}" for node in nodes
    ]
    assert len(modules) > 2
    for module in modules:
        path = SOURCE / module.replace(".", "/")
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        functions = [
            node.name for node in ast.parse(path.read_text()).body if hasattr(node, "name")
        ]
        assert "main" in functions, path


@pytest.mark.parametrize(("folder", "name"), examination.SHIPPED)
def test_shipped_data_is_found(folder, name):
    assert resources.resource(folder, name).is_file()


def test_installed_package_uses_the_data_it_carries(tmp_path, monkeypatch):
    package = tmp_path / "ros_scenesense"
    for base in (tmp_path, package / "data"):
        (base / "config").mkdir(parents=True)
        (base / "config" / "params.yaml").touch()
    monkeypatch.setattr(resources, "_PACKAGE", package)
    # A stranger's `config` beside it, as in a crowded site-packages, is left alone.
    assert resources.resource("config", "params.yaml") == package / "data/config/params.yaml"
