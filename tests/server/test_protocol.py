"""Frames, by hand and by chance."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from moldline.server import protocol, wire
from moldline.server.protocol import ServerError

ARRAYS = st.dictionaries(
    st.text(max_size=8),
    st.sampled_from(protocol.DTYPES).flatmap(
        lambda kind: stn.arrays(
            np.dtype(kind), stn.array_shapes(min_dims=0, min_side=0, max_side=4)
        )
    ),
    max_size=3,
)
QUICK = settings(max_examples=60, deadline=None)


def halves(frame):
    """The header and the body of a frame."""
    header, body = protocol.lengths(frame[:16])
    assert len(frame) == 16 + header + body
    return protocol.parsed(frame[16 : 16 + header]), frame[16 + header :]


@QUICK
@given(ARRAYS)
def test_what_is_encoded_reads_back_to_the_bit(arrays):
    header, body = halves(b"".join(protocol.encode({"id": 1, "op": "x"}, arrays)))
    assert (header["id"], header["op"]) == (1, "x")
    found = protocol.arrays_of(header, body)
    assert list(found) == list(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype and found[name].shape == array.shape
        assert found[name].tobytes() == array.tobytes()


@QUICK
@given(st.binary(max_size=200))
def test_any_bytes_are_a_frame_or_are_refused(data):
    try:
        header, body = protocol.lengths(data[:16].ljust(16, b"\0"))
        protocol.arrays_of(protocol.parsed(data[16 : 16 + header]), data[16 + header :][:body])
    except ServerError as error:
        assert error.code in protocol.CODES


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
ENTRIES = st.fixed_dictionaries(
    {
        "name": st.text(max_size=3) | JSON,
        "dtype": st.sampled_from(protocol.DTYPES) | JSON,
        "shape": st.lists(st.integers(-1, 2**40), max_size=4) | JSON,
    },
    optional={"segment": JSON, "offset": JSON},
)


@QUICK
@given(st.lists(ENTRIES, max_size=3) | JSON, st.binary(max_size=64))
def test_any_description_of_arrays_is_right_or_is_refused(entries, body):
    try:
        protocol.arrays_of({"arrays": entries}, body)
    except ServerError as error:
        assert error.code in ("malformed", "too large")


def test_lengths_beyond_the_limits_are_refused():
    huge = protocol.PREFIX.pack(protocol.MAGIC, 2**32 - 1, 2**64 - 1)
    with pytest.raises(ServerError, match="a header of 4294967295 bytes; at most"):
        protocol.lengths(huge)
    with pytest.raises(ServerError, match="a body of"):
        protocol.lengths(protocol.PREFIX.pack(protocol.MAGIC, 2, 2**40))
    with pytest.raises(ServerError, match="begins with b'MLD1', got b'GET '"):
        protocol.lengths(b"GET / HTTP/1.1\r\n")


def test_a_header_that_is_nested_too_deep_is_refused():
    with pytest.raises(ServerError, match="a header is JSON"):
        protocol.parsed(b"[" * 100_000)


def test_arrays_of_objects_and_texts_do_not_travel():
    with pytest.raises(ServerError, match="do not travel"):
        protocol.encode({}, {"a": np.array(["text"])})


def test_big_endian_arrays_are_turned_around():
    header, body = halves(b"".join(protocol.encode({}, {"a": np.arange(3.0).astype(">f8")})))
    np.testing.assert_array_equal(protocol.arrays_of(header, body)["a"], [0, 1, 2])


def test_an_answer_without_reason_is_still_an_error():
    problem = wire.problem_of(json.loads('{"ok": false, "error": 5}'))
    assert problem is not None and problem.code == "internal"
