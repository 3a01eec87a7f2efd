"""Chapter 10: contacts together: balance, the zero-moment point and its areas."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from wfbook.omni.support import (
    Contact,
    axes_on,
    balance,
    gravity_wrench,
    inside,
    shadow,
    support_area,
    zmp,
)
from wfbook.omni.wrench import line_contact, line_ends, point_contact

MU, WIDTH = 0.5, 0.06
CORNERS = np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]])


def wheels(mu=MU, heading=0.0, places=CORNERS):
    return [
        Contact(np.array([x, y, 0.0]), axes_on((0, 0, 1), heading), line_contact(mu, WIDTH))
        for x, y in places
    ]


def hull(points):
    return np.array(points)[ConvexHull(points).vertices]


def same(area, other):
    """Whether each corner of one polygon is a corner of the other."""
    gaps = np.linalg.norm(np.asarray(area)[:, None] - np.asarray(other), axis=2)
    return len(area) == len(other) and gaps.min(axis=0).max() < 1e-6 and gaps.min(axis=1).max() < 1e-6


def wall(mu=0.6, place=(0.8, 0.0, 0.7)):
    """A hand on a wall that faces the robot."""
    return Contact(np.array(place), axes_on((-1, 0, 0)), point_contact(mu))


def random_forces(random, contacts):
    """Points of all contacts, and forces in the friction pyramids there, in the world."""
    points, forces = [], []
    for contact in contacts:
        line = len(contact.cone.A) == 10
        for end in line_ends(WIDTH) if line else np.zeros((1, 3)):
            press = random.exponential()
            mu = MU if line else 0.6
            points.append(contact.position + contact.R_wc @ end)
            forces.append(contact.R_wc @ [*(mu * press * random.uniform(-1, 1, 2)), press])
    return np.array(points), np.array(forces)


@pytest.mark.parametrize("heading", [0.0, 0.7, np.pi / 2])
@pytest.mark.parametrize("mu", [0.05, 0.8])
def test_on_the_level_the_full_area_is_the_support_polygon_whatever_the_friction(heading, mu):
    contacts = wheels(mu, heading)
    ends = [(c.position + c.R_wc @ end)[:2] for c in contacts for end in line_ends(WIDTH)]
    area = support_area(contacts)
    assert same(area, hull(ends))
    assert same(support_area(contacts, "static"), area)


def test_friction_cuts_the_pendular_area():
    com = np.array([0.25, 0.1, 0.5])
    polygon = support_area(wheels())
    assert same(support_area(wheels(2.0), "pendular", com), polygon), "enough friction: the whole polygon"
    area = support_area(wheels(0.1), "pendular", com)
    reach = np.abs(area - com[:2]).max(axis=0)
    assert (reach <= 0.05 + 1e-6).all(), "no further than μ times the height"
    assert all(inside(corner, polygon) for corner in area) and len(area) >= 4


def test_every_wrench_of_real_forces_has_its_point_in_the_full_area():
    random = np.random.default_rng(0)
    contacts = [*wheels(), wall()]
    area = support_area(contacts, height=0.1)
    assert len(area) >= 3
    for _ in range(300):
        points, forces = random_forces(random, contacts)
        total = np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])
        if total[2] > 0.1 and np.abs(zmp(total, 0.1)).max() < 5.0:
            assert inside(zmp(total, 0.1), area, 1e-6)


def test_where_the_static_area_ends_nothing_balances():
    contacts = [*wheels(0.5), wall()]
    area = support_area(contacts, "static")
    ground = support_area(wheels(0.5), "static")
    assert any(not inside(corner, ground) for corner in area), "the hand supports beyond the wheels"
    middle = area.mean(axis=0)
    for corner in area:
        for share, holds in ((0.999, True), (1.001, False)):
            com = np.array([*(middle + share * (corner - middle)), 0.6])
            found = balance(contacts, gravity_wrench(com, weight=300.0))
            assert (found is not None) == holds


def test_balance_balances_within_the_cones():
    """Eqs 10 and 11."""
    contacts = [*wheels(), wall()]
    outside = gravity_wrench(np.array([0.2, 0.05, 0.5]), np.array([0.1, -0.05, 0.0]), 300.0)
    wrenches = balance(contacts, outside)
    total = sum(contact.G @ wrench for contact, wrench in zip(contacts, wrenches, strict=True))
    assert total + outside == pytest.approx(np.zeros(6), abs=1e-6)
    for contact, wrench in zip(contacts, wrenches, strict=True):
        assert contact.cone.admits(wrench, 1e-6)
    assert balance(contacts, gravity_wrench(np.array([5.0, 0, 0.5]), weight=300.0)) is None


def test_the_zero_moment_point():
    random = np.random.default_rng(1)
    points = np.column_stack([random.uniform(-1, 1, (6, 2)), np.zeros(6)])
    press = random.uniform(1, 5, 6)
    forces = np.column_stack([random.normal(size=(6, 2)), press])
    total = np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])
    assert zmp(total) == pytest.approx(press @ points[:, :2] / press.sum()), "the centre of pressure"
    for height in (-0.3, 0.0, 0.4):  # horizontal moments about it vanish: the property it has its name from
        at = np.array([*zmp(total, height), height])
        assert (total[3:] - np.cross(at, total[:3]))[:2] == pytest.approx([0, 0], abs=1e-12)


def test_at_rest_the_point_is_below_the_centre_of_mass_and_runs_away_from_acceleration():
    com = np.array([0.1, -0.05, 0.5])
    assert zmp(-gravity_wrench(com)) == pytest.approx(com[:2])
    assert zmp(-gravity_wrench(com, np.array([0.2, 0, 0]))) == pytest.approx([0.1 - 0.5 * 0.2, -0.05])


def test_areas_turn_and_shift_with_the_contacts():
    angle, shift = 0.4, np.array([0.2, -0.3])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    places, com = CORNERS[:3], np.array([0.0, 0.0, 0.5])
    area = support_area(wheels(0.2, places=places), "pendular", com)
    moved = support_area(
        wheels(0.2, angle, places @ turn.T + shift), "pendular", np.array([*(turn @ com[:2] + shift), 0.5])
    )
    assert same(moved, area @ turn.T + shift)


def test_two_wheels_in_line_support_a_line_and_a_hanging_robot_nothing():
    one = support_area(wheels(places=CORNERS[:2], heading=0.0))
    assert len(one) == 2 and np.ptp(one[:, 1]) == pytest.approx(0.4 + WIDTH)
    ceiling = [Contact(np.zeros(3), axes_on((0, 0, -1)), point_contact(0.5))]
    assert support_area(ceiling).shape == (0, 2)
    assert not inside(np.zeros(2), one)


def test_a_shadow_takes_few_questions():
    random = np.random.default_rng(2)
    points = random.normal(size=(60, 2))
    asked = []

    def outermost(direction):
        asked.append(direction)
        return points[np.argmax(points @ direction)]

    area = shadow(outermost)
    assert same(area, hull(points)) and len(asked) < 3 * len(area) + 2
    edge, after = np.roll(area, -1, axis=0) - area, np.roll(area, -2, axis=0) - np.roll(area, -1, axis=0)
    assert (edge[:, 0] * after[:, 1] > edge[:, 1] * after[:, 0]).all(), "counter-clockwise"
    assert len(shadow(lambda d: np.array([0.0, np.sign(d[1])]))) == 2, "a vertical line"
    assert len(shadow(lambda d: np.ones(2))) == 1, "a point"


def test_axes_on_a_surface_are_right_handed():
    for normal in ((0, 0, 1), (-1, 0, 0), (0.2, -0.1, 2.0)):
        R = axes_on(normal, 0.3)
        assert np.allclose(R.T @ R, np.eye(3)) and np.linalg.det(R) == pytest.approx(1.0)
        assert R[:, 2] == pytest.approx(np.array(normal) / np.linalg.norm(normal))
    assert axes_on((-1, 0, 0))[:, 0] == pytest.approx([0, 0, 1])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"kind": "round"}, "kind: 'round'"),
        ({"kind": "pendular"}, "com: "),
        ({"kind": "pendular", "com": np.zeros(3)}, "com: "),
    ],
)
def test_wrong_areas(arguments, message):
    with pytest.raises(ValueError, match=message):
        support_area(wheels(), **arguments)
    with pytest.raises(ValueError, match="contacts: there is none"):
        support_area([])


def test_where_the_pendular_area_ends_nothing_balances():
    contacts = wheels(0.3)
    com = np.array([0.1, 0.05, 0.45])
    area = support_area(contacts, "pendular", com)
    middle = area.mean(axis=0)
    for corner in area:
        for share, holds in ((0.999, True), (1.001, False)):
            point = middle + share * (corner - middle)
            acceleration = np.array(
                [*(com[:2] - point) / com[2], 0.0]
            )  # of the linear pendulum, in units of g
            outside = gravity_wrench(com, acceleration, 300.0)
            assert zmp(-outside) == pytest.approx(point)
            assert (balance(contacts, outside) is not None) == holds
