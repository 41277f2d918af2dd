"""`scenesense train`: from labelled scenes to a network that the stage takes."""

import pytest

from ros_scenesense.attention.networks.answers import TrainedNetwork
from ros_scenesense.cli.main import main
from ros_scenesense.errors import ParameterError
from ros_scenesense.parameters import build
from ros_scenesense.stages.attention import AttentionConfiguration, AttentionStage


def test_a_network_is_trained_on_simulated_scenes_and_used(tmp_path, capsys):
    path = tmp_path / "mine.pt"
    words = ["train", "--scenes", "10", "--iterations", "2", "--seed", "5", "--out", str(path)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "examples of 10 scenes, 2 iterations" in said
    assert TrainedNetwork.load(path).iterations == 2
    stage = AttentionStage(build(AttentionConfiguration, {"network": str(path)}))
    stage.close()


def test_wrong_values_are_one_line(tmp_path, capsys):
    assert main(["train", "--out", str(tmp_path / "mine.bin")]) == 2
    assert "must be a file name that ends in .pt" in capsys.readouterr().err
    assert main(["train", "--out", str(tmp_path / "mine.pt"), "--scenes", "1"]) == 2
    assert "'scenes' is '1'" in capsys.readouterr().err
    missing = str(tmp_path / "nowhere.pt")
    with pytest.raises(ParameterError, match="must be shipped, none, or a file"):
        AttentionStage(build(AttentionConfiguration, {"network": missing}))
