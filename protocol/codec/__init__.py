"""One CAN frame: layout, encoding, decoding, counters and CRC, length on the wire."""
