# SPDX-License-Identifier: BSD-3-Clause
"""Choice among several models with the same joints: by lengths, motion and names seen."""
from __future__ import annotations

from typing import FrozenSet, Iterable, NamedTuple, Optional, Sequence

from process_visualizer.discovery.evidence.moving_frames import Motion
from process_visualizer.discovery.evidence.seen import Seen, SeenTopic
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.model_fit import ModelFit
from process_visualizer.discovery.names import words

_FIT_M = 0.01  # an arm that is not calibrated
_NOISE_M = 0.002
_CLEAR = 3.0  # the next model leaves so many times as much


class Choice(NamedTuple):
    """The number of a model, and why it is that one."""

    number: int
    reason: str


class ModelEvidence:
    """Observations that may tell models apart."""

    def __init__(self, seen: Seen, motions: Sequence[Motion] = ()) -> None:
        """Take everything that was seen, and what a recording has of frames that move."""
        self._seen, self._motions = seen, motions

    def choose(self, topic: SeenTopic, models: Sequence[FoundModel]) -> Choice:
        """Return which of some models, all with the joints of a topic, it is."""
        fits = [ModelFit(it) for it in models]
        lengths = [it.lengths_m(self._seen.transforms) for it in fits]
        return (_decided(models, lengths, 'its links are as far apart as on tf')
                or self._by_motion(topic, models, fits) or self._by_names(topic, models)
                or Choice(0, f'nothing seen tells it from {_files(models[1:])}, which '
                          'have the same joints: is it the one?'))

    def _by_motion(self, topic: SeenTopic, models: Sequence[FoundModel],
                   fits: Sequence[ModelFit]) -> Optional[Choice]:
        """First if poses are those of a link, then if base or tool may be elsewhere."""
        motions = [it for it in self._motions if it.joint_topic == topic.name]
        exact = ((it, [fit.tool_m(it) for fit in fits], '') for it in motions)
        free = ((it, [fit.free_tool_m(it) for fit in fits], ', up to a constant offset')
                for it in motions)
        choices = (_decided(models, misfits, f'its joints bring it to {motion.name}{more}')
                   for them in (exact, free) for motion, misfits, more in them)
        return next((it for it in choices if it is not None), None)

    def _by_names(self, topic: SeenTopic, models: Sequence[FoundModel]) -> Optional[Choice]:
        """The one that is named where no other is: near the topic first."""
        names = [words(model.path.rpartition('/')[2].partition('.')[0]) | words(model.name)
                 for model in models]
        common = frozenset.intersection(*names)
        for seen in self._words(topic):
            named = [i for i, own in enumerate(names) if (own - common) & seen]
            if len(named) == 1:
                word = sorted((names[named[0]] - common) & seen)[0]
                others = _files([it for it in models if it is not models[named[0]]])
                return Choice(named[0], f'"{word}" is in the names that were seen; {others} have '
                                         'the same joints: is it the one?')
        return None

    def _words(self, topic: SeenTopic) -> Iterable[FrozenSet[str]]:
        yield _all_words((topic.name, *topic.publishers, *topic.frames))
        yield _all_words(name for it in self._seen.topics
                         for name in (it.name, *it.publishers, *it.frames))
        yield _all_words(name for it in self._seen.transforms for name in (it.parent, it.child))
        yield words(self._seen.where.replace(' ', '_'))


def _all_words(names: Iterable[str]) -> FrozenSet[str]:
    return frozenset().union(*map(words, names))


def _files(models: Sequence[FoundModel]) -> str:
    """The files of models in words; each once."""
    names = list(dict.fromkeys(map(_file, models)))
    return ' and '.join([', '.join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _file(model: FoundModel) -> str:
    return model.path.rpartition('/')[2]


def _decided(models: Sequence[FoundModel], misfits: Sequence[Optional[float]],
             reason: str) -> Optional[Choice]:
    """The model that fits, if no other comes near it."""
    known = sorted((misfit, number) for number, misfit in enumerate(misfits) if misfit is not None)
    if not known or known[0][0] > _FIT_M:
        return None
    best, number = known[0]
    if any(misfit < _CLEAR * max(best, _NOISE_M) for misfit, _ in known[1:]):
        return None
    others = ', '.join(f'{_file(models[i])} {_millimetres(misfit)}' for misfit, i in known[1:])
    why = f'chosen of those with the same joints, as {reason}: {_millimetres(best)} off'
    return Choice(number, f'{why}; the others: {others}' if others else why)


def _millimetres(distance_m: float) -> str:
    return f'{1e3 * distance_m:.1f} mm'
