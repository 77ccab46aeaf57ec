"""Backends of a test file are registered while its tests run, and no longer: some of them kill whoever asks them."""

from collections.abc import Iterator

import pytest

from safefilter.backends import registry


@pytest.fixture(scope="module", autouse=True)
def registered(request: pytest.FixtureRequest) -> Iterator[None]:
    """Those that the file names in ``REGISTERED``, and no others."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_registered", dict(getattr(request.module, "REGISTERED", {})))
        yield
