"""Reader of compressed files."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import zlib
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rsfstudy.errors import DataError
from rsfstudy.rig.readers.source import Source

#: Functions that open compressed files, indexed by the first bytes of the file.
_OPENERS: dict[bytes, Callable[[Any], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\0": lzma.open,
}
#: Maximum number of bytes after decompression, and maximum ratio of the sizes after and before
#: decompression. The maximum ratio applies only to files that are longer than a mebibyte after
#: decompression.
_MAX_DECOMPRESSED_BYTES, _MAX_COMPRESSION_RATIO = 2**31, 200
_MIN_BYTES_OF_RATIO = 2**20


def is_compressed(source: Source) -> bool:
    """Return True if the file is compressed by gzip, bzip2 or xz.

    Parameters
    ----------
    source : Source
        File.

    Returns
    -------
    bool
        True if the reader can decompress the file. If a compressed file contains another compressed
        file, only the outer file is decompressed.
    """
    return source.content is None and source.signature.startswith((*_OPENERS,))


def decompress(source: Source) -> Source:
    """Decompress a file.

    Parameters
    ----------
    source : Source
        Compressed file.

    Returns
    -------
    Source
        Source with the decompressed content.

    Raises
    ------
    DataError
        If the file is damaged, or if the decompressed content is too large.
    """
    data = source.read_bytes()
    opener = next(of for mark, of in _OPENERS.items() if data.startswith(mark))
    limit = max(_MIN_BYTES_OF_RATIO, _MAX_COMPRESSION_RATIO * len(data))
    limit = min(limit, _MAX_DECOMPRESSED_BYTES)
    try:
        with opener(io.BytesIO(data)) as file:
            content = file.read(limit + 1)
    except (OSError, EOFError, lzma.LZMAError, zlib.error) as error:
        raise DataError(f"{source.origin}: cannot be decompressed ({error})") from error
    if len(content) > limit:
        raise DataError(
            f"{source.origin}: contains more than {limit:,} bytes after decompression, which is "
            "too much for a text file of this size. Decompress the file before you read it."
        )
    return replace(source, content=content)
