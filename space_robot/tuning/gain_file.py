"""Texts of a tuned gain set: its files, as in ``config/gains/<robot>/<set>``, and a remark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from space_robot_control.controller.gains import NOMINAL_H_BAR as IN_FILES
from space_robot_control.controller.settings import SET_FILE
from space_robot_model.elementary.matrices import Array

from .law_gains import TunedLaw
from .method import Tuned
from .task import NOMINAL

NOTES = {
    "ctc": "(31): K_P = W^2, K_D = 2 W.",
    "ctc_smc": "lambda = W; g: what the nominal model does not know of; Delta: s fades with W.",
    "tde_smc": "lambda = W; g = h_bar eps, the least that holds the surface.",
    "tde_tsmc": "K_P = W^2, K_D = 2 W; K_1 = (W eps)^1/2.",
    "tde_stc": "lambda = W; K_2 = 1.1 W eps, K_1 = 2.2 (W eps)^1/2.",
    "pd": "K_D = 2 W d, K_P = W^2 d, d the inertia of an axis with the others free.",
    "pd_feedforward": "K_D = 2 W d, K_P = W^2 d, d the inertia of an axis with the others free.",
    "slotine_li": "lambda = W, K_D = W d; gamma: adapts with W / 6 at the mission's largest force.",
    "indi": "K_P = W^2, K_D = 2 W; estimate with the nominal inertia and the low-pass of the set.",
    "dob": "J = h_bar; bandwidth: weight of the estimate's low-pass; K_P = W^2, K_D = 2 W.",
    "adrc": "J = h_bar, less if it is not stable; omega_o: lag or noise; omega_c = W.",
}
"""Tuning rule of each law, see `method`."""


def gain_files(tuned: Tuned, command: str) -> Mapping[str, str]:
    """Return the text of each file of the set by file name.

    Args:
        tuned: the set.
        command: the command that reproduces it.
    """
    head = [f"Made by `{command}`."]
    files = {
        f"{name}.yaml": gain_text([*head, NOTES[name], *_numbers(tuned, law)], name, law.gains)
        for name, law in tuned.laws.items()
    }
    files[SET_FILE] = set_text(
        [*head, "Low-pass of the time-delay estimate, part of the set's margin."], tuned.corner_hz
    )
    return files


MUCH_SLOWER = 0.1
"""A law is weak below this share of the bandwidth of the laws with a model."""


def estimate_remark(tuned: Tuned) -> str:
    """Return a remark if a constant h_bar does not suit a set's robot; else empty.

    Its laws with time-delay estimation then have less than a tenth of the bandwidth of those with a
    model.
    """
    design = tuned.design
    if design.kind == NOMINAL or design.bandwidth >= MUCH_SLOWER * tuned.model_bandwidth:
        return ""
    eigen = f"eigenvalues of H_S^-1 h_bar {design.smallest:.2g} to {design.largest:.3g}"
    return (
        f"The laws with time-delay estimation are weak: {design.bandwidth:.2g} rad/s, those with a "
        f"model {tuned.model_bandwidth:.2g} (no diagonal h_bar suits light and heavy directions at "
        f"once: {eigen}, lag {design.delay * 1e3:.3g} ms). What helps: gains tune --h-bar nominal; "
        "panels on hinges without motors as passive joints; a smaller --margin or "
        "--mass-uncertainty; a shorter period."
    )


def _numbers(tuned: Tuned, law: TunedLaw) -> Sequence[str]:
    options, design = tuned.options, tuned.design
    lines = [f"W = {law.bandwidth:.3g} rad/s; masses wrong by {options.mass_uncertainty:.0%}."]
    if "h_bar" in law.gains:
        margin = options.margin
        if design.kind == NOMINAL:
            margin = design.smallest / (1.0 + options.mass_uncertainty)
        lines += [
            f"Eigenvalues of H_S^-1 h_bar {design.smallest:.3g} to {design.largest:.3g}: "
            f"margin {margin:.1%}.",
            f"The estimate lags by {design.delay * 1e3:.3g} ms; eps = {_list(design.error, 2)}.",
        ]
        if design.switching < 1.0:
            lines.append(
                f"eps is {design.switching:.2g} times the bound of the estimate's error: K_1 for "
                f"the whole would switch the force by more than {options.ripple:.0%}."
            )
    return [*lines, *law.remarks]


def set_text(comments: Sequence[str], corner_hz: float) -> str:
    """Return the text of a set's `SET_FILE`; ``corner_hz`` of the estimate's low-pass."""
    return "\n".join(
        [
            *_comments(comments),
            "controller_node:",
            "  ros__parameters:",
            f"    acceleration_filter_hz: {corner_hz:g}",
            "",
        ]
    )


def gain_text(comments: Sequence[str], law: str, gains: Mapping[str, Array]) -> str:
    """Return the text of a law's gain file; ``gains`` (m,) by name."""
    lines = [*_comments(comments), "controller_node:", "  ros__parameters:", f"    {law}:"]
    for name, values in gains.items():
        if name == "h_bar" and not values.any():
            lines.append(f"      h_bar: {IN_FILES}")
            continue
        same = bool(np.all(values == values[0]))
        lines.append(f"      {name}: {_list(values[:1] if same else values, 12)}")
    return "\n".join([*lines, ""])


def _comments(lines: Sequence[str]) -> list[str]:
    return [f"# {line}" for line in lines]


def _list(values: Array, digits: int) -> str:
    return f"[{', '.join(_number(value, digits) for value in values.tolist())}]"


def _number(value: float, digits: int) -> str:
    """Format a number for YAML 1.1, which needs a point before an exponent."""
    text = f"{value:.{digits}g}"
    mantissa, e, exponent = text.partition("e")
    return text if "." in mantissa else f"{mantissa}.0{e}{exponent}"
