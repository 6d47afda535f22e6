"""Running ``go2-wbc`` in this process."""

from typing import NamedTuple, Protocol

import pytest

from controller.cli.common import ExitCode
from controller.cli.main import main


class Said(NamedTuple):
    """What a command wrote."""

    out: str
    err: str


class Run(Protocol):
    """Runs ``go2-wbc`` with these words, which must end with ``code``."""

    def __call__(self, *words: object, code: int = ExitCode.OK) -> Said: ...


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def run(*words: object, code: int = ExitCode.OK) -> Said:
        assert main(list(map(str, words))) == code
        told = capsys.readouterr()
        return Said(told.out, told.err)

    return run
