"""Records: names for the numbers of a row, the same for Python, numpy and compiled code."""

import copy
import pickle
from dataclasses import dataclass, field

import numpy as np
import pytest
from jaxtyping import Float, Int

from go2_wbc.compilation import kernel, plain
from go2_wbc.records import Record, layout_of, packed


class Wheel(Record):
    place: Float[np.ndarray, "3"]
    turns: float


class Cart(Record):
    __slots__ = ("driver",)
    driver: str
    time: float
    is_loaded: bool
    axes: Float[np.ndarray, "2 3"]
    wheels: tuple[Wheel, Wheel]
    spare: Wheel


@dataclass(frozen=True, slots=True)
class Gains:
    kp: tuple[float, float, float] = (1.0, 2.0, 3.0)
    kd: float = 4.0


@dataclass(frozen=True, slots=True)
class Numbers:
    gains: Gains = field(default_factory=Gains)
    mass: float = 5.0
    hips: Float[np.ndarray, "2 2"] = field(default_factory=lambda: np.eye(2))


@kernel
def drive(cart: Cart, c: Numbers) -> bool:
    """Touch every kind of part."""
    cart.time += c.gains.kd
    cart.is_loaded = cart.time > c.mass
    for n in range(2):
        wheel = cart.wheels[n]
        wheel.turns += c.gains.kp[n]
        wheel.place[:] = cart.axes[n]
    cart.spare.place[2] = c.hips[1, 1]
    return cart.is_loaded and not cart.spare.turns > 0.0


def test_the_parts_of_a_record_are_places_in_its_row_for_compiled_code_too() -> None:
    cart = Cart(time=1.5, axes=np.arange(6.0).reshape(2, 3))
    cart.wheels[1].place[:] = 7.0, 8.0, 9.0
    cart.is_loaded = True
    cart.spare.turns = 3.0
    assert cart.row.tolist() == [1.5, 1, *range(6), *[0.0] * 4, 7.0, 8.0, 9.0, 0.0, *[0.0] * 3, 3.0]
    assert cart.is_loaded is True
    assert Cart.of(cart.row).spare.turns == 3.0
    carts = [Cart(time=1.5, axes=np.arange(6.0).reshape(2, 3)) for _ in range(2)]
    numbers = packed(Numbers())
    compiled, written = drive(carts[0], numbers), plain(drive)(carts[1], numbers)
    assert compiled is written is True
    np.testing.assert_array_equal(carts[0].row, carts[1].row)
    assert carts[0].wheels[1].turns == 2.0
    assert carts[0].spare.place[2] == 1.0


def test_a_packed_dataclass_is_the_same_value_and_a_copy_has_its_own() -> None:
    numbers = packed(Numbers(mass=6.0))
    assert isinstance(numbers, Numbers)
    assert (numbers.mass, numbers.gains.kd) == (6.0, 4.0)
    assert [*numbers.gains.kp] == [1.0, 2.0, 3.0]
    with pytest.raises(AttributeError):
        numbers.mass = 7.0  # type: ignore[misc]
    cart = Cart(time=1.0)
    for other in (copy.deepcopy(cart), pickle.loads(pickle.dumps(cart))):
        assert isinstance(other, Cart)
        other.time = 2.0
    assert cart.time == 1.0


def test_what_a_record_has_not_or_cannot_hold_is_refused_by_name() -> None:
    cart = Cart()
    with pytest.raises(AttributeError, match="Cart has no part 'tme'"):
        cart.tme = 1.0
    with pytest.raises(TypeError, match="Cart has no part 'tme'"):
        Cart(tme=1.0)
    with pytest.raises(AttributeError):
        cart.axes = np.zeros((2, 3))  # compiled code could not exchange it either

    class Counted(Record):
        steps: Int[np.ndarray, "3"]

    with pytest.raises(TypeError, match=r"Counted\.steps is declared as .*no row of numbers holds"):
        Counted()


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"axes": np.zeros((3, 2))}, r"axes must have the shape \(2, 3\), got \(3, 2\)"),
        ({"wheels": [Wheel()]}, "wheels must be 2 values, got 1"),
        ({"time": "noon"}, "time must hold numbers, got 'noon'"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(values: dict[str, object], told: str) -> None:
    with pytest.raises((TypeError, ValueError), match=told):
        Cart(**values)


def test_a_number_is_told_by_its_name_and_all_in_a_line() -> None:
    layout = layout_of(Cart)
    assert layout.place(0) == ("time", "")
    assert layout.place(layout.slice("axes").start + 4) == ("axes", "[1, 1]")
    assert layout.place(layout.slice("wheels").start + 6) == ("wheels[1].place", "[2]")
    assert layout.place(layout.size - 1) == ("spare.turns", "")
    said = repr(Cart(time=0.25))
    assert said.startswith("Cart(time=0.25, is_loaded=False, axes=<2 x 3>")
    assert "spare=Wheel(place=(0, 0, 0), turns=0)" in said
