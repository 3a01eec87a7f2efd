"""Chapter 1's widgets are driven by their traits; what they draw obeys eqs 1, 8 and 9."""

import numpy as np
import pytest

from wfbook.centroidal import GRAVITY
from wfbook.modes import LEGS
from wfbook.view.style import FOOT, SWING
from wfbook.view.widgets.centroidal import ForcesAndFeet, SquaresAsBounds, TightOrNot, WhereToStand


def drawn(axes, gid):
    """The data of the line of that name."""
    (line,) = [line for line in axes.lines if line.get_gid() == gid]
    return np.array(line.get_data())


def bars(axes):
    return [bar.get_height() for bar in axes.patches]


@pytest.fixture(scope="module")
def pushes():
    return ForcesAndFeet()


def show(pushes, example):
    pushes.example.value = example
    pushes.again.click()
    return pushes.board.picture.axes


def test_standing_nothing_moves(pushes):
    view, speed, spin = show(pushes, "stand")
    assert np.ptp(drawn(view, "CoM path"), axis=1) == pytest.approx(0.0, abs=1e-9)
    assert drawn(spin, "pitch momentum")[1] == pytest.approx(0.0, abs=1e-9)
    assert drawn(speed, "vz")[1] == pytest.approx(0.0, abs=1e-9)
    assert drawn(view, "line of action")[0] == pytest.approx(0.0, abs=1e-9), "through the CoM"


def test_a_force_that_is_dragged_moves_and_turns(pushes):
    show(pushes, "stand")
    x, z = pushes.board.points["front force"]
    pushes.board.move("front force", x + 0.05, z)
    push = pushes.forces()[0, 0]
    view, speed, spin = pushes.board.picture.axes
    assert push > 0.0
    assert drawn(speed, "vx")[1, -1] == pytest.approx(0.3 * push / pushes.robot.mass)
    assert pushes.motion.torque[0, 1] == pytest.approx(-push * pushes.robot.height, rel=0.05), "nose up"
    assert drawn(spin, "pitch momentum")[1, 1] < 0.0
    assert drawn(view, "CoM path")[0, -1] > 0.0
    assert "nose up" in pushes.status.value


def test_a_foot_takes_its_force_along(pushes):
    show(pushes, "stand")
    forces = pushes.forces()
    pushes.board.move("rear foot", -0.1, 0.3)
    assert pushes.board.points["rear foot"] == [-0.1, 0.0], "feet stay on the ground"
    np.testing.assert_allclose(pushes.forces(), forces, atol=1e-9)
    assert pushes.motion.torque[0, 1] < 0.0, "all pushes together act ahead of the CoM: the nose comes up"


def test_load_on_the_rear_feet_takes_the_turning_out_of_a_push(pushes):
    torque = {}
    for example in ("set off, load as it was", "set off, load on the rear feet"):
        show(pushes, example)
        torque[example] = pushes.motion.torque[0, 1]
    first, second = torque.values()
    assert first < -2.0 and abs(second) < 0.05 * abs(first) + 0.1


def test_let_go_it_falls_and_does_not_turn(pushes):
    view, speed, spin = show(pushes, "let go")
    assert drawn(speed, "vz")[1, -1] == pytest.approx(-0.3 * GRAVITY)
    assert not drawn(spin, "pitch momentum")[1].any()
    assert "line of action" not in [line.get_gid() for line in view.lines]


@pytest.fixture
def above():
    return WhereToStand()


def test_four_legs_share_the_weight(above):
    assert above.forces == pytest.approx(above.robot.weight / 4, rel=1e-3)
    assert bars(above.board.picture.axes[1]) == pytest.approx([0.0, 0.0], abs=1e-3)
    above.board.move("CoM", 0.1, 0.05)
    assert above.forces.sum() == pytest.approx(above.robot.weight) and above.forces[0] == above.forces.max()
    assert bars(above.board.picture.axes[1]) == pytest.approx([0.0, 0.0], abs=1e-2)


def test_a_diagonal_pair_carries_on_its_line_only(above):
    above.stands[0].value = above.stands[3].value = False
    assert above.forces[[0, 3]] == pytest.approx(0.0) and "do not turn" in above.status.value
    assert above.board._colours == {"CoM": "#0072B2", "FL": SWING, "FR": FOOT, "RL": FOOT, "RR": SWING}
    above.board.move("CoM", *0.5 * above.robot.stance[1])
    assert "do not turn" in above.status.value
    above.board.move("CoM", 0.0, 0.05)
    roll, pitch = bars(above.board.picture.axes[1])
    assert roll < -1.0 and pitch > 0.0, "to its left and forward: away from the line"
    assert "rolls to its left and pitches nose down" in above.status.value


def test_the_centre_of_pressure_is_where_the_polygon_is_nearest(above):
    above.board.move("CoM", 0.25, 0.0)
    pressure = drawn(above.board.picture.axes[0], "centre of pressure")[:, 0]
    assert pressure == pytest.approx([above.robot.stance[0, 0], 0.0], abs=1e-3)


def test_without_legs_it_falls(above):
    for box in above.stands:
        box.value = False
    assert not above.forces.any() and "falls" in above.status.value
    assert {line.get_gid() for line in above.board.picture.axes[0].lines} >= {
        f"{leg} in the air" for leg in LEGS
    }


@pytest.fixture
def squares():
    return SquaresAsBounds()


def test_the_two_parabolas_differ_by_the_torque(squares):
    for scale in (6.0, 15.0, 30.0):
        squares.scale.value = scale
        halves = squares.pictures["bounds"].axes[0]
        up, down, line = (drawn(halves, gid) for gid in ("U+", "U-", "torque"))
        np.testing.assert_allclose(up[1] + down[1], line[1], atol=1e-9)
        np.testing.assert_allclose(line[1], squares.force.value * line[0], atol=1e-9)


def test_the_bounds_close_as_the_charge_rises(squares):
    slack = []
    for charge in (0.0, 0.5, 1.0, 2.0):
        squares.charge.value = charge
        halves, books, _ = squares.pictures["bounds"].axes
        slack.append(np.ptp(drawn(halves, "slack U+")[1]))
        assert bars(books)[0] == pytest.approx(6.0) and bars(books)[1] == pytest.approx(6.0 + slack[-1])
    assert slack == pytest.approx([6.0, 4.0, 2.0, 0.0]) and "tight" in squares.status.value


def test_less_torque_opens_the_other_bound(squares):
    squares.wanted.value = -10.0
    halves = squares.pictures["bounds"].axes[0]
    assert np.ptp(drawn(halves, "slack U+")[1]) == 0.0 and np.ptp(drawn(halves, "slack U-")[1]) > 0.0


def test_no_scale_charges_less_than_twice_the_torque(squares):
    axes = squares.pictures["bounds"].axes[2]
    charge, least = drawn(axes, "charge"), drawn(axes, "least")
    assert charge[1].min() == pytest.approx(least[1][0], rel=1e-3) == 12.0
    assert charge[0][charge[1].argmin()] == pytest.approx(np.sqrt(40.0 / 0.15), abs=0.2), "parts alike"


@pytest.fixture(scope="module")
def program():
    return TightOrNot()


def curves(program):
    _, bought, price = program.pictures["program"].axes
    return drawn(bought, "made by nothing")[1], drawn(price, "price")[1], drawn(price, "cap")[1]


@pytest.mark.parametrize(("legs", "braking", "pull"), [("all four", 3.0, 0.0), ("FL and RR", 0.0, 0.06)])
def test_torque_is_bought_where_its_price_is_at_the_cap_and_nowhere_else(program, legs, braking, pull):
    program.legs.value, program.braking.value, program.pull.value = legs, braking, pull
    bought, price, cap = curves(program)
    assert (price <= cap * 1.001).all()
    assert (bought[price < 0.98 * cap] < 0.02).all() and (
        price[bought > 0.1] > 0.999 * cap[bought > 0.1]
    ).all()
    assert bought[0] > 1.0 and bought[-1] < 0.01


def test_the_relaxed_cost_is_a_bound(program):
    program.legs.value, program.pull.value = "FL and RR", 0.06
    for charge in (0.001, 0.005, 0.1):
        program.charge.value = charge
        assert program.relaxed.cost <= program.true.cost + 1e-7
    assert (
        program.relaxed.cost == pytest.approx(program.true.cost, rel=1e-5) and "tight" in program.status.value
    )


def test_the_true_com_stays_on_the_line_of_two_feet(program):
    program.legs.value, program.braking.value, program.pull.value = "FL and RR", 0.0, 0.06
    program.charge.value = 0.005
    view = program.pictures["program"].axes[0]
    feet = program.robot.stance[[0, 3]]
    x, y = (feet[0] - feet[1]) / np.linalg.norm(feet[0] - feet[1])
    aside = {name: abs(np.array([-y, x]) @ drawn(view, name)[:, 0]) for name in ("relaxed", "true")}
    assert aside["true"] < 1e-3 < 0.01 < aside["relaxed"]


def test_over_the_middle_of_three_feet_nothing_is_bought(program):
    program.legs.value, program.braking.value, program.pull.value = "all but RR", 0.0, 0.0
    assert curves(program)[0] == pytest.approx(0.0, abs=0.01)
