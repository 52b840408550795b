# SPDX-License-Identifier: BSD-3-Clause
"""Identification of the frame of a robot's model to which the reported tool poses belong.

A pose and the model's frames at the same joint positions are one sample. Hypotheses are compared
by their residuals (root mean square, m or rad): the tool is a frame of the model; it is fixed to
the chosen frame; it is fixed to another link; the base is another one and the tool is the chosen
frame. There is a finding only if one of the first two explains all samples and none of the others
comes near: few or similar motions give no evidence.
"""
from __future__ import annotations

import math
from typing import List, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import (
    Quaternion,
    Triple,
    Vector,
    matrix_from_quaternion,
    rotation_vector_from_matrix,
    ypr_from_matrix,
)

MIN_SAMPLES = 8
_MAX_SAMPLES = 40
_APART = 0.2  # rad or m: minimum difference of a joint between two samples
_FIT_M = 0.006  # maximum residual by noise and by the model of an uncalibrated arm
_NOISE_M = 0.002
_CLEAR = 5.0  # minimum factor by which residuals of other hypotheses are larger
_FIT_RAD, _CLEAR_RAD = 0.1, 0.3
_TURNED_RAD = 1.0  # minimum turn between two links: it moves every point off their axis
_DECIMALS_M, _DECIMALS_RAD = 4, 3


class Body(NamedTuple):
    """A rigid body: a link, and all links that carry it, including the link itself."""

    link: str
    carriers: Sequence[str]


class Finding(NamedTuple):
    """The pose of the reported tool in a frame of the model: xyz [m], yaw pitch roll [rad]."""

    frame: str
    xyz: Triple
    ypr: Triple
    distance_m: float  # from the chosen frame to the reported tool

    @property
    def is_frame(self) -> bool:
        """Return whether the tool is the frame itself."""
        return not any((*self.xyz, *self.ypr))


class _Sample(NamedTuple):
    joints: Mapping[str, float]
    frames: Mapping[str, Placement]
    position: Vector
    quaternion: Optional[Quaternion]


class _Fixed(NamedTuple):
    """The reported poses in a frame; constant if the tool is fixed to that frame."""

    offsets: np.ndarray  # (n, 3) [m]
    center: np.ndarray  # (3,) [m]
    spread_m: float
    rotation: Optional[np.ndarray]  # (3, 3), if there are reported rotations
    spread_rad: float  # infinity without rotations


class ToolLearner:
    """Collects samples of one robot, and draws the conclusion."""

    def __init__(self, chosen: str, bodies: Mapping[str, Body]) -> None:
        """Set the chosen frame, and the bodies of the model's frames (including the base)."""
        self._chosen, self._bodies = chosen, bodies
        self._samples: List[_Sample] = []

    def add(self, joints: Mapping[str, float], frames: Mapping[str, Placement], position: Vector,
            quaternion: Optional[Quaternion] = None) -> None:
        """Add a pose, and the model's frames in the base frame at the same time.

        Args:
            joints: the joints' positions; the sample replaces those with similar positions.
            frames: all known frames of the model, including the base frame.
            position, quaternion: the reported pose in the base frame [m]; None: no rotation.
        """
        others = [it for it in self._samples if _difference(it.joints, joints) >= _APART]
        self._samples = [*others, _Sample(joints, frames, position, quaternion)][-_MAX_SAMPLES:]

    def finding(self) -> Optional[Finding]:
        """Return the tool to which the poses belong, if it differs from the chosen frame."""
        if len(self._samples) < MIN_SAMPLES:
            return None
        frames = set.intersection(*(set(it.frames) for it in self._samples)) & set(self._bodies)
        if self._chosen not in frames:
            return None
        return _Comparison(self._chosen, self._bodies, sorted(frames), self._samples).finding()


class _Comparison:
    """Compares the hypotheses for some samples."""

    def __init__(self, chosen: str, bodies: Mapping[str, Body], names: Sequence[str],
                 samples: Sequence[_Sample]) -> None:
        self._chosen, self._bodies, self._names = chosen, bodies, names
        self._reported = np.array([sample.position for sample in samples])
        has_rotation = all(sample.quaternion is not None for sample in samples)
        self._turns = _matrices([sample.quaternion for sample in samples]) if has_rotation else None
        self._origins = {name: np.array([sample.frames[name].position for sample in samples])
                         for name in names}
        self._axes = {name: _matrices([sample.frames[name].quaternion for sample in samples])
                      for name in names}
        self._fixed = {name: self._seen_from(name) for name in names}

    def finding(self) -> Optional[Finding]:
        """Return the finding, unless another hypothesis is possible."""
        chosen = self._fixed[self._chosen]
        if _rms(chosen.offsets) < _CLEAR * _NOISE_M or self._may_be_another_base():
            return None
        name = self._matching() or self._chosen
        fixed = self._fixed[name]
        if fixed.spread_m > _FIT_M or not self._is_only_there(name):
            return None
        is_there = _rms(fixed.offsets) <= _FIT_M
        return Finding(name, (0.0, 0.0, 0.0) if is_there else _rounded(fixed.center, _DECIMALS_M),
                       self._ypr(fixed), float(np.median(_lengths(chosen.offsets))))

    def _matching(self) -> str:
        """Return the frame at the reported tool, preferably with the same rotation; '' for none."""
        near = [name for name in self._names if _rms(self._fixed[name].offsets) <= _FIT_M]
        return min(near, default='', key=lambda name: (
            any(self._ypr(self._fixed[name])), round(_rms(self._fixed[name].offsets), 3),
            -len(self._bodies[name].carriers)))

    def _may_be_another_base(self) -> bool:
        """Return whether another base, with the chosen frame as the tool, explains the poses."""
        residuals = rigid_residuals(self._origins[self._chosen], self._reported)
        return _rms(residuals) < _CLEAR * _NOISE_M

    def _is_only_there(self, name: str) -> bool:
        """Return whether the samples exclude that the tool is fixed to another link."""
        links = {self._bodies[other].link: other for other in self._names}
        links.pop(self._bodies[name].link)
        return all(self._is_distinct(name, other) for other in links.values())

    def _is_distinct(self, name: str, other: str) -> bool:
        fixed, alternative = self._fixed[name], self._fixed[other]
        if alternative.spread_m >= _CLEAR * max(fixed.spread_m, _NOISE_M):
            return True
        if fixed.spread_rad <= _FIT_RAD and alternative.spread_rad >= _CLEAR_RAD:
            return True
        if self._bodies[name].link in self._bodies[other].carriers:
            return True  # such as the fingers of a hand: the tool is not on a carried link
        between = np.einsum('nji,njk->nik', self._axes[name], self._axes[other])
        return _largest_turn(between) >= _TURNED_RAD  # then the tool is on the axis between them

    def _seen_from(self, name: str) -> _Fixed:
        axes = self._axes[name]
        offsets = np.einsum('nji,nj->ni', axes, self._reported - self._origins[name])
        center = offsets.mean(axis=0)
        if self._turns is None:
            return _Fixed(offsets, center, _rms(offsets - center), None, math.inf)
        turns = np.einsum('nji,njk->nik', axes, self._turns)
        mean = _mean_rotation(turns)
        away = [np.linalg.norm(rotation_vector_from_matrix(mean.T @ turn)) for turn in turns]
        return _Fixed(offsets, center, _rms(offsets - center), mean,
                      float(np.sqrt(np.mean(np.square(away)))))

    def _ypr(self, fixed: _Fixed) -> Triple:
        """Return yaw pitch roll of the tool in a frame; zero if they are small or not constant."""
        if fixed.rotation is None or fixed.spread_rad > _FIT_RAD \
                or np.linalg.norm(rotation_vector_from_matrix(fixed.rotation)) <= _FIT_RAD:
            return 0.0, 0.0, 0.0
        return _rounded(ypr_from_matrix(fixed.rotation), _DECIMALS_RAD)


def _difference(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    return max((abs(value - other[name]) for name, value in one.items() if name in other),
               default=0.0)


def _matrices(quaternions: Sequence[Optional[Quaternion]]) -> np.ndarray:
    """Return the matrices (n, 3, 3) of quaternions without None."""
    return np.array([matrix_from_quaternion(it) for it in quaternions if it is not None])


def _lengths(vectors: np.ndarray) -> np.ndarray:
    lengths: np.ndarray = np.linalg.norm(vectors, axis=1)
    return lengths


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(_lengths(vectors)))))


def _mean_rotation(turns: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) nearest to the rotations (n, 3, 3) by the norm of matrices."""
    left, _, right = np.linalg.svd(turns.sum(axis=0))
    return _proper(left, right)


def rigid_residuals(points: np.ndarray, images: np.ndarray) -> np.ndarray:
    """Return the residuals (n, 3) of the best rigid motion of points (n, 3) to images (n, 3).

    W. Kabsch, A solution for the best rotation to relate two sets of vectors, Acta
    Crystallographica A32, 1976.
    """
    from_center, to_center = points - points.mean(axis=0), images - images.mean(axis=0)
    left, _, right = np.linalg.svd(to_center.T @ from_center)
    residuals: np.ndarray = to_center - from_center @ _proper(left, right).T
    return residuals


def _proper(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the rotation from a singular value decomposition, never a reflection."""
    sign = math.copysign(1.0, float(np.linalg.det(left @ right)))
    rotation: np.ndarray = left @ np.diag([1.0, 1.0, sign]) @ right
    return rotation


def _largest_turn(turns: np.ndarray) -> float:
    """Return the largest angle [rad] between the first of rotations (n, 3, 3) and the others."""
    return max(float(np.linalg.norm(rotation_vector_from_matrix(turns[0].T @ turn)))
               for turn in turns)


def _rounded(values: np.ndarray, decimals: int) -> Triple:
    x, y, z = (round(float(value), decimals) + 0.0 for value in values)
    return x, y, z
