# SPDX-License-Identifier: BSD-3-Clause
"""The table of play_timing: schedule errors per topic of two players."""
from __future__ import annotations

from typing import Dict, Mapping, Sequence

from players import PEER
from schedule_error import TopicError

_PERCENTS = (50.0, 99.0, 100.0)


def print_table(title: str, names: Sequence[str], errors: Mapping[str, Sequence[TopicError]],
                aim: float) -> None:
    """Print the errors of each player, and the ratio of the 99th percentiles with its limit.

    Args:
        names: of the topics.
        errors: of each topic, by the player's name.
        aim: the largest acceptable ratio of p99.
    """
    print(f'\n{title}: size of the schedule error in ms (p50, p99, max), lost, disordered\n')
    print('| topic | ' + ' | '.join(errors) + ' | p99 ratio |\n' + '|---' * (len(errors) + 2) + '|')
    reached = 0
    for number, name in enumerate(names):
        row = {player: its[number] for player, its in errors.items()}
        good = _is_good(row, aim)
        reached += good
        print(f'| {name} | ' + ' | '.join(_cell(error) for error in row.values())
              + f' | {_ratio(row):.2f}{"" if good else " (!)"} |')
    print(f'\naim (ratio at most {aim:g}, nothing lost or disordered): '
          f'{reached} of {len(names)} topics', flush=True)


def _cell(error: TopicError) -> str:
    figures = ' '.join(f'{error.percentile(percent):.2f}' for percent in _PERCENTS)
    return f'{figures}, {error.lost}, {error.disordered}'


def _ratio(row: Dict[str, TopicError]) -> float:
    if PEER not in row or len(row) < 2:
        return float('nan')
    return _ours(row).percentile(99) / row[PEER].percentile(99)


def _is_good(row: Dict[str, TopicError], aim: float) -> bool:
    return _ratio(row) <= aim and _ours(row).lost == 0 and _ours(row).disordered == 0


def _ours(row: Dict[str, TopicError]) -> TopicError:
    return next(error for player, error in row.items() if player != PEER)
