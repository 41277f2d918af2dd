"""Finds the data that is shipped with the package, however it was installed.

`asp/`, `msg_defs/` and `config/` stand at the top of the source tree. An installed package carries
them inside itself, as `data/` (see `setup.py`); an editable install, and a colcon build with
symbolic links, use the source tree, where they stand beside the package.
"""

from __future__ import annotations

from pathlib import Path

from ros_scenesense.errors import SceneSenseError

_PACKAGE = Path(__file__).resolve().parent  # the source tree, where the file is a symbolic link


def resource(folder: str, name: str = "") -> Path:
    """Path of a shipped file or, without a name, of its folder.

    Args:
        folder: `asp`, `msg_defs` or `config`.
        name: File in the folder.

    Raises:
        SceneSenseError: If it is not there; the installation is broken.
    """
    inside = _PACKAGE / "data"
    path = (inside if inside.is_dir() else _PACKAGE.parent) / folder / name
    if not path.exists():
        raise SceneSenseError(f"{path} is missing from the installation: reinstall ros_scenesense")
    return path
