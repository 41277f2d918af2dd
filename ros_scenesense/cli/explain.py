"""Tell why a literal holds in a scene, or why it does not."""

from __future__ import annotations

import argparse
import json
import uuid
from pathlib import Path
from typing import Any

import msgspec

from ros_scenesense.cli.launch import add_domain_arguments, add_timeout_argument
from ros_scenesense.cli.scene_source import add_scene_arguments, scene_of
from ros_scenesense.errors import ParameterError, SceneSenseError
from ros_scenesense.messages.reasoning import Explanation, Query
from ros_scenesense.reasoning.explanation.drawing import drawing
from ros_scenesense.reasoning.explanation.scenes import SceneExplainer, SceneExplanation
from ros_scenesense.reasoning.program import Program
from ros_scenesense.stages.queries import words_of

_EPILOG = """\
`scenesense explain "-stable(red_can)" --scene FILE` proves that the can is unstable, down to what
was perceived and given; if it is not, it tells which axioms might have concluded it and what they
lack. Without --scene the reasoner of the running graph is asked, about its newest scene. Exit code:
0 when it is explained, 3 when the reasoner refuses, 2 for a wrong value, 1 for any other error.
"""
_REFUSED = 3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the arguments of `scenesense explain`."""
    parser.description = __doc__
    parser.epilog = _EPILOG
    parser.add_argument(
        "literal",
        nargs="?",
        metavar="LITERAL",
        help="in the action language, e.g. '-stable(red_can)'",
    )
    parser.add_argument(
        "--goal",
        metavar="GOAL",
        help="instead of LITERAL: why each action of the shortest plan for this goal",
    )
    add_scene_arguments(parser, required=False)
    parser.add_argument(
        "--domain",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="instead of --scene: a domain in the action language, and files that go on from it; "
        "explained is what its history makes believe",
    )
    parser.add_argument(
        "--step", type=int, metavar="INT", help="with --domain: the step (default: the last one)"
    )
    parser.add_argument(
        "--why-not", action="store_true", help="ask why not: it says so if the literal does hold"
    )
    parser.add_argument(
        "--without", metavar="IDS", default="", help="axioms to leave out, separated by commas"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--svg", type=Path, metavar="FILE", help="draw the explanation into a file")
    parser.add_argument(
        "--scene-id", metavar="ID", help="scene of the running graph (default: the newest one)"
    )
    add_domain_arguments(parser)
    add_timeout_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Prints the explanation."""
    if (arguments.literal is None) is (arguments.goal is None):
        raise ParameterError("say either a LITERAL or a --goal")
    if arguments.goal is not None:
        return _explain_plan(arguments)
    if arguments.domain is not None:
        return _explain_history(arguments)
    if arguments.step is not None:
        raise ParameterError("--step belongs to --domain: a scene has no steps")
    if arguments.scene is None:
        return _ask(arguments)
    if arguments.scene_id is not None:
        raise ParameterError("--scene-id names a scene of the running graph: leave out --scene")
    explained = _explained(arguments)
    if arguments.svg is not None:
        _write(arguments.svg, drawing(explained.reason))
    if arguments.json:
        print(json.dumps(_as_json(explained), indent=2))
    else:
        print(words_of(explained, "why_not" if arguments.why_not else "why"))
    return 0


def _explained(arguments: argparse.Namespace) -> SceneExplanation:
    program = Program.shipped()
    withheld = _withheld(arguments)
    known = [axiom.id for axiom in program.axioms]
    unknown = [name for name in withheld if name not in known]
    if unknown:
        raise ParameterError(
            f"--without: there is no axiom {', '.join(unknown)}, known are {', '.join(known)}"
        )
    explainer = SceneExplainer(program, scene_of(arguments).facts, withheld)
    return explainer.explain(explainer.literal(arguments.literal))


def _withheld(arguments: argparse.Namespace) -> list[str]:
    return [name for name in arguments.without.replace(" ", "").split(",") if name]


def _explain_history(arguments: argparse.Namespace) -> int:
    """Explains a literal of a domain with a history."""
    from ros_scenesense.cli.history_explanation import as_json, explained_history, words

    if arguments.scene is not None:
        raise ParameterError("--domain has a history of its own: leave out --scene")
    explained = explained_history(arguments)
    if arguments.svg is not None:
        _write(arguments.svg, drawing(explained.reason))
    print(json.dumps(as_json(explained), indent=2) if arguments.json else words(explained))
    return 0


def _explain_plan(arguments: argparse.Namespace) -> int:
    """Tells why each action of a plan."""
    from ros_scenesense.cli.plan_purposes import as_json, explained_plan

    if arguments.scene is None:
        raise ParameterError("--goal needs --scene: from where should the plan start?")
    if arguments.svg is not None:
        raise ParameterError("--svg draws the explanation of a literal, not of a plan")
    explained, renamed = explained_plan(arguments, _withheld(arguments))
    if arguments.json:
        print(json.dumps({"plan": as_json(explained), "renamed": renamed}, indent=2))
        return 0
    for each in explained:
        print(f"{each.step}. {each.action}\n   {each}")
    if not explained:
        print("the goal holds already")
    for constant, name in renamed.items():
        print(f"{constant} is {name!r}.")
    return 0


def _ask(arguments: argparse.Namespace) -> int:
    """Asks the running graph."""
    # Imports ROS: not for `--help`.
    from ros_scenesense.cli.conversation import ask

    for name, given in (("--svg", arguments.svg), ("--without", arguments.without)):
        if given:
            raise ParameterError(f"{name} needs --scene: the running graph explains in words")
    query = Query(
        id=f"command-{uuid.uuid4().hex}",
        literal=arguments.literal.strip(),
        why="why_not" if arguments.why_not else "why",
        scene_id=arguments.scene_id,
    )
    answer = ask(arguments, query, Explanation, lambda each: each.id == query.id)
    if arguments.json:
        print(msgspec.json.format(msgspec.json.encode(answer)).decode())
    else:
        print(answer.text)
    return _REFUSED if answer.outcome == "refused" else 0


def _as_json(explained: SceneExplanation) -> dict[str, Any]:
    return {
        "literal": explained.literal,
        "holds": explained.holds,
        "explanation": explained.reason.as_json(),
        "withdrawn": [
            {
                "relation": each.relation,
                "object": each.object,
                "reference": each.reference,
                "confidence": each.confidence,
                "source": each.source,
            }
            for each in explained.withdrawn
        ],
        "renamed": dict(explained.renamed),
    }


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise SceneSenseError(f"{path} cannot be written: {error.strerror or error}") from error
