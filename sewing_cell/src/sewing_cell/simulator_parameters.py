# SPDX-License-Identifier: BSD-3-Clause
"""The simulator's private ROS parameters, read and checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Optional, Sequence, TypeVar

from sewing_cell.arms import ARMS
from sewing_cell.faults import KINDS
from sewing_cell.intruder import INTRUDERS
from sewing_cell.schedule import Schedule
from sewing_cell.steering import QUALITIES

_FASTEST_HZ = 1000.0

GetParameter = Callable[[str, Any], Any]
_Number = TypeVar("_Number", int, float)


class ParameterError(ValueError):
    """A parameter cannot be used; the message names it and says what to give instead."""


@dataclass(frozen=True)
class SimulatorParameters:
    """Rates in Hz (0: that group is off), the cycle's period in s, the quality and the seed.

    ``fault`` is one of ``faults.KINDS``, or empty.  Its moment in the cycle [s], its size and its
    arm are given, or None: then the seed decides.  Without ``fault_cycle`` every cycle has it.
    ``intruder`` is one of ``intruder.INTRUDERS``, or None.
    """

    joint_rate: float
    force_rate: float
    sensor_rate: float
    image_rate: float
    period: float
    quality: str
    seed: int
    fault: str = ""
    fault_start: Optional[float] = None
    fault_size: Optional[float] = None
    fault_arm: Optional[str] = None
    fault_cycle: Optional[int] = None
    second_kinect: bool = False
    intruder: Optional[str] = None

    @classmethod
    def read(cls, get: GetParameter) -> SimulatorParameters:
        """From ``get(name, default)``, which is rospy.get_param.  Raises ParameterError."""
        return cls(
            joint_rate=_rate(get, "~joint_rate", 125.0),
            force_rate=_rate(get, "~force_rate", 94.0),
            sensor_rate=_rate(get, "~sensor_rate", 50.0),
            image_rate=_rate(get, "~image_rate", 30.0),
            period=_period(get),
            quality=_quality(get),
            seed=_seed(get),
            fault=_one_of(get, "~fault", KINDS) or "",
            fault_start=_optional(get, "~fault_start", float),
            fault_size=_optional(get, "~fault_size", float),
            fault_arm=_one_of(get, "~fault_arm", tuple(arm.name for arm in ARMS)),
            fault_cycle=_optional(get, "~fault_cycle", int),
            second_kinect=_boolean(get, "~second_kinect"),
            intruder=_one_of(get, "~intruder", tuple(INTRUDERS)),
        )


def _boolean(get: GetParameter, name: str) -> bool:
    value = get(name, False)
    if not isinstance(value, bool):
        raise ParameterError(f"{name} is {value!r}; give true or false")
    return value


def _rate(get: GetParameter, name: str, default: float) -> float:
    rate = _number(get, name, default, float)
    if not 0.0 <= rate <= _FASTEST_HZ:
        raise ParameterError(
            f"{name} is {rate} Hz; give 0 (off) or up to {_FASTEST_HZ:.0f} Hz"
        )
    return rate


def _period(get: GetParameter) -> float:
    period = _number(get, "~period", 20.0, float)
    try:
        return Schedule(period).period_s
    except ValueError as error:
        raise ParameterError(f"~period: {error}") from error


def _quality(get: GetParameter) -> str:
    quality = get("~quality", "good")
    if quality not in QUALITIES:
        raise ParameterError(f"~quality is '{quality}'; give one of {', '.join(QUALITIES)}")
    return str(quality)


def _one_of(get: GetParameter, name: str, names: Sequence[str]) -> Optional[str]:
    """One of some names; None for an empty text, as launch files write it."""
    value = get(name, "")
    if value == "":
        return None
    if value not in names:
        raise ParameterError(f"{name} is '{value}'; give one of {', '.join(names)}")
    return str(value)


def _optional(get: GetParameter, name: str, kind: type[_Number]) -> Optional[_Number]:
    return None if get(name, "") == "" else _number(get, name, kind(0), kind)


def _seed(get: GetParameter) -> int:
    seed = _number(get, "~seed", 0, int)
    if seed < 0:
        raise ParameterError(f"~seed is {seed}; give a whole number from 0 up")
    return seed


def _number(get: GetParameter, name: str, default: _Number, kind: type[_Number]) -> _Number:
    value = get(name, default)
    accepted = (int,) if kind is int else (int, float)
    if isinstance(value, bool) or not isinstance(value, accepted):
        what = "whole number" if kind is int else "number"
        raise ParameterError(f"{name} is {value!r}; give a {what}")
    return kind(value)
