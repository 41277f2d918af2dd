"""The floors of docs/architecture.md, kept by reading every module's imports."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "ros_scenesense"
MODULES = sorted(path.relative_to(PACKAGE).as_posix() for path in PACKAGE.rglob("*.py"))

# Room (a folder, or a module beside them) -> floor. What is not named here is on the top floor.
GROUND = ["__init__", "errors", "geometry", "messages", "parameters", "resources", "scene"]
FLOORS = {
    **dict.fromkeys(GROUND, 0),
    "knowledge": 1,
    **dict.fromkeys(
        ["simulation", "perception", "grounding", "reasoning", "attention", "learning"], 2
    ),
    **dict.fromkeys(["stages", "pipeline"], 3),
}
TOP = 4
ROS = {"rclpy", "std_msgs", "std_srvs", "sensor_msgs", "geometry_msgs", "visualization_msgs"}
ROS |= {"diagnostic_msgs", "builtin_interfaces", "rcl_interfaces", "rosgraph_msgs", "tf2_msgs"}
ROS |= {"rosbags"}
# These take seconds to import: only functions that run in a worker may.
HEAVY = {"matplotlib", "open3d", "torch"}
NETWORKS = "attention/networks"  # classes of torch: what imports this folder imports torch
# Random numbers come from a generator that the caller passes or seeds, never from global state.
GENERATORS = {"Generator", "SeedSequence", "default_rng"}
LONGEST_MODULE = 400


def room_of(module):
    return module.split("/")[0].removesuffix(".py")


def imports(tree):
    """All imported module names, wherever in the module they stand."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." if node.level else node.module
            if node.module == "ros_scenesense":
                yield from (f"ros_scenesense.{alias.name}" for alias in node.names)


def module_level(tree):
    """The tree without functions and what types are read for: what runs when it is imported."""

    class WithoutFunctions(ast.NodeTransformer):
        def visit_FunctionDef(self, node):
            node.body = [ast.Pass()]
            return node

        visit_AsyncFunctionDef = visit_FunctionDef  # noqa: N815

        def visit_If(self, node):
            return None if ast.unparse(node.test) == "TYPE_CHECKING" else self.generic_visit(node)

    return WithoutFunctions().visit(tree)


def violations(module, source):
    """What a module does that the architecture forbids, in words."""
    room = room_of(module)
    floor = FLOORS.get(room, TOP)
    tree = ast.parse(source)
    for name in imports(tree):
        top, _, rest = name.partition(".")
        if name.startswith("."):
            yield "imports relatively: write the full name"
        elif top == "ros_scenesense" and rest:
            other = rest.split(".")[0]
            other_floor = FLOORS.get(other, TOP)
            if other_floor > floor:
                yield f"imports {name}, which is {other_floor - floor} floors up"
            elif other_floor == floor == 2 and other != room:
                yield f"imports {name}, another room of its floor"
        elif top in ROS and floor < TOP:
            yield f"imports {name}: ROS belongs to the top floor alone"
        elif top == "random" and floor < TOP:
            yield "imports random: take a numpy Generator"
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) in (
            "np.random",
            "numpy.random",
        ):
            if node.attr not in GENERATORS:
                yield f"uses np.random.{node.attr}: take a numpy Generator"
        elif isinstance(node, ast.Global):
            yield f"has global state: {', '.join(node.names)}"
    if source.count("\n") > LONGEST_MODULE:
        yield f"has {source.count(chr(10))} lines, more than {LONGEST_MODULE}"
    for name in imports(module_level(tree)):
        heavy = name.partition(".")[0] in HEAVY or f"{NETWORKS}/" in f"{name.replace('.', '/')}/"
        if heavy and not module.startswith(NETWORKS):
            yield f"imports {name} when it is imported: do it in the function that needs it"


@pytest.mark.parametrize("module", MODULES)
def test_a_module_keeps_to_its_floor(module):
    assert list(violations(module, (PACKAGE / module).read_text())) == []


@pytest.mark.parametrize(
    ("module", "source", "words"),
    [
        ("geometry.py", "import ros_scenesense.stages.join", "3 floors up"),
        ("messages/base.py", "from ros_scenesense import pipeline", "3 floors up"),
        ("grounding/qsr.py", "from ros_scenesense.perception.clouds import x", "another room"),
        ("reasoning/session.py", "def f():\n    import ros_scenesense.stages.worker", "1 floors"),
        ("stages/grounding.py", "from ros_scenesense.nodes import qos", "1 floors up"),
        ("pipeline.py", "import rclpy.node", "ROS belongs"),
        ("stages/protocol.py", "from sensor_msgs.msg import Image", "ROS belongs"),
        ("stages/protocol.py", "from . import worker", "relatively"),
        ("perception/clouds.py", "import open3d as o3d", "when it is imported"),
        ("nodes/grounding.py", "class A:\n    import torch", "when it is imported"),
        (
            "stages/attention.py",
            "from ros_scenesense.attention.networks.lenet import LeNet",
            "when it is imported",
        ),
        ("simulation/world.py", "import numpy as np\nnp.random.seed(1)", "np.random.seed"),
        ("simulation/world.py", "import random", "Generator"),
        ("demo/live.py", "def f():\n    global x\n    x = 1", "global state: x"),
        ("scene.py", "x = 1\n" * 401, "401 lines"),
    ],
)
def test_the_check_sees_what_is_forbidden(module, source, words):
    (found,) = violations(module, source)
    assert words in found


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("stages/grounding.py", "from ros_scenesense.perception.clouds import x"),
        ("nodes/grounding.py", "import rclpy\nfrom ros_scenesense.stages.grounding import x"),
        ("stages/grounding_engine.py", "def cloud():\n    import open3d"),
        ("reasoning/session.py", "from ros_scenesense.reasoning.facts import x"),
        ("attention/networks/lenet.py", "import torch"),
        ("stages/worker.py", "if TYPE_CHECKING:\n    from torch import Tensor"),
        ("simulation/world.py", "import numpy as np\nrng = np.random.default_rng(1)"),
        ("launcher.py", "import random\nfrom ros_scenesense import pipeline"),
    ],
)
def test_the_check_lets_pass_what_is_allowed(module, source):
    assert list(violations(module, source)) == []
