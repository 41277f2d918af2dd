import itertools

import numpy as np
import pytest

from ros_scenesense.reasoning.selection import Version, decision, select


def version(name, value, fires, length=1, strict=True, given=False):
    return Version(name, value, strict, length, frozenset(fires), given)


def test_the_general_version_beats_the_over_specified_one():
    over = version("over", False, {0}, length=2, given=True)
    general = version("general", False, {0, 1, 2})
    result = select([[over, general]], [], [False, False, False, True])
    assert result.kept == {"general"}
    (dropped,) = result.dropped
    assert (dropped.id, dropped.instead, dropped.wins) == ("over", "general", (1, 2))


def test_the_most_general_is_kept_among_equals():
    over = version("over", False, {0, 1}, length=2)
    general = version("general", False, {0, 1})
    assert select([[over, general]], [], [False, False]).kept == {"general"}


def test_a_version_that_is_too_general_loses():
    right = version("right", False, {0}, length=2)
    rash = version("rash", False, {0, 1, 2})
    assert select([[rash, right]], [], [False, True, True]).kept == {"right"}


def test_a_version_that_others_must_overrule_loses_against_one_that_knows_its_exceptions():
    law = version("law", False, {1}, strict=True)
    rash = version("rash", True, {0, 1}, strict=False)
    careful = version("careful", True, {0}, length=2, strict=False)
    assert select([[rash, careful]], [law], [True, False]).kept == {"law", "careful"}


def test_what_contradicts_the_given_is_decided_by_scenes():
    given = version("given", True, {0, 1}, given=True)
    learned = version("learned", False, {0, 1})
    assert select([], [], [False, False], [given, learned]).kept == {"learned"}
    assert select([], [], [True, True], [given, learned]).kept == {"given"}
    # Nothing speaks against what was given: it stays.
    assert "given" in select([], [], [], [given]).kept


@pytest.mark.parametrize("seed", range(8))
def test_it_is_as_good_as_trying_all_combinations(seed):
    generator = np.random.default_rng(seed)
    labels = [bool(each) for each in generator.integers(0, 2, 12)]

    def drawn(name):
        fires = {i for i in range(12) if generator.random() < 0.3}
        value, strict = bool(generator.integers(2)), bool(generator.integers(2))
        return version(name, value, fires, int(generator.integers(1, 4)), strict)

    groups = [[drawn(f"g{g}v{v}") for v in range(3)] for g in range(3)]
    fixed = [drawn("fixed")]

    def quality(combination):
        axioms = [*combination, *fixed]
        said = [decision(axioms, item) for item in range(len(labels))]
        right = sum(one == label for one, label in zip(said, labels, strict=True))
        wrong = sum(one == (not label) for one, label in zip(said, labels, strict=True))
        fired = sum(each.value != labels[item] for each in axioms for item in each.fires)
        return -right, wrong, fired, sum(each.length for each in combination)

    best = min(quality(each) for each in itertools.product(*groups))
    kept = select(groups, fixed, labels).kept
    chosen = [each for group in groups for each in group if each.id in kept]
    assert len(chosen) == 3
    assert quality(chosen) == best
