"""Commands that talk to a running graph: the right answer among others, and none in time."""

import argparse

import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.cli.conversation import ask
from ros_scenesense.errors import ConversationError, ParameterError
from ros_scenesense.messages.grounding import Feedback, FeedbackResult

FEEDBACK = Feedback(id="mine", relation="left", object="mug", reference="can")


def arguments(**values) -> argparse.Namespace:
    given = {"namespace": "/scenesense", "domain_id": None, "discovery": None, "timeout": 10.0}
    return argparse.Namespace(**{**given, **values})


def put(request=FEEDBACK, **values) -> FeedbackResult:
    return ask(arguments(**values), request, FeedbackResult, lambda one: one.id == request.id)


def test_without_a_node_it_is_said_how_to_start_one():
    with pytest.raises(ConversationError, match=r"/nobody/here/feedback .*'scenesense launch'"):
        put(namespace="/nobody/here", timeout=0.3)


@pytest.mark.parametrize(
    ("values", "words"),
    [({"timeout": 0.0}, "--timeout is 0"), ({"namespace": "no name"}, "namespace 'no name'")],
    ids=["timeout", "namespace"],
)
def test_wrong_arguments_are_refused(values, words):
    with pytest.raises(ParameterError, match=words):
        put(**values)


def test_a_relation_that_is_none_is_refused_with_the_known_ones(capsys):
    assert cli.main(["feedback", "beside", "mug", "can"]) == 2
    error = capsys.readouterr().err
    assert "'beside'" in error
    assert "not_touching" in error
