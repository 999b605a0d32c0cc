"""What can be turned in a file that is open in Blender."""

from typing import Any

import bpy  # type: ignore[import-not-found,unused-ignore]

from . import rna
from .wrong import Wrong


def listed() -> list[dict[str, Any]]:
    """Objects with their modifiers, the properties that can be turned, and their control points."""
    return [_object(body) for body in sorted(bpy.data.objects, key=lambda one: one.name)]


def _object(body: Any) -> dict[str, Any]:
    found = {
        "object": body.name,
        "type": body.type,
        "modifiers": [{"name": m.name, "type": m.type} for m in body.modifiers],
        "groups": [group.name for group in body.vertex_groups],
        "parameters": [p for path in _paths(body) if (p := _parameter(path)) is not None],
    }
    if body.type == "MESH":
        found["points"] = len(body.data.vertices)
    elif body.type == "LATTICE":
        found["points"] = len(body.data.points)
        found["shape"] = [body.data.points_u, body.data.points_v, body.data.points_w]
    elif body.type == "ARMATURE":
        found["bones"] = [bone.name for bone in body.pose.bones]
    return found


def _paths(body: Any) -> list[str]:
    """Paths of what is worth turning, from bpy.data."""
    start = "objects" + _item(body.name)
    found = [f"{start}.location", f"{start}.rotation_euler", f"{start}.scale"]
    found += _added(body, start)
    for modifier in body.modifiers:
        own = f"{start}.modifiers{_item(modifier.name)}"
        if modifier.type == "NODES":
            found += [own + _item(name) for _, name in rna.sockets(modifier)]
        else:
            known = set(bpy.types.Modifier.bl_rna.properties.keys())
            found += [f"{own}.{name}" for name in rna.properties(modifier) if name not in known]
    data = body.data
    if data is not None:
        collection = _collection(data)
        if collection:
            found += _added(data, collection + _item(data.name))
        keys = getattr(data, "shape_keys", None)
        if keys is not None:
            found += [
                f"shape_keys{_item(keys.name)}.key_blocks{_item(key.name)}.value"
                for key in keys.key_blocks
                if key != keys.reference_key
            ]
    return found


def _added(owner: Any, start: str) -> list[str]:
    """Properties that users have added."""
    return [start + _item(key) for key in list(owner.keys()) if isinstance(owner[key], float)]


def _collection(data: Any) -> str:
    kinds = (("meshes", "Mesh"), ("lattices", "Lattice"), ("armatures", "Armature"),
             ("curves", "Curve"))  # fmt: skip
    return next((name for name, kind in kinds if isinstance(data, getattr(bpy.types, kind))), "")


def _parameter(path: str) -> dict[str, Any] | None:
    try:
        place = rna.place(path)
        numbers = place.read()
        limits = place.limits
        return {
            "path": path,
            "value": numbers if place.is_list else numbers[0],
            "limits": limits,
            "kind": place.kind,
            "driver": place.driver,
        }
    except Wrong:
        return None


def _item(name: str) -> str:
    return f"['{name}']" if '"' in name else f'["{name}"]'
