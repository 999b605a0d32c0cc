"""Writers that are stopped in the middle, and what is no file at all."""

import errno
import os
import signal
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest
from conftest import same_bits
from strategies import geometry, key, variants

from moldline.errors import FileError
from moldline.mesh import io
from moldline.mesh.io import FORMATS, files
from moldline.mesh.io.sensitivities import write_sensitivities

OLD = b"the old file"

every_writer = pytest.mark.parametrize(
    ("module", "variant"),
    [
        pytest.param(module, variant, id=f"{key(module)}-{number}")
        for module in FORMATS
        if hasattr(module, "write")
        for number, variant in enumerate(variants(module)[::5])
    ],
)
needs_posix = pytest.mark.skipif(
    not hasattr(os, "mkfifo"), reason="pipes, limits and signals are POSIX's"
)


def names_in(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


class FullDisk:
    """A file on a disk with room for so many bytes."""

    def __init__(self, file, room):
        self.file, self.room = file, room

    def __getattr__(self, name):
        return getattr(self.file, name)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()

    def write(self, data):
        self.room -= memoryview(data).nbytes
        if self.room < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return self.file.write(data)

    def writelines(self, lines):
        for line in lines:
            self.write(line)


@every_writer
@pytest.mark.parametrize("suffix", ["", ".gz"])
def test_a_full_disk_leaves_the_old_file_and_nothing_else(
    tmp_path, monkeypatch, module, variant, suffix
):
    path = tmp_path / (variant.file + suffix)
    content = geometry(module.HOLDS, 3, variant.precision)
    io.write(path, content, format=key(module), **variant.options)
    size, opened = path.stat().st_size, Path.open
    for room in (0, 1, size // 2, size - 1):
        path.write_bytes(OLD)
        with monkeypatch.context() as patch:
            patch.setattr(Path, "open", lambda *args: FullDisk(opened(*args), room))  # noqa: B023
            with pytest.raises(FileError, match=r"no space left.*; the old file, if any, is as it"):
                io.write(path, content, format=key(module), **variant.options)
        assert path.read_bytes() == OLD
        assert names_in(tmp_path) == [path.name]


def child(tmp_path, body, **options):
    """Another process that writes `wing.tri`, of about 5 MB, in the way that `body` says."""
    script = """
        import os, resource, signal, sys
        import numpy as np
        import moldline as ml
        from moldline.mesh.io import files, text
        def surface(value):
            return ml.Surface(np.full((100_000, 3), value), np.arange(99_999).reshape(-1, 3))
    """
    code = textwrap.dedent(script) + textwrap.dedent(body)
    return subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path, text=True, **options)


@needs_posix
def test_a_limit_of_the_system_leaves_the_old_file_too(tmp_path):
    (tmp_path / "wing.tri").write_bytes(OLD)
    body = """
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
        try:
            ml.write("wing.tri", surface(1.5))
        except ml.errors.FileError as error:
            print(error)
    """
    told, _ = child(tmp_path, body, stdout=subprocess.PIPE).communicate(timeout=60)
    assert told.startswith("wing.tri: cannot write it: file too large; the old file")
    assert (tmp_path / "wing.tri").read_bytes() == OLD
    assert names_in(tmp_path) == ["wing.tri"]


@needs_posix
def test_a_killed_writer_leaves_the_old_file_whole(tmp_path):
    (tmp_path / "wing.tri").write_bytes(OLD)
    body = """
        plain = text.written
        def until_killed(array):
            yield from plain(array[:50_000])
            os.kill(os.getpid(), signal.SIGKILL)
        text.written = until_killed
        ml.write("wing.tri", surface(1.5))
    """
    writer = child(tmp_path, body)
    assert writer.wait(timeout=60) == -signal.SIGKILL
    assert (tmp_path / "wing.tri").read_bytes() == OLD


@needs_posix
def test_two_writers_at_once_leave_one_of_the_two_whole(tmp_path):
    body = """
        print(flush=True)
        sys.stdin.readline()
        ml.write("wing.tri", surface(float(os.environ["VALUE"])))
    """
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    writers = [child(tmp_path, body, env=os.environ | {"VALUE": value}, **pipes) for value in "12"]
    for writer in writers:
        writer.stdout.readline()
    for writer in writers:
        writer.stdin.write("\n")
        writer.stdin.flush()
    for writer in writers:
        writer.communicate(timeout=60)
        assert writer.returncode == 0
    points = io.read(tmp_path / "wing.tri").points
    assert points.shape == (100_000, 3)
    assert np.unique(points).tolist() in ([1.0], [2.0])
    assert names_in(tmp_path) == ["wing.tri"]


def test_two_threads_do_not_share_the_file_beside(tmp_path):
    path = tmp_path / "wing.tri"
    with files.replacing(path) as one:
        one.write(b"one")

        def other():
            with files.replacing(path) as file:
                file.write(b"other")

        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
    assert path.read_bytes() == b"one"
    assert names_in(tmp_path) == ["wing.tri"]


def test_sensitivities_leave_the_old_file_too(tmp_path, monkeypatch, ball):
    path, opened = tmp_path / "a.npz", Path.open
    path.write_bytes(OLD)
    monkeypatch.setattr(Path, "open", lambda *args: FullDisk(opened(*args), 500))
    with pytest.raises(FileError, match="no space left"):
        write_sensitivities(path, ball, {"span": np.asarray(ball.points)})
    monkeypatch.undo()
    assert path.read_bytes() == OLD
    assert names_in(tmp_path) == ["a.npz"]


@needs_posix
@pytest.mark.parametrize("module", FORMATS, ids=key)
def test_a_pipe_is_neither_waited_for_nor_replaced(tmp_path, module):
    path = tmp_path / ("a" + module.SUFFIXES[0])
    os.mkfifo(path)
    if hasattr(module, "read"):
        with pytest.raises(FileError, match="is no ordinary file but a pipe or a device; name a"):
            module.read(path)
        with pytest.raises(FileError, match="is no ordinary file"):
            io.read(path)
    with pytest.raises(FileError, match="is no ordinary file"):
        io.write(path, geometry(module.HOLDS, 3))
    assert path.is_fifo()


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="the system has no /dev/zero")
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null", "/dev/full"])
def test_a_device_is_refused(device):
    with pytest.raises(FileError, match="is no ordinary file"):
        io.read(device)
    with pytest.raises(FileError, match="is no ordinary file"):
        io.write(device, geometry(io.tri.HOLDS, 3), format="tri")
    assert Path(device).is_char_device()


@needs_posix
def test_a_loop_of_links_is_told(tmp_path):
    path = tmp_path / "a.tri"
    path.symlink_to(tmp_path / "b.tri")
    (tmp_path / "b.tri").symlink_to(path)
    with pytest.raises(
        FileError, match=r"a\.tri: cannot read it: too many levels of symbolic links"
    ):
        io.read(path)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read and write everything"
)
def test_a_file_without_permission_is_told(tmp_path):
    path = tmp_path / "a.tri"
    io.write(path, geometry(io.tri.HOLDS, 3))
    path.chmod(0)
    with pytest.raises(FileError, match="no permission to read it; change its owner or mode"):
        io.read(path)
    tmp_path.chmod(0o500)
    with pytest.raises(FileError, match="no permission to write it"):
        io.write(path, geometry(io.tri.HOLDS, 3))


@pytest.mark.parametrize(
    "name",
    ["a b", "-rf", "ü ☃ 翼", "'\"", "a\nb", "%s{}", "*?", "." * 9, "x" * 240, "☃" * 80],
)
def test_names_of_all_kinds_are_written_and_read(tmp_path, name):
    path = tmp_path / f"{name}.tri"
    content = geometry(io.tri.HOLDS, 3)
    try:
        path.touch()
    except OSError:
        pytest.skip(f"the system has no files named {name!r}")
    io.write(path, content)
    assert same_bits(io.read(path).points, content.points)
    assert names_in(tmp_path) == [path.name]


@pytest.mark.parametrize("name", ["a\0b.tri", "\ud800.tri", "x" * 300 + ".tri"])
def test_names_that_no_file_can_have_are_refused(tmp_path, name):
    for action in (io.read, lambda path: io.write(path, geometry(io.tri.HOLDS, 3))):
        with pytest.raises(FileError, match=r"a NUL in it|surrogates not allowed|name too long"):
            action(tmp_path / name)
