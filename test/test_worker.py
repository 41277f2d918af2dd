"""Workers: whatever a job does, each gets one answer in order and the next one works."""

import multiprocessing
import os
import pickle
import queue
import select
import signal
import subprocess
import sys
from functools import partial

import pytest

from ros_scenesense.errors import ReasoningError
from ros_scenesense.stages.protocol import Job, JobFailure
from ros_scenesense.stages.worker import CAPACITY, GIB, InlineRunner, WorkerProcess

PATIENCE_S = 60.0


class Engine:
    """Does what a job can do to its process."""

    def __init__(self, log=None):
        self.calls = 0
        if log is not None:
            with open(log, "a") as file:
                file.write(f"{os.getpid()}\n")

    def process(self, *_):
        self.calls += 1
        return os.getpid(), self.calls

    def fail(self, error):
        raise error

    def kill_itself(self, number):
        os.kill(os.getpid(), number)
        return "alive"

    def leave(self):
        sys.exit(3)

    def hang(self, fifo=None):
        if fifo is not None:
            with open(fifo, "wb") as file:
                file.write(b"%d\n" % os.getpid())
        signal.pause()

    def unpicklable(self):
        return lambda: None

    def unreadable(self):
        return Unreadable()

    def allocate(self, size):
        return len(bytearray(size))


class Wearing(Engine):
    """Wants a new process after two jobs."""

    jobs_per_life = 2


class Unreadable:
    """Can be pickled, but not unpickled."""

    def __reduce__(self):
        return (int, ("no number",))


def refuse(log):
    Engine(log)
    raise ReasoningError("the program is missing")


def refuse_once(log):
    if not log.exists():
        refuse(log)
    return Engine()


class Results(queue.Queue):
    """Results in the order in which the runner gives them."""

    def __call__(self, job, result):
        self.put((job.key, result))

    def next(self):
        return self.get(timeout=PATIENCE_S)[1]

    def failure(self):
        result = self.next()
        assert isinstance(result, JobFailure), result
        return result


class Client:
    """A worker process and what came back from it."""

    def __init__(self, factory=Engine, **options):
        self.results = Results()
        self.warm = queue.Queue()
        self.failed = queue.Queue()
        self.worker = WorkerProcess(
            factory,
            self.results,
            warm=lambda: self.warm.put(None),
            failed=self.failed.put,
            **options,
        )

    def submit(self, method, *arguments, key="k", deadline_s=PATIENCE_S, droppable=False):
        self.worker.submit(Job(key, method, arguments, deadline_s, droppable))

    def call(self, method, *arguments, **options):
        self.submit(method, *arguments, **options)
        return self.results.next()

    def fails(self, method, *arguments, **options):
        self.submit(method, *arguments, **options)
        return self.results.failure()

    def process(self):
        return self.call("process")[0]


@pytest.fixture
def clients():
    opened = []
    others = set(multiprocessing.active_children())

    def client(*arguments, **options):
        opened.append(Client(*arguments, **options))
        return opened[-1]

    yield client
    for one in opened:
        one.worker.close()
        assert not one.worker._thread.is_alive()
    assert set(multiprocessing.active_children()) <= others


@pytest.fixture(scope="module")
def shared():
    """One worker for all tests after which it goes on working."""
    client = Client()
    yield client
    client.worker.close()


def is_gone(process_id):
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return True
    return False


def read_line(fifo):
    """The first line that somebody writes into a FIFO."""
    reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert select.select([reader], [], [], PATIENCE_S)[0], f"nobody wrote into {fifo}"
        return os.read(reader, 100).decode().strip()
    finally:
        os.close(reader)


@pytest.fixture
def fifo(tmp_path):
    path = tmp_path / "fifo"
    os.mkfifo(path)
    return path


def test_results_come_in_order_from_one_engine(clients, tmp_path):
    log = tmp_path / "log"
    client = clients(partial(Engine, log))
    for number in range(20):
        client.submit("process", key=str(number))
    answers = [client.results.get(timeout=PATIENCE_S) for _ in range(20)]
    assert [key for key, _ in answers] == [str(number) for number in range(20)]
    assert [calls for _, (_, calls) in answers] == list(range(1, 21))
    (process_id,) = {process_id for _, (process_id, _) in answers}
    assert process_id != os.getpid()
    assert log.read_text() == f"{process_id}\n"
    assert client.warm.qsize() == 1


@pytest.mark.parametrize(
    ("method", "arguments", "words"),
    [
        ("fail", (ReasoningError("no program: reinstall"),), "no program: reinstall"),
        ("fail", (KeyError("duck"),), "KeyError: 'duck'"),
        ("fail", (RuntimeError(),), "RuntimeError"),
        ("no_such_method", (), "no_such_method"),
        ("process", (lambda: None,), "process of k cannot be sent"),
        ("process", (Unreadable(),), "cannot be sent: ValueError"),
        ("unpicklable", (), "cannot be sent"),
        ("unreadable", (), "the result cannot be read: ValueError"),
    ],
)
def test_a_job_that_goes_wrong_fails_alone(shared, method, arguments, words):
    before = shared.process()
    failure = shared.fails(method, *arguments)
    assert words in failure.reason
    assert not failure.timed_out
    assert shared.process() == before


def test_interrupts_from_the_terminal_are_left_to_the_parent(shared):
    assert shared.call("kill_itself", signal.SIGINT) == "alive"


def test_a_large_argument_and_result_pass(shared):
    assert shared.call("process", b"x" * 20_000_000)
    assert shared.call("allocate", 1000) == 1000


@pytest.mark.parametrize(
    ("method", "arguments"), [("kill_itself", (signal.SIGKILL,)), ("leave", ())]
)
def test_after_a_process_died_in_a_job_the_next_job_works(shared, method, arguments):
    before = shared.process()
    shared.submit(method, *arguments)
    shared.submit("process")
    failure = shared.results.failure()
    assert f"{method} of k: the worker process died" in failure.reason
    assert not failure.timed_out
    assert shared.results.next()[0] != before
    assert is_gone(before)


def test_a_process_that_died_between_jobs_costs_no_job(shared):
    before = shared.process()
    os.kill(before, signal.SIGKILL)
    os.waitid(os.P_PID, before, os.WEXITED | os.WNOWAIT)
    assert shared.process() != before


def test_a_job_past_its_deadline_is_killed_and_the_next_works(shared):
    before = shared.process()
    failure = shared.fails("hang", deadline_s=0.1)
    assert failure == JobFailure("hang of k: stopped after 0.1 s", timed_out=True)
    assert shared.process() != before
    assert is_gone(before)


def test_after_a_job_brought_the_process_down_a_new_one_gets_warm_by_itself(shared):
    shared.process()
    while not shared.warm.empty():
        shared.warm.get()
    shared.fails("leave")
    shared.warm.get(timeout=PATIENCE_S)


def test_an_engine_that_wears_out_gets_a_new_process_and_no_job_is_lost(clients):
    client = clients(Wearing)
    for number in range(5):
        client.submit("process", key=str(number))
    answers = [client.results.get(timeout=PATIENCE_S) for _ in range(5)]
    assert [key for key, _ in answers] == ["0", "1", "2", "3", "4"]
    assert [calls for _, (_, calls) in answers] == [1, 2, 1, 2, 1]
    assert len({process for _, (process, _) in answers}) == 3


def test_a_process_that_takes_no_data_is_killed_at_the_deadline(shared):
    before = shared.process()
    os.kill(before, signal.SIGSTOP)
    assert shared.fails("process", b"x" * 20_000_000, deadline_s=0.1).timed_out
    assert shared.process() != before
    assert is_gone(before)


def test_an_engine_that_cannot_be_built_is_tried_once_at_the_start_and_once_for_each_job(
    clients, tmp_path
):
    log = tmp_path / "log"
    client = clients(partial(refuse, log))
    reason = "the engine did not start: the program is missing"
    assert client.failed.get(timeout=PATIENCE_S) == reason
    for _ in range(3):
        assert client.fails("process").reason == reason
    client.worker.close()
    assert len(log.read_text().split()) == 4
    assert client.failed.qsize() == 3
    assert client.warm.empty()


def test_an_engine_that_cannot_be_built_at_first_costs_no_job(clients, tmp_path):
    client = clients(partial(refuse_once, tmp_path / "log"))
    assert "the program is missing" in client.failed.get(timeout=PATIENCE_S)
    assert client.process()
    assert client.warm.qsize() == 1


def test_a_factory_that_cannot_be_sent_fails_the_job(clients):
    failure = clients(lambda: Engine()).fails("process")
    assert "the worker process did not start" in failure.reason


def hang_while_built(fifo):
    Engine().hang(fifo)


def test_an_engine_that_takes_too_long_to_build_fails_the_job(clients):
    failure = clients(partial(hang_while_built, None), start_deadline_s=0.1).fails("process")
    assert failure == JobFailure("the engine did not start: stopped after 0.1 s", timed_out=True)


@pytest.mark.parametrize("busy_with", ["a job", "the start"])
def test_close_while_busy_leaves_no_process_and_calls_nobody_back(clients, fifo, busy_with):
    client = clients() if busy_with == "a job" else clients(partial(hang_while_built, fifo))
    client.submit("hang", fifo)
    client.submit("process")
    process_id = int(read_line(fifo))
    client.worker.close()
    assert is_gone(process_id)
    assert client.results.empty()
    client.submit("process")
    client.worker.close()


def test_of_too_many_jobs_the_oldest_droppable_one_is_given_up_at_once(clients, fifo):
    client = clients()
    client.submit("hang", str(fifo))
    with open(fifo, "rb") as opened:
        worker = int(opened.readline())
    client.submit("process", key="kept")
    for number in range(CAPACITY + 3):
        client.submit("process", key=f"scene-{number}", droppable=True)
    dropped = [client.results.get(timeout=PATIENCE_S) for _ in range(3)]
    assert [key for key, _ in dropped] == ["scene-0", "scene-1", "scene-2"]
    assert all(result.dropped for _, result in dropped)
    assert dropped[0][1].reason == "process of scene-0: dropped, 32 newer jobs wait"
    os.kill(worker, signal.SIGKILL)
    answered = [client.results.get(timeout=PATIENCE_S)[0] for _ in range(CAPACITY + 2)]
    assert answered == ["k", "kept", *(f"scene-{number}" for number in range(3, CAPACITY + 3))]


def test_close_right_after_the_start_leaves_no_process(clients):
    for _ in range(5):
        clients().worker.close()


def test_a_job_over_the_memory_limit_fails_alone(clients):
    client = clients(memory_bytes=2 * GIB)
    before = client.process()
    assert client.fails("allocate", 8 * GIB).reason == "MemoryError"
    assert client.process() == before


def main_of_a_parent(fifo):
    """Starts a worker that hangs, then dies without a word."""
    client = Client()
    client.submit("hang", fifo)
    print(read_line(fifo), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_worker_dies_with_its_parent_even_in_a_job(fifo):
    program = f"import test_worker; test_worker.main_of_a_parent({str(fifo)!r})"
    parent = subprocess.Popen(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        stdout=subprocess.PIPE,
    )
    # The worker inherits the pipe: its end comes when the last process that holds it is gone.
    output, _ = parent.communicate(timeout=PATIENCE_S)
    assert int(output)
    assert parent.returncode == -signal.SIGKILL


class Closable(Engine):
    closed = 0

    def close(self):
        type(self).closed += 1


def test_the_inline_runner_answers_at_once_with_the_same_engine():
    results = Results()
    runner = InlineRunner(Closable, results)
    runner.close()
    assert Closable.closed == 0
    runner.submit(Job("a", "process", ()))
    runner.submit(Job("b", "fail", (KeyError("duck"),)))
    runner.submit(Job("c", "process", ()))
    assert [results.get_nowait() for _ in range(3)] == [
        ("a", (os.getpid(), 1)),
        ("b", JobFailure("KeyError: 'duck'")),
        ("c", (os.getpid(), 2)),
    ]
    runner.close()
    assert Closable.closed == 1


def test_the_inline_runner_reports_an_engine_that_cannot_be_built(tmp_path):
    results = Results()
    runner = InlineRunner(partial(refuse_once, tmp_path / "log"), results)
    runner.submit(Job("a", "process", ()))
    assert results.failure().reason == "the engine did not start: the program is missing"
    runner.submit(Job("b", "process", ()))
    assert results.next() == (os.getpid(), 1)


def test_unreadable_is_what_the_tests_take_it_for():
    with pytest.raises(ValueError, match="no number"):
        pickle.loads(pickle.dumps(Unreadable()))
