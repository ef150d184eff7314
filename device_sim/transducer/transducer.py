"""A simulated torque transducer on the bus: a CANopen measuring device, and the sensor behind it."""

from pathlib import Path

from torquerig.device_sim.canopen.core import NodeTiming
from torquerig.device_sim.canopen.node import CanopenNode
from torquerig.device_sim.transducer import objects
from torquerig.device_sim.transducer.sensor import SensorFault, SensorParameters, ShaftTorque, TorqueSensor
from torquerig.driver.wire.dictionary import load_dictionary
from torquerig.driver.wire.measuring import TRANSDUCER_EDS


class SimulatedTransducer(CanopenNode):
    """One torque transducer on the bus."""

    def __init__(
        self,
        node_id: int,
        shaft: ShaftTorque,
        parameters: SensorParameters | None = None,
        *,
        timing: NodeTiming | None = None,
        eds: Path = TRANSDUCER_EDS,
        power_on_ns: int = 0,
    ) -> None:
        """Build the transducer; it is switched on at its first event.

        Args:
            node_id: CANopen node-id, 1 to 127.
            shaft: What the shaft feels at a time.
            parameters: The truth about it; None for one without faults.
            timing: How long it takes.
            eds: Its object dictionary.
            power_on_ns: When it is switched on [ns].

        Raises:
            EdsError: The EDS cannot be read.
            ValueError: The node-id is out of range.
        """
        truth = parameters or SensorParameters()
        super().__init__(
            node_id,
            load_dictionary(eds, node_id),
            lambda node: self._build(node, shaft, truth),
            timing=timing,
            volatile=objects.VOLATILE,
            power_on_ns=power_on_ns,
        )
        self.store.personalise(node_id, *objects.SERIAL_NUMBER)

    def _build(self, node: CanopenNode, shaft: ShaftTorque, parameters: SensorParameters) -> TorqueSensor:
        self._sensor = TorqueSensor(node, shaft, parameters)
        return self._sensor

    def suffer(self, fault: SensorFault, at_ns: int) -> None:
        """Let something go wrong, or heal it, after all that is due until then.

        Args:
            fault: What is wrong from now on.
            at_ns: When [ns].
        """
        self.advance(at_ns)
        self.timers.now_ns = at_ns
        self._sensor.suffer(fault, at_ns)
