"""Decision trees by ID3 on the columns of a table (paper, *Decision Tree Induction ...*)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from ros_scenesense.learning.columns import Table

Test = tuple[int, bool]
"""A column by its number, and its answer."""


@dataclass(frozen=True)
class Node:
    """A node of a tree; a leaf if it has no column.

    Attributes:
        positive: Training examples that get here and have a true label.
        count: Training examples that get here.
        column: Number of the column that splits them.
        yes: Where its answer is yes.
        no: Where it is no.
    """

    positive: int
    count: int
    column: int | None = None
    yes: Node | None = None
    no: Node | None = None

    @property
    def label(self) -> bool:
        """The label of most of the examples that get here."""
        return 2 * self.positive >= self.count

    @property
    def purity(self) -> float:
        """The share of examples of that label."""
        return max(self.positive, self.count - self.positive) / self.count


def grow(table: Table, members: int, depth: int | None = None, pure: float = 1.0) -> Node:
    """Grows a tree by the largest information gain; no column is used twice on a branch.

    Args:
        table: The columns.
        members: The training examples, as bits.
        depth: Tests on a branch at most; None = as many as it takes.
        pure: A node of this purity is a leaf, but for the root, which says nothing as a leaf.
    """
    columns = tuple(range(len(table.columns)))
    return _grow(table, members, columns, -1 if depth is None else depth, pure, root=True)


def branches(node: Node, path: tuple[Test, ...] = ()) -> Iterator[tuple[tuple[Test, ...], Node]]:
    """The branches of a tree, from the root to each leaf."""
    if node.column is None or node.yes is None or node.no is None:
        yield path, node
        return
    yield from branches(node.yes, (*path, (node.column, True)))
    yield from branches(node.no, (*path, (node.column, False)))


def exported(node: Node, table: Table, fluent: str, indent: str = "") -> str:
    """A tree as text, a line per test, with how many examples of each label get where."""
    tally = f"[{node.positive} {fluent}, {node.count - node.positive} not]"
    if node.column is None or node.yes is None or node.no is None:
        return f"{indent}{fluent if node.label else f'not {fluent}'} {tally}\n"
    question = table.columns[node.column]
    return (
        f"{indent}{question}? {tally}\n"
        f"{indent}  yes:\n{exported(node.yes, table, fluent, indent + '    ')}"
        f"{indent}  no:\n{exported(node.no, table, fluent, indent + '    ')}"
    )


def _grow(
    table: Table,
    members: int,
    columns: tuple[int, ...],
    depth: int,
    pure: float,
    root: bool = False,
) -> Node:
    count = members.bit_count()
    true = members & table.positive
    positive = true.bit_count()
    node = Node(positive, count)
    if depth == 0 or positive in (0, count) or (not root and node.purity >= pure):
        return node
    best, least = None, entropy(positive, count) * count - 1e-9
    for column in columns:
        bits = table.bits[column]
        inside = (members & bits).bit_count()
        if inside in (0, count):
            continue
        hits = (true & bits).bit_count()
        left = entropy(hits, inside) * inside
        if left >= least:
            continue
        left += entropy(positive - hits, count - inside) * (count - inside)
        if left < least:
            best, least = column, left
    if best is None:
        return node
    rest = tuple(column for column in columns if column != best)
    bits = table.bits[best]
    return Node(
        positive,
        count,
        best,
        _grow(table, members & bits, rest, depth - 1, pure),
        _grow(table, members & ~bits, rest, depth - 1, pure),
    )


@lru_cache(maxsize=1 << 16)
def entropy(positive: int, count: int) -> float:
    """The entropy of a label, in bits, where so many of so many examples are true."""
    if positive in (0, count):
        return 0.0
    share = positive / count
    return -share * math.log2(share) - (1.0 - share) * math.log2(1.0 - share)
