"""Size of compressed data after unpacking, found without keeping the data."""

import zlib

LARGEST = 1 << 26  # bytes of one block, packed or not; loggers make 128 KiB (BLF) to 4 MiB (MDF)
AT_ONCE = 1 << 16  # bytes that are unpacked at once


def fits(packed: bytes, most: int) -> bool:
    """Whether zlib unpacks the data to at most `most` bytes; True where it cannot unpack them."""
    total, unpacking = 0, zlib.decompressobj()
    try:
        while packed and total <= most:
            total += len(unpacking.decompress(packed, AT_ONCE))
            packed = unpacking.unconsumed_tail
    except zlib.error:
        return True  # whoever reads it names that
    return total <= most
