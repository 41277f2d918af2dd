"""The networks learn, are the same for the same seed, and survive interruptions and bad files."""

import numpy as np
import pytest

from ros_scenesense.attention.networks import checkpoints, training
from ros_scenesense.attention.networks.alexnet import AlexNetConfiguration
from ros_scenesense.attention.networks.answers import TrainedNetwork
from ros_scenesense.attention.networks.kinds import build
from ros_scenesense.attention.networks.lenet import LeNetConfiguration
from ros_scenesense.attention.networks.query import QueryNetworkConfiguration
from ros_scenesense.attention.networks.samples import Samples
from ros_scenesense.attention.networks.training import TrainingConfiguration, train
from ros_scenesense.errors import NetworkError

SMALL = LeNetConfiguration(side=24, objects=2)
QUICK = TrainingConfiguration(iterations=40, batch=8, interval=10, patience=0)


def random_samples(configuration, outputs, count=50, seed=0):
    """Random patches with random answers: only who remembers each image gets them right."""
    rng = np.random.default_rng(seed)
    side = configuration.side
    patch = np.ones((1, 1, side // 4 + 1, side // 4 + 1), np.float32)
    patches = rng.random((count, configuration.channels, 4, 4)).astype(np.float32)
    answers = rng.integers(0, 2, (count, outputs)).astype(np.float32)
    answers[rng.random(answers.shape) < 0.1] = np.nan
    return Samples(
        images=np.kron(patches, patch)[..., :side, :side],
        numbers=rng.random((count, configuration.numbers)).astype(np.float32),
        answers=answers,
        groups=np.arange(count),
    )


def share_right(trained, samples):
    said = trained.probabilities(samples.images, samples.numbers) > 0.5
    known = ~np.isnan(samples.answers)
    return float((said == (samples.answers > 0.5))[known].mean())


@pytest.mark.parametrize(
    ("configuration", "outputs", "iterations"),
    [
        (LeNetConfiguration(side=32, learning_rate=2e-3), 6, 100),
        (AlexNetConfiguration(side=67, width=0.15, learning_rate=1e-3), 6, 350),
        (QueryNetworkConfiguration(side=32, dropout=0.0, learning_rate=3e-3), 2, 100),
    ],
    ids=["lenet", "alexnet", "query"],
)
def test_every_network_can_learn_50_images_by_heart(configuration, outputs, iterations):
    samples = random_samples(configuration, outputs)
    schedule = TrainingConfiguration(iterations=iterations, batch=50, validation_share=0.0)
    assert share_right(train(configuration, samples, schedule), samples) >= 0.99


def test_the_papers_networks_have_the_papers_inputs_and_outputs():
    for configuration in (LeNetConfiguration(), AlexNetConfiguration(width=0.1)):
        network = TrainedNetwork(build(configuration, seed=0))
        side = {LeNetConfiguration: 56, AlexNetConfiguration: 227}[type(configuration)]
        images = np.zeros((1, 3, side, side), np.float32)
        assert network.probabilities(images, np.zeros((1, 0), np.float32)).shape == (1, 6)


def test_same_seed_same_network_and_torchs_own_randomness_is_left_alone():
    import torch

    samples = random_samples(SMALL, 3)
    before = torch.random.get_rng_state()
    one, again = (train(SMALL, samples, QUICK) for _ in range(2))
    assert torch.equal(before, torch.random.get_rng_state())
    said = [each.probabilities(samples.images, samples.numbers) for each in (one, again)]
    np.testing.assert_array_equal(*said)
    other = train(SMALL, samples, TrainingConfiguration(**(vars(QUICK) | {"seed": 1})))
    assert not np.array_equal(said[0], other.probabilities(samples.images, samples.numbers))


@pytest.mark.parametrize(
    "configuration",
    [SMALL, QueryNetworkConfiguration(side=16, filters=4, dropout=0.5)],
    ids=["lenet", "with dropout and normalisation"],
)
def test_an_interrupted_training_goes_on_to_the_same_network(configuration, tmp_path):
    samples = random_samples(configuration, 2 if configuration is not SMALL else 3)
    checkpoint = tmp_path / "training.pt"
    whole = train(configuration, samples, QUICK)

    def interrupt(progress):
        if progress.iteration == 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(configuration, samples, QUICK, interrupt, checkpoint)
    seen = []
    resumed = train(
        configuration, samples, QUICK, lambda each: seen.append(each.iteration), checkpoint
    )
    assert seen == [30, 40]
    assert not checkpoint.exists()
    np.testing.assert_array_equal(
        whole.probabilities(samples.images, samples.numbers),
        resumed.probabilities(samples.images, samples.numbers),
    )


def test_a_checkpoint_of_another_training_is_refused(tmp_path):
    samples, checkpoint = random_samples(SMALL, 3), tmp_path / "training.pt"

    def interrupt(progress):
        if progress.iteration == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(SMALL, samples, QUICK, interrupt, checkpoint)
    longer = TrainingConfiguration(**(vars(QUICK) | {"iterations": 60}))
    with pytest.raises(NetworkError, match="another training"):
        train(SMALL, samples, longer, checkpoint=checkpoint)


def test_training_stops_where_held_out_scenes_gain_nothing_and_keeps_the_best():
    samples = random_samples(SMALL, 3)
    seen = []
    schedule = TrainingConfiguration(iterations=2000, interval=10, patience=3)
    trained = train(SMALL, samples, schedule, seen.append)
    losses = [each.validation_loss for each in seen]
    assert len(seen) < 200
    assert trained.validation_loss == min(losses)
    assert trained.iterations == seen[int(np.argmin(losses))].iteration


def test_probabilities_are_calibrated_on_what_was_held_out():
    # Answers that an image tells in two cases of three: whoever is surer than that is wrong.
    rng = np.random.default_rng(3)
    count = 400
    truth = rng.integers(0, 2, count)
    shown = np.where(rng.random(count) < 0.67, truth, 1 - truth)
    images = np.zeros((count, 3, 24, 24), np.float32) + shown[:, None, None, None].astype("f4")
    answers = np.full((count, 3), np.nan, np.float32)
    answers[:, 0] = truth
    samples = Samples(images, np.zeros((count, 0), np.float32), answers, np.arange(count))
    trained = train(SMALL, samples, TrainingConfiguration(iterations=100, patience=3))
    said = trained.probabilities(samples.images, samples.numbers)[:, 0]
    assert said[shown == 1].mean() == pytest.approx(truth[shown == 1].mean(), abs=0.08)


def test_a_network_is_read_as_it_was_written(tmp_path):
    samples = random_samples(SMALL, 3)
    trained = train(SMALL, samples, QUICK)
    trained.save(tmp_path / "networks" / "one.pt")
    read = TrainedNetwork.load(tmp_path / "networks" / "one.pt")
    assert (read.temperature, read.validation_loss) == (
        trained.temperature,
        trained.validation_loss,
    )
    assert read.network.configuration == SMALL
    np.testing.assert_array_equal(
        trained.probabilities(samples.images, samples.numbers),
        read.probabilities(samples.images, samples.numbers),
    )


def test_bad_files_are_named_with_the_mend(tmp_path, monkeypatch):
    path = tmp_path / "one.pt"
    with pytest.raises(NetworkError, match="no network"):
        TrainedNetwork.load(path)
    TrainedNetwork(build(SMALL, seed=0)).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(NetworkError, match=r"one\.pt' is damaged"):
        TrainedNetwork.load(path)
    path.write_bytes(b"")
    with pytest.raises(NetworkError, match="damaged"):
        TrainedNetwork.load(path)
    path.write_bytes(whole)
    monkeypatch.setattr(checkpoints, "VERSION", checkpoints.VERSION + 1)
    with pytest.raises(NetworkError, match="version 3, this release reads 4"):
        TrainedNetwork.load(path)


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "one.pt"
    TrainedNetwork(build(SMALL, seed=0)).save(path)
    whole = path.read_bytes()

    def full(*_arguments):
        raise OSError("No space left on device")

    monkeypatch.setattr(checkpoints.torch, "save", full)
    with pytest.raises(NetworkError, match="No space left"):
        TrainedNetwork(build(SMALL, seed=1)).save(path)
    assert path.read_bytes() == whole
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: {"answers": np.ones_like(s.answers)}, "all 120 answers are true"),
        (lambda s: {"answers": np.full_like(s.answers, np.nan)}, "needs labels"),
        (lambda s: {"groups": np.zeros_like(s.groups)}, "at least two"),
        (lambda s: {"answers": s.answers[:-1]}, "do not belong together"),
        (lambda s: {"answers": s.answers + 0.5}, "neither 0"),
        (lambda s: {"images": s.images * np.nan}, "no number"),
    ],
)
def test_samples_that_teach_nothing_are_refused(change, words):
    samples = random_samples(SMALL, 3)
    with pytest.raises(NetworkError, match=words):
        train(SMALL, Samples(**(vars(samples) | change(samples))), QUICK)


def test_too_little_memory_is_said(monkeypatch):
    import torch

    def none_left(*_arguments):
        raise torch.OutOfMemoryError("CUDA out of memory")

    monkeypatch.setattr(training.Training, "_step", none_left)
    with pytest.raises(NetworkError, match="too little memory for batches of 8"):
        train(SMALL, random_samples(SMALL, 3), QUICK)


def test_the_papers_schedule_is_met_at_both_ends():
    assert training.paper_iterations("lenet", 100) == 10_000
    assert training.paper_iterations("lenet", 5000) == 40_000
    assert training.paper_iterations("alexnet", 25) == 8_000
    assert 10_000 < training.paper_iterations("lenet", 1000) < 40_000


def test_one_example_alone_is_refused():
    one = random_samples(QueryNetworkConfiguration(), 2, count=1)
    with pytest.raises(NetworkError, match="one example alone"):
        train(
            QueryNetworkConfiguration(),
            one,
            TrainingConfiguration(iterations=1, validation_share=0.0),
        )
