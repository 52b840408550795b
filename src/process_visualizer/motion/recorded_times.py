"""When the messages of a topic were recorded, as the player tells it."""
from __future__ import annotations

from collections import deque
from itertools import islice
from typing import Deque, Iterable, NamedTuple, Optional, Tuple

from process_visualizer.motion.playback_clock import BagTime

MOST_BUNCHED = 50  # messages: what was held up for longer is dated by the rest of them
_MEMORY = 4096  # messages: the player tells of those of the next tenth of a second


class Told(NamedTuple):
    """What the player tells of a message: the CRC-32 of its bytes, when it was recorded."""

    checksum: int
    bag: BagTime


class Recorded(NamedTuple):
    """When a message was recorded, and those that the player sends after it."""

    bag: BagTime
    following: Tuple[BagTime, ...]


class RecordedTimes:
    """Finds the times of a topic's messages by their bytes, in the order of their coming.

    What was found is a message of these bytes that is in the recording at that time, also where
    others with the same bytes are near, or where the player has taken messages back: so a pose
    may get the time of another one that is equal, but never a time at which it was not so.
    """

    def __init__(self) -> None:
        self._coming: Deque[Told] = deque(maxlen=_MEMORY)

    def tell(self, coming: Iterable[Told]) -> None:
        """Take note of messages that come next."""
        self._coming.extend(coming)

    def take(self, checksum: int) -> Optional[Recorded]:
        """Return when a message that has come was recorded; None if it is not known, or not yet.

        What should have come before it is forgotten.
        """
        place = next((place for place, told in enumerate(self._coming)
                      if told.checksum == checksum), None)
        if place is None:
            return None
        bag = self._coming[place].bag
        following = tuple(told.bag for told in
                          islice(self._coming, place + 1, place + 1 + MOST_BUNCHED))
        for _ in range(place + 1):
            self._coming.popleft()
        return Recorded(bag, following)
