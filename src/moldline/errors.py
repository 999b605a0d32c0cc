"""What moldline raises when it is misused.

```text
MoldlineError
├── FileError        a file that cannot be read or written: names file, place and cause
├── GeometryError    a geometry that cannot serve the purpose
├── ParameterError   a value, name or option that is not allowed
├── CaseError        a case file that does not say what it must: names file and key
└── TaskError        a task or a program that did not end as it must: names it and its last words
```
"""


class MoldlineError(Exception):
    """Whatever moldline raises on purpose; the command line prints it without a traceback."""


class FileError(MoldlineError):
    """A file cannot be read or written."""


class GeometryError(MoldlineError):
    """A geometry cannot serve the purpose."""


class ParameterError(MoldlineError, ValueError):
    """A value, a name or an option is not allowed."""


class CaseError(MoldlineError):
    """A case file does not say what it must."""


class TaskError(MoldlineError):
    """A task, or a program that was run, did not end as it must."""
