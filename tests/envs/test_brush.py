import numpy as np
import pygame
import pytest

from envs.brush import HEADER, SUPERSAMPLING, Canvas, as_picture, draw_disc, write

CANVAS = Canvas(200, 5.0)


def test_a_world_point_is_drawn_where_it_belongs() -> None:
    corners = CANVAS.pixels(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]))
    middle, east, north = np.array(corners)
    assert east[0] - middle[0] == pytest.approx(CANVAS.scale)
    assert middle[1] - north[1] == pytest.approx(CANVAS.scale)
    assert middle.tolist() == [SUPERSAMPLING * 100.0, SUPERSAMPLING * (HEADER + 100.0)]


def test_a_picture_has_rows_first() -> None:
    surface = pygame.Surface((60, 40))
    surface.fill((255, 255, 255))
    draw_disc(surface, (50.0, 10.0), 4.0, (200, 0, 0), 1)
    picture = as_picture(surface)
    assert picture.shape == (40, 60, 3)
    assert picture[10, 50].tolist() == [200, 0, 0]
    assert picture[30, 10].tolist() == [255, 255, 255]


def test_text_ends_where_it_is_said_to() -> None:
    surface = pygame.Surface((200, 40))
    surface.fill((255, 255, 255))
    end = write(surface, (10.0, 20.0), "arrived 3")
    inked = np.flatnonzero((as_picture(surface) < 128).any(axis=(0, 2)))
    assert 10 <= inked.min() <= 13
    assert end - 3 <= inked.max() <= end + 1
    assert write(surface, (190.0, 20.0), "arrived 3", side="right") == 190.0
