"""ONNX: the deterministic policy as a graph that any runtime evaluates, with contract and checksum in its metadata.

Made of the arrays, node by node, without torch: a few linear layers, and the action map.

Letters: B robots, F numbers of an observation.
"""

from __future__ import annotations

import json

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from policies.contract import INPUTS, METADATA, OUTPUT, contract
from policies.onnx_seal import BLANK, SEAL, sealed
from policies.policy_weights import Weights

OPSET, IR_VERSION = 17, 8
"""Old enough for runtimes since 2022 to read."""


def to_onnx(weights: Weights) -> bytes:
    """The policy as an ONNX model.

    Args:
        weights: What was learnt.

    Returns:
        Content of a file ``.onnx``: inputs ``observation`` (B, F), ``v_max`` (B,) and ``omega_max`` (B,), output
        ``command`` (B, 2), all float32.
    """
    constants: dict[str, np.typing.NDArray[np.generic]] = {
        "-1": np.array(-1.0, np.float32),
        "1": np.array(1.0, np.float32),
        "half": np.array(0.5, np.float32),
        "columns": np.array([1, 1]),
        "axis": np.array([1]),
    }
    nodes, signal = [], INPUTS[0]
    for number, (weight, bias) in enumerate(weights.layers):
        constants |= {f"weight_{number}": weight, f"bias_{number}": bias}
        linear = f"linear_{number}"
        layer = [signal, f"weight_{number}", f"bias_{number}"]
        nodes.append(helper.make_node("Gemm", layer, [linear], transB=1))
        signal = linear
        if number < len(weights.layers) - 1:
            signal = f"active_{number}"
            nodes.append(helper.make_node("Relu", [linear], [signal]))
    graph = helper.make_graph(
        [*nodes, *_action_map(signal)],
        "policy",
        [_floats(INPUTS[0], ["B", weights.layout.size]), *(_floats(n, ["B"]) for n in INPUTS[1:])],
        [_floats(OUTPUT, ["B", 2])],
        [numpy_helper.from_array(array, name) for name, array in constants.items()],
    )
    opset = helper.make_opsetid("", OPSET)
    model = helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION)
    model.producer_name = "safefilter"
    helper.set_model_props(model, {METADATA: json.dumps(contract(weights)), SEAL: BLANK})
    onnx.checker.check_model(model, full_check=True)
    return sealed(model.SerializeToString())


def _action_map(raw: str) -> list[onnx.NodeProto]:
    """`policies.action_map.to_command` as nodes."""
    return [
        helper.make_node("Clip", [raw, "-1", "1"], ["clipped"]),
        helper.make_node("Split", ["clipped", "columns"], ["ahead", "turn"], axis=1),
        helper.make_node("Mul", ["ahead", "half"], ["ahead_half"]),
        helper.make_node("Add", ["ahead_half", "half"], ["share"]),
        helper.make_node("Unsqueeze", [INPUTS[1], "axis"], ["v_max_column"]),
        helper.make_node("Unsqueeze", [INPUTS[2], "axis"], ["omega_max_column"]),
        helper.make_node("Mul", ["v_max_column", "share"], ["v"]),
        helper.make_node("Mul", ["omega_max_column", "turn"], ["w"]),
        helper.make_node("Concat", ["v", "w"], [OUTPUT], axis=1),
    ]


def _floats(name: str, shape: list[int | str]) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
