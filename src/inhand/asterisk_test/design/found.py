"""What a design study has found."""

from dataclasses import dataclass

from inhand.asterisk_test.design.asked import Asked
from inhand.asterisk_test.design.finals import Final
from inhand.asterisk_test.design.looked import Looked, front_of


@dataclass(frozen=True, eq=False)
class Found:
    """What a study has found."""

    asked: Asked
    catalogue: tuple[Looked, ...]
    """Hands of the catalogue, the best by mean reach first."""
    looked: tuple[Looked, ...]
    """Hands that were proposed."""
    finals: tuple[Final, ...]
    """The best of the front in simulation, the farthest first."""
    known: Final
    """The best of the catalogue in simulation."""
    off: dict[str, float]
    """Mean reach of the winner [mm], and of hands a little off it, by what is off."""

    @property
    def winner(self) -> Final:
        """The hand that suits best."""
        return self.finals[0]

    @property
    def front(self) -> list[Looked]:
        """Hands that no other is better than in all aims, the best by the first aim first."""
        return front_of(self.asked, self.looked)
