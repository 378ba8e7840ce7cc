"""Plant, controller and mission in one process, with the gains of Table IV."""

from __future__ import annotations

from typing import Any

import numpy as np

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.laws import ControlLaw, find_law
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

PERIOD = 5e-4
PAPER_DEG = [[0, 120, 220, 0, -10, 0], [15, 110, 185, 45, 10, -25], [30, 100, 150, 90, 30, -50]]

H_BAR = [50.0] * 3 + [5.0] * 3 + [0.5] * 3
GAINS: dict[str, dict[str, list[float]]] = {
    "ctc": {"k_p": [1e4] * 9, "k_d": [200.0] * 9},  # 100 rad/s, critically damped
    # Table IV
    "tde_smc": {"h_bar": H_BAR, "lambda": [1.0] * 9, "g": [0.1] * 6 + [0.01] * 3},
    "tde_tsmc": {
        "h_bar": H_BAR,
        "k_p": [10.0] * 3 + [8.0] * 3 + [2.0] * 3,
        "k_d": [2.0] * 6 + [0.5] * 3,
        "k_1": [2.0] * 9,
    },
    "tde_stc": {
        "h_bar": H_BAR,
        "lambda": [1.0] * 9,
        "k_1": [0.02] * 3 + [0.2] * 3 + [0.4, 0.2, 0.2],
        "k_2": [8e-5] * 3 + [3e-3] * 3 + [4e-3, 2e-3, 2e-3],
    },
}


def law_of(name: str) -> ControlLaw:
    return find_law(name)({key: np.array(v) for key, v in GAINS[name].items()}, PERIOD)


NAVIGATION = NavigationFilterSettings(
    tracker_across=1e-5,
    tracker_about=8e-5,
    tracker_boresight=[0.0, 0.0, 1.0],
    tracker_delay=0.1,
    gyro_angle_walk=3e-7,
    gyro_rate_walk=1e-9,
    gyro_bias=1e-6,
    joint_angle_noise=1e-7,
    joint_rate_noise=0.0,
)
"""A filter for good sensors, with a number for everything."""


class Loop:
    """Plant, controller and mission in one process; a test may bend what passes between them."""

    def __init__(
        self,
        robot: Robot,
        law: ControlLaw,
        navigation: NavigationFilterSettings | None = None,
        **plant: Any,
    ) -> None:
        start, *goals = np.asarray(PAPER_DEG, float).tolist()
        plant = {"initial_joints_deg": start, **plant}
        segments = [f"{{joints_deg: {goal}, duration: 15}}" for goal in goals]
        mission = MissionSettings(joints_deg=start, segments=segments)
        self.plant = Plant(robot, PlantSettings(**plant), PERIOD)
        self.controller = Controller(robot, law, PERIOD, navigation=navigation)
        self.mission = Mission(robot, mission, PERIOD)
        self.references = ReferenceBuffer(robot.n)
        self.answer = self.controller.update

    def fly(self, ticks: int, is_blind: bool = False) -> tuple[Array, Array]:
        """Errors and torques, (ticks, m) each; whoever is blind measures no attitude."""
        errors, torques = [], []
        for _ in range(ticks):
            tick, state = self.plant.tick, self.plant.state.copy()
            if not self.references.covers(tick):
                self.references.add(self.mission.chunk(tick, 100))
            if is_blind:
                state.quaternion[:] = np.nan
            command = self.answer(state, self.references.at(tick))
            assert command.tick == tick
            errors.append(self.controller.signals.error.copy())
            torques.append(command.torque.copy())
            self.plant.step(command)
        return np.array(errors), np.array(torques)
