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
from rsfstudy.rig.readers.tables_from_files_or_objects import TableSource

#: Functions that open compressed files, indexed by the first bytes of the file.
_OPEN_FUNCTION_BY_FILE_SIGNATURE: dict[bytes, Callable[[Any], Any]] = {
    b"\x1f\x8b": gzip.open,
    b"BZh": bz2.open,
    b"\xfd7zXZ\0": lzma.open,
}
#: Maximum number of bytes after decompression, and maximum ratio of the sizes after and before
#: decompression. The maximum ratio applies only to files that are longer than a mebibyte after
#: decompression.
_MAX_DECOMPRESSED_BYTES, _MAX_COMPRESSION_RATIO = 2**31, 200
_MIN_BYTES_TO_CHECK_COMPRESSION_RATIO = 2**20


def is_compressed_file(source: TableSource) -> bool:
    """Return True if the file is compressed by gzip, bzip2 or xz.

    Parameters
    ----------
    source : TableSource
        File.

    Returns
    -------
    bool
        True if the reader can decompress the file. If a compressed file contains another compressed
        file, only the outer file is decompressed.
    """
    return source.file_bytes is None and source.first_bytes_of_file.startswith(
        (*_OPEN_FUNCTION_BY_FILE_SIGNATURE,)
    )


def decompress_file(source: TableSource) -> TableSource:
    """Decompress a file.

    Parameters
    ----------
    source : TableSource
        Compressed file.

    Returns
    -------
    TableSource
        Source with the decompressed content.

    Raises
    ------
    DataError
        If the file is damaged, or if the decompressed content is too large.
    """
    data = source.read_all_bytes()
    opener = next(
        of for mark, of in _OPEN_FUNCTION_BY_FILE_SIGNATURE.items() if data.startswith(mark)
    )
    limit = max(_MIN_BYTES_TO_CHECK_COMPRESSION_RATIO, _MAX_COMPRESSION_RATIO * len(data))
    limit = min(limit, _MAX_DECOMPRESSED_BYTES)
    try:
        with opener(io.BytesIO(data)) as file:
            content = file.read(limit + 1)
    except (OSError, EOFError, lzma.LZMAError, zlib.error) as error:
        raise DataError(f"{source.path_or_object}: cannot be decompressed ({error})") from error
    if len(content) > limit:
        raise DataError(
            f"{source.path_or_object}: contains more than {limit:,} bytes after "
            "decompression, which is "
            "too much for a text file of this size. Decompress the file before you read it."
        )
    return replace(source, file_bytes=content)
