"""What runs inside Blender's own Python: a program of its own, which knows nothing of moldline.

These files import bpy (GPL-3.0-or-later). moldline runs them as a process and speaks to it through
pipes; it imports `frames` and `wrong` alone.
"""
