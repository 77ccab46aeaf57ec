"""Files taken apart into the JSON that they hold, and made again with checksums that are right.

A damaged byte is told by a checksum. Whether what is behind it is believed shows only where the checksum is right and
the content is not.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import onnx
import safetensors.numpy
import yaml

from policies.contract import METADATA
from policies.onnx_seal import BLANK, SEAL, sealed
from policies.tensor_file import LENGTH_BYTES, TensorFile

Json = Any
"""As `json.loads` returns it."""


class FileTree(NamedTuple):
    """How files of a kind are taken apart.

    Attributes:
        taken: From the content of a usable file to a tree.
        made: From that content, and a tree that took the place of its own, to the content of another file.
    """

    taken: Callable[[bytes], Json]
    made: Callable[[bytes, Json], bytes]


def tensor_parts(content: bytes) -> TensorFile:
    """Arrays and texts of a safetensors file that is known to be whole."""
    end = LENGTH_BYTES + int.from_bytes(content[:LENGTH_BYTES], "little")
    texts: Mapping[str, str] = json.loads(content[LENGTH_BYTES:end])["__metadata__"]
    return TensorFile(safetensors.numpy.load(content), texts)


def weights_file(file: TensorFile, said: Json) -> bytes:
    """Weights whose card says something else, with a checksum over that."""
    if isinstance(said, dict):
        signed = {name: value for name, value in said.items() if name != "sha256"}
        text = json.dumps(signed, sort_keys=True)
        said = {**said, "sha256": TensorFile(file.arrays, {"said": text}).checksum("said")}
    return TensorFile(file.arrays, {**file.texts, "card": json.dumps(said)}).content()


def _training_file(content: bytes, state: Json) -> bytes:
    file = tensor_parts(content)
    texts = {**file.texts, "state": json.dumps(state)}
    signed = ("format", "version", "number", "state")
    texts["sha256"] = TensorFile(file.arrays, texts).checksum(*signed)
    return TensorFile(file.arrays, texts).content()


def _exported_contract(content: bytes) -> Json:
    (text,) = [
        prop.value for prop in onnx.load_from_string(content).metadata_props if prop.key == METADATA
    ]
    return json.loads(text)


def _exported_file(content: bytes, made: Json) -> bytes:
    model = onnx.load_from_string(content)
    del model.metadata_props[:]
    onnx.helper.set_model_props(model, {METADATA: json.dumps(made), SEAL: BLANK})
    return sealed(model.SerializeToString())


def lines_of(content: bytes) -> list[Json]:
    """JSON Lines as a list of what each holds."""
    return [json.loads(line) for line in content.splitlines()]


def _recording_lines(content: bytes) -> list[Json]:
    lines = lines_of(content)
    for line in lines:
        del line["crc32"]
    return lines


def recording_file(lines: Json) -> bytes:
    """A recording whose checksums are right, whatever its lines are; what is no object has none."""
    checksum, content = 0, b""
    for line in lines if isinstance(lines, list) else [lines]:
        body = json.dumps(line, separators=(",", ":"))
        checksum = zlib.crc32(body.encode(), checksum)
        content += f'{body[:-1]},"crc32":"{checksum:08x}"}}\n'.encode()
    return content


def _lines_file(_: bytes, lines: Json) -> bytes:
    listed = lines if isinstance(lines, list) else [lines]
    return "".join(json.dumps(line) + "\n" for line in listed).encode()


def _json_file(_: bytes, tree: Json) -> bytes:
    return json.dumps(tree).encode()


FILE_TREES = {
    "weights": FileTree(
        lambda content: json.loads(tensor_parts(content).texts["card"]),
        lambda content, said: weights_file(tensor_parts(content), said),
    ),
    "card of weights": FileTree(json.loads, _json_file),
    "checkpoint of a training": FileTree(
        lambda content: json.loads(tensor_parts(content).texts["state"]), _training_file
    ),
    "exported policy": FileTree(_exported_contract, _exported_file),
    "recording": FileTree(_recording_lines, lambda _, lines: recording_file(lines)),
    "layout": FileTree(yaml.safe_load, _json_file),
    "settings of a training": FileTree(yaml.safe_load, _json_file),
    "problems": FileTree(lines_of, _lines_file),
    "rows of the table": FileTree(json.loads, _json_file),
    "learning curve": FileTree(json.loads, _json_file),
}
"""By the names of `assurance.file_loaders`; the other kinds hold no JSON."""

STRANGE_ARRAYS: tuple[np.typing.NDArray[Any], ...] = (
    np.array(1.0, np.float32),
    np.zeros((0,), np.float32),
    np.zeros((0, 0), np.float32),
    np.ones((5,), np.float32),
    np.ones((1, 2, 3), np.float32),
    np.ones((2, 2), np.float64),
    np.ones((2,), np.int64),
    np.ones((2,), np.bool_),
    np.full((2,), np.nan, np.float32),
)
"""Tensors that no network has."""
