"""What a worker process does: it waits for tasks and answers."""

import os
import pickle
import signal
import sys
from multiprocessing.connection import Connection
from types import FrameType

from ..errors import TaskError
from .attempt import Attempt, attempted


def serve(pipe: Connection, environment: dict[str, str]) -> None:
    """Run what comes through the pipe until it is closed."""
    os.environ.update(environment)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started it was interrupted too
    signal.signal(signal.SIGTERM, _leave)
    try:
        _answer_all(pipe)
    finally:  # nothing is left to be ended: while libraries clean up, leaving would be a traceback
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _answer_all(pipe: Connection) -> None:
    while True:
        try:
            message = pipe.recv_bytes()
        except (EOFError, OSError):
            return
        answer = _answer(message)
        try:
            pipe.send_bytes(answer)
        except OSError:
            return


def _leave(number: int, frame: FrameType | None) -> None:
    """Leave through all `finally`: programs that were started are ended there."""
    sys.exit(128 + number)


def _answer(message: bytes) -> bytes:
    try:
        function, argument = pickle.loads(message)
    except Exception as error:
        problem = TaskError(f"cannot be understood by the worker: {type(error).__name__}: {error}")
        return pickle.dumps(Attempt(None, problem, 0.0))
    attempt = attempted(function, argument)
    try:
        answer = pickle.dumps(attempt)
        pickle.loads(answer)  # some errors can be packed but not unpacked
        return answer
    except Exception as error:
        kept = attempt.error if attempt.error is not None else error
        return pickle.dumps(
            Attempt(None, TaskError(f"{type(kept).__name__}: {kept}"), attempt.seconds)
        )
