"""The `scenesense` command: help at once, one line and exit code 2 for wrong values."""

import sys
import types

import pytest

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import LaunchError, ParameterError


@pytest.fixture
def command(monkeypatch):
    """Puts a stand-in for a subcommand in place; `run` decides what it does."""
    module = types.ModuleType("ros_scenesense.cli.check")
    module.add_arguments = lambda parser: parser.add_argument("--count", type=int)
    module.run = lambda arguments: arguments.count
    monkeypatch.setitem(sys.modules, "ros_scenesense.cli.check", module)
    return module


@pytest.mark.usefixtures("command")
def test_exit_code_is_the_commands():
    assert cli.main(["check", "--count", "7"]) == 7


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["bogus"], "bogus"),
        ([], "COMMAND"),
        (["check", "--count", "many"], "many"),
        (["check", "--no-such-option"], "--no-such-option"),
    ],
)
@pytest.mark.usefixtures("command")
def test_wrong_words_end_with_one_line_and_exit_code_2(capsys, words, said):
    with pytest.raises(SystemExit) as ended:
        cli.main(words)
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "code"),
    [(ParameterError("parameter 'x' is 9"), 2), (LaunchError("node died"), 1)],
)
def test_errors_are_one_line(command, capsys, error, code):
    def fail(_arguments):
        raise error

    command.run = fail
    assert cli.main(["check"]) == code
    assert capsys.readouterr().err == f"scenesense check: {error}\n"


def test_help_names_every_command(capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert [name for name in cli.COMMANDS if name not in text] == []
