"""Parameters: any value is converted or refused with the allowed range in words."""

import math
from dataclasses import dataclass

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ros_scenesense.errors import ParameterError
from ros_scenesense.nodes.registry import NODES
from ros_scenesense.parameters import Parameter, build, parameter, parameters_of


@dataclass(frozen=True)
class Configuration:
    count: int = parameter(3, "how many", minimum=0, maximum=10)
    rate: float = parameter(1.5, "how often, hertz", minimum=0.1)
    below: float = parameter(-1.0, "how deep, metres", maximum=0.0)
    seed: int = parameter(0, "seed")
    shown: bool = parameter(True, "whether to show")
    shape: str = parameter("cube", "which shape", choices=("cube", "duck"))
    folder: str = parameter("", "where to")
    derived: str = "not a parameter"


PARAMETERS = {one.name: one for one in parameters_of(Configuration)}
ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.text(),
    st.binary(),
    st.decimals(),
    st.fractions(),
    st.floats().map(str),
    st.integers().map(str),
    st.lists(st.integers()),
    st.dictionaries(st.text(), st.integers()),
    st.sampled_from(["true", "FALSE", "cube", "1e3", "nan", "inf", "-inf", "1_0", "٣", " 4 "]),
)


class Unprintable:
    def __repr__(self):
        raise RuntimeError("no words")


@given(st.sampled_from(sorted(PARAMETERS)), ANYTHING)
@example("seed", 10**5000)
@example("count", 10**5000)
@example("rate", 10**5000)
@example("folder", 10**5000)
@example("seed", "9" * 5000)
@example("rate", "9" * 5000)
@example("rate", math.nan)
@example("count", math.inf)
@example("shape", "\ud800")
def test_any_value_is_converted_or_refused(name, value):
    one = PARAMETERS[name]
    try:
        converted = one.check(value)
    except ParameterError as error:
        words = str(error)
        assert words.startswith(f"parameter '{name}' is ")
        assert words.endswith(f", must be {one.allowed}")
        assert len(words) < 200
        return
    assert type(converted) is one.type
    assert one.check(converted) == converted
    if one.type in (int, float):
        assert math.isfinite(converted)
        assert one.minimum is None or converted >= one.minimum
        assert one.maximum is None or converted <= one.maximum
    assert not one.choices or converted in one.choices


def test_a_value_without_words_is_refused():
    with pytest.raises(ParameterError, match="'count' is some Unprintable, must be an integer"):
        PARAMETERS["count"].check(Unprintable())


@given(st.integers(0, 10))
def test_integers_are_taken_as_floats_and_as_text(number):
    assert type(PARAMETERS["rate"].check(number + 1)) is float
    assert PARAMETERS["rate"].check(number + 1) == number + 1
    assert PARAMETERS["count"].check(str(number)) == number
    assert PARAMETERS["count"].check(float(number)) == number


@given(st.floats(0.1, 1e6))
def test_floats_are_taken_as_text(number):
    assert PARAMETERS["rate"].check(repr(number)) == number


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("count", 2.5),
        ("count", "2.5"),
        ("count", True),
        ("count", 11),
        ("count", -1),
        ("count", None),
        ("rate", 0.0999),
        ("rate", False),
        ("rate", "fast"),
        ("below", 0.1),
        ("shown", 1),
        ("shown", "yes"),
        ("shape", "cone"),
        ("shape", ""),
        ("folder", 5),
        ("folder", b"x"),
    ],
)
def test_other_types_and_values_are_refused(name, value):
    with pytest.raises(ParameterError, match=f"'{name}'"):
        PARAMETERS[name].check(value)


def test_booleans_are_taken_as_text():
    assert [PARAMETERS["shown"].check(text) for text in ("true", "False", "TRUE")] == [
        True,
        False,
        True,
    ]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("count", "an integer from 0 to 10"),
        ("rate", "a number of at least 0.1"),
        ("below", "a number of at most 0"),
        ("seed", "an integer"),
        ("shown", "true or false"),
        ("shape", "one of cube, duck"),
        ("folder", "a string"),
    ],
)
def test_the_allowed_values_in_words(name, words):
    assert PARAMETERS[name].allowed == words


def test_large_bounds_are_written_in_full():
    many = Parameter("many", int, 0, "", minimum=0, maximum=123_456_789)
    assert many.allowed == "an integer from 0 to 123456789"


def test_the_declaration_is_read_in_order():
    assert list(PARAMETERS) == ["count", "rate", "below", "seed", "shown", "shape", "folder"]
    count = PARAMETERS["count"]
    assert (count.type, count.default, count.description) == (int, 3, "how many")


def test_build_checks_converts_and_keeps_defaults():
    built = build(Configuration, {"count": "4", "rate": 2, "shape": "duck"})
    assert built == Configuration(count=4, rate=2.0, shape="duck")
    assert type(built.rate) is float
    with pytest.raises(ParameterError, match="'count' is 11, must be an integer from 0 to 10"):
        build(Configuration, {"count": 11})


@pytest.mark.parametrize("name", ["colour", "derived", ""])
def test_an_unknown_name_is_refused_with_the_known_ones(name):
    with pytest.raises(ParameterError, match=f"parameter '{name}' is unknown.* count,.* shown"):
        build(Configuration, {name: 1})


@pytest.mark.parametrize("node", NODES)
def test_parameters_of_the_nodes_have_descriptions_and_allowed_defaults(node):
    declared = parameters_of(NODES[node].configuration())
    for one in declared:
        assert one.description
        assert type(one.default) is one.type
        assert one.check(one.default) == one.default
