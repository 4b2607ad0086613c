"""Frames of Rerun's files, whose reader unpacks whatever they hold: the sizes that they unpack to, found beforehand.

A file is a header and frames: kind and length as 64-bit integers, then a message in the wire format of Protocol
Buffers. A frame of data has the fields compression, size and content; the content is a stream of Arrow messages, whose
headers are FlatBuffers. Arrow could compress every buffer once more, which Rerun's writer never does; such a frame is
refused, because its size cannot be told.
"""

from collections import defaultdict
from collections.abc import Iterator
from struct import Struct, error
from typing import NamedTuple

import pyarrow as pa

_HEADER, _FRAME, _END, _DATA = 12, Struct("<QQ"), 0, 2
_LZ4 = 2
_MANIFEST, _PART = 1, 4
"""Numbers of the fields of the last frame that hold manifests, and of a manifest that holds its table."""
_INT32, _UINT16, _INT64 = Struct("<i"), Struct("<H"), Struct("<q")
_KIND_FIELD, _MESSAGE_FIELD, _BODY_FIELD, _COMPRESSED_FIELD = 1, 2, 3, 3
"""Numbers of the fields of an Arrow message: kind, header and length of the body; of a batch: compression."""
_SCHEMA, _BATCH = 1, 3
"""Kinds of Arrow messages that Rerun writes."""


class _Numbers(NamedTuple):
    """Numbers of the fields of a message that holds a table."""

    compression: int
    size: int
    content: int


_OF_DATA, _OF_PART = _Numbers(2, 3, 5), _Numbers(3, 4, 2)


def unpacked_size(content: bytes, most: int) -> int:
    """Add up the sizes that the tables in a file unpack to [bytes].

    Args:
        content: of the file.
        most: size at which to stop adding up.

    Raises:
        ValueError: a frame is none of those that Rerun writes.
    """
    total = 0
    codec = pa.Codec("lz4_raw")
    try:
        for compression, size, packed in _tables(content):
            total += max(size, len(packed))
            if total > most:
                break
            _check_batches(codec.decompress(packed, size, asbytes=True) if compression == _LZ4 else bytes(packed))
    except (error, IndexError, OSError, pa.ArrowException) as fault:
        raise ValueError(f"a frame is damaged: {fault}") from None
    return total


def _tables(content: bytes) -> Iterator[tuple[int, int, memoryview]]:
    """Yield compression, size and content of every table of Arrow's."""
    view, place = memoryview(content), _HEADER
    kind = _DATA
    while kind != _END:
        kind, length = _FRAME.unpack_from(view, place)
        place += _FRAME.size
        if length > len(view) - place:
            raise ValueError("a frame is longer than the file")
        frame = view[place : place + length]
        place += length
        if kind == _DATA:
            yield _table(frame, _OF_DATA)
        elif kind == _END:
            for manifest in _Message(frame).contents[_MANIFEST]:
                for part in _Message(manifest).contents[_PART]:
                    yield _table(part, _OF_PART)


def _table(message: memoryview, fields: _Numbers) -> tuple[int, int, memoryview]:
    found = _Message(message)
    content = found.contents[fields.content] or [memoryview(b"")]
    return found.numbers.get(fields.compression, 0), found.numbers.get(fields.size, 0), content[-1]


class _Message:
    """Fields of a message by number.

    Attributes:
        numbers: those that are integers, of which the last counts.
        contents: those that are bytes.
    """

    def __init__(self, message: memoryview) -> None:
        self.numbers: dict[int, int] = {}
        self.contents: dict[int, list[memoryview]] = defaultdict(list)
        place = 0
        while place < len(message):
            key, place = _varint(message, place)
            value, place = _varint(message, place)
            if key & 7 == 0:
                self.numbers[key >> 3] = value
            elif key & 7 == 2 and value <= len(message) - place:
                self.contents[key >> 3].append(message[place : place + value])
                place += value
            else:
                raise ValueError("a frame has other fields")


def _varint(message: memoryview, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = message[place]
        value |= (byte & 127) << shift
        shift, place = shift + 7, place + 1
        if byte < 128:
            return value, place
        if shift > 63:
            raise ValueError("a frame has other fields")


def _check_batches(stream: bytes) -> None:
    """Check that a stream of Arrow messages has a schema and batches that are not compressed.

    Raises:
        ValueError: it has others.
    """
    place = 0
    while place < len(stream):
        length = _INT32.unpack_from(stream, place)[0]
        place += 4
        if length == -1:  # marks that the length follows
            length = _INT32.unpack_from(stream, place)[0]
            place += 4
        if length == 0:
            return
        if not 0 < length <= len(stream) - place:
            raise ValueError("a batch is longer than its frame")
        header = _Table(stream[place : place + length])
        kind = header.byte(_KIND_FIELD)
        if kind not in (_SCHEMA, _BATCH) or (kind == _BATCH and header.table(_MESSAGE_FIELD).has(_COMPRESSED_FIELD)):
            raise ValueError("a batch is packed as Rerun packs none")
        body = header.int64(_BODY_FIELD)
        if not 0 <= body <= len(stream) - place - length:
            raise ValueError("a batch is longer than its frame")
        place += length + body


class _Table:
    """Table of a FlatBuffer; the root where no place is given."""

    def __init__(self, content: bytes, place: int | None = None) -> None:
        self._content = content
        self._place = _INT32.unpack_from(content, 0)[0] if place is None else place
        fields = self._place - _INT32.unpack_from(content, self._place)[0]
        if self._place < 0 or fields < 0:
            raise ValueError("a batch has another header")
        self._fields, self._size = fields, _UINT16.unpack_from(content, fields)[0]

    def _offset(self, field: int) -> int:
        entry = 4 + 2 * field
        return int(_UINT16.unpack_from(self._content, self._fields + entry)[0]) if entry < self._size else 0

    def has(self, field: int) -> bool:
        return self._offset(field) != 0

    def byte(self, field: int) -> int:
        offset = self._offset(field)
        return self._content[self._place + offset] if offset else 0

    def int64(self, field: int) -> int:
        offset = self._offset(field)
        return int(_INT64.unpack_from(self._content, self._place + offset)[0]) if offset else 0

    def table(self, field: int) -> "_Table":
        place = self._place + self._offset(field)
        return _Table(self._content, place + _INT32.unpack_from(self._content, place)[0])
