"""What the Diamond's bodies weigh: presets of its paper, and numbers of one's own over them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

from pkm_gym.core.options import Options, option
from pkm_gym.core.reference import Reference

PRINTED = "printed"
MASSES = ("m_arm", "mu1", "m_rod", "mu2", "m_d", "m_p", "motor")  # options that are a preset's, too
# A body's mass has one source: a number, one a length, or density and section.
SOURCES = {"arm": ("m_arm", "mu1"), "rod": ("m_rod", "mu2")}


@dataclass(frozen=True)
class Inertia:
    """A preset of paper.toml: its numbers are named as dynamics.py names them."""

    doc: str
    motor: float
    mu1: float
    mu2: float
    m_d: float
    m_p: float
    arm: float
    rod_elbow: float
    rod_platform: float
    m_arm: float = 0.0
    m_rod: float = 0.0


def presets() -> dict[str, Inertia]:
    """Return the inertia presets by name."""
    return Reference.load("pkm_gym.mechanisms.diamond").table("inertia", dict[str, Inertia])


@dataclass(frozen=True)
class MassOptions(Options):
    """The preset, what is one's own instead of its numbers, and what the motors can give."""

    inertia: str = option(
        PRINTED, "preset of paper.toml, for the masses below that aren't given", choices=presets
    )
    m_arm: float | None = option(
        None,
        "mass of an arm without its elbow, whatever its length",
        unit="kg",
        low=1e-3,
        high=50.0,
    )
    mu1: float | None = option(
        None, "the same over its length: it grows with the arm", unit="kg/m", low=1e-3, high=100.0
    )
    arm_density: float | None = option(
        None, "of the arms' material; with arm_section", unit="kg/m^3", low=10.0, high=3e4
    )
    arm_section: float | None = option(
        None, "cross-section of an arm; with arm_density", unit="m^2", low=1e-6, high=0.01
    )
    m_rod: float | None = option(
        None, "mass of one of a limb's two rods, whatever its length", unit="kg", low=0.0, high=50.0
    )
    mu2: float | None = option(
        None, "the same over its length: it grows with the rod", unit="kg/m", low=0.0, high=100.0
    )
    rod_density: float | None = option(
        None, "of the rods' material; with rod_section", unit="kg/m^3", low=10.0, high=3e4
    )
    rod_section: float | None = option(
        None, "cross-section of a rod; with rod_density", unit="m^2", low=1e-6, high=0.01
    )
    m_d: float | None = option(None, "mass of an elbow", unit="kg", low=0.0, high=50.0)
    m_p: float | None = option(
        None, "mass of the platform without payload", unit="kg", low=1e-3, high=50.0
    )
    motor: float | None = option(
        None, "inertia of motor and gear about a drive's axis", unit="kg m^2", low=0.0, high=10.0
    )
    torque_max: float | None = option(
        None,
        "a limit, if given: peak torque of a drive over the cycle",
        unit="N m",
        low=1e-3,
        high=1e5,
    )
    rms_max: float | None = option(
        None,
        "a limit, if given: rms torque of a drive over the cycle",
        unit="N m",
        low=1e-3,
        high=1e5,
    )
    speed_max: float | None = option(
        None, "a limit, if given: rate of an arm over the cycle", unit="rad/s", low=1e-3, high=1e5
    )
    power_max: float | None = option(
        None, "a limit, if given: power of a drive over the cycle", unit="W", low=1e-3, high=1e7
    )

    def __post_init__(self) -> None:
        """Refuse an illegal value, half a material, and a body's mass that is said twice.

        Raises:
            ValueError: naming the options.
        """
        Options.__post_init__(self)
        for body, names in SOURCES.items():
            material = (f"{body}_density", f"{body}_section")
            given = [name for name in (*names, *material) if getattr(self, name) is not None]
            half = [name for name in material if name in given]
            if len(half) == 1:
                (other,) = set(material) - set(half)
                raise ValueError(f"{half[0]} says no mass without {other}: give both")
            if len(given) > max(1, len(half)):
                raise ValueError(
                    f"{' and '.join(given)} say twice what {body}s weigh: give one, or density "
                    "and section"
                )

    @property
    def own_masses(self) -> bool:
        """Whether arms or rods have masses of one's own."""
        names = [*SOURCES["arm"], *SOURCES["rod"], "arm_section", "rod_section"]
        return any(getattr(self, name) is not None for name in names)


def chosen_inertia(options: MassOptions) -> Inertia:
    """Return the options' preset with what is given instead of its numbers."""
    given = {name: x for name in MASSES if (x := getattr(options, name)) is not None}
    for body, (mass, per_length) in SOURCES.items():
        density, section = (getattr(options, f"{body}_{what}") for what in ("density", "section"))
        if density is not None:
            given[per_length] = density * section
        if mass in given:
            given[per_length] = 0.0
    return replace(presets()[options.inertia], **given)


def numbers(inertia: Inertia, names: tuple[str, ...]) -> list[float]:
    """Return an inertia's numbers in an order."""
    table = asdict(inertia)
    return [table[name] for name in names]
