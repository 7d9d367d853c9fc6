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
#: Limit of the size of a file in bytes.
MOST_BYTES = 15_000


def draw_figure(results: Path) -> Image.Image:
    """Return the figure of a results file as an image with a white background."""
    figure = rsfstudy.plot(rsfstudy.open(results))
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=150, facecolor="white")
    return Image.open(buffer).convert("RGB")


def write_thumbnail(image: Image.Image, file: Path) -> None:
    """Write an image that fits into the size of a thumbnail, with as many colours as possible."""
    image.thumbnail(SIZE, Image.Resampling.LANCZOS)
    canvas = Image.new("RGB", SIZE, "white")
    canvas.paste(image, ((SIZE[0] - image.width) // 2, (SIZE[1] - image.height) // 2))
    for colours in (64, 32, 16, 8, 4):
        canvas.quantize(colours, dither=Image.Dither.NONE).save(file, optimize=True)
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
