"""Exceptions of this package."""


class ParameterError(ValueError):
    """A parameter out of its range; the message is one line made of the four attributes.

    Attributes
    ----------
    table : str
        Table of the scene that holds the parameter, for example "blade".
    parameter : str
        Name of the parameter in that table.
    value : object
        Value as given.
    allowed : str
        The reason, and what would be accepted.

    Examples
    --------
    >>> from geometry import ParameterError
    >>> error = ParameterError("blade", "length", -0.1, "must be a positive number")
    >>> error.parameter, str(error)
    ('length', 'blade.length = -0.1: must be a positive number')
    """

    def __init__(self, table: str, parameter: str, value: object, allowed: str) -> None:
        super().__init__(table, parameter, value, allowed)  # all four, so that it can be pickled between processes
        self.table = table
        self.parameter = parameter
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        return f"{self.table}.{self.parameter} = {self.value!r}: {self.allowed}"


class GeometryError(ParameterError):
    """A geometric parameter out of its range, or a set of parameters that does not fit together.

    Examples
    --------
    >>> from geometry import BladeParameters, GeometryError, MeshParameters, ShroudParameters, build_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> try:
    ...     build_sector(blade, shroud, MeshParameters(size=-1.0))
    ... except GeometryError as error:
    ...     print(error)
    mesh.size = -1.0: must be a positive number
    """


class SectorFileError(ValueError):
    """A file that does not hold a sector; the message is one line and names the file and what is wrong."""


class MeshFileError(ValueError):
    """A mesh file that cannot be used; the message is one line made of the two attributes.

    Attributes
    ----------
    path : str
        The file.
    found : str
        What is wrong, where in the file, and what is allowed.

    Examples
    --------
    >>> from geometry import MeshFileError, read_mesh
    >>> try:
    ...     read_mesh("blade.stl")
    ... except MeshFileError as error:
    ...     print(error)
    blade.stl: the suffix must be one of .inp, .bdf, .nas, .dat, .cdb, .msh, .vtu, .med
    """

    def __init__(self, path: object, found: object) -> None:
        line = " ".join(str(found).split())
        super().__init__(str(path), line)  # both, so that it can be pickled between processes
        self.path = str(path)
        self.found = line

    def __str__(self) -> str:
        return f"{self.path}: {self.found}"


class OwnMeshError(ParameterError):
    """A mesh of another program that cannot be taken for a sector; the message is one line."""

    def __init__(self, key: str, value: object, allowed: str) -> None:
        table, _, parameter = key.partition(".")
        super().__init__(table, parameter, value, allowed)
        self.key = key

    def __str__(self) -> str:
        return f"{self.key}: {self.allowed}" if self.value is None else super().__str__()

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        return type(self), (self.key, self.value, self.allowed)  # as it is pickled between processes
