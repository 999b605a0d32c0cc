"""The elements that XDDM documents are made of, and what their attributes hold."""

from .element import Element

INPUTS = ("Variable", "Constant")
"""What is given."""

EXPRESSIONS = ("Function", "Objective", "Constraint", "Sum")
"""What is computed from others by its Expr."""

VALUED = (*INPUTS, "Analysis", *EXPRESSIONS)
"""What has a Value, and a name that expressions may use."""

POINT = "DesignPoint"

PLAIN = ("Configure", "Intersect", "AeroFun", "SensitivityArray", "Sensitivity", "Tessellate",
         "Component", "Data")  # fmt: skip
"""What is neither a value nor a namespace."""

NEEDED = {
    **dict.fromkeys(INPUTS, ("ID", "Value")),
    **dict.fromkeys(EXPRESSIONS, ("ID", "Expr")),
    "Analysis": ("ID",),
    "Sensitivity": ("P", "Value"),
    "Intersect": ("Parts",),
    "DesignPoint": ("ID",),
    "Component": ("Name", "Type"),
}
"""Attributes that an element cannot do without."""

NUMBERS = {
    **dict.fromkeys(INPUTS, ("Value", "Min", "Max", "TypicalSize", "FDstep")),
    **dict.fromkeys(EXPRESSIONS, ("Value", "Min", "Max")),
    "Analysis": ("Value", "DiscretizationError"),
    "Sensitivity": ("Value",),
    "Tessellate": ("MaxEdge", "Sag", "Angle"),
}
"""Attributes that hold numbers."""

POSITIVE = ("TypicalSize", "FDstep", "MaxEdge", "Sag", "Angle")
"""Numbers that must be above zero."""

WORDS = {
    "Sensitivity": ("Required", "None"),
    "Bound": ("Upper", "Lower"),
    "Type": ("tri", "container"),
}
"""Attributes that hold one of a few words, whatever their case; Type is a Component's."""

DIFFERENCED = ("FD", "oFD")
"""Comments of a Variable that force its derivatives to be differences."""


def is_namespace(element: Element) -> bool:
    """Whether what is within an element is read: a document's first, or an unknown with an ID."""
    if element.parent is None:
        return True
    return element.tag not in (*VALUED, *PLAIN) and bool(element.id)
