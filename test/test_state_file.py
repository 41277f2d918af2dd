"""State files: created, kept, refused, and set aside when they are damaged."""

import sqlite3

import pytest

from ros_scenesense.errors import StateError
from ros_scenesense.stages.health import Health
from ros_scenesense.stages.scene_ledger import SceneLedger
from ros_scenesense.stages.state_file import IN_MEMORY, open_state_file

SCHEMA = "CREATE TABLE thing (name TEXT);"


def test_what_is_written_is_there_after_reopening(tmp_path):
    path = tmp_path / "new" / "thing.db"
    connection = open_state_file(path, SCHEMA, 1, Health())
    with connection:
        connection.execute("INSERT INTO thing VALUES ('kept')")
    connection.close()
    again = open_state_file(path, SCHEMA, 1, Health())
    assert again.execute("SELECT name FROM thing").fetchall() == [("kept",)]


@pytest.mark.parametrize("damage", [b"this is no database" * 100, None])
def test_a_damaged_file_is_reported_and_kept_aside(tmp_path, damage):
    path = tmp_path / "thing.db"
    connection = open_state_file(path, SCHEMA, 1, Health())
    with connection:
        connection.executemany("INSERT INTO thing VALUES (?)", [("x" * 500,)] * 200)
    connection.close()
    content = damage if damage else path.read_bytes()[:5000] + b"\xff" * 20000
    path.write_bytes(content)
    health = Health()
    open_state_file(path, SCHEMA, 1, health).close()
    assert health.counters["state_set_aside"] == 1
    assert str(path) in (health.last_problem or "")
    assert (tmp_path / "thing.db.broken-1").read_bytes() == content


def test_a_file_of_another_release_is_refused_untouched(tmp_path):
    path = tmp_path / "thing.db"
    open_state_file(path, SCHEMA, 7, Health()).close()
    with pytest.raises(StateError, match="version 7"):
        open_state_file(path, SCHEMA, 1, Health())
    assert sqlite3.connect(path).execute("PRAGMA user_version").fetchone() == (7,)


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StateError, match="file"):
        open_state_file(tmp_path / "file" / "thing.db", SCHEMA, 1, Health())


def test_ledger_never_reuses_a_number():
    ledger = SceneLedger(IN_MEMORY, Health())
    assert ledger.next_number("a") == 0
    ledger.record("a", 0, "open")
    ledger.record("a", 1, "open")
    ledger.record("a", 0, "settled")
    assert ledger.open_scenes("a") == [1]
    assert ledger.next_number("a") == 2
    assert ledger.next_number("b") == 0


def test_an_older_file_is_lifted_and_keeps_what_it_has(tmp_path):
    path = tmp_path / "thing.db"
    connection = open_state_file(path, SCHEMA, 1, Health())
    with connection:
        connection.execute("INSERT INTO thing VALUES ('kept')")
    connection.close()
    steps = ["ALTER TABLE thing ADD COLUMN size INTEGER;", "CREATE TABLE more (x);"]
    lifted = open_state_file(path, "", 3, Health(), migrations=steps)
    assert lifted.execute("SELECT name, size FROM thing").fetchall() == [("kept", None)]
    assert lifted.execute("SELECT * FROM more").fetchall() == []
    assert lifted.execute("PRAGMA user_version").fetchone() == (3,)


def test_a_file_older_than_all_migrations_is_refused(tmp_path):
    path = tmp_path / "thing.db"
    open_state_file(path, SCHEMA, 1, Health()).close()
    with pytest.raises(StateError, match="version 1"):
        open_state_file(path, SCHEMA, 3, Health(), migrations=["CREATE TABLE more (x);"])


def test_ledger_reads_the_file_of_the_first_release(tmp_path):
    path = tmp_path / "camera.db"
    first_release = (
        "CREATE TABLE scene (session TEXT NOT NULL, number INTEGER NOT NULL, state TEXT NOT NULL, "
        "PRIMARY KEY (session, number)) WITHOUT ROWID; INSERT INTO scene VALUES ('a', 0, 'open');"
    )
    open_state_file(path, first_release, 1, Health()).close()
    health = Health()
    ledger = SceneLedger(path, health)
    assert ledger.open_scenes("a") == [0]
    assert ledger.step("a", 0) is None
    assert ledger.answer("a-0000", "x") is None
    assert not health.counters
