"""What the program inside Blender refuses, and why."""


class Wrong(Exception):
    """An error of whoever asks; `kind` says of what: parameter, geometry or file."""

    def __init__(self, kind: str, told: str):
        Exception.__init__(self, told)
        self.kind = kind


def there_are(names: list[str], most: int = 12) -> str:
    """Names for a message, the first few of them."""
    if not names:
        return "there are none"
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"there are {', '.join(map(repr, names[:most]))}{more}"
