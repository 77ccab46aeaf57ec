"""Card: where weights come from, what they reach and what they are not for.

The same fields become the JSON beside the weights and the page for people (`policies.card_page`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Self, TypeAlias

from policies.checkpoint_errors import CheckpointForeign
from safefilter.errors import InvalidInput

Json: TypeAlias = "bool | int | float | str | Sequence[Json] | Mapping[str, Json] | None"


@dataclass(frozen=True, slots=True)
class Card:
    """What weights are. Everything is plain JSON, without NaN; None where a figure is not known.

    Attributes:
        name: What the policy is called in tables.
        data: What it was trained on, in a sentence or two.
        command: The command that trained it, to be typed again.
        seed: Seed of the training.
        settings: All settings of the training.
        figures: Rows of the evaluation, each with its scenario, figures and number of episodes.
        figures_command: The command that measured them.
        limits: What the policy is not for, or was not tested for, a sentence each.
        versions: Of the packages, and the commit.
    """

    name: str
    data: str = ""
    command: str = ""
    seed: int = 0
    settings: Mapping[str, Json] = field(default_factory=dict)
    figures: Sequence[Mapping[str, Json]] = ()
    figures_command: str = ""
    limits: Sequence[str] = ()
    versions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Take only what comes back from a file as it went there.

        Raises:
            InvalidInput: If something is not JSON, or is NaN or infinite.
        """
        try:
            plain = json.loads(json.dumps(asdict(self), allow_nan=False))
        except (TypeError, ValueError) as error:
            raise InvalidInput(
                f"card {self.name!r}: expected JSON without NaN, with None for what is not known: {error}"
            ) from error
        # A copy, with lists for tuples: equal to what is read back, and nobody else's to change.
        for name, value in plain.items():
            object.__setattr__(self, name, value)

    def plain(self) -> dict[str, Json]:
        """As JSON."""
        return asdict(self)

    @classmethod
    def of(cls, plain: object, what: str) -> Self:
        """From JSON.

        Args:
            plain: What `plain` returned once.
            what: File that it is from, for messages.

        Raises:
            CheckpointForeign: If it has other fields.
        """
        names = {each.name for each in fields(cls)}
        if not isinstance(plain, dict) or set(plain) != names:
            raise CheckpointForeign(
                f"{what}: expected a card with {', '.join(sorted(names))}, got "
                f"{', '.join(sorted(map(str, plain))) if isinstance(plain, dict) else type(plain).__name__}"
            )
        return cls(**plain)
