"""A small modeler for tests: a tetrahedron, by the file protocol; its Constants make it fail."""

import math
import os
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

POINTS = ((0.1, 0.2, 0.3), (1.1, 0.2, 0.3), (0.1, 1.2, 0.3), (0.1, 0.2, 1.3))
FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))

tree = ET.parse("model.input.xml")
root = tree.getroot()
values = {
    e.get("ID"): float(e.get("Value")) for e in root.iter() if e.tag in ("Variable", "Constant")
}
mode = int(values.get("mode", 0))
moved = values.get("w", 0.0) != float(values.get("w0", values.get("w", 0.0)))
sys.stdout.write("making it\n\x1b[31mred\n")
sys.stdout.flush()
if mode == 1 and moved:
    sys.stderr.write("no such width\n")
    sys.exit(3)
if mode == 7 and moved:  # one step fails while the other is under way
    waiting = Path(__file__).parent / "waiting.txt"
    if values["w"] > values["w0"]:
        waiting.write_text(str(os.getpid()))
        time.sleep(60)
    while not waiting.exists():
        time.sleep(0.01)
    sys.stderr.write("no such width\n")
    sys.exit(3)
if mode == 2:
    time.sleep(60)
w, t = values["w"], values["t[1,2]"]
points = [(x * math.exp(w), y + t * t * z, z * (1 + t)) for x, y, z in POINTS]
faces = FACES[:3] if mode == 3 and moved else FACES
faces = (*FACES[:2], FACES[3], FACES[2]) if mode == 4 and moved else faces
lines = [f"{len(points)} {len(faces)}", *(" ".join(map(repr, p)) for p in points),
         *(f"{a + 1} {b + 1} {c + 1}" for a, b, c in faces), *("1" for _ in faces)]  # fmt: skip
if mode != 5:
    Path("Components.i.tri").write_text("\n".join(lines) + "\n")
for one in root.iter("Analysis"):
    if one.get("ID") == "size":
        one.set("Value", repr(math.exp(w) * (1 + t)))
        if mode == 6:
            array = ET.SubElement(one, "SensitivityArray")
            ET.SubElement(array, "Sensitivity", P="Model__m__Variable__w", Value="7.5")
tree.write("model.output.xml")
with (Path(__file__).parent / "runs.txt").open("a") as file:
    file.write(f"{os.getpid()} {w!r} {t!r}\n")
