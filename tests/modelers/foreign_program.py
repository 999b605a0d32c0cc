"""A program for the tests: a strip whose shape depends on numbers, and on a strip that it takes.

It has modes: "complex" numbers, a "linearised" output, too few "digits", other "counts", "slow".
It imports no moldline, as other people's programs do not.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

COUNT = 12


def shape(length, rise, start):
    """Points of the strip; `start` is where they begin."""
    t = np.arange(COUNT) / COUNT
    x = start[:, 0] + length * t + 0.1 * rise[0] ** 2 * t
    y = start[:, 1] * (1 + rise[1] * t)
    z = start[:, 2] + rise[0] * np.sin(length * t) + rise[1] * start[:, 0] ** 2
    return np.stack([x, y, z], axis=1)


def slopes(length, rise, start):
    """By complex step, for the linearised output."""
    found, h = {}, 1e-30
    for name, change in {"length": (1, 0, 0), "rise[0]": (0, 1, 0), "rise[1]": (0, 0, 1)}.items():
        a, b, c = (1j * h * part for part in change)
        found[name] = shape(length + a, [rise[0] + b, rise[1] + c], start).imag / h
    return found


def faces():
    return np.array([(i, i + 1, i + 2) for i in range(COUNT - 2)])


def written(path, points, digits="%.17g"):
    with Path(path).open("w") as file:
        file.write(f"{len(points)} {COUNT - 2}\n")
        np.savetxt(file, points, digits)
        np.savetxt(file, faces() + 1, "%d")
        np.savetxt(file, np.ones(COUNT - 2), "%d")


def linearised(path, points, columns):
    def array(name, kind, data, extra=""):
        text = " ".join(f"{x:.17g}" if kind == "Float64" else str(x) for x in np.ravel(data))
        size = f'NumberOfComponents="{np.shape(data)[1]}" ' if np.ndim(data) > 1 else ""
        return (
            f'<DataArray Name="{name}" type="{kind}" {size}format="ascii"{extra}>{text}</DataArray>'
        )

    mark = ' TRIXtype="SHAPE_LINEARIZATION"'
    count, joined = len(points), faces()
    Path(path).write_text(
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" '
        'byte_order="LittleEndian"><UnstructuredGrid>'
        f'<Piece Name="strip" NumberOfPoints="{count}" NumberOfCells="{len(joined)}">'
        f"<Points>{array('Points', 'Float64', points)}</Points><Cells>"
        f"{array('connectivity', 'Int64', joined.ravel())}"
        f"{array('offsets', 'Int64', 3 * np.arange(1, len(joined) + 1))}"
        f"{array('types', 'UInt8', np.full(len(joined), 5))}</Cells><PointData>"
        + "".join(array(k, "Float64", c, mark) for k, c in columns.items())
        + "</PointData><CellData></CellData></Piece></UnstructuredGrid></VTKFile>\n"
    )


def read(path):
    lines = Path(path).read_text().split("\n")
    return np.array([line.split() for line in lines[1 : COUNT + 1]], float)


def main():
    mode = sys.argv[1] if len(sys.argv) > 1 else ""
    given = json.loads(Path("parameters.json").read_text())
    length, rise = given["length"], given["rise"]
    start = read("in.tri") if Path("in.tri").exists() else np.ones((COUNT, 3))
    if mode == "slow":
        time.sleep(60)
    if mode == "counts" and length > 2.0:
        Path("out.tri").write_text("3 1\n0 0 0\n1 0 0\n0 1 0\n1 2 3\n1\n")
        return
    if mode == "fails" and length > 2.0:
        sys.exit("length is beyond what I can do")
    if mode == "complex":
        parts = given["imaginary"]
        length, rise = length + 1j * parts["length"], [
            a + 1j * b for a, b in zip(rise, parts["rise"], strict=True)
        ]  # fmt: skip
        if Path("in_imaginary.tri").exists():
            start = start + 1j * read("in_imaginary.tri")
        points = shape(length, rise, start)
        written("out_imaginary.tri", points.imag)
        written("out.tri", points.real)
        return
    points = shape(length, rise, start)
    if mode == "linearised":
        linearised("out.trix", points, slopes(length, rise, start))
    else:
        written("out.tri", points, "%.6f" if mode == "digits" else "%.17g")


if __name__ == "__main__":
    main()
