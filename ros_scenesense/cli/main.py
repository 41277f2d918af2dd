"""Entry point of `scenesense`: finds the subcommand, reports errors in one line."""

from __future__ import annotations

import argparse
import importlib
import re
import sys
from collections.abc import Sequence
from typing import NoReturn

import ros_scenesense
from ros_scenesense.errors import ParameterError, SceneSenseError

COMMANDS = {
    "demo": "run the whole graph on simulated scenes and write a report",
    "launch": "start the nodes and keep them running",
    "feedback": "tell the running graph how two objects are related",
    "groundings": "draw what prepositions mean to the robot, as it learned",
    "state": "show, export, take over, empty and examine what the nodes remember",
    "params": "list the parameters of all nodes, or make a params file",
    "bag": "record a session of the graph, tell what a recording holds, repair and play it",
    "dataset": "make, verify, count and show datasets of simulated scenes",
    "scene": "draw one scene and list what is known of it",
    "perceive": "find objects, relations and decisions in one real RGB-D frame",
    "label": "ask a person for the relations in real scenes of the Table Object Scene Database",
    "solve": "compute the answer sets of a domain with its history, of a SPARC or a logic program",
    "query": "ask a SPARC program: yes, no or unknown, and for which values",
    "translate": "turn a domain or a SPARC program into a program that clingo runs alone",
    "goal": "give the robot of the running graph a goal, and tell how it pursues it",
    "plan": "find the actions that lead from a scene to a goal",
    "explain": "tell why a literal holds in a scene, or why not",
    "train": "train the network that answers where reasoning is undecided",
    "axioms": "list learned axioms and their history; pin, veto or accept one",
    "experiment": "run an experiment of the paper: tables, plot, discussion",
    "soak": "try the running graph: long work, nodes killed, nonsense on every topic",
    "timing": "tell how long the steps of the running graph take; as CSV too",
    "bench": "measure the figures that the documentation quotes",
    "check": "tell what is installed, what is missing, and the mend",
}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a subcommand.

    Returns:
        Exit code: the subcommand's, 2 for wrong values, 1 for any other error.
    """
    words = list(map(_literal, sys.argv[1:] if arguments is None else arguments))
    parser = _Parser(prog="scenesense", description=ros_scenesense.__doc__)
    parser.add_argument("--version", action="version", version=ros_scenesense.__version__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, help_text in COMMANDS.items():
        command = commands.add_parser(name, help=help_text, description=help_text)
        # Only the asked-for command is imported: `--help` answers at once.
        if words and words[0] == name:
            module = importlib.import_module(f"ros_scenesense.cli.{name}")
            module.add_arguments(command)
            command.set_defaults(run=module.run)
    parsed = parser.parse_args(words)
    try:
        return int(parsed.run(parsed))
    except ParameterError as error:
        print(f"scenesense {parsed.command}: {error}", file=sys.stderr)
        return 2
    except SceneSenseError as error:
        print(f"scenesense {parsed.command}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def _literal(word: str) -> str:
    """A word as argparse should take it: `-stable(red_can)` is a literal, not an option."""
    return f" {word}" if re.match(r"-[a-z_]\w*\(", word) else word


if __name__ == "__main__":
    sys.exit(main())
