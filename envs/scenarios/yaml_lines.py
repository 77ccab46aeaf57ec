"""YAML that remembers lines: values as plain Python, and where in the file each stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, cast

import yaml
from yaml.composer import ComposerError

from safefilter.bounded_file import read_bounded
from safefilter.errors import InvalidInput


class ScenarioFileError(InvalidInput):
    """A file cannot be used; the message names file, line and reason, one line for each fault."""


# A hundred times the longest layout of the library.
MAX_BYTES = 1_000_000
MAX_DEPTH = 50


class _PlainLoader(yaml.SafeLoader):
    """Reads data written out in full: a few aliases to aliases could stand for more than fits in memory."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Compose a node and those in it.

        Raises:
            yaml.composer.ComposerError: If it is an alias, has a tag, or is in too many others.
        """
        event = self.peek_event()  # type: ignore[no-untyped-call]  # its stubs forget this one
        mark = event.start_mark
        if self.check_event(yaml.AliasEvent):
            raise ComposerError(None, None, "an alias (*name); write it out", mark)
        if getattr(event, "tag", None) is not None:
            raise ComposerError(None, None, f"a tag ({event.tag}); drop it", mark)
        if self._depth > MAX_DEPTH:
            raise ComposerError(None, None, f"more than {MAX_DEPTH} levels deep", mark)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


@dataclass(frozen=True, slots=True, eq=False)
class YamlFile:
    """One parsed file.

    Attributes:
        path: Of the file.
        content: What it says, as dicts, lists, strings and numbers.
        root: Its nodes, which know their lines.
    """

    path: Path
    content: Any
    root: yaml.Node

    @classmethod
    def read(cls, path: Path) -> Self:
        """Parse a file.

        Raises:
            ScenarioFileError: If the file cannot be read, is too large, is not YAML, is empty, says a key twice, or has
                aliases or tags.
        """
        try:
            loader = _PlainLoader(read_bounded(path, MAX_BYTES).decode())
            root = loader.get_single_node()
            if root is None:
                raise ScenarioFileError(f"{path}:1: the file is empty; expected a mapping")
            # First, for it refuses keys that are no scalars.
            content = loader.construct_document(root)
            twice = _key_said_twice(root)
            if twice is not None:
                raise ScenarioFileError(
                    f"{path}:{twice.start_mark.line + 1}: {twice.value}: said before in the same mapping"
                )
            return cls(path, content, root)
        except ScenarioFileError:
            raise
        except InvalidInput as error:  # too large, or no file
            raise ScenarioFileError(str(error)) from None
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark or error.context_mark
            line = 1 if mark is None else mark.line + 1
            raise ScenarioFileError(f"{path}:{line}: not YAML: {error.problem}") from None
        except yaml.YAMLError as error:
            raise ScenarioFileError(f"{path}:1: not YAML: {error}") from None
        except (OSError, UnicodeDecodeError) as error:
            raise ScenarioFileError(f"{path}: cannot be read: {error}") from None
        except ValueError as error:  # a number or a date that is none
            raise ScenarioFileError(f"{path}: not YAML: {error}") from None

    def find(self, keys: Sequence[int | str]) -> tuple[int, list[int | str]]:
        """Look up where a value stands.

        Args:
            keys: Keys and indices from the root to the value. Those that are not in the file are passed over, but
                for the last: a missing key is looked up where it is missing.

        Returns:
            Its line, from 1 on, and the keys that lead there.
        """
        node, line, found = self.root, self.root.start_mark.line, []
        for place, key in enumerate(keys):
            below = _child(node, key)
            if below is not None:
                line, node = below[0].start_mark.line, below[1]
            if below is not None or place == len(keys) - 1:
                found.append(key)
        return line + 1, found


def way_text(keys: Sequence[int | str]) -> str:
    """The way to a value as people write it: ``robots[0].start: ``; of the root, nothing.

    Args:
        keys: Keys and indices from the root to the value.
    """
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return f"{text.removeprefix('.')}: " if text else ""


def _child(node: yaml.Node, key: int | str) -> tuple[yaml.Node, yaml.Node] | None:
    """The node to point at, and the value, of one key or index."""
    if isinstance(node, yaml.MappingNode):
        return next(((name, value) for name, value in node.value if name.value == key), None)
    if isinstance(node, yaml.SequenceNode) and isinstance(key, int) and key < len(node.value):
        return node.value[key], node.value[key]
    return None


def _key_said_twice(root: yaml.Node) -> yaml.Node | None:
    """PyYAML takes the last of equal keys in silence, and so half of a file could be lost."""
    # An alias is the same node again, maybe inside of itself.
    waiting, looked_at = [root], {id(root)}
    while waiting:
        node = waiting.pop()
        children: list[yaml.Node] = []
        if isinstance(node, yaml.MappingNode):
            seen: set[str] = set()
            for name, value in node.value:
                if name.value in seen:
                    return cast("yaml.Node", name)
                seen.add(name.value)
                children.append(value)
        elif isinstance(node, yaml.SequenceNode):
            children = node.value
        fresh = [child for child in children if id(child) not in looked_at]
        looked_at.update(map(id, fresh))
        waiting += fresh
    return None
