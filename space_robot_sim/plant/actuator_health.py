"""Diagnostics of the base's actuators: saturation, failures, momentum, propellant."""

from __future__ import annotations

import numpy as np

from .plant import Plant

Values = dict[str, float | int | str]


class ActuatorHealth:
    """State of the base's actuators from one report to the next. Independent of ROS."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._before = [0] * len(plant.names.wheels)

    @property
    def values(self) -> Values:
        """Diagnostic values by name with unit; empty for an ideal base."""
        return {**self._of_wheels(), **self._of_thrusters()}

    def saturated(self) -> str:
        """Return the names of wheels that were at a limit since the last call."""
        now = self._saturated_ticks
        names = [
            name
            for name, ticks, before in zip(self._names, now, self._before, strict=True)
            if ticks > before
        ]
        self._before = now
        return ", ".join(names)

    @property
    def _names(self) -> tuple[str, ...]:
        return self._plant.names.wheels

    @property
    def _saturated_ticks(self) -> list[int]:
        ticks = self._plant.memory.actuators.wheels.saturated_ticks
        return [int(count) for count in ticks[: len(self._names)]]

    def _of_wheels(self) -> Values:
        wheels, speeds = self._plant.memory.actuators.wheels, self._plant.truth.wheel_velocities
        values: Values = {}
        for k, name in enumerate(self._names):
            if np.isfinite(wheels.max_momentum[k]):
                share = wheels.inertia[k] * speeds[k] / wheels.max_momentum[k]
                values[f"momentum_percent: {name}"] = float(100.0 * share)
            if wheels.saturated_ticks[k]:
                values[f"saturated_ticks: {name}"] = int(wheels.saturated_ticks[k])
        failed = [name for k, name in enumerate(self._names) if wheels.failed[k]]
        return {**values, **({"failed": ", ".join(failed)} if failed else {})}

    def _of_thrusters(self) -> Values:
        names, thrusters = self._plant.names.thrusters, self._plant.memory.actuators.thrusters
        if not names:
            return {}
        values: Values = {
            "pulses": int(thrusters.pulses.sum()),
            "propellant_used_kg": float(thrusters.burnt),
        }
        if np.isfinite(thrusters.propellant):
            values["propellant_left_kg"] = float(thrusters.propellant)
        for what in ("stuck_on", "stuck_off"):
            if stuck := [name for k, name in enumerate(names) if getattr(thrusters, what)[k]]:
                values[what] = ", ".join(stuck)
        return values
