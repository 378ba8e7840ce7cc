"""Pictures of control laws in flight, and of what the paper says of them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import theme
from matplotlib.figure import Figure
from theme import BLUE, GREEN, INK, MUTED, ORANGE, PURPLE

from space_robot import Campaign, Scenario
from space_robot.analysis.errors import attitude_angles
from space_robot.flight.simulate import simulate
from space_robot.paper.flights import PRINTED
from space_robot.paper.stability import study
from space_robot.scenario.scenario import NO_FRICTION
from space_robot_model.elementary.matrices import norms

LAWS = ("ctc", "ctc_smc", "tde_smc", "tde_tsmc", "tde_stc")


@theme.picture
def chattering() -> Figure:
    """Torque on the base's y axis under TDE-SMC and TDE-STC, over 15 s and over 0.1 s."""
    logs = {law: Scenario(controller=law, duration=15.0).fly().log for law in LAWS[2::2]}
    figure, (whole, part) = theme.panels(2, 5.0)
    for axes, rows in ((whole, slice(None)), (part, slice(8_000, 8_200))):
        time = logs["tde_stc"].time[rows]
        theme.curves(axes, time, {law: log.applied_torque[rows, 1] for law, log in logs.items()})
        axes.set_ylabel("base torque y, N m")
    part.set_xlabel("time, s")
    return figure


@theme.picture
def own_law() -> Figure:
    """Attitude errors of the tutorial's own law and of TDE-STC."""
    with tempfile.TemporaryDirectory() as folder:
        law, gains = Path(folder) / "my_laws.py", Path(folder) / "tde.yaml"
        law.write_text(theme.block("tutorial.md", "my_laws.py"), "utf-8")
        gains.write_text(theme.block("tutorial.md", "gains/tde.yaml"), "utf-8")
        own = Scenario(controller=f"{law}:TimeDelayControl", gains=str(gains), duration=5.0)
        logs = {"your tde": own.fly().log, "tde_stc": Scenario(duration=5.0).fly().log}
    figure, (axes,) = theme.panels(height=3.4)
    errors = {name: norms(attitude_angles(log)) for name, log in logs.items()}
    theme.curves(axes, logs["tde_stc"].time, errors)
    theme.powers(axes.yaxis)
    axes.set(xlabel="time, s", ylabel="attitude error, deg", ylim=(1e-8, 1e-4))
    return figure


@theme.picture
def verdicts() -> Figure:
    """Shares that the campaign `first` shows after more and more runs, beside its requirement."""
    counts, sides = (20, 50, 100, 200), {"tde_stc": (-0.15, BLUE), "ctc": (0.15, ORANGE)}
    figure, (axes,) = theme.panels(height=3.8)
    with tempfile.TemporaryDirectory() as folder:
        for number, runs in enumerate(counts):
            flown = Campaign.load("first").run(runs=runs, seed=7, out=Path(folder) / "campaign")
            for verdict in flown.verdicts:
                side, color = sides[verdict.law]
                share, limits = 1.0 - verdict.failures / verdict.runs, np.array(verdict.limits)
                axes.plot([number + side] * 2, 100 * limits, color=color, linewidth=4.0)
                name = verdict.law if not number else None
                axes.plot(number + side, 100 * share, "o", color=color, label=name)
    axes.axhline(90.0, color=INK, linestyle="--")
    axes.text(3.45, 91.0, "required", ha="right")
    axes.set(xlabel="runs", ylabel="flights that point, %", xlim=(-0.5, 3.5))
    axes.set_xticks(range(len(counts)), [str(runs) for runs in counts])
    theme.legend(axes)
    return figure


@theme.picture
def errata() -> Figure:
    """Table V's case 1: printed, and flown without friction."""
    flights = [Scenario(controller=law, parameters={"plant": NO_FRICTION}).fly() for law in LAWS]
    figure, (error, torque) = theme.panels(2, 5.0)
    for axes, column, place in ((error, "joints_1_3", 1), (torque, "base_torque", 3)):
        axes.plot([PRINTED[law, "1"][place] for law in LAWS], "s", color=ORANGE, label="printed")
        axes.plot([flight.metrics[f"{column}.rms"] for flight in flights], "o", label="flown")
        axes.set_xticks(range(5), LAWS)
        axes.set_xlim(-0.4, 4.4)
    theme.legend(error)
    theme.powers(error.yaxis)
    error.set_ylabel("joints 1-3, rad")
    torque.set(ylabel="base torque, N m", ylim=(0.75, 0.95))
    return figure


@theme.picture
def stability() -> Figure:
    """Gains of Table IV in the region K₁² > 4 K₂, and the K₂ that each would need."""
    proofs = study(Scenario(), 1e-3, lambda flight, _: simulate(flight))
    gains = proofs.flight.controller.law.gain_values
    k_1, k_2, beta = gains["k_1"], gains["k_2"], proofs.error.beta
    figure, (axes,) = theme.panels(height=4.2)
    region = np.array([0.01, 1.0])
    axes.fill_between(region, 1e-5, region**2 / 4.0, color=GREEN, alpha=0.18, linewidth=0.0)
    axes.vlines(k_1, k_2, beta, color=MUTED, linewidth=1.0)
    axes.plot(k_1, k_2, "o", color=BLUE, label="Table IV")
    axes.plot(k_1, proofs.frictionless_error.beta, "^", color=PURPLE, label="no friction")
    axes.plot(k_1, beta, "^", color=ORANGE, label="needed")
    theme.legend(axes)
    theme.powers(axes.xaxis, axes.yaxis)
    axes.text(0.13, 1e-4, "K₁² > 4 K₂")
    axes.set(xlabel="K₁", ylabel="K₂", xlim=region, ylim=(1e-5, 10.0))
    return figure
