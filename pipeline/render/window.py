"""An offscreen window that draws many pictures: what it compiles for the first serves the others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any


class Window:
    """A window with views side by side, white and smoothed."""

    def __init__(self, size: tuple[int, int], widths: Sequence[float]) -> None:
        from pyvista import Plotter

        make: Any = Plotter  # the stubs of pyvista ask for whole numbers as proportions
        # where a picture is composed; it is empty but for the lights after each
        self.plotter = make(
            off_screen=True, window_size=list(size), shape=(1, len(widths)), col_weights=tuple(widths), border=False
        )
        self.plotter.set_background("white", all_renderers=True)
        self.plotter.enable_anti_aliasing("ssaa", all_renderers=True)
        self.plotter.suppress_rendering = True  # once it has drawn, it would draw anew at each change

    def picture(self) -> Any:
        """The picture composed, (height, width, 3) of bytes; the window is emptied for the next."""
        self.plotter.suppress_rendering = False
        self.plotter.render()
        image = self.plotter.screenshot(return_img=True)
        self.plotter.suppress_rendering = True
        self.plotter.scalar_bars.clear()
        for renderer in self.plotter.renderers:
            renderer.clear_actors()
        return image

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()


def save_png(image: Any, path: Path) -> None:
    """Write a picture (height, width, 3) of bytes."""
    from PIL import Image

    Image.fromarray(image).save(path)
