"""The same machine in MuJoCo, where that is installed: three legs of hinges, their tips held together by equalities."""

import importlib
from types import ModuleType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from torquerig.mechanism import HOME, Link, Manipulator

Array = NDArray[np.float64]

HOW_TO_GET_IT: Final = "pip install mujoco (it is no dependency of torquerig)"
STIFFNESS_STEPS: Final = 2.0
"""Time constant of the equalities in steps: the least that MuJoCo takes (its manual, "Solver parameters")."""


def find() -> ModuleType | None:
    """MuJoCo, or None where it is not installed."""
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        return None


class MuJoCoPlant:
    """The manipulator in MuJoCo, viscous friction included, at rest in the home position."""

    def __init__(self, mujoco: ModuleType, model: Manipulator, step: float) -> None:
        """Build it.

        Args:
            mujoco: The library.
            model: The machine.
            step: Of its Runge-Kutta integration [s].
        """
        self._library = mujoco
        self._step = mujoco.mj_step
        self._model: Any = mujoco.MjModel.from_xml_string(mjcf(model, step))
        self._data: Any = mujoco.MjData(self._model)
        angles = model.inverse_kinematics(HOME)
        self._data.qpos[:] = np.column_stack((angles.theta, angles.phi)).ravel()
        mujoco.mj_forward(self._model, self._data)

    @property
    def position(self) -> Array:
        """The middle of the three tips, shape (2,) [m]."""
        middle: Array = self._tips().mean(axis=0)
        return middle

    @property
    def gap(self) -> float:
        """How far a tip is from the middle of the three [m]."""
        tips = self._tips()
        return float(np.max(np.linalg.norm(tips - tips.mean(axis=0), axis=1)))

    def command(self, tau_m: Array) -> None:
        """From now on these motor torques, shape (3,) [N·m]."""
        self._data.ctrl[:] = tau_m

    def step(self) -> None:
        """One step."""
        self._step(self._model, self._data)

    def _tips(self) -> Array:
        """The ends of the legs, shape (3, 2) [m]."""
        self._library.mj_kinematics(self._model, self._data)  # a step leaves them where its last stage was
        tips: Array = np.array(self._data.site_xpos)[:, :2]
        return tips


def mjcf(model: Manipulator, step: float) -> str:
    """The machine in MuJoCo's format. The plane is x, y; links are given by mass, centre and inertia about z.

    Args:
        model: The machine.
        step: Of the integration [s].
    """
    legs = "".join(_leg(model, number) for number in range(3))
    stiff = f'solref="{STIFFNESS_STEPS * step} 1" solimp="0.9999 0.9999 0.001"'
    return f"""
<mujoco>
  <compiler angle="radian"/>
  <option timestep="{step}" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>{legs}</worldbody>
  <equality>
    <connect site1="tip0" site2="tip1" {stiff}/>
    <connect site1="tip0" site2="tip2" {stiff}/>
  </equality>
  <actuator>{"".join(f'<motor joint="theta{n}" gear="{model.gear_ratio}"/>' for n in range(3))}</actuator>
</mujoco>"""


def _leg(model: Manipulator, number: int) -> str:
    """A base joint, a proximal link, an elbow, a distal link with its tip."""
    x, y = model.bases[number]
    length = model.link_length
    return f"""
    <body pos="{x} {y} 0">
      <joint name="theta{number}" axis="0 0 1" damping="{model.active_viscous}" armature="{model.actuator_inertia}"/>
      {_inertial(model.proximal[number])}
      <body pos="{length} 0 0">
        <joint name="phi{number}" axis="0 0 1" damping="{model.passive_viscous}"/>
        {_inertial(model.distal[number])}
        <site name="tip{number}" pos="{length} 0 0"/>
      </body>
    </body>"""


def _inertial(link: Link) -> str:
    inertia = f"{link.inertia} {link.inertia} {link.inertia}"
    return f'<inertial pos="{link.centre} 0 0" mass="{link.mass}" diaginertia="{inertia}"/>'
