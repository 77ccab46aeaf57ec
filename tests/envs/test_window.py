import numpy as np
import pygame

from envs.window import Window


def test_window_shows_the_picture_it_is_given() -> None:
    window = Window("title", 1000.0)
    picture = np.zeros((30, 50, 3), dtype=np.uint8)
    picture[20, 40] = [10, 200, 30]
    window.show(picture)
    screen = pygame.display.get_surface()
    assert screen is not None
    assert screen.get_size() == (50, 30)
    assert tuple(screen.get_at((40, 20)))[:3] == (10, 200, 30)
    assert pygame.display.get_caption()[0] == "title"
    window.close()
    assert not pygame.display.get_init()
    window.close()
