"""Settings of a training as plain data, and as files in YAML or JSON."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import cattrs
import yaml
from cattrs import transform_error
from cattrs.errors import BaseValidationError

from envs.norm_area import NormArea
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"


def plain_settings(settings: TrainingSettings) -> dict[str, Plain]:
    """Settings as JSON takes them."""
    plain: dict[str, Plain] = _converter().unstructure(settings)
    return plain


def settings_of(plain: object, what: str = "settings") -> TrainingSettings:
    """Settings from plain data; what is not said is as by default.

    Args:
        plain: A dictionary with the names of `TrainingSettings`.
        what: Where it comes from, for messages.

    Raises:
        InvalidInput: If a name is unknown, or a value cannot be used.
    """
    try:
        return _converter().structure(plain, TrainingSettings)
    except BaseValidationError as error:
        raise InvalidInput(f"{what}: " + "; ".join(transform_error(error))) from error


def read_settings(path: Path) -> TrainingSettings:
    """Read a file of settings, in YAML (or JSON, which is YAML).

    Args:
        path: The file.

    Raises:
        InvalidInput: If there is no such file, or it holds something else.
    """
    try:
        plain = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InvalidInput(f"{path}: cannot be read as settings: {error}") from error
    return settings_of({} if plain is None else plain, str(path))


def _converter() -> cattrs.Converter:
    converter = cattrs.Converter(forbid_extra_keys=True)
    converter.register_unstructure_hook(NormArea, lambda area: area.corners.tolist())
    converter.register_structure_hook(NormArea, lambda corners, _: NormArea(corners))
    return converter
