"""Somebody else's modeler: ellipsoids, by the file protocol of XDDM; it knows nothing of moldline.

python modeler.py wing                  a Wrapper: a tapered one along y
python modeler.py body --derivatives    one along x, and its derivatives, by complex steps
"""

import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

ALONG, AROUND = 24, 32
STEP = 1e-30


def grid():
    """Points of a unit sphere about its x axis, and triangles, counter-clockwise from outside."""
    s, t = np.meshgrid(
        np.pi * np.arange(1, ALONG) / ALONG, 2 * np.pi * np.arange(AROUND) / AROUND, indexing="ij"
    )
    rings = np.stack([-np.cos(s), np.sin(s) * np.cos(t), np.sin(s) * np.sin(t)], axis=-1)
    points = np.concatenate([[[-1.0, 0, 0]], rings.reshape(-1, 3), [[1.0, 0, 0]]])
    a = 1 + np.arange(len(points) - 2).reshape(ALONG - 1, AROUND)
    b = np.roll(a, -1, axis=1)
    nose, tail = np.zeros(AROUND, int), np.full(AROUND, len(points) - 1)
    parts = (
        (nose, b[0], a[0]),
        (a[-1], b[-1], tail),
        (a[:-1], b[1:], a[1:]),
        (a[:-1], b[:-1], b[1:]),
    )
    return points, np.concatenate([np.stack(part, axis=-1).reshape(-1, 3) for part in parts])


def shape(kind, sphere, v):
    """Points for the values of the variables."""
    a, b, c = sphere.T
    if kind == "wing":
        out = np.sqrt(a * a + 1e-4)  # how far outboard
        chord = v["chord"] * (1 - 0.4 * out)
        return np.stack([v["x"] - chord * b / 2 + v["sweep"] * out, v["span"] * a / 2,
                         v["z"] + 0.12 * chord * c / 2], axis=1)  # fmt: skip
    return np.stack([v["length"] * a / 2, v["height"] * b / 2, v["height"] * c / 2], axis=1)


def volume(points, triangles):
    p, q, r = (points[triangles[:, k]] for k in range(3))
    return np.sum(p * np.cross(q, r)) / 6


def array(name, numbers, kind="Float64", more=""):
    width = numbers.shape[1] if numbers.ndim > 1 else 1
    text = " ".join(f"{x:.17e}" if kind == "Float64" else str(x) for x in numbers.ravel())
    head = f'Name="{name}" type="{kind}" NumberOfComponents="{width}" {more} format="ascii"'
    return f"<DataArray {head}>{text}</DataArray>\n"


def surface(kind, points, triangles, columns):
    """The extended triangulation, as text."""
    count, tags = len(triangles), np.ones(len(triangles), int)
    tag = 'TRIXtype="COMPONENT_TAG"'
    return "".join((
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1">\n',
        "<UnstructuredGrid>\n",
        f'<Piece Name="{kind}" NumberOfPoints="{len(points)}" NumberOfCells="{count}">\n',
        "<Points>", array("Points", points), "</Points>\n<Cells>",
        array("connectivity", triangles, "Int32"),
        array("offsets", 3 * np.arange(1, count + 1), "Int32"),
        array("types", 5 * tags, "UInt8"), "</Cells>\n<CellData>",
        array("IntersectComponents", tags, "Int16", tag), array("GMPtags", tags, "Int16", tag),
        "</CellData>\n<PointData>",
        *(array(n, c, more='TRIXtype="SHAPE_LINEARIZATION"') for n, c in columns.items()),
        "</PointData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ))  # fmt: skip


def main(kind, with_derivatives=False):
    tree = ET.parse("model.input.xml")
    root = tree.getroot()
    values = {e.get("ID"): float(e.get("Value")) for e in root if e.tag in ("Variable", "Constant")}
    sphere, triangles = grid()
    points = shape(kind, sphere, values)
    result = root.find("Analysis[@ID='volume']")
    result.set("Value", f"{volume(points, triangles):.17e}")
    columns = {}
    if with_derivatives and root.find("Configure").get("Sensitivity") == "Required":
        slopes = ET.SubElement(result, "SensitivityArray")
        for one in root.iter("Variable"):
            moved = shape(kind, sphere, values | {one.get("ID"): values[one.get("ID")] + STEP * 1j})
            columns[one.get("ID")] = moved.imag / STEP
            name = f"{root.tag}__{root.get('ID')}__Variable__{one.get('ID')}"
            slope = volume(moved, triangles).imag / STEP
            ET.SubElement(slopes, "Sensitivity", P=name, Value=f"{slope:.17e}")
    Path("Components.i.tri").write_text(surface(kind, points, triangles, columns))
    tree.write("model.output.xml", encoding="ISO-8859-1", xml_declaration=True)


if __name__ == "__main__":
    main(sys.argv[1], "--derivatives" in sys.argv)
