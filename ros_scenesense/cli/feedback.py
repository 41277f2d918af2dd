"""Tell the robot how two objects are related; the running graph learns from it."""

from __future__ import annotations

import argparse
import uuid
from typing import get_args

from ros_scenesense.cli.launch import add_domain_arguments, add_timeout_argument
from ros_scenesense.errors import ParameterError
from ros_scenesense.messages.grounding import Feedback, FeedbackResult, RelationName

_EPILOG = """\
`scenesense feedback left mug can` says: the mug is left of the can, in the newest scene that has
both. Exit code: 0 when it counts (or a repetition of it did before), 3 when it is refused, 2 for a
wrong value, 1 when no node answers.
"""
_REFUSED = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense feedback`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument("relation", metavar="RELATION", help=", ".join(get_args(RelationName)))
    parser.add_argument("object", metavar="OBJECT", help="the object that is in this relation …")
    parser.add_argument("reference", metavar="REFERENCE", help="… with respect to this one")
    parser.add_argument(
        "--scene", metavar="ID", help="scene id (default: the newest scene that has both objects)"
    )
    add_domain_arguments(parser)
    add_timeout_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Publishes the feedback, and prints what became of it."""
    # Imports ROS: not for `--help`.
    from ros_scenesense.cli.conversation import ask

    known = get_args(RelationName)
    if arguments.relation not in known:
        raise ParameterError(
            f"relation is '{arguments.relation}', must be one of {', '.join(known)}"
        )
    feedback = Feedback(
        id=f"command-{uuid.uuid4().hex}",
        relation=arguments.relation,
        object=arguments.object,
        reference=arguments.reference,
        scene_id=arguments.scene,
    )
    result = ask(arguments, feedback, FeedbackResult, lambda answer: answer.id == feedback.id)
    where = f" (scene {result.scene_id})" if result.scene_id else ""
    # Names are what anybody on the network says: no control sequences for the terminal.
    words = f"{result.outcome}{where}: {result.reason}"
    print("".join(one if one.isprintable() else "?" for one in words))
    return _REFUSED if result.outcome == "refused" else 0
