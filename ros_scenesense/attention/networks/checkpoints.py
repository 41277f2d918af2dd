"""Networks on disk: weights with the configuration that they belong to, written atomically."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

from ros_scenesense.attention.networks.kinds import KINDS, NetworkConfiguration, build, kind_of
from ros_scenesense.errors import NetworkError

VERSION = 3


def save(path: Path, network: nn.Module, content: Mapping[str, Any]) -> None:
    """Writes a network and whatever belongs to it (numbers, texts, tensors, lists, dicts).

    The file is complete or the one that was there before: it is written beside it, brought to the
    disk, and renamed.

    Raises:
        NetworkError: If the file cannot be written.
    """
    configuration: NetworkConfiguration = network.configuration  # type: ignore[assignment]
    whole = {
        "version": VERSION,
        "kind": kind_of(configuration),
        "configuration": dataclasses.asdict(configuration),
        "weights": network.state_dict(),
        "content": dict(content),
    }
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("wb") as file:
            torch.save(whole, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        raise NetworkError(
            f"network '{path}' cannot be written: {error}; make room or choose another folder"
        ) from error
    finally:
        temporary.unlink(missing_ok=True)


def load(path: Path) -> tuple[nn.Module, dict[str, Any]]:
    """Reads a network, on the CPU, and what was saved with it.

    Raises:
        NetworkError: If the file is missing, damaged, or of another version.
    """
    mend = "train again, or restore the file"
    try:
        # Weights alone: a file from elsewhere must not run code.
        whole = torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError as error:
        raise NetworkError(f"there is no network '{path}': train one") from error
    except Exception as error:
        # What reading a damaged file raises depends on where the damage is.
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise NetworkError(f"network '{path}' is damaged ({first}): {mend}") from error
    if not isinstance(whole, dict) or "version" not in whole:
        raise NetworkError(f"'{path}' holds no network of SceneSense: {mend}")
    if whole["version"] != VERSION:
        raise NetworkError(
            f"network '{path}' is of version {whole['version']}, this release reads {VERSION}: "
            "train again"
        )
    try:
        network = build(KINDS[whole["kind"]][0](**whole["configuration"]), seed=0)
        network.load_state_dict(whole["weights"])
    except (KeyError, TypeError, RuntimeError) as error:
        raise NetworkError(f"network '{path}' does not fit its configuration: {mend}") from error
    return network.eval(), whole["content"]
