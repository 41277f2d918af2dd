"""Finds the data that is shipped with the package, however it was installed.

`asp/`, `msg_defs/` and `config/` stand at the top of the source tree. An installed package
carries them inside itself (see `setup.py`); an editable install finds them beside the package.
"""

from __future__ import annotations

from pathlib import Path

from ros_scenesense.errors import SceneSenseError

_PACKAGE = Path(__file__).resolve().parent


def resource(folder: str, name: str = "") -> Path:
    """Path of a shipped file or, without a name, of its folder.

    Args:
        folder: `asp`, `msg_defs` or `config`.
        name: File in the folder.

    Raises:
        SceneSenseError: If it is not there; the installation is broken.
    """
    # An editable install's source tree comes first: it is what the developer edits.
    for base in (_PACKAGE.parent, _PACKAGE / "data"):
        if (base / "setup.py").is_file() or base.name == "data":
            path = base / folder / name
            if path.exists():
                return path
    raise SceneSenseError(
        f"{folder}/{name} is missing from the installation in {_PACKAGE}: reinstall ros_scenesense"
    )
