from dataclasses import replace

import numpy as np

from envs import Crossroad, Fleet, Navigation
from envs.brush import FOOTER
from envs.legend import draw_legend
from envs.recording import Recorder, Recording


def start(priority: list[float]) -> Recording:
    navigation = Navigation(Crossroad(), Fleet.of(8, priority=priority))
    navigation.reset(0)
    return Recorder(navigation.world, 0, 0.2).recording()


def inked(recording: Recording) -> int:
    """How much is written."""
    return int((draw_legend([recording], 900) < 200).any(axis=-1).sum())


def test_only_what_is_seen_is_explained() -> None:
    plain, mixed = start([1.0] * 8), start([1.0, 2.0, 4.0, 8.0] * 2)
    people = replace(plain, setting=replace(plain.setting, person=np.arange(8) > 5))
    filtered = replace(plain, case=np.full_like(plain.case, 2))
    assert inked(plain) + 100 < min(inked(mixed), inked(people), inked(filtered))
    assert inked(replace(plain, case=np.ones_like(plain.case))) == inked(plain)


def test_what_does_not_fit_goes_to_the_next_row() -> None:
    mixed = start([1.0, 2.0, 4.0, 8.0] * 2)
    wide, narrow = draw_legend([mixed], 900), draw_legend([mixed], 200)
    assert wide.shape == (FOOTER, 900, 3)
    assert narrow.shape[0] > FOOTER
    assert (narrow[:, -10:] == 255).all()
