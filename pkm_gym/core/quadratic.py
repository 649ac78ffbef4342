"""Where a quadratic model is highest: on a line, and over a rectangle."""

from __future__ import annotations

from pkm_gym.core.compile import formula


@formula
def clipped(value: float, low: float, high: float) -> float:
    """Return the value, or the end of [low, high] that it is beyond."""
    return min(high, max(low, value))


@formula
def highest_on_line(slope: float, bend: float, low: float, high: float) -> float:
    """Return where ``slope t + bend t^2 / 2`` is highest; uphill to the end if it bends upwards."""
    if bend < 0.0:
        return clipped(-slope / bend, low, high)
    return high if slope > 0.0 else low


@formula
def highest_in_rectangle(
    gu: float,
    gv: float,
    huu: float,
    huv: float,
    hvv: float,
    u_low: float,
    u_high: float,
    v_low: float,
    v_high: float,
    v_first: bool,
) -> tuple[float, float]:
    """Return where a model with this gradient and Hessian is highest, along each axis in turn.

    A model that bends downwards in every direction has one such point, found from its vertex. One
    with a saddle may have two, on two sides: ``v_first`` chooses.
    """
    saddle = huu * hvv - huv * huv
    if huu < 0.0 and saddle > 0.0:
        u = clipped((huv * gv - hvv * gu) / saddle, u_low, u_high)
    elif v_first:
        v = highest_on_line(gv, hvv, v_low, v_high)
        u = highest_on_line(gu + huv * v, huu, u_low, u_high)
    else:
        u = highest_on_line(gu, huu, u_low, u_high)
    v = highest_on_line(gv + huv * u, hvv, v_low, v_high)
    return highest_on_line(gu + huv * v, huu, u_low, u_high), v
