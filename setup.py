"""Packaging, read by pip and by colcon alike."""

import re
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup
from setuptools.command.build_py import build_py

NAME = "ros_scenesense"
NODES = (
    "simulated_camera",
    "grounding",
    "grounding_control",
    "reasoner",
    "attention",
    "axiom_learner",
    "recorder",
)
# Top-level folders that are needed at run time; ros_scenesense/resources.py finds them.
DATA = ("asp", "config", "msg_defs")
VERSION = re.search(r'__version__ = "(.+)"', Path(NAME, "__init__.py").read_text())[1]


class BuildWithData(build_py):
    """Puts the data folders into the package; an editable install reads them where they stand.

    `package_dir` could say the same, but not for `colcon build --symlink-install`, which shows
    setuptools a folder with symbolic links to the package and to `data_files` only.
    """

    def run(self):
        super().run()
        if not self.editable_mode:
            for folder in DATA:
                self.copy_tree(folder, f"{self.build_lib}/{NAME}/data/{folder}")


setup(
    name=NAME,
    version=VERSION,
    description="Commonsense reasoning and knowledge acquisition that guide deep learning on ROS 2",
    license="Apache-2.0",
    author="The SceneSense authors",
    maintainer="The SceneSense authors",
    maintainer_email="scenesense@users.noreply.github.com",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={"": ["*.j2", "*.lark"]},
    cmdclass={"build_py": BuildWithData},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", glob("config/*.*")),
        (f"share/{NAME}/config/objects", glob("config/objects/*")),
        (f"share/{NAME}/config/scenes", glob("config/scenes/*")),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
    ],
    zip_safe=False,
    install_requires=[
        "clingo",
        "Jinja2",
        "joblib",
        "lark-parser",
        "matplotlib",
        "msgspec",
        "numpy",
        "open3d",
        "opencv-python-headless",
        "platformdirs",
        "pybullet",
        "PyYAML",
        "rich",
        "rosbags",
        "scipy",
        "torch==2.13.0",
    ],
    extras_require={
        # ROS 2 Jazzy for machines that have none; whoever has it from apt does not need these.
        "ros": ["ros-jazzy-rclpy[fastrtps]==7.1.6", "ros-jazzy-common-interfaces==5.3.6"],
        # `scenesense dataset generate --cluster`
        "cluster": ["distributed"],
        "test": ["hypothesis", "mcap", "mypy", "pytest", "ruff"],
    },
    entry_points={
        "console_scripts": [
            "scenesense = ros_scenesense.cli.main:main",
            "launcher = ros_scenesense.launcher:main",
            *(f"{node} = {NAME}.nodes.{node}:main" for node in NODES),
        ],
    },
)
