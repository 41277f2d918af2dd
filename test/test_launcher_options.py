"""What the launcher refuses before anything starts, and which values the nodes get."""

import pytest
import yaml

from ros_scenesense.cli import launch
from ros_scenesense.cli.main import main as command
from ros_scenesense.errors import ParameterError
from ros_scenesense.launcher import Graph, GraphOptions
from ros_scenesense.launcher import graph as launcher_graph
from ros_scenesense.launcher.parameter_values import parameter_values, write_parameter_values

# What is refused before anything starts


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"nodes": ("camera",)}, "node 'camera' is unknown"),
        ({"namespace": "/a b"}, "namespace '/a b'"),
        ({"domain_id": 400}, "from 0 to 232"),
        ({"discovery": "MOON"}, "LOCALHOST, SUBNET"),
        ({"remaps": ("camera/color/image_raw",)}, "must be written FROM:=TO"),
        ({"remaps": ("camera/color/image_raw:=/a b",)}, "remapping 'camera/color/image_raw:=/a b'"),
        ({"silence_s": 0.1}, "at least 1"),
        ({"silence_s": float("nan")}, "at least 1"),
    ],
)
def test_wrong_options_are_one_line(options, said):
    with pytest.raises(ParameterError) as refused:
        GraphOptions(**options)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({"simulated_camera": {"in_flight": "0"}}, "an integer from 1 to 32"),
        ({"simulated_camera": {"in_flite": "2"}}, "'in_flite' is unknown, known are: arrangement"),
        ({"moon": {"phase": "1"}}, "node 'moon' is not started"),
    ],
)
def test_wrong_overrides_name_node_parameter_and_range(overrides, said):
    with pytest.raises(ParameterError, match=r"simulated_camera|moon") as refused:
        Graph(GraphOptions(overrides=overrides))
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "cannot be read"),
        ("- 1", "section"),
        ("grounding: 5", "'grounding' must hold 'ros__parameters'"),
        ("/**/grounding: {ros__parameters: {min_pts: 5}}", "'min_pts' is unknown"),
        ("/**/grounding: {ros__parameters: {min_points: -5}}", "an integer of at least 1"),
        ("/**/grounding: {ros__parameters: {min_points: [5]}}", "an integer of at least 1"),
    ],
)
def test_wrong_params_files_are_one_line(tmp_path, text, said):
    file = tmp_path / "params.yaml"
    file.write_text(text)
    with pytest.raises(ParameterError) as refused:
        parameter_values(GraphOptions(parameters_file=file))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_missing_params_file_is_named(tmp_path):
    with pytest.raises(ParameterError, match=r"nowhere\.yaml"):
        parameter_values(GraphOptions(parameters_file=tmp_path / "nowhere.yaml"))


# Which values the nodes get


@pytest.mark.parametrize(
    ("key", "matches"),
    [
        ("grounding", True),
        ("/**/grounding", True),
        ("/**", True),
        ("/room/grounding", True),
        ("/room/*", True),
        ("/*/grounding", True),
        ("/grounding", False),
        ("/*", False),
        ("/other/grounding", False),
        ("/room/grounding_control", False),
    ],
)
def test_sections_are_found_by_the_wildcards_of_ros(tmp_path, key, matches):
    file = tmp_path / "params.yaml"
    file.write_text(yaml.safe_dump({key: {"ros__parameters": {"seed": 9}}}))
    options = GraphOptions(nodes=("grounding",), namespace="/room", parameters_file=file)
    assert parameter_values(options)["grounding"].get("seed") == (9 if matches else None)


def test_overrides_beat_the_state_folder_and_both_the_file(tmp_path):
    file = tmp_path / "params.yaml"
    file.write_text(
        "simulated_camera:\n"
        "  ros__parameters: {seed: 1, scenes: 2, state_dir: /a, use_sim_time: true}\n"
    )
    options = GraphOptions(
        nodes=("simulated_camera",),
        parameters_file=file,
        state_dir=tmp_path / "state",
        overrides={"simulated_camera": {"seed": "7", "resend_s": "3", "session": "mine"}},
    )
    values = parameter_values(options)["simulated_camera"]
    expected = {"seed": 7, "scenes": 2, "resend_s": 3.0, "session": "mine", "use_sim_time": True}
    assert values == {**expected, "state_dir": str(tmp_path / "state")}
    assert isinstance(values["resend_s"], float)


def test_every_node_that_remembers_gets_the_state_folder(tmp_path):
    values = parameter_values(GraphOptions(state_dir=tmp_path))
    for node in ("simulated_camera", "grounding", "grounding_control"):
        assert values[node]["state_dir"] == str(tmp_path)


def test_every_graph_has_a_session_of_its_own():
    options = GraphOptions(nodes=("simulated_camera",))
    sessions = {parameter_values(options)["simulated_camera"]["session"] for _ in range(3)}
    assert len(sessions) == 3
    assert all(sessions)


def test_written_values_are_keyed_by_full_names(tmp_path):
    options = GraphOptions(nodes=("grounding",), namespace="/room")
    write_parameter_values(tmp_path / "out.yaml", options, {"grounding": {"seed": 3}})
    written = yaml.safe_load((tmp_path / "out.yaml").read_text())
    assert written == {"/room/grounding": {"ros__parameters": {"seed": 3}}}


def test_environment_keeps_what_the_user_set(monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    monkeypatch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "/mine.xml")
    kept = GraphOptions().environment()
    assert kept["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SUBNET"
    assert kept["FASTRTPS_DEFAULT_PROFILES_FILE"] == "/mine.xml"
    assert "ROS_DOMAIN_ID" not in kept
    asked = GraphOptions(discovery="LOCALHOST", domain_id=7).environment()
    assert (asked["ROS_AUTOMATIC_DISCOVERY_RANGE"], asked["ROS_DOMAIN_ID"]) == ("LOCALHOST", "7")
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE")
    monkeypatch.delenv("FASTRTPS_DEFAULT_PROFILES_FILE")
    shipped = GraphOptions().environment()
    assert shipped["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert shipped["FASTRTPS_DEFAULT_PROFILES_FILE"].endswith("fastdds_profile.xml")


def test_only_the_newest_logs_are_kept(monkeypatch, tmp_path):
    monkeypatch.setattr(launcher_graph.platformdirs, "user_log_path", lambda *_, **__: tmp_path)
    for number in range(20):
        (tmp_path / f"launch-2000010{number:02d}").mkdir()
    (tmp_path / "mine").mkdir()
    with Graph(GraphOptions(nodes=())) as graph:
        assert graph.log_dir.parent == tmp_path
    left = sorted(path.name for path in tmp_path.iterdir())
    assert len(left) == launcher_graph.KEPT_LOGS + 1
    assert graph.log_dir.name in left
    assert "mine" in left
    assert "launch-200001000" not in left


def test_overrides_of_the_command_line():
    assert launch.parse_overrides(["a.x=1", "a.y=b=c", "b.z="]) == {
        "a": {"x": "1", "y": "b=c"},
        "b": {"z": ""},
    }
    for wrong in ("a.x", "x=1", "=1", "a.=1"):
        with pytest.raises(ParameterError, match=r"node\.parameter=value"):
            launch.parse_overrides([wrong])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-p", "simulated_camera.in_flight=0"], "an integer from 1 to 32"),
        (["-p", "nonsense"], "node.parameter=value"),
        (["--nodes", "camera"], "node 'camera' is unknown"),
        (["--domain-id", "999"], "from 0 to 232"),
        (["--silence", "0"], "silence is 0 s, must be a number of at least 1"),
        (["--params", "/no/such.yaml"], "/no/such.yaml"),
    ],
)
def test_wrong_command_lines_end_with_one_line_and_exit_code_2(capfd, words, said):
    assert command(["launch", *words]) == 2
    error = capfd.readouterr().err
    assert said in error
    assert error.count("\n") == 1
