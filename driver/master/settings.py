"""What holds for all drives of a group: the cycle, the watchdogs, the master's patience."""

from dataclasses import dataclass
from typing import Final

from torquerig.driver.master.process_data import STATUS_CYCLES
from torquerig.driver.master.pump import MILLISECOND_NS
from torquerig.driver.wire import cob, pdo

LIFE_TIME_FACTOR: Final = 3
_ROOMY_NS: Final = 2 * MILLISECOND_NS
_POSITIVE: Final = (
    "watchdog_periods",
    "heartbeat_ms",
    "heartbeat_limit_ms",
    "listening_ms",
    "settling_ms",
    "bit_rate",
)


@dataclass(frozen=True, slots=True)
class GroupSettings:
    """What holds for all axes of a group.

    Attributes:
        period_ns: Cycle, from SYNC to SYNC [ns]; whole microseconds.
        rpdo_type: Transmission type of the cyclic RPDO: 255 acts on reception, 1 at the next SYNC.
        watchdog_periods: Periods without an RPDO after which a drive stops; as many SYNCs may a drive leave unanswered.
        master_id: The master's own node-id.
        heartbeat_ms: Drives send theirs this often [ms].
        heartbeat_limit_ms: Who hears no heartbeat for so long stops [ms]; the master sends its own 2.5 times as often.
        listening_ms: Silence of other masters demanded before the first frame is sent [ms].
        settling_ms: The longest that one step of starting or enabling may take [ms].
        group_rpdo: Whether one RPDO carries the torques of all drives, see `process_data`.
        bit_rate: Of the bus [bit/s]: what a cycle leaves of it is shared with SDO transfers.
        most_on_a_bus: Where the drives are on several buses, how many are on the fullest; None for one bus.
    """

    period_ns: int = 4 * MILLISECOND_NS
    rpdo_type: int = pdo.EVENT_PROFILE
    watchdog_periods: int = 3
    master_id: int = 127
    heartbeat_ms: int = 50
    heartbeat_limit_ms: int = 100
    listening_ms: int = 120
    settling_ms: int = 2000
    group_rpdo: bool = False
    bit_rate: int = 1_000_000
    most_on_a_bus: int | None = None

    def __post_init__(self) -> None:
        cob.check_node_id(self.master_id)
        if self.period_ns <= 0 or self.period_ns % 1000:
            raise ValueError(f"a period is a positive number of whole microseconds, not {self.period_ns} ns")
        if not pdo.allowed_for_rpdo(self.rpdo_type):
            raise ValueError(f"an RPDO's transmission type is 0 to 240, 254 or 255, not {self.rpdo_type}")
        for name in _POSITIVE:
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is to be positive, not {getattr(self, name)}")

    @property
    def rpdo_deadline_ms(self) -> int:
        """Value of the RPDO's event timer: the watchdog's periods, rounded up to whole milliseconds."""
        return -(-self.watchdog_periods * self.period_ns // MILLISECOND_NS)

    @property
    def has_room(self) -> bool:
        """Whether slower TPDOs find room in a cycle: 745 bits are taken, theirs are 405 more, and 1 Mbit/s is usual."""
        return self.period_ns >= _ROOMY_NS

    @property
    def status_ns(self) -> int:
        """How old a statusword may be [ns]."""
        return self.period_ns * (STATUS_CYCLES if self.group_rpdo else 1)

    @property
    def guard_ms(self) -> int:
        """Guard time (100C) of drives that are guarded: their patience is three of them."""
        return self.heartbeat_limit_ms // LIFE_TIME_FACTOR

    @property
    def master_heartbeat_ns(self) -> int:
        """Time between the master's own heartbeats [ns]."""
        return self.heartbeat_limit_ms * MILLISECOND_NS * 2 // 5
