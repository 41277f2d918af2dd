"""What the pages show of `scenesense plan` is what it prints."""

import re
import shlex
from pathlib import Path

import pytest

from ros_scenesense.cli.main import main

ROOT = Path(__file__).resolve().parent.parent
PAGES = (ROOT / "README.md", ROOT / "docs" / "planning.md")
SHOWN = [
    (page.name, command, output)
    for page in PAGES
    for command, output in re.findall(
        r"```console\n\$ scenesense (plan .*)\n((?:.*\n)*?)```", page.read_text()
    )
]


def test_both_pages_show_plans():
    assert {page for page, _, _ in SHOWN} == {page.name for page in PAGES}


@pytest.mark.parametrize(("page", "command", "output"), SHOWN)
def test_the_output_on_the_page_is_that_of_the_command(page, command, output, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    main(shlex.split(command))
    printed = capsys.readouterr().out
    shown, ellipsis, _ = output.partition("...\n")
    assert printed.startswith(shown) if ellipsis else printed == shown, page
