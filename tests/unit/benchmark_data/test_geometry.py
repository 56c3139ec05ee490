"""Rotations, limbs, cameras and boxes of the rendered scenes."""
import numpy as np
import pytest

from development.benchmark_data.people.geometry import align, frame_of, heading, rotation, two_bones, unit
from development.benchmark_data.rendering.camera import Camera, Intrinsics
from development.benchmark_data.rendering.room import Box

MODEL = Intrinsics(640, 480, 540.0, 540.0, 319.5, 239.5)


@pytest.mark.parametrize('end', [(0, 0, 1), (1, -2, 0.5), (-1, 0.2, 0.1), (-1, 0, 0)])
def test_align_takes_a_direction_to_another(end):
    turn = align((1, 0, 0), end)
    assert turn @ [1, 0, 0] == pytest.approx(unit(end), abs=1e-9)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-9) and np.linalg.det(turn) == pytest.approx(1)


def test_frame_is_a_rotation():
    frame = frame_of((1, 2, 0), np.array([0.3, 0.1, 1.0]))
    assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-9) and np.linalg.det(frame) == pytest.approx(1)


def test_two_bones_end_at_their_target_bent_towards_the_pole():
    start, end, pole = np.array([0.1, 0.2, 1.4]), np.array([0.3, -0.1, 1.1]), np.array([0, 0, -1.0])
    upper, lower = two_bones(start, end, (0.3, 0.26), pole)
    assert start + 0.3 * upper + 0.26 * lower == pytest.approx(end, abs=1e-6)
    line = unit(end - start)
    assert (upper - line * (upper @ line)) @ pole > 0


def test_two_bones_stretch_towards_a_target_out_of_reach():
    upper, lower = two_bones(np.zeros(3), np.array([2.0, 0, 0]), (0.3, 0.3), np.array([0, 1.0, 0]))
    assert upper[0] > 0.99 and lower[0] > 0.99


@pytest.mark.parametrize(('step', 'yaw'), [((0, -1), 0), ((1, 0), 90), ((-1, 0), -90)])
def test_heading_and_the_direction_of_a_person(step, yaw):
    assert heading(*step) == pytest.approx(yaw)
    assert (rotation('z', yaw) @ [0, -1, 0])[:2] == pytest.approx(step, abs=1e-9)


def test_camera_projects_what_its_rays_hit():
    camera = Camera(MODEL, 1.4, 8, x=0.3, y=-0.2, yaw=20)
    pixels = np.array([[10, 20], [319.5, 239.5], [600, 400]])
    points = camera.origin + 2.5 * camera.rays(pixels[:, 0], pixels[:, 1])
    local = camera.to_camera(points)
    assert local[:, 2] == pytest.approx(2.5, abs=1e-5)
    assert camera.project(local) == pytest.approx(pixels, abs=1e-3)
    assert (camera.pose() @ np.append(local[0], 1))[:3] == pytest.approx(points[0], abs=1e-5)
    assert camera.rays(*np.array([[319.5], [239.5]]))[0, 2] < 0  # it looks down


def test_halved_images_show_the_same():
    """Pixel (u, v) covers half a pixel at ((u + 0.5) / 2 - 0.5) of the smaller image."""
    point = np.array([0.4, -0.3, 2.0])
    full, half = (Camera(model, 1.4, 0).project(point) for model in (MODEL, MODEL.halved()))
    assert half == pytest.approx((full + 0.5) / 2 - 0.5)


def test_box_contains_and_distance():
    box = Box(1.0, 3.0, 2.0, 0.5, 90, 0.0, 0.8)  # turned: 2 m along y
    inside = box.contains(np.array([[1.0, 3.9, 0.4], [1.9, 3.0, 0.4], [1.0, 3.0, 0.9]]))
    assert inside.tolist() == [True, False, False]
    assert box.contains(np.array([[1.0, 3.0, 0.9]]), margin=-0.2).all()
    assert box.distance(1.0, 3.5) == 0 and box.distance(2.0, 3.0) == pytest.approx(0.75)
