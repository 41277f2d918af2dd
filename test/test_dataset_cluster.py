"""Datasets made on a Dask cluster: a scheduler and workers on loopback, some of which die."""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import pytest
from test_dataset import content, small

from ros_scenesense.cli import main as cli
from ros_scenesense.errors import DatasetError, SimulationError
from ros_scenesense.simulation.dataset import cluster as dataset_cluster
from ros_scenesense.simulation.dataset import generation
from ros_scenesense.simulation.dataset.cluster import run_on_cluster
from ros_scenesense.simulation.dataset.generation import generate
from ros_scenesense.simulation.dataset.metadata import installed_versions

distributed = pytest.importorskip(
    "distributed", reason="the extra `cluster` is not installed: pip install '.[cluster]'"
)

HERE = Path(__file__).parent
TIMEOUT_S = 60.0
VERSIONS = installed_versions()


class Cluster:
    """A scheduler and its workers, each a process that nobody starts again when it dies."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file = folder / "scheduler.json"
        self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0")
        self._workers: list[subprocess.Popen[bytes]] = []
        # Waits for the file of the scheduler.
        self._start_worker()
        until(lambda: is_whole(self._file))
        self.address = str(msgspec.json.decode(self._file.read_bytes())["address"])
        self.client = distributed.Client(self.address, timeout=TIMEOUT_S, set_as_default=False)

    def workers(self, count: int) -> dict[str, int]:
        """Starts workers until there are so many; their process ids by address."""
        self._workers = [worker for worker in self._workers if worker.poll() is None]
        for _ in range(count - len(self._workers)):
            self._start_worker()
        pids = {worker.pid for worker in self._workers}
        until(lambda: set(self.client.run(os.getpid).values()) == pids)
        return dict(self.client.run(os.getpid))

    def close(self) -> None:
        self.client.close()
        for process in (*self._workers, self._scheduler):
            process.kill()
            process.wait(TIMEOUT_S)

    def _start_worker(self) -> None:
        self._workers.append(self._start("worker", "--nthreads", "1", "--no-nanny"))

    def _start(self, kind: str, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", *words]
        command += ["--scheduler-file", str(self._file), "--dashboard-address", ":0"]
        # One more death of the same part is one too many.
        environment = os.environ | {
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
            "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path]),
        }
        with (self._folder / "log.txt").open("ab") as log:
            return subprocess.Popen(
                command, cwd=self._folder, env=environment, stdout=log, stderr=log
            )


def is_whole(file: Path) -> bool:
    """Whether a JSON file is there, and not only its beginning."""
    try:
        return bool(msgspec.json.decode(file.read_bytes()))
    except (FileNotFoundError, msgspec.DecodeError):
        return False


def until(condition: Callable[[], bool]) -> None:
    """Waits until something is so."""
    never = threading.Event()
    for _ in range(int(TIMEOUT_S / 0.02)):
        if condition():
            return
        never.wait(0.02)
    raise TimeoutError(f"not so within {TIMEOUT_S:g} s")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("cluster"))
    yield cluster
    cluster.close()


def kill_if_busy(cluster: Cluster, worker: str, pid: int) -> bool:
    """Kills a worker if it has work in hand, which a stopped process cannot finish meanwhile."""
    os.kill(pid, signal.SIGSTOP)
    busy = bool(cluster.client.processing()[worker])
    os.kill(pid, signal.SIGKILL if busy else signal.SIGCONT)
    return busy


def test_a_killed_worker_changes_no_byte(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = 9
    monkeypatch.setattr(generation, "_SCENES_PER_JOB", 1)
    worker, pid = next(iter(cluster.workers(2).items()))
    killed: list[int] = []

    def report(done: int, _count: int) -> None:
        if done > 0 and not killed and kill_if_busy(cluster, worker, pid):
            killed.append(done)

    assert generate(tmp_path / "there", small(count), 1, report, cluster.address) == count
    assert killed
    generate(tmp_path / "here", small(count))
    assert content(tmp_path / "there") == content(tmp_path / "here")


def double(part: int) -> int:
    return 2 * part


def refuse(part: int) -> int:
    raise SimulationError(f"part {part} cannot be made")


def fail(part: int) -> int:
    raise KeyError(part)


def die(_part: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def test_results_come_in_order_and_few_parts_are_under_way(cluster: Cluster) -> None:
    cluster.workers(1)
    taken: list[int] = []

    def parts() -> Iterator[int]:
        for part in range(40):
            taken.append(part)
            yield part

    results = run_on_cluster(cluster.address, double, parts(), VERSIONS)
    for number, result in enumerate(results):
        assert result == 2 * number
        assert len(taken) <= number + 4  # two workers at most, two parts for each
    assert len(taken) == 40


@pytest.mark.parametrize(
    ("function", "error", "words"),
    [
        (refuse, SimulationError, "part 7 cannot be made"),
        (fail, DatasetError, r"worker of the cluster failed \(KeyError: 7\).*same command again"),
    ],
)
def test_what_a_job_raises_is_told(
    cluster: Cluster, function: Callable[[int], int], error: type[Exception], words: str
) -> None:
    cluster.workers(1)
    with pytest.raises(error, match=words):
        list(run_on_cluster(cluster.address, function, [7], VERSIONS))


def test_a_part_that_kills_its_workers_is_given_up(cluster: Cluster) -> None:
    cluster.workers(2)
    with pytest.raises(DatasetError, match=r"2 workers died.*--memory-limit.*finished scenes"):
        list(run_on_cluster(cluster.address, die, [1], VERSIONS))


def test_workers_of_other_versions_are_refused(cluster: Cluster, tmp_path: Path) -> None:
    cluster.workers(1)
    other = msgspec.structs.replace(small(), versions={**VERSIONS, "pybullet": "0.1"})
    with pytest.raises(DatasetError, match=r"worker tcp://\S+ has pybullet \S+ instead of 0.1"):
        generate(tmp_path, other, cluster=cluster.address)


def test_a_worker_of_another_version_that_comes_late_is_refused() -> None:
    with pytest.raises(DatasetError, match=r"has ros_scenesense \S+ instead of 0\.0\.1"):
        dataset_cluster._do(double, 1, {"ros_scenesense": "0.0.1"})


def test_a_worker_with_several_threads_does_one_part_at_a_time() -> None:
    both = threading.Barrier(2)

    def meet(_part: int) -> bool:
        try:
            both.wait(0.1)
        except threading.BrokenBarrierError:
            return False
        return True

    with ThreadPoolExecutor(2) as threads:
        assert not any(threads.map(lambda part: dataset_cluster._do(meet, part, {}), range(2)))


def test_a_cluster_without_workers_is_an_error() -> None:
    with (
        distributed.LocalCluster(
            n_workers=0, processes=False, protocol="tcp://", dashboard_address=":0"
        ) as empty,
        pytest.raises(DatasetError, match=r"has no workers: start them with `dask worker tcp://"),
    ):
        next(run_on_cluster(empty.scheduler_address, double, [1], VERSIONS, patience_s=0.2))


def test_a_lost_scheduler_is_an_error() -> None:
    cluster = distributed.LocalCluster(
        n_workers=1, processes=False, protocol="tcp://", dashboard_address=":0"
    )
    results = run_on_cluster(cluster.scheduler_address, double, range(9), VERSIONS, patience_s=0.5)
    assert next(results) == 0
    cluster.close()
    with pytest.raises(DatasetError, match=r"scheduler at 'tcp://\S+' was lost.*same command"):
        list(results)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{port}", "somewhere", "gopher://127.0.0.1:1"])
def test_an_unreachable_scheduler_is_an_error(address: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        place = address.format(port=silent.getsockname()[1])
        with pytest.raises(DatasetError, match=rf"no scheduler answers at '{place}'.*`dask sch"):
            next(run_on_cluster(place, double, [1], VERSIONS, patience_s=0.2))


def test_without_dask_the_mend_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(DatasetError, match=r"pip install 'ros_scenesense\[cluster\]'"):
        next(run_on_cluster("tcp://127.0.0.1:1", double, [1], VERSIONS))


def test_the_command_takes_a_cluster_or_jobs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["dataset", "generate", str(tmp_path / "out"), "--cluster", "somewhere"]
    assert cli.main(command) == 1
    assert "no scheduler answers at 'somewhere'" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main([*command, "--jobs", "2"])
    assert "not allowed with argument --cluster" in capsys.readouterr().err
