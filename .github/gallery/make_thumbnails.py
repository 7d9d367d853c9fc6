"""Draw the thumbnails of the gallery from the results of the named studies.

Run all studies first, and then this script from the root of the repository::

    rsfstudy run --all
    python .github/gallery/make_thumbnails.py outputs

To update some thumbnails only, append the names of their studies.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import matplotlib
from PIL import Image

import rsfstudy

HERE = Path(__file__).parent
#: Width and height of a thumbnail in pixels.
SIZE = (360, 225)
#: Resolution of the figure before it is scaled down.
DPI = 200
#: Limit of the size of a file in bytes.
MOST_BYTES = 15_000


def draw_figure(results: Path) -> Image.Image:
    """Return the first panel of the figure of a results file, with a white background."""
    figure = rsfstudy.plot(rsfstudy.open(results))
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DPI, facecolor="white")
    image = Image.open(buffer).convert("RGB")
    panel = figure.axes[0].get_tightbbox().transformed(figure.dpi_scale_trans.inverted())
    left, bottom, right, top = (round(DPI * edge) for edge in panel.padded(0.03).extents)
    edges = (max(left, 0), max(image.height - top, 0), right, image.height - bottom)
    return image.crop((*edges[:2], min(right, image.width), min(edges[3], image.height)))


def write_thumbnail(image: Image.Image, file: Path) -> None:
    """Write an image that fits into the size of a thumbnail, with as many colours as possible."""
    image.thumbnail(SIZE, Image.Resampling.LANCZOS)
    canvas = Image.new("RGB", SIZE, "white")
    canvas.paste(image, ((SIZE[0] - image.width) // 2, (SIZE[1] - image.height) // 2))
    for colours in (64, 32, 16, 8, 4):
        reduced = canvas.quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        reduced.save(file, optimize=True)
        if file.stat().st_size <= MOST_BYTES:
            return
    raise SystemExit(f"{file.name} has more than {MOST_BYTES} bytes with four colours.")


def main(folder: str = "outputs", *names: str) -> None:
    """Draw the thumbnails of the given studies, or of all studies."""
    matplotlib.use("agg")
    for name in names or rsfstudy.studies():
        write_thumbnail(draw_figure(Path(folder) / f"{name}.nc"), HERE / f"{name}.png")


if __name__ == "__main__":
    main(*sys.argv[1:])
