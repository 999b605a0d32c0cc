"""Stands in for a Python with bpy: the real loop and pipes, and a shape in place of Blender.

The shape is a strip whose points are (length x, rise sin(x) + tip[0], tip[1]) in single precision,
or points that are given and moved by (0, rise sin(x) + tip[0], tip[1]). The object's name says how
it misbehaves.
"""

import os
import sys
import time
import types
from pathlib import Path

os.write(1, b"Blender 9.9 prints before it speaks\n")
import numpy as np  # noqa: E402

COUNT = 12


class Session:
    """The strip."""

    version = "9.9 stand-in"

    def do_list(self, told, arrays):
        """One object."""
        found = {"object": "wing", "type": "MESH", "modifiers": [{"name": "Bend", "type": "BEND"}],
                 "groups": ["tip"], "points": COUNT, "parameters": [
                     {"path": 'objects["wing"].rise', "value": 0.5, "limits": [0.0, 4.0],
                      "kind": "number", "driver": ""}]}  # fmt: skip
        return {"listed": [found]}, {}

    def do_open(self, told, arrays):
        """What the parameters are."""
        self.object, self.file = told["object"], Path(told["file"])
        infinite = [float("-inf"), float("inf")]
        numbers = {"length": 2.0, "rise": 0.5}
        if "wrong" in told["paths"]:
            from in_blender.wrong import Wrong

            raise Wrong("parameter", "the file has nothing named 'wrong'; there are 'length'")
        given = {
            name: {"values": [numbers[name]], "limits": [0.0, 4.0], "kind": "number",
                   "labels": [name]}
            for name in told["paths"]
        } | {
            name: {"values": [0.0, 0.0], "limits": infinite, "kind": "length",
                   "labels": [f"{name}[{axis}]" for axis in table["axes"]]}
            for name, table in told["controls"].items()
        }  # fmt: skip
        self.names = list(given)
        return {"given": given, "count": COUNT}, {"matrix": np.eye(4)}

    def do_evaluate(self, told, arrays):
        """The points; or whatever the object's name says."""
        if self.object == "slow":
            time.sleep(60)
        once = self.file.with_suffix(".died")
        if self.object == "dies" or (self.object == "dies once" and not once.exists()):
            once.touch()
            os.write(2, b"out of memory, says Blender\n")
            os._exit(3)
        if self.object == "fails":
            raise ZeroDivisionError("inside Blender")
        time.sleep(0.02)
        numbers = arrays["numbers"]
        length, rise, *tip = [*numbers, 0.0, 0.0, 0.0][:4]
        x = np.linspace(0, 1, COUNT)
        points = np.stack([length * x, rise * np.sin(x) + tip[0], x * 0 + tip[1]], axis=1)
        if "points" in arrays:
            given = arrays["points"].astype(float)
            points = given + np.stack([given[:, 0] * 0, rise * np.sin(given[:, 0]) + tip[0],
                                       given[:, 0] * 0 + tip[1]], axis=1)  # fmt: skip
        count = len(points) + int(self.object == "grows" and length > 2.5)
        answer = {"form": [count, 4, 12, 1], "is_same": "points" in arrays, "problems": []}
        found = {"points": points.astype(np.float32), "matrix": np.eye(4)}
        if told.get("faces"):
            answer["materials"] = []
            found["faces"] = np.arange(COUNT).reshape(-1, 3).astype(np.int32)
            found["materials"] = np.zeros(COUNT // 3, np.int32)
        return answer, found


stand_in = types.ModuleType("in_blender.session")
stand_in.Session = Session
sys.modules["in_blender.session"] = stand_in
exec(sys.argv[-1])  # the code that the real one is started with
