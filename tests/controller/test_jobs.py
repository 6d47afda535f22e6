"""The job server: one job at a time, prepared, carried out and answered once, from any thread."""

import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from controller import jobs
from controller.jobs import Job, JobServer
from controller.modes import Aborted, Measurements, Outcome
from go2_wbc.errors import ModeError
from go2_wbc.robot.state import RobotState
from tests.controller.plants import HANG_GUARD, Clock, failing, in_thread, lying_state, wait_for

PATIENCE = 0.8
LOOKS = 5000  #: How often, a millisecond apart, a test looks whether a job is prepared
A_WHILE = 0.2  #: Time [s] in which a thread that spins is seen to


class Robot:
    """Does nothing, and notes what it was told."""

    def __init__(self) -> None:
        self.calls: list[str] = []
        self.time = 0.0
        self.is_limp = threading.Event()

    @property
    def state(self) -> RobotState:
        return lying_state(self.time)

    def cancel(self) -> None:
        self.calls.append("cancel")

    def damp(self) -> None:
        self.calls.append("damp")
        self.is_limp.set()


class Client:
    """Submits jobs and keeps what they were answered, in order."""

    def __init__(self, jobs: JobServer[Robot]) -> None:
        self.jobs, self.is_accepted = jobs, False
        self.answers: list[tuple[str, Outcome]] = []
        self.answered = threading.Condition()

    def submit(
        self,
        name: str,
        act: Callable[[Job], Measurements] = lambda _job: {},
        prepare: Callable[[], None] | None = None,
        begin: Callable[[], str] = lambda: "",
    ) -> None:
        def reply(answer: Outcome) -> None:
            with self.answered:
                self.answers.append((name, answer))
                self.answered.notify_all()

        job = Job(name, act, reply, prepare, begin)
        self.is_accepted = self.jobs.submit(job)

    def does(self, name: str, act: Callable[[Job], Measurements] = lambda _job: {}) -> Outcome:
        """What a job is answered that is carried out now."""
        self.submit(name, act)
        assert self.jobs.work()
        return self.only(name)

    def told(self, name: str) -> list[Outcome]:
        return [answer for told, answer in self.answers if told == name]

    def only(self, name: str) -> Outcome:
        """The answer to this job, which has come once; waits for it."""
        with self.answered:
            assert self.answered.wait_for(lambda: self.told(name), HANG_GUARD)
        (answer,) = self.told(name)
        return answer


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def client(robot: Robot) -> Client:
    return Client(JobServer(robot))


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(jobs.time, "monotonic", clock)
    return clock


@pytest.fixture
def queued(robot: Robot, clock: Clock) -> Client:
    """Of a server with a queue and a patience, as Unitree's clients want it."""
    return Client(JobServer(robot, queue=2, patience=PATIENCE))


@pytest.fixture
def threaded(robot: Robot) -> Iterator[Client]:
    """Of a server with a thread of its own."""
    jobs = JobServer(robot, queue=1000)
    jobs.start("jobs")
    yield Client(jobs)
    jobs.abandon("the test has ended", HANG_GUARD)
    assert "jobs" not in [thread.name for thread in threading.enumerate()]


def test_a_job_is_answered_after_it_was_carried_out_with_what_was_measured(
    robot: Robot, client: Client
) -> None:
    def act(_job: Job) -> Measurements:
        robot.time += 1.5
        assert client.answers == []
        return {"height [m]": 0.31}

    client.submit("stand", act)
    assert client.answers == []
    assert client.jobs.work()
    assert client.only("stand") == Outcome(
        True, "done in 1.5 s: height [m] 0.31", 1.5, {"height [m]": 0.31}
    )
    assert client.jobs.last is client.only("stand")
    assert client.jobs.job is None
    assert not client.jobs.work()


def test_a_second_job_is_refused_at_once_and_the_first_goes_on(
    robot: Robot, client: Client
) -> None:
    client.submit("sit")
    assert client.is_accepted
    robot.time += 0.4
    client.submit("up")
    assert not client.is_accepted
    refused = client.only("up")
    assert refused.is_refused
    assert refused.reason == "busy with 'sit' since 0.4 s; ask again when it has answered"
    client.jobs.work()
    assert client.only("sit").ok
    assert client.jobs.refusal() == ""


@pytest.mark.parametrize("error", [Aborted("the rump is too high"), ModeError("fallen: recover()")])
def test_what_was_not_done_is_answered_with_the_reason(client: Client, error: Exception) -> None:
    assert client.does("sit", failing(error)) == Outcome(False, str(error), error=error)


def test_a_job_that_may_not_begin_or_is_called_off_too_late_or_never_was_one(
    client: Client, robot: Robot
) -> None:
    client.submit("rise", failing(AssertionError("carried out")), begin=lambda: "it does not sit")
    client.jobs.work()
    assert client.only("rise") == Outcome(False, "it does not sit", is_refused=True)
    assert not client.jobs.cancel(failing(AssertionError("told")))
    assert robot.calls == []

    def act(_job: Job) -> Measurements:
        client.jobs.cancel()
        return {}

    assert client.does("sit", act) == Outcome(True, "done in 0.0 s")


def test_a_bug_in_an_action_is_answered_and_the_server_goes_on(
    client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    answer = client.does("dance", failing(ZeroDivisionError("beat")))
    assert answer.reason == "ZeroDivisionError: beat"
    assert "Traceback" in caplog.text
    assert client.does("sit").ok


def test_a_reply_that_fails_does_not_stop_the_server(
    client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    client.jobs.submit(Job("sit", lambda _job: {}, failing(OSError("no route"))))
    assert client.jobs.work()
    assert "sit could not be answered" in caplog.text
    assert client.does("up").ok


def test_somebody_who_fails_to_hear_of_an_end_does_not_stop_the_server(
    client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    # The ROS 2 server answers "stop" so: an error of the middleware ended its loop.
    def act(_job: Job) -> Measurements:
        assert client.jobs.cancel(failing(OSError("no route")))
        return {}

    assert client.does("sit", act).ok
    assert "sit could not be answered" in caplog.text


def test_queued_jobs_have_their_turns_in_order_and_one_too_many_is_refused(queued: Client) -> None:
    done: list[str] = []
    for name in "abcd":
        queued.submit(name, lambda job: done.append(job.name) or {})
    assert queued.only("d").is_refused
    while queued.jobs.work():
        pass
    assert done == ["a", "b", "c"]
    assert [name for name, _ in queued.answers] == ["d", "a", "b", "c"]


def test_after_the_patience_what_runs_has_begun_and_what_waits_is_refused(
    queued: Client, clock: Clock
) -> None:
    def act(_job: Job) -> Measurements:
        clock.now += PATIENCE
        queued.jobs.expire()
        assert queued.answers == []
        clock.now += 0.01
        queued.jobs.expire()
        assert queued.only("dance") == Outcome(True, "dance has begun")
        assert queued.only("hello") == Outcome(False, "hello has waited in vain", is_refused=True)
        queued.submit("late")
        queued.jobs.expire()
        assert queued.told("late") == []
        raise Aborted("fell")

    queued.submit("dance", act)
    queued.submit("hello")
    queued.jobs.work()
    assert len(queued.answers) == 2  # the end of the dance is no second answer
    assert queued.jobs.last is not None
    assert not queued.jobs.last.ok
    queued.jobs.work()
    assert queued.only("late").ok
    assert not queued.jobs.work()


def test_a_job_is_prepared_in_another_thread_and_carried_out_afterwards(client: Client) -> None:
    goes_on, seen = threading.Event(), []

    def prepare() -> None:
        wait_for(goes_on)
        seen.append(threading.current_thread().name)

    client.submit("nod", lambda _job: seen.append("played") or {}, prepare)
    assert not client.jobs.work()
    assert seen == []
    goes_on.set()
    worked_off(client)
    assert seen == ["prepare", "played"]
    assert client.only("nod").ok


def test_a_thread_of_the_server_sleeps_while_a_job_is_prepared(
    threaded: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would spin, and take the processor from the control loop."""
    work, looked_in_vain = JobServer.work, threading.Event()

    def noted(server: JobServer[Robot]) -> bool:
        was_there = work(server)
        if not was_there:
            looked_in_vain.set()
        return was_there

    def prepare() -> None:
        looked_in_vain.wait(A_WHILE)

    monkeypatch.setattr(JobServer, "work", noted)
    threaded.submit("nod", prepare=prepare)
    assert threaded.only("nod").ok
    assert not looked_in_vain.is_set()


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (ModeError("times must be 1 to 9"), "times must be 1 to 9"),
        (OSError("disk"), "OSError: disk"),
    ],
)
def test_an_error_of_the_preparation_is_the_answer(
    client: Client, error: Exception, message: str
) -> None:
    client.submit("nod", failing(AssertionError("played")), failing(error))
    worked_off(client)
    assert client.only("nod").reason == message


def test_going_limp_during_the_preparation_keeps_the_job_from_beginning(
    robot: Robot, client: Client
) -> None:
    goes_on = threading.Event()
    client.submit("nod", failing(AssertionError("played")), lambda: wait_for(goes_on))
    client.jobs.damp()
    goes_on.set()
    worked_off(client)
    answer = client.only("nod")
    assert (answer.ok, answer.cancelled, answer.is_refused) == (False, True, True)
    assert robot.calls == ["damp"]


def worked_off(client: Client) -> None:
    """Carry out the job, which a thread prepares, when that is done."""
    polled = threading.Event()
    for _ in range(LOOKS):
        if client.jobs.work():
            return
        polled.wait(0.001)
    raise AssertionError("the job was prepared and not carried out")


def test_a_job_that_is_called_off_says_so_and_then_whoever_wants_to_know_is_told(
    robot: Robot, client: Client
) -> None:
    def act(job: Job) -> Measurements:
        assert client.jobs.cancel(lambda: robot.calls.append("told"))
        assert (job.phase, job.is_cancelled) == ("returning", True)
        assert robot.calls == ["cancel"]
        raise Aborted("")

    answer = client.does("nod", act)
    assert (answer.ok, answer.cancelled, answer.is_refused) == (False, True, False)
    assert answer.reason == "nod was cancelled"
    assert robot.calls == ["cancel", "told"]


def test_going_limp_ends_what_runs_and_refuses_what_waits(robot: Robot, threaded: Client) -> None:
    has_begun = threading.Event()

    def act(_job: Job) -> Measurements:
        has_begun.set()
        wait_for(robot.is_limp)
        raise Aborted("damped")

    threaded.submit("dance", act)
    wait_for(has_begun)
    threaded.submit("hello", failing(AssertionError("carried out")))
    threaded.jobs.damp()
    assert threaded.only("hello").is_refused
    answer = threaded.only("dance")
    assert (answer.reason, answer.cancelled, answer.is_refused) == ("damped", True, False)


def test_a_robot_goes_limp_before_an_action_begins_or_after_never_in_between(
    robot: Robot, threaded: Client
) -> None:
    limp: list[object] = []

    def begin() -> str:
        limp.append(in_thread(threaded.jobs.damp))  # can go on only when this has returned
        robot.calls.append("begin")
        return ""

    def act(_job: Job) -> Measurements:
        wait_for(robot.is_limp)
        raise Aborted("damped")

    threaded.submit("stand", act, begin=begin)
    assert threaded.only("stand").reason == "damped"
    assert robot.calls == ["begin", "damp"]


def test_at_the_end_whoever_waits_is_told_once_and_nothing_is_accepted_any_more(
    robot: Robot, queued: Client
) -> None:
    for name in "ab":
        queued.submit(name, failing(AssertionError("carried out")))
    robot.time += 2.0
    for _ in range(2):
        queued.jobs.abandon("the server is ending")
    assert queued.only("a") == Outcome(False, "the server is ending", 2.0)
    assert queued.only("b").is_refused
    assert not queued.jobs.work()
    queued.submit("c")
    assert queued.only("c") == Outcome(False, "the server is ending", is_refused=True)


def test_a_job_that_outlives_the_server_is_called_off_and_not_answered_again(
    robot: Robot, threaded: Client, caplog: pytest.LogCaptureFixture
) -> None:
    has_begun = threading.Event()

    def act(job: Job) -> Measurements:
        has_begun.set()
        wait_for(robot.is_limp)
        assert job.is_cancelled
        return {}

    threaded.submit("dance", act)
    wait_for(has_begun)
    threaded.jobs.abandon("the server is ending")
    robot.damp()
    threaded.jobs.abandon("the server is ending", HANG_GUARD)
    assert threaded.only("dance").reason == "the server is ending"
    assert "failed" not in caplog.text


def test_many_threads_get_one_answer_for_each_job_and_one_job_runs_at_a_time(
    threaded: Client,
) -> None:
    threads, each, running, most = 6, 40, [], []

    def act(job: Job) -> Measurements:
        running.append(job.name)
        most.append(len(running))
        running.remove(job.name)
        return {}

    def submit_all(thread: int) -> None:
        for number in range(each):
            prepare = (lambda: None) if number % 3 == 0 else None
            threaded.submit(f"{thread}/{number}", act, prepare)
            if number % 7 == 0:
                threaded.jobs.cancel()
            if number % 11 == 0:
                threaded.jobs.damp()
            threaded.jobs.expire()

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        for done in [in_thread(lambda t=t: submit_all(t)) for t in range(threads)]:
            done.result(HANG_GUARD)
        with threaded.answered:
            assert threaded.answered.wait_for(
                lambda: len(threaded.answers) >= threads * each, HANG_GUARD
            )
    finally:
        sys.setswitchinterval(interval)
    names = [name for name, _ in threaded.answers]
    assert len(names) == len(set(names)) == threads * each
    assert max(most) == 1
