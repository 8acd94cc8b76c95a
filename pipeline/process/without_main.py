"""Child processes that do not run the script of their parent again."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def without_main() -> Iterator[None]:
    """Within the block a process is started that does not import `__main__`.

    multiprocessing imports the file of `__main__` in the child, so that functions of it can be called there. Ours
    stand in our packages. A script that runs a scene would run it again, and would wait for its own output folder.
    """
    main = sys.modules["__main__"]
    hidden: dict[str, Any] = {name: vars(main).get(name) for name in ("__spec__", "__file__") if name in vars(main)}
    vars(main).pop("__file__", None)
    vars(main)["__spec__"] = None
    try:
        yield
    finally:
        vars(main).update(hidden)
