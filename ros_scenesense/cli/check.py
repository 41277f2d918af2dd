"""`scenesense check`: tells what is installed, what is missing, and the mend."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from ros_scenesense.cli.examination import State, examine


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options of `scenesense check`."""
    parser.add_argument("--json", action="store_true", help="print the findings as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Prints the findings; returns 0 if everything required is there, else 1."""
    findings = examine()
    missing = [finding for finding in findings if finding.state is State.MISSING]
    if arguments.json:
        lines = [{**asdict(finding), "state": finding.state.value} for finding in findings]
        print(json.dumps({"ok": not missing, "findings": lines}, indent=2))
        return 1 if missing else 0
    width = max(len(finding.name) for finding in findings)
    for finding in findings:
        print(f"{finding.state.value:8} {finding.name:{width}}  {finding.found}")
        if finding.mend:
            print(f"{'':8} {'':{width}}  -> {finding.mend}")
    print()
    if missing:
        print(f"missing: {', '.join(finding.name for finding in missing)}")
        return 1
    print("everything that is required is there")
    return 0
