"""The loop: a message in, what the session makes of it out, until the pipe is closed."""

import os
import sys
import traceback
from io import BufferedIOBase
from typing import Any

from . import frames
from .wrong import Wrong


def main() -> None:
    """Answer on what was standard output; all that Blender prints goes to the error stream."""
    answers = os.fdopen(os.dup(1), "wb")
    requests = os.fdopen(os.dup(0), "rb")
    os.dup2(2, 1)
    try:
        from .session import Session

        serve(requests, answers, Session())
    except BrokenPipeError:
        pass
    except Exception:
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)  # bpy may hang while the interpreter cleans up


def serve(requests: BufferedIOBase, answers: BufferedIOBase, session: Any) -> None:
    """Answer until there is nothing more to read."""
    answers.write(frames.HELLO)
    frames.write(answers, {"version": session.version}, {})
    while (message := frames.read(requests)) is not None:
        told, arrays = message
        try:
            answer = getattr(session, f"do_{told['do']}")(told, arrays)
        except Wrong as problem:
            answer = {"error": problem.kind, "message": str(problem)}, {}
        except Exception as problem:
            traceback.print_exc()
            said = f"{type(problem).__name__}: {problem}"
            answer = {"error": "task", "message": said}, {}
        sys.stderr.flush()
        frames.write(answers, *answer)
