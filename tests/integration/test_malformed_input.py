"""Whatever is handed to a public entry point: what comes out is an error of ours that names it, or a usable answer.

No NaN executes, and nothing takes long. Functions are called with usable arguments of which one or two are replaced.
"""

from __future__ import annotations

from pathlib import Path
from time import process_time

import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import safefilter as sf
from assurance.filter_entries import FILTER_ENTRIES
from assurance.junk import junk
from assurance.loop_entries import LOOP_ENTRIES

# Of the processor, in s. A kernel that is compiled for the first time takes some 20 s; what takes this long hangs.
PATIENCE = 120.0
ENTRIES = FILTER_ENTRIES | LOOP_ENTRIES
# Whose usable arguments are those for which nothing is done.
REFUSING = {"Box", "register_backend", "compare_backends", "read_problems"}


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ENTRIES)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(data=st.data())
def test_malformed_input_is_refused_by_an_error_of_ours_or_answered(
    name: str, data: st.DataObject, tmp_path: Path
) -> None:
    call, usable = ENTRIES[name]
    given_values = dict(usable())
    fields = st.sampled_from(sorted(given_values))
    wrong = data.draw(st.dictionaries(fields, junk, min_size=1, max_size=2))
    start = process_time()
    try:
        answer = call(**{**given_values, **wrong})
    except (sf.SafeFilterError, ResetNeeded):
        answer = None
    if isinstance(answer, sf.Decision):
        assert np.isfinite(answer.action).all()
    assert process_time() - start <= PATIENCE
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ENTRIES)
def test_usable_input_is_answered(name: str) -> None:
    call, usable = ENTRIES[name]
    if name in REFUSING:
        with pytest.raises(sf.SafeFilterError):
            call(**usable())
    else:
        call(**usable())
