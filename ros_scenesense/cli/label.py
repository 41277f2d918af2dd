"""Asks a person for the spatial relations in real scenes, for the experiment on grounding."""

from __future__ import annotations

import argparse
from pathlib import Path

from ros_scenesense.errors import ParameterError

_EPILOG = """\
Every answer is written at once: end with q, Ctrl-D or Ctrl-C, and go on later with the same
command. docs/real_cameras.md describes the folder and the file of labels.
"""
_SPLITS = ("training", "test", "both")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense label`."""
    parser.epilog = _EPILOG
    parser.add_argument(
        "folder", type=Path, metavar="DIR", help="folder of the Table Object Scene Database"
    )
    parser.add_argument(
        "--labels", type=Path, metavar="FILE", help="file of labels (default: DIR/relations.jsonl)"
    )
    parser.add_argument(
        "--pictures",
        type=Path,
        metavar="DIR",
        help="where the pictures of the scenes are put (default: DIR/overlays)",
    )
    parser.add_argument("--split", choices=_SPLITS, default="both", help="default: %(default)s")
    parser.add_argument(
        "--pairs",
        type=int,
        metavar="INT",
        default=4,
        help="at most so many pairs of each scene, drawn at random but always the same "
        "(default: %(default)s)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Asks until all is answered or the person quits."""
    from ros_scenesense.experiments.labelling import Labelling, LabellingOptions
    from ros_scenesense.experiments.tosd import Split, Tosd

    if arguments.pairs < 1:
        raise ParameterError(f"--pairs is {arguments.pairs}, must be an integer of at least 1")
    tosd = Tosd(arguments.folder, arguments.labels)
    options = LabellingOptions(
        pairs=arguments.pairs,
        split=None if arguments.split == "both" else Split(arguments.split),
        pictures=arguments.pictures or arguments.folder / "overlays",
    )
    answered = Labelling(tosd, options, ask=input, tell=print).run()
    print(f"\npairs answered: {answered}; all labels are in {tosd.label_file}")
    return 0
