"""Shipped data is found, and a broken installation is named."""

import pytest

from ros_scenesense.errors import SceneSenseError
from ros_scenesense.messages.schemas import file_name
from ros_scenesense.messages.topics import TOPICS
from ros_scenesense.resources import resource


def test_every_message_has_its_schema_file():
    for message in TOPICS:
        assert resource("msg_defs", file_name(message)).is_file()


@pytest.mark.parametrize("folder", ["asp", "msg_defs", "config"])
def test_the_folders_are_there_and_not_empty(folder):
    assert any(resource(folder).iterdir())


@pytest.mark.parametrize(("folder", "name"), [("asp", "no_such_file.lp"), ("no_such_folder", "")])
def test_what_is_missing_is_named_with_the_mend(folder, name):
    with pytest.raises(SceneSenseError, match=rf"{folder}/?{name}.*reinstall ros_scenesense"):
        resource(folder, name)
