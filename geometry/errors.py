"""The one exception of this package: a parameter that does not give a blade."""


class GeometryError(ValueError):
    """A geometric parameter out of its range, or a set of parameters that does not fit together.

    Attributes: ``table`` ("blade", "shroud" or "mesh"), ``parameter`` (its name there), ``value`` (as given)
    and ``allowed`` (the reason and what would be accepted). ``str(error)`` is one line made of the four.
    """

    def __init__(self, table: str, parameter: str, value: object, allowed: str) -> None:
        super().__init__(table, parameter, value, allowed)
        self.table = table
        self.parameter = parameter
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.table}.{self.parameter} = {self.value!r}: {self.allowed}"


class SectorFileError(ValueError):
    """A file that does not hold a sector; ``str(error)`` names the file and what is wrong, in one line."""
