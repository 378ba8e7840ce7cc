"""What is flown for docs/manual/navigation.md."""

from __future__ import annotations

from base_numbers import ATTITUDE, LAWS, ended_at
from flown_tables import Number, Options, Page, Table, Text

GRADES = ("fine", "coarse")
RIPPLE = "base_torque.ripple"
SMOOTH = {"controller": {"acceleration_filter_hz": 100.0}}
DIVERGE = {("fine", "ctc"), ("coarse", "tde_smc"), ("coarse", "tde_tsmc"), ("coarse", "tde_stc")}
"""Without the filter."""
CORNERS_HZ = ((200.0, 300.0), (50.0, 75.0), (20.0, 30.0), (10.0, 15.0))


def _cell(options: Options) -> Text:
    return Text("{}; {}", (Number(options, ATTITUDE, ".1e"), Number(options, RIPPLE)))


def _direct(sensors: str, law: str) -> Text | Number:
    options: Options = {"sensors": sensors, "controller": law}
    if (sensors, law) in DIVERGE:
        return Text("diverges at {} s", (Number(options, ended_at, ".1f"),))
    if (sensors, law) == ("coarse", "ctc"):  # its ripple is of no use: the attitude is lost
        return Number(options, ATTITUDE, ".1e")
    return _cell(options)


def _row(sensors: str, law: str) -> list[str | Text | Number]:
    filtered: Options = {"sensors": sensors, "controller": law, "navigation": "filtered"}
    smooth = _cell({**filtered, "parameters": SMOOTH}) if law.startswith("tde") else ""
    label = f"`{sensors}`: {law}" if law == LAWS[0] else law
    return [label, _direct(sensors, law), _cell(filtered), smooth]


def _corners(rate_hz: float, joints_hz: float) -> list[str | Text]:
    corners = {
        "navigation_filter.rate_filter_hz": rate_hz,
        "navigation_filter.joint_bandwidth_hz": joints_hz,
    }
    options: Options = {
        "sensors": "fine",
        "navigation": "filtered",
        "duration": 10.0,
        "parameters": {"controller": corners},
    }
    laws = ("tde_stc", "tde_smc")
    return [f"{rate_hz:g}, {joints_hz:g}", *(_cell({**options, "controller": law}) for law in laws)]


PAGE = Page(
    "navigation",
    "manual/navigation.md",
    (
        Table(
            "grades",
            ("", "direct", "filtered", "filtered + 100 Hz"),
            [_row(sensors, law) for sensors in GRADES for law in LAWS],
        ),
        Table(
            "corners",
            ("rate, joints, Hz", "`fine`, tde_stc", "`fine`, tde_smc"),
            [_corners(*corners) for corners in CORNERS_HZ],
        ),
    ),
)
