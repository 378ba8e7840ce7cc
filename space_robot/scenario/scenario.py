"""A scenario: the options of a flight as names, paths or objects, and methods to fly it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, ValidationError, ValidationInfo, field_validator
from typing_extensions import Self

from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import StrictModel, one_line, one_of, short
from space_robot_msgs_py.errors import InputError, explained_by

from .options import OPTIONS, Options

if TYPE_CHECKING:
    from space_robot_sim.faults.grammar import Kinds


NO_FRICTION = {"friction.coulomb": 0.0, "friction.viscous": 0.0}

for _name, _option in OPTIONS.items():  # errors of numbers show the description, with the unit
    _limits = Field(
        description=_option.help_text, ge=_option.low, le=_option.high, gt=_option.above
    )
    Options.__annotations__[_name] = Annotated[_option.annotation, _limits]


class Scenario(StrictModel, Options):
    """The options of a flight as names, paths or objects; `space_robot.Scenario` flies them."""

    def __init__(self, **options: Any) -> None:
        """Store the options; one that is unknown, or of a wrong type, raises `InputError`."""
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
        default = cls.model_fields[name].default
        is_default = type(value) is type(default) and value == default
        return value if is_default or name not in CONVERTERS else CONVERTERS[name](value)

    def replace(self, **options: Any) -> Self:
        """Return a copy of the scenario with these options changed."""
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
    def fault_texts(self, kinds: Kinds) -> list[str]:
        """Return the texts of the faults of the given ``kinds``."""
        from space_robot_sim.faults.grammar import parse_faults

        from .faults import KINDS

        return [str(f) for f in parse_faults(self.faults, KINDS) if f.kind.name in kinds]

    def with_parameters(self, node: str, values: dict[str, Any]) -> Self:
        """Return the same scenario with further parameters of a node, by dotted name."""
        parameters = {**self.parameters, node: {**self.parameters.get(node, {}), **values}}
        return self.model_copy(update={"parameters": parameters})

    def _repr_html_(self) -> str:
        rows = [[name, _text(value), _default(name)] for name, value in self.given.items()]
        caption = "Scenario" if rows else "Scenario: all options have their defaults"
        return html_table(("option", "value", "default"), rows, caption)

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={short(value)}" for name, value in self.given.items())
        return f"Scenario({said})"

    __str__ = __repr__


def _text(value: object) -> str:
    if isinstance(value, str):
        return value
    name = getattr(value, "name", None) or getattr(value, "__name__", None)
    return name if isinstance(name, str) else short(value)


def _default(name: str) -> str:
    if name not in OPTIONS:
        return "none"
    option = OPTIONS[name]
    return option.default_text or ("none" if option.default is None else str(option.default))
