"""The documentation quotes the figures that were measured, and links to files that are there."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
SHARES = ("strict_accuracy", "strict_share", "decided_share")


@pytest.fixture(scope="module")
def figures() -> dict[str, float]:
    return json.loads((ROOT / "docs/results/bench.json").read_text())["figures"]


def rows(text: str, pattern: str) -> list[tuple[str, ...]]:
    found = re.findall(pattern, text)
    assert found, f"no row like {pattern}"
    return found


def test_quoted_figures_are_the_measured_ones(figures):
    text = (ROOT / "README.md").read_text()
    for name, quoted in rows(text, r"\| `(\w+)`: [^|]*\| ([\d.]+) \|"):
        decimals = len(quoted.partition(".")[2])
        assert f"{figures[name]:.{decimals}f}" == quoted, name


def test_quoted_shares_are_the_measured_ones(figures):
    text = (ROOT / "README.md").read_text()
    pattern = r"\(`(\w+)`\) \| ([\d.]+) % \| ([\d.]+) % \| ([\d.]+) %"
    for task, *quoted in rows(text, pattern):
        measured = [f"{100 * figures[f'{task}_{share}']:.1f}" for share in SHARES]
        assert measured == quoted, task


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page):
    targets = re.findall(r"\]\(([^)#]+)\)", page.read_text())
    local = [target for target in targets if "://" not in target]
    assert [target for target in local if not (page.parent / target).exists()] == []
