"""What can happen to a file: it is cut, a bit turns over, bytes are lost or put in, another one is in its place."""

from __future__ import annotations

import json
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from hypothesis import strategies as st

Json = Any
"""As `json.loads` returns it."""

FOREIGN: dict[str, bytes] = {
    "nothing": b"",
    "a newline": b"\n",
    "zeros": bytes(200),
    "an empty object": b"{}",
    "an empty object in a line": b"{}\n",
    "an empty list": b"[]",
    "a number": b"7",
    "not UTF-8": b"\xff\xfe\x00\x01",
    "deep lists": b"[" * 100_000,
    "a number of many digits": b'{"a": ' + b"9" * 5000 + b"}\n",
    "an infinite number": b"[1e999, NaN, Infinity]\n",
    "a pickle": b"cos\nsystem\n(S'touch stolen'\ntR.",
    "an empty zip": b"PK\x05\x06" + bytes(18),
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(64),
    # 10 GB of header, and one of the length that is there.
    "a header of 10 GB": (10**10).to_bytes(8, "little") + b"{" + bytes(50),
    "a tensor of 10 GB": (88).to_bytes(8, "little")
    + b'{"a":{"dtype":"F32","shape":[2500000000],"data_offsets":[0,10000000000]}}'.ljust(88),
    "a tensor of infinite size": (60).to_bytes(8, "little")
    + b'{"a":{"dtype":"F32","shape":[1],"data_offsets":[0,1e999]}}'.ljust(60),
}
"""Files that are something else."""


def truncations(content: bytes, number: int) -> Iterator[bytes]:
    """A file cut at about so many places, evenly spread."""
    step = max(1, len(content) // number)
    for length in range(0, len(content), step):
        yield content[:length]


def flips(content: bytes, number: int) -> Iterator[bytes]:
    """A file with one bit turned over at about so many places, evenly spread; each time another bit."""
    step = max(1, len(content) // number)
    for count, place in enumerate(range(0, len(content), step)):
        turned = content[place] ^ (1 << count % 8)
        yield content[:place] + bytes([turned]) + content[place + 1 :]


@st.composite
def damages(draw: st.DrawFn, content: bytes) -> bytes:
    """Draw a damaged file: bytes cut off, replaced, put in, lost, repeated."""
    place = draw(st.integers(0, len(content) - 1))
    end = draw(st.integers(place, min(len(content), place + 40)))
    piece = draw(st.binary(min_size=1, max_size=8))
    return draw(
        st.sampled_from((
            content[:place],
            content[place:],
            content[:place] + piece + content[place + len(piece) :],
            content[:place] + piece + content[place:],
            content[:place] + content[end:],
            content[:end] + content[place:],
            content + content,
            piece + content,
        ))
    )


def places_in(tree: Json) -> Iterator[tuple[Json, Any]]:
    """Every list or dictionary in a tree, with every index or key of it."""
    children = (
        tree.items()
        if isinstance(tree, dict)
        else enumerate(tree)
        if isinstance(tree, list)
        else ()
    )
    for key, child in children:
        yield tree, key
        yield from places_in(child)


STRANGE = st.recursive(
    st.sampled_from((
        None, True, False, 0, -1, 1, 3, 2**63, 2**70, 10**400, 0.5, -0.0, 1e308, 1e-320, "", "x", "nan", "\ud800",
    )),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(("x", "rows", "0")), inner, max_size=2),
    max_leaves=5,
)  # fmt: skip
"""Values that JSON can hold, and few expect."""


@st.composite
def strange_trees(draw: st.DrawFn, tree: Json) -> Json:
    """Draw a JSON tree in which one or two values, anywhere, are replaced, lost or repeated."""
    changed = deepcopy(tree)
    for _ in range(draw(st.integers(1, 2))):
        places = list(places_in(changed))
        if not places:
            return draw(STRANGE)
        holder, key = places[draw(st.integers(0, len(places) - 1))]
        action = draw(st.sampled_from(("replace", "replace", "replace", "lose", "repeat")))
        if action == "replace":
            holder[key] = draw(STRANGE)
        elif action == "lose":
            del holder[key]
        elif isinstance(holder, list):
            holder.insert(key, deepcopy(holder[key]))
    return changed


def as_text(tree: Json) -> str:
    """As JSON, NaN and infinities included, as other programs write them."""
    return json.dumps(tree, ensure_ascii=True)
