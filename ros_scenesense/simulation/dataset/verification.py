"""Says what is broken in a dataset, file by file."""

from __future__ import annotations

from pathlib import Path

from ros_scenesense.simulation.dataset.folder import DatasetFolder, Fault


def verify(path: Path) -> list[Fault]:
    """Compares every file of a dataset with its checksum.

    Returns:
        What is broken; generating the dataset again mends it.

    Raises:
        DatasetError: If there is no dataset, or its metadata cannot be read.
    """
    folder = DatasetFolder(path)
    metadata = folder.read_metadata()
    found = folder.examine()
    faults = list(found.faults)
    if found.fingerprints - {metadata.fingerprint()}:
        words = "does not say how all scenes were made: they are of another dataset"
        faults.append(Fault(folder.metadata.name, words))
    missing = set(range(metadata.count)) - set(found.whole) - {fault.index for fault in faults}
    for first, last in _ranges(sorted(missing)):
        numbers = f"{first}" if first == last else f"{first} to {last}"
        faults.append(Fault(folder.index.name, f"scene {numbers} not made yet", first))
    surplus = [index for index in found.whole if index >= metadata.count]
    if surplus:
        words = f"has scene {surplus[0]}, but the dataset has {metadata.count}"
        faults.append(Fault(folder.index.name, words))
    return faults


def _ranges(numbers: list[int]) -> list[tuple[int, int]]:
    """First and last of every run of consecutive numbers."""
    runs: list[tuple[int, int]] = []
    for number in numbers:
        if runs and runs[-1][1] == number - 1:
            runs[-1] = (runs[-1][0], number)
        else:
            runs.append((number, number))
    return runs
