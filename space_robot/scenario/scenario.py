"""A scenario: the options of a flight as names, paths or objects, and methods to fly it."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationError, ValidationInfo, field_validator
from typing_extensions import Self

from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import StrictModel, one_line, one_of, short
from space_robot_msgs_py.errors import InputError, explained_by

from .options import OPTIONS, Options

if TYPE_CHECKING:
    from space_robot_sim.faults.grammar import Kinds

    from ..api.bench import Bench
    from ..api.flown_flight import FlownFlight
    from ..flight.plan import Flight

NO_FRICTION = {"friction.coulomb": 0.0, "friction.viscous": 0.0}

for _name, _option in OPTIONS.items():  # errors of numbers show the description, with the unit
    _limits = Field(
        description=_option.help_text, ge=_option.low, le=_option.high, gt=_option.above
    )
    Options.__annotations__[_name] = Annotated[_option.annotation, _limits]


class Scenario(StrictModel, Options):
    """Definition of a flight: the options of ``space-robot simulate``, with the same defaults.

        Scenario(robot="paper", controller="tde_stc", case="3", sensors="fine", seed=1)

    An option that names a file may also be an object, or the content of the file:

    - ``robot``: a `Robot`, with the mission and gains of the shipped robot of the same name, if
      any; or the mapping of its file
    - ``plant_robot``: the robot of the plant, if it differs from that of controller and mission
    - ``controller``: a `ControlLaw` class or object; a function, see
      `space_robot_control.controller.law_choice`; None: none, for `bench`
    - ``gains``: values by gain, in place of the default set's: ``{"k_1": 3.0, "h_bar": [...]}``,
      one for all axes or n+3 (base x, y, z, joints); or such a mapping for each of several laws
    - ``mission``: a mission's document, ``{"start": ..., "segments": [...]}``, or
      `MissionSettings`; also ``initial_joints_deg``, ``initial_quaternion`` and
      ``initial_rate_deg_s`` (default: the mission's start)
    - ``disturbance``: columns, numbers by name; or a function of time, sampled at 100 Hz
    - ``case``, ``sensors``, ``actuators``, ``orbit``: their settings, objects or mappings
    - ``assumed_actuators``: the base's actuators as assumed by the flight software
    - ``parameters``: any parameter of a node, ``{"plant": {"friction.coulomb": 0.0}}``

    The other options: ``duration`` s, ``period`` s, ``substeps``, ``navigation`` ("direct" or
    "filtered"), ``command_latency_ticks``, ``friction`` (False: none), ``faults``, ``events`` and
    ``swaps`` (lists of texts), ``seed``, ``compression`` and ``split_size`` of a bag; and those of
    ``space-robot fly``, which no flight in this process can have. A scenario is immutable and can
    be pickled; `replace` returns a modified one.
    """

    def __init__(self, **options: Any) -> None:
        """Store the options; `check`, `fly` and `bench` resolve the names in them.

        Raises:
            InputError: (a ValueError) an unknown option, or one of a wrong type.
        """
        for name in options:
            one_of(name, type(self).model_fields, "option", " of Scenario")
        try:
            super().__init__(**options)
        except ValidationError as error:
            raise InputError(one_line(error, type(self), "Scenario")) from None

    # `model_validate` needs Pydantic's own error, to which it adds the name of a file
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @field_validator("*", mode="before")
    @classmethod
    def _convert(cls, value: Any, field: ValidationInfo) -> Any:
        from .objects import CONVERTERS

        name = str(field.field_name)
        is_absent = value is None and cls.model_fields[name].default is None
        return value if is_absent or name not in CONVERTERS else CONVERTERS[name](value)

    def replace(self, **options: Any) -> Self:
        """Return a copy of the scenario with these options changed.

        Raises:
            InputError: an unknown option, or one of a wrong type.
        """
        return type(self)(**{**self.given, **options})

    @property
    def given(self) -> dict[str, Any]:
        """The options that were set, by name."""
        return {name: getattr(self, name) for name in sorted(self.model_fields_set)}

    @property
    def has_chosen_law(self) -> bool:
        """Whether the user set the law."""
        own = self.parameters.get("controller", {})
        return "controller" in self.model_fields_set or "controller" in own

    @property
    def graph_options(self) -> list[str]:
        """The options that were set, and that only a graph of nodes can fulfil."""
        return [
            name
            for name, option in OPTIONS.items()
            if option.needs_graph and getattr(self, name) != option.default
        ]

    @explained_by("disturbances")
    def faults_of(self, kinds: Kinds) -> list[str]:
        """Return the texts of the faults of the given ``kinds``."""
        from space_robot_sim.faults.grammar import parse_faults

        from .faults import KINDS

        return [str(f) for f in parse_faults(self.faults, KINDS) if f.kind.name in kinds]

    def with_parameters(self, node: str, values: dict[str, Any]) -> Self:
        """Return the same scenario with further parameters of a node, by dotted name."""
        parameters = {**self.parameters, node: {**self.parameters.get(node, {}), **values}}
        return self.model_copy(update={"parameters": parameters})

    def check(self) -> Flight:
        """Resolve all names, and return the flight that would be flown.

        Raises:
            InputError: something does not exist, or does not fit the rest; in one line.
        """
        from ..flight.plan import Flight, resolve

        flight = Flight(resolve(self))
        flight.check_in_process()
        return flight

    def resolved(self) -> dict[str, Any]:
        """Return the same scenario with all numbers, independent of files.

        It consists of mappings, lists, numbers and texts: ``Scenario(**resolved)`` flies the same
        bits, and so does ``space-robot simulate --scenario`` with the mapping as a YAML file.

        Raises:
            InputError: see `check`.
        """
        return self.check().scenario.tree

    def fly(
        self,
        bag: str | Path | None = None,
        progress: Callable[[float], object] | bool | None = None,
        keep_log: bool = True,
    ) -> FlownFlight:
        """Fly in this process; the bits are those of ``simulate``, and of ``fly`` in lockstep.

        A diverged flight is a result, too: see `FlownFlight.outcome`. The first flight on a machine
        compiles the kernels. A start away from the mission's, with commands far above those of the
        mission, causes a `UserWarning`, and so does a mission that controls the attitude of a base
        without actuators.

        Args:
            bag: folder to record to, which must not exist.
            progress: called regularly with the simulated time, s; True: a progress line, in a
                terminal or a notebook.
            keep_log: False: only the metrics are kept. A log above 1 GB lies in files of the folder
                for temporary ones.

        Raises:
            InputError: see `check`; or the bag cannot be created, or there is no room for a log.
        """
        from ..api.flown_flight import fly_in_process
        from ..console.progress import check_progress

        if self.controller is None:
            raise InputError("controller is None, so there is nothing to fly: use bench()")
        check_progress(progress)
        path, flight = None if bag is None else as_path(bag, "bag"), self.check()
        for remark in flight.remarks:
            warnings.warn(remark, stacklevel=2)
        return fly_in_process(flight, path, progress, keep_log)

    def bench(self, record: bool = True) -> Bench:
        """Return a bench at the flight's first tick.

        Args:
            record: keep the commands, for `Bench.log` and `Bench.flown`: half a microsecond and
                some 110 bytes a tick; 300 bytes more where the law is asked.

        Raises:
            InputError: see `check`.
        """
        from ..api.bench import Bench
        from ..flight.compilation import compile_kernels

        flight = self.check()
        compile_kernels(bool(flight.plant.names.actuators))
        return Bench(flight, record)

    def _repr_html_(self) -> str:
        """Show the options that were set in a notebook."""
        rows = [[name, _text(value), _default(name)] for name, value in self.given.items()]
        caption = "Scenario" if rows else "Scenario: all options have their defaults"
        return html_table(("option", "value", "default"), rows, caption)

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={short(value)}" for name, value in self.given.items())
        return f"Scenario({said})"

    __str__ = __repr__


def _text(value: object) -> str:
    """Return a value as text: of a robot or a law its name."""
    if isinstance(value, str):
        return value
    name = getattr(value, "name", None) or getattr(value, "__name__", None)
    return name if isinstance(name, str) else short(value)


def _default(name: str) -> str:
    if name not in OPTIONS:
        return "none"
    option = OPTIONS[name]
    return option.default_text or ("none" if option.default is None else str(option.default))
