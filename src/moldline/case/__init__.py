"""STATE: the case file, its schema, and the pipeline it describes."""

from .case import Case, load
from .schema import json_schema

__all__ = ["Case", "json_schema", "load"]
