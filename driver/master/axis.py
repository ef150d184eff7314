"""One drive as the cycle sees it: where it stands, where it is to go, and what its PDOs look like."""

from typing import Final

import numpy as np
from canopen.objectdictionary import ObjectDictionary
from numpy.typing import NDArray

from torquerig.driver.master.objects import DriveObjects
from torquerig.driver.master.profile import CONTROLWORD, POSITION, STATUSWORD, ObjectAddress
from torquerig.driver.master.scale import AxisScale, AxisSettings
from torquerig.driver.wire import cob
from torquerig.driver.wire.cia402 import DriveState, controlword_towards, decode_state
from torquerig.driver.wire.emcy import Emergency

STATE_MASK: Final = 0x6F  # the bits of the statusword that make up the state
DISABLED_STATES: Final = frozenset({DriveState.NOT_READY, DriveState.SWITCH_ON_DISABLED, DriveState.FAULT})


class Axis:
    """One drive of a group.

    Attributes:
        node_id: Its node-id.
        settings: What it is and how its counts relate to the joint.
        objects: Its objects, typed by its EDS.
        scale: Its factors; None until the drive was asked for its rated value.
        rpdo: Layout of its cyclic RPDO.
        rpdo_cob: COB-ID of its cyclic RPDO.
        rpdo_places: Where controlword and target torque are in it.
        tpdo: Layout of its cyclic TPDO.
        tpdo_cob: COB-ID of its cyclic TPDO.
        tpdo_places: Where statusword, position and actual torque are in it.
        statusword: The last one heard.
        state: What it says; None before the first one, or when it says nothing that CiA 402 knows.
        controlword: What the next RPDO tells the drive.
        emergency: The last emergency heard, None when there was none or the drive took it back.
        monitored: The last values of objects that other TPDOs than the cyclic one carry.
    """

    __slots__ = (
        "_goal",
        "_operation_bits",
        "_place",
        "controlword",
        "emergency",
        "monitored",
        "node_id",
        "objects",
        "rpdo",
        "rpdo_cob",
        "rpdo_places",
        "scale",
        "settings",
        "state",
        "statusword",
        "tpdo",
        "tpdo_cob",
        "tpdo_places",
    )

    def __init__(self, settings: AxisSettings, dictionary: ObjectDictionary | None = None) -> None:
        """Read the EDS and lay out the PDOs.

        Args:
            settings: What the drive is.
            dictionary: What is in its EDS, if it was read already.

        Raises:
            EdsError: The EDS cannot be read, or lacks an object that the profile maps.
            ProfileError: There is no EDS.
        """
        profile = settings.profile
        self.node_id = settings.node_id
        self.settings = settings
        self.objects = DriveObjects(settings.node_id, settings.eds_path, dictionary)
        self.scale: AxisScale | None = None
        self.rpdo = self.objects.layout(profile.rpdo.objects)
        self.rpdo_cob = cob.RPDO[profile.rpdo.number] + settings.node_id
        self.rpdo_places = (
            profile.rpdo.objects.index(CONTROLWORD),
            profile.rpdo.objects.index(profile.torque.target),
        )
        cyclic = profile.tpdos[0]
        self.tpdo = self.objects.layout(cyclic.objects)
        self.tpdo_cob = cob.TPDO[cyclic.number] + settings.node_id
        self.tpdo_places = (
            cyclic.objects.index(STATUSWORD),
            cyclic.objects.index(POSITION),
            cyclic.objects.index(profile.torque.actual),
        )
        self.statusword = 0
        self.state: DriveState | None = None
        self.controlword = 0
        self.emergency: Emergency | None = None
        self.monitored: dict[ObjectAddress, float] = {}
        self._goal = DriveState.SWITCH_ON_DISABLED
        self._operation_bits = 0
        self._place: NDArray[np.int64] = np.zeros(1, dtype=np.int64)

    @property
    def state_words(self) -> str:
        """Where the drive stands, for messages."""
        return f"{state_words(self.state)} (statusword {self.statusword:#06x})"

    @property
    def is_disabled(self) -> bool:
        """Whether the drive's last statusword says that it can make no torque."""
        return self.state in DISABLED_STATES

    @property
    def is_homed(self) -> bool:
        """Whether the drive's last statusword says that its position refers to the home fixture."""
        bit = self.settings.profile.homed_bit
        return bit is not None and bool(self.statusword >> bit & 1)

    def aim(self, goal: DriveState, *, operation_bits: int = 0) -> None:
        """Steer towards a state from the next RPDO on.

        Args:
            goal: The state; 'switch on disabled' disables the voltage at once, wherever the drive stands.
            operation_bits: Bits of the controlword to set once operation is enabled, such as the start of homing.
        """
        self._goal = goal
        self._operation_bits = operation_bits
        self._steer()

    def hear(self, statusword: int) -> bool:
        """Take a statusword; whether it tells of another state than the last one."""
        changed = self.state is None or bool((statusword ^ self.statusword) & STATE_MASK)
        self.statusword = statusword
        if changed:
            self.state = decode_state(statusword)
            self._steer()
        return changed

    def write_to(self, place: NDArray[np.int64]) -> None:
        """Keep the controlword also in the memory of a cycle that is sent from there, shape (1,)."""
        self._place = place
        place[0] = self.controlword

    def _steer(self) -> None:
        # a fault is never reset from here: the reset is a deliberate act, over SDO
        controlword = 0
        if self.state is not None and self._goal is not DriveState.SWITCH_ON_DISABLED:
            controlword = controlword_towards(self.state, self._goal)
            if self.state is DriveState.OPERATION_ENABLED is self._goal:
                controlword |= self._operation_bits
        self.controlword = self._place[0] = controlword


def state_words(state: DriveState | None) -> str:
    """A state in quotes, or "an unknown state"."""
    return "an unknown state" if state is None else f"'{state.words}'"
