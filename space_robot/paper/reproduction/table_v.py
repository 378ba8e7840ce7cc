"""Table V as printed."""

from __future__ import annotations

COLUMNS = ("attitude", "joints_1_3", "joints_4_6", "base_torque", "torque_1_3", "torque_4_6")
"""Keys of `space_robot.analysis.analyze` in the order of the table's columns."""
TRACKING, TORQUE = COLUMNS[:3], COLUMNS[3:]

HEADINGS = {
    "attitude": ("attitude", ""),
    "joints_1_3": ("joints 1-3", "rad"),
    "joints_4_6": ("joints 4-6", "rad"),
    "base_torque": ("base torque", "N m"),
    "torque_1_3": ("torque 1-3", "N m"),
    "torque_4_6": ("torque 4-6", "N m"),
}
"""Name and unit of each column."""

PRINTED: dict[tuple[str, str], tuple[float, ...]] = {
    ("ctc", "1"): (2.5642e-4, 0.0107, 0.0227, 0.8772, 0.9896, 0.0454),
    ("ctc", "2"): (2.5922e-4, 0.0107, 0.0227, 0.8773, 0.9897, 0.0454),
    ("ctc", "3"): (3.2715e-4, 0.0137, 0.0281, 1.0617, 1.1713, 0.0606),
    ("ctc_smc", "1"): (0.0037, 0.0055, 3.3158e-4, 0.9062, 1.0030, 0.0470),
    ("ctc_smc", "2"): (0.0073, 0.1139, 0.0511, 0.9622, 1.0373, 0.0470),
    ("ctc_smc", "3"): (0.0070, 0.1697, 0.1143, 1.1600, 1.2310, 0.0639),
    ("tde_smc", "1"): (6.2914e-4, 8.5157e-5, 1.2593e-4, 0.8328, 0.9461, 0.0489),
    ("tde_smc", "2"): (7.3128e-4, 8.4997e-5, 1.2709e-4, 0.8318, 0.9468, 0.0490),
    ("tde_smc", "3"): (7.2389e-4, 8.5018e-5, 1.3153e-4, 0.9924, 1.1092, 0.0628),
    ("tde_tsmc", "1"): (1.3647e-4, 2.5458e-5, 7.7319e-5, 0.7991, 0.9296, 0.0451),
    ("tde_tsmc", "2"): (1.5397e-4, 2.5458e-5, 7.7319e-5, 0.8003, 0.9305, 0.0451),
    ("tde_tsmc", "3"): (1.5253e-4, 2.5458e-5, 7.7314e-5, 0.9635, 1.0938, 0.0600),
    ("tde_stc", "1"): (6.2950e-4, 8.4955e-5, 1.2742e-4, 0.7988, 0.9285, 0.0450),
    ("tde_stc", "2"): (7.3142e-4, 8.4956e-5, 1.2742e-4, 0.8027, 0.9313, 0.0451),
    ("tde_stc", "3"): (7.2380e-4, 8.4959e-5, 1.2742e-4, 0.9665, 1.0952, 0.0601),
    ("tde_stc", "4-1"): (7.0756e-4, 8.4966e-5, 1.2742e-4, 1.1328, 1.2610, 0.0749),
    ("tde_stc", "4-2"): (6.9310e-4, 8.4968e-5, 1.2741e-4, 1.3002, 1.4276, 0.0889),
}
"""Values by controller and case: mean of the axes' RMS values, which is not (64)."""


def printed(controller: str, case: str, column: str) -> float:
    """Return one number of Table V."""
    return PRINTED[controller, case][COLUMNS.index(column)]
