"""Colours of clothes: where they are looked at, what they are, how far two of them differ."""
import numpy as np
import pytest

from skeleton_extract_3d.track import appearance
from synthetic_scene import Person, Room, pinhole, render, standing

# CIELAB of pure colours under D65 (sRGB, IEC 61966-2-1)
LAB = {(0, 0, 255): (53.24, 80.09, 67.20), (0, 255, 0): (87.73, -86.18, 83.18), (255, 0, 0): (32.30, 79.19, -107.86),
       (255, 255, 255): (100, 0, 0), (0, 0, 0): (0, 0, 0)}


def picture(bgr=(0, 0, 255), size=(20, 30)):
    return np.tile(np.array(bgr, np.uint8), (*size, 1))


def colours(image, pixels, usable):
    """Return colours (L, a, b) and what is known of the upper part, for (P, N, 2) pixels on it; N up to 12."""
    people, count = len(pixels), np.shape(pixels)[1]
    places, use = np.full((people, 18, 2), np.nan), np.zeros((people, 18), bool)
    places[:, :count], use[:, :count] = pixels, usable
    clothes = appearance.mean_colours(image, places, use)
    assert not clothes.weights[:, 1].any(), 'nothing is known of the trousers'
    return clothes.colours[:, 0], clothes.weights[:, 0]


def known(*parts):
    return np.array(parts, bool)


def test_the_pixels_show_shirt_and_trousers():
    frame = render(pinhole(480, 270), [Person(1, 0.1, 2.6, standing(), shirt=(200, 20, 20), trousers=(20, 200, 20)),
                                       Person(2, -1.0, 2.6, standing(), shirt=(20, 20, 200), trousers=(90, 90, 90))],
                   Room(wall=4.0))
    pixels = appearance.clothes_pixels(frame.people.xy)
    for part, expected in zip((pixels[:, :12], pixels[:, 12:]),
                              (((200, 20, 20), (20, 20, 200)), ((20, 200, 20), (90, 90, 90)))):
        u, v = np.rint(part).astype(int).transpose(2, 0, 1)
        for person, colour in enumerate(expected):
            assert (frame.owner[v, u][person] == person).all()
            # the picture has noise of 8 grey levels, and the hips' edge is between both
            good = (np.abs(frame.bgr[v, u][person].astype(int) - colour) <= 8).all(axis=1)
            assert good.mean() >= 0.8


@pytest.mark.parametrize('bgr', LAB, ids=str)
def test_colours_are_cielab(bgr):
    lab, weight = colours(picture(bgr), [[[3.0, 4.0], [5.4, 8.6]]], known([True, True]))
    np.testing.assert_allclose(lab[0], LAB[bgr], atol=0.1)
    assert weight.tolist() == [1]
