"""Tables of motors, what a cycle asks of them, and the pick against one by hand."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from pkm_gym.core.drives import Drives
from pkm_gym.core.motor_choice import fit, fits, motor_torques, pick
from pkm_gym.core.motors import DIRECT, Gear, Motor, MotorTable, read_motors

MOTOR = Motor("one", torque=2.0, torque_peak=6.0, speed=300.0, inertia=1e-4, mass=2.0)
GEAR = Gear("ten", 10.0, torque_peak=80.0, speed=400.0, efficiency=0.9, inertia=2e-5, mass=1.0)
SWING, PACE, HEAVY, WEIGHT = 0.8, 12.0, 0.3, 4.0  # rad, rad/s, kg m^2, N m


def swinging(scale: float = 1.0, n: int = 2001) -> Drives:
    """A body of inertia HEAVY with a weight, that swings as SWING sin(PACE t), beside its half."""
    t = np.linspace(0.0, 2.0 * np.pi / PACE, n)
    rate = SWING * PACE * np.cos(PACE * t)
    acceleration = -SWING * PACE**2 * np.sin(PACE * t)
    torque = scale * (HEAVY * acceleration + WEIGHT)
    both = np.stack([np.ones(n), np.full(n, 0.5)], axis=1)
    return Drives(t[-1], torque[:, None] * both, rate[:, None] * both, acceleration[:, None] * both)


@pytest.fixture
def written(tmp_path: Path) -> Any:
    """A function that writes a table, with entries' lines replaced."""

    def write(**changed: str) -> Path:
        lines = {
            "motor": '[[motor]]\nname = "m"',
            "torque": 'torque = "1.3 N m"',
            "peak": "torque_peak = 3.9",
            "speed": 'speed = "3000rpm"',
            "inertia": 'inertia = "0.3 kg cm^2"',
            "mass": 'mass = "900g"',
            "gear": '[[gear]]\nname = "g"',
            "ratios": "ratios = [5, 7.5]",
            "bears": "torque_peak = 30",
            "input": "speed = 500",
            "efficiency": "efficiency = 0.97",
            "own": "inertia = 1e-5",
            "weighs": "mass = 0.7",
        } | changed
        path = tmp_path / "motors.toml"
        path.write_text("\n".join(lines.values()), encoding="utf-8")
        return path

    return write


def test_a_table_has_numbers_in_si_and_texts_with_units(written: Any) -> None:
    (motor,), gears = read_motors(written())
    expected = Motor("m", 1.3, 3.9, 100.0 * np.pi, 3e-5, 0.9)
    for name in ("torque", "torque_peak", "speed", "inertia", "mass"):
        assert getattr(motor, name) == pytest.approx(getattr(expected, name), rel=1e-12)
    assert gears == tuple(Gear("g", ratio, 30.0, 500.0, 0.97, 1e-5, 0.7) for ratio in (5.0, 7.5))


def test_a_table_needs_no_gears(written: Any) -> None:
    path = written()
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("[[gear]]")], encoding="utf-8")
    assert read_motors(path).gears == ()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"motor": '[[motr]]\nname = "m"'}, "unknown key 'motr'; did you mean 'motor'"),
        ({"torque": ""}, r"it lacks motor\[0\].torque"),
        ({"torque": 'torque = "1.3 kg"'}, "torque of motor 'm' is '1.3 kg': 'kg' is no unit of it"),
        ({"torque": "torque = 0"}, "torque of motor 'm' is 0: it must be greater than 0"),
        ({"torque": "torque = true"}, "torque of motor 'm' is True: it must be a number, or a"),
        ({"torque": "torque = inf"}, "torque of motor 'm' is inf: it must be a number"),
        ({"peak": "torque_peak = 1"}, "torque_peak of motor 'm' is 1 N m: it must be at least its"),
        ({"speed": 'speed = "fast"'}, "speed of motor 'm' is 'fast': it must be a finite number"),
        ({"ratios": "ratios = []"}, r"the ratios of gear 'g' are \[\]: they must be numbers from"),
        ({"ratios": "ratios = [0.5]"}, r"the ratios of gear 'g' are \[0.5\]"),
        ({"efficiency": "efficiency = 1.2"}, "the efficiency of gear 'g' is 1.2: it must be at"),
        ({"mass": 'mass = 1\n[[motor]]\nname = "m"\ntorque = 1\ntorque_peak = 1\nspeed = 1\n'
          "inertia = 1\nmass = 1"}, "it names m twice"),
        ({"weighs": "mass = "}, "it is no TOML"),
    ],
)  # fmt: skip
def test_a_bad_table_is_refused_in_one_sentence(
    written: Any, changed: dict[str, str], sentence: str
) -> None:
    path = written(**changed)
    with pytest.raises(ValueError, match=sentence) as refused:
        read_motors(path)
    assert str(refused.value).startswith(f"'{path}' is no motor table: ")
    assert "\n" not in str(refused.value)


def test_an_empty_table_or_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "motors.toml"
    with pytest.raises(ValueError, match=r"can't read the motor table .*: No such file"):
        read_motors(path)
    path.write_text("motor = []", encoding="utf-8")
    with pytest.raises(ValueError, match=r"it has no \[\[motor\]\]"):
        read_motors(path)


def test_the_shipped_table_goes_from_light_to_heavy_and_from_weak_to_strong() -> None:
    motors, gears = read_motors()
    assert len(motors) > 5
    assert list(motors) == sorted(motors, key=lambda one: one.mass)
    assert list(motors) == sorted(motors, key=lambda one: one.torque)
    assert {gear.mass for gear in gears} == {gear.mass for gear in gears if gear.ratio == 3.0}


# What a cycle asks --------------------------------------------------------------------------------


def test_without_losses_a_motor_gives_the_power_of_the_drive_and_of_its_rotor() -> None:
    drives = swinging()
    lossless = Gear("ten", 10.0, 80.0, 400.0, 1.0, 2e-5, 1.0)
    given = motor_torques(drives, MOTOR, lossless) * 10.0 * drives.rates
    spinning = 0.5 * (1e-4 + 2e-5) * (10.0 * drives.rates) ** 2
    time = np.linspace(0.0, drives.duration, len(spinning))
    gained = np.gradient(spinning, time, axis=0, edge_order=2)
    np.testing.assert_allclose(given, drives.torques * drives.rates + gained, atol=1e-3)


def test_a_gear_loses_whichever_side_drives() -> None:
    drives = swinging()
    still = Motor("still", 2.0, 6.0, 300.0, 0.0, 2.0)
    massless = Gear("ten", 10.0, 80.0, 400.0, 0.9, 0.0, 1.0)
    given = motor_torques(drives, still, massless) * 10.0 * drives.rates
    power = drives.torques * drives.rates
    lost = given - power
    assert lost.min() >= -1e-12
    np.testing.assert_allclose(lost[power > 0.0], power[power > 0.0] * (1.0 / 0.9 - 1.0))
    np.testing.assert_allclose(lost[power < 0.0], -0.1 * power[power < 0.0])


def test_a_fit_asks_what_the_worse_drive_does() -> None:
    demands = {one.what: one for one in fit(swinging(), MOTOR, GEAR).demands}

    def torque(t: float) -> float:
        rate, acceleration = SWING * PACE * np.cos(PACE * t), -SWING * PACE**2 * np.sin(PACE * t)
        load = HEAVY * acceleration + WEIGHT
        share = 1.0 / 0.9 if load * rate >= 0.0 else 0.9
        return 1.2e-4 * 10.0 * acceleration + share * load / 10.0

    end = 2.0 * np.pi / PACE
    jumps = np.arcsin(WEIGHT / (HEAVY * SWING * PACE**2)) / PACE
    points = sorted(t % end for t in (jumps, 0.5 * end - jumps, 0.25 * end, 0.75 * end))
    square = quad(lambda t: torque(t) ** 2, 0.0, end, points=points, limit=200)[0] / end
    assert demands["rms torque"].asked == pytest.approx(np.sqrt(square), rel=1e-3)
    peak = max(abs(torque(t)) for t in np.linspace(0.0, end, 20_001))
    assert demands["peak torque"].asked == pytest.approx(peak, rel=1e-3)
    assert demands["speed"].asked == pytest.approx(10.0 * SWING * PACE, rel=1e-9)
    assert demands["gear torque"].asked == pytest.approx(HEAVY * SWING * PACE**2 + WEIGHT, rel=1e-5)
    assert [one.given for one in demands.values()] == [6.0, 2.0, 300.0, 80.0, 400.0]
    assert fit(swinging(), MOTOR, GEAR).inertia == pytest.approx(100.0 * 1.2e-4)


def picked_by_hand(drives: Drives, table: MotorTable) -> tuple[str, str, float] | None:
    """The lightest motor that carries it, its lightest gear, the ratio with the most in reserve."""
    found = []
    for motor, gear in product(table.motors, (DIRECT, *table.gears)):
        shares = []
        for j in range(drives.torques.shape[1]):
            load, rate = drives.torques[:, j], drives.rates[:, j]
            share = np.where(load * rate >= 0.0, 1.0 / gear.efficiency, gear.efficiency)
            own = (motor.inertia + gear.inertia) * gear.ratio * drives.accelerations[:, j]
            torque = own + share * load / gear.ratio
            mean = (torque[:-1] ** 2 + torque[1:] ** 2).sum() / (2.0 * (len(torque) - 1))
            fastest = gear.ratio * max(abs(rate))
            shares += [max(abs(torque)) / motor.torque_peak, np.sqrt(mean) / motor.torque]
            shares += [fastest / motor.speed, fastest / gear.speed]
            shares += [max(abs(load)) / gear.torque_peak]
        if max(shares) <= 1.0:
            found.append((motor.mass, gear.mass, max(shares), motor.name, gear.name, gear.ratio))
    return min(found)[3:] if found else None


def test_the_pick_is_the_one_by_hand() -> None:
    table, seen = read_motors(), set()
    for scale in np.geomspace(0.003, 30.0, 25):
        drives = swinging(scale, 301)
        best = pick(fits(drives, table))
        answer = best and (best.motor.name, best.gear.name, best.gear.ratio)
        assert answer == picked_by_hand(drives, table)
        seen.add(answer)
    assert None in seen
    assert len(seen) > 5


def test_of_a_motor_that_is_too_weak_the_closest_gear_is_told() -> None:
    drives, table = swinging(30.0, 301), read_motors()
    for one in fits(drives, table):
        assert not one.carries
        gears = (DIRECT, *table.gears)
        assert one.load == min(fit(drives, one.motor, gear).load for gear in gears)
