"""The command line of ``python -m policies.train``: a preset or a file, and every setting by name.

Asking for a setting of curiosity turns curiosity on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import torch
import tyro

from envs.norm_area import NormArea
from policies.curiosity import CuriositySettings
from policies.presets import PRESETS
from policies.settings_file import read_settings
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput, OutOfRange

USAGE = "python -m policies.train"
USUAL = "srl-orca"
CURIOSITY = "--settings.curiosity."
DESCRIPTION = f"""Train a policy: Alg. 1 of Qin et al.

{USAGE} srl-orca --settings.seed 2

{USAGE} my_settings.yaml --out runs/mine

The first argument is a preset ({{presets}}; {USUAL} if it is left out) or a file of settings in YAML; every setting can
be changed after it. Options of curiosity turn curiosity on. In the folder of the run are checkpoints, TensorBoard's
events, the learning curve, and in the end the weights with their card. The same command goes on with a training that
was stopped.
"""


@dataclass(frozen=True, slots=True)
class Command:
    """Train a policy.

    Attributes:
        settings: What the training depends on.
        out: Folder of the run; None: runs/NAME-SEED.
        device: Where networks live: cpu or cuda.
        num_threads: Threads of torch; 1 gives the same numbers on every machine of a kind.
        keep_every: Steps between checkpoints; 0: only one, in the end.
        check_every: Steps between checks in the paper's scenarios; 0: none.
        is_fresh: Begin anew, whatever is in the folder.
    """

    settings: TrainingSettings
    out: Path | None = None
    device: str = "cpu"
    num_threads: int = torch.get_num_threads()
    keep_every: int = 500_000
    check_every: int = 1_000_000
    is_fresh: bool = False

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OutOfRange: If a number is below what it can be.
            InvalidInput: If torch has no such device here.
        """
        for field, least in (("num_threads", 1), ("keep_every", 0), ("check_every", 0)):
            if getattr(self, field) < least:
                raise OutOfRange(f"{field}: expected {least} or more, got {getattr(self, field)}")
        try:
            # Numbers have to come back from it, which those of "meta" do not.
            torch.zeros(1, device=self.device).item()
        except (RuntimeError, AssertionError) as error:
            raise InvalidInput(
                f"device: expected cpu, or another that torch finds here, got {self.device!r}: "
                f"{str(error).splitlines()[0]}"
            ) from None


def parse(arguments: Sequence[str]) -> tuple[str, Command]:
    """Read a command line; prints help and leaves where it asks for it or is wrong.

    Args:
        arguments: After the name of the program.

    Returns:
        Name of the preset, or of the file without its suffix, and the command.

    Raises:
        InvalidInput: If the first argument is neither a preset nor a file of settings, or the file is wrong.
    """
    source, rest = _split(arguments)
    settings = PRESETS[source] if source in PRESETS else read_settings(Path(source))
    # Options exist for what there is by default; help shows them all.
    is_asked_for = any(text.startswith((CURIOSITY, "-h", "--help")) for text in rest)
    if settings.curiosity is None and is_asked_for:
        settings = replace(settings, curiosity=CuriositySettings())
    command = tyro.cli(
        Command,
        default=Command(settings),
        args=rest,
        prog=f"{USAGE} {source}",
        description=DESCRIPTION.format(presets=", ".join(PRESETS)),
        config=(tyro.conf.AvoidSubcommands, tyro.conf.EnumChoicesFromValues),
        registry=_registry(),
    )
    return Path(source).stem, command


def _split(arguments: Sequence[str]) -> tuple[str, list[str]]:
    """The preset or file, and what comes after it.

    Raises:
        InvalidInput: If it is neither.
    """
    if not arguments or arguments[0].startswith("-"):
        return USUAL, list(arguments)
    source = arguments[0]
    if source not in PRESETS and not Path(source).is_file():
        raise InvalidInput(
            f"expected a file of settings or one of {', '.join(PRESETS)}, got {source!r}"
        )
    return source, list(arguments[1:])


def _registry() -> tyro.constructors.ConstructorRegistry:
    """How to write what is no number: a norm area by its corners, FORWARD LEFT FORWARD LEFT ..."""
    registry = tyro.constructors.ConstructorRegistry()

    @registry.primitive_rule
    def norm_area(
        info: tyro.constructors.PrimitiveTypeInfo,
    ) -> tyro.constructors.PrimitiveConstructorSpec[NormArea] | None:
        if info.type is not NormArea:
            return None
        return tyro.constructors.PrimitiveConstructorSpec(
            nargs="*",
            metavar="[FORWARD LEFT [FORWARD LEFT ...]]",
            instance_from_str=_area,
            is_instance=lambda instance: isinstance(instance, NormArea),
            str_from_instance=lambda area: [str(number) for number in area.corners.ravel()],
        )

    return registry


def _area(texts: list[str]) -> NormArea:
    """A norm area.

    Raises:
        InvalidInput: If there is no second number to one.
    """
    if len(texts) % 2:
        raise InvalidInput(f"expected pairs of numbers, forward and left, got {len(texts)} numbers")
    numbers = [float(text) for text in texts]
    return NormArea([numbers[k : k + 2] for k in range(0, len(numbers), 2)])  # type: ignore[arg-type]  # checked there
