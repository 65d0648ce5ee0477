"""The filters of chunks, against HDF5's own, which verifies the checksum as it reads."""

import h5py
import numpy as np
import pytest

from dea_maps.files.filters import filtered, fletcher32, restored
from dea_maps.files.writer import Storage

FLETCHER, SHUFFLE, DEFLATE = h5py.h5z.FILTER_FLETCHER32, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_DEFLATE
SET = {
    FLETCHER: lambda properties: properties.set_fletcher32(),
    SHUFFLE: lambda properties: properties.set_shuffle(),
    DEFLATE: lambda properties: properties.set_deflate(1),
}


def read_back(chunks, filters, kind, cells):
    """Return what HDF5 reads from a chunk."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk((cells,))
    for number in filters:
        SET[number](properties)
    with h5py.File("in memory", "w", driver="core", backing_store=False) as file:
        space = h5py.h5s.create_simple((cells,))
        data = h5py.h5d.create(file.id, b"x", h5py.h5t.py_create(np.dtype(kind)), space, properties)
        data.write_direct_chunk((0,), chunks)
        return file["x"][:]


@pytest.mark.parametrize("filters", [(FLETCHER, SHUFFLE, DEFLATE), (SHUFFLE, DEFLATE, FLETCHER), (DEFLATE,)])
@pytest.mark.parametrize("kind", ["int8", "float32", "float64"])
@pytest.mark.parametrize("cells", [1, 3, 511, 512, 1025, 65_537])
def test_hdf5_reads_what_was_filtered(filters, kind, cells):
    rng = np.random.default_rng(cells)
    random = rng.integers(-128, 128, cells * np.dtype(kind).itemsize).astype(np.int8).view(kind)
    for values in (random, np.zeros(cells, kind), np.full(cells, -1).astype(kind), np.full(cells, -1, kind)):
        stored = filtered(values, filters)
        np.testing.assert_array_equal(read_back(stored, filters, kind, cells), values)
        np.testing.assert_array_equal(restored(stored, filters, np.dtype(kind)), values)


def test_hdf5_finds_a_changed_bit():
    stored = bytearray(filtered(np.arange(100.0), (FLETCHER, SHUFFLE)))
    stored[300] ^= 1
    with pytest.raises(OSError, match="filter"):
        read_back(bytes(stored), (FLETCHER, SHUFFLE), "float64", 100)


def test_published_checksums():
    """Of "abcde", "abcdef" and "abcdefgh", F04FC729, 56502D2A and EBE19591 over little-endian words; bytes swapped."""
    for text, sums in ((b"abcde", 0x4FF029C7), (b"abcdef", 0x50562A2D), (b"abcdefgh", 0xE1EB9195)):
        assert fletcher32(np.frombuffer(text, np.uint8)) == sums


@pytest.mark.parametrize("fill", [np.float32(np.nan), np.int8(0)])
def test_the_last_chunk_is_filled_up(fill):
    filters = (FLETCHER, SHUFFLE, DEFLATE)
    values = np.arange(1, 11).astype(fill.dtype)
    first, stored = Storage(fill, 7, filters).chunks(values, [slice(7), slice(7, 10)])
    np.testing.assert_array_equal(read_back(first, filters, fill.dtype, 7), np.arange(1, 8))
    np.testing.assert_array_equal(read_back(stored, filters, fill.dtype, 7), [8, 9, 10, *[fill] * 4])
