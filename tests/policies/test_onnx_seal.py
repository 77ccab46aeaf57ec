import pytest
from hypothesis import given
from hypothesis import strategies as st

from assurance.file_loaders import small_weights
from policies.onnx_export import to_onnx
from policies.onnx_seal import BLANK, SEAL, is_intact, sealed

MODEL = to_onnx(small_weights())


def test_an_exported_model_is_sealed() -> None:
    assert is_intact(MODEL) is True
    assert BLANK.encode() not in MODEL
    assert MODEL.count(SEAL.encode()) > 0


@given(st.integers(0, len(MODEL) - 1), st.integers(1, 255))
def test_no_byte_can_change_unnoticed(place: int, change: int) -> None:
    altered = bytearray(MODEL)
    altered[place] ^= change
    assert is_intact(bytes(altered)) is not True


@given(st.binary(max_size=50))
def test_other_files_have_no_seal(content: bytes) -> None:
    assert is_intact(content) is None
    assert is_intact(MODEL + MODEL) is None
    with pytest.raises(ValueError, match="expected metadata with sha256="):
        sealed(content)
    with pytest.raises(ValueError, match="expected metadata with sha256="):
        sealed(MODEL)
