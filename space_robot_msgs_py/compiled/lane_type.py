"""The number that is eight numbers wide, as a type of Numba (0.58 to 0.68) and llvmlite.

Its value is a vector of LLVM, ``<8 x double>``, which the compiler turns into the instructions of
the processor. IEEE arithmetic of a vector is that of its elements, so a lane has the bits of a
plain number. A comparison gives a mask, ``<8 x i1>``; it has no truth value. What can be done with
both is in `lane_arithmetic` and `lane_words`.
"""

from __future__ import annotations

from typing import Any, ClassVar

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.extending import models, register_model

from .lanes import WIDTH

DOUBLE, BIT, INDEX = ir.DoubleType(), ir.IntType(1), ir.IntType(32)
LANE_VECTOR, MASK_VECTOR = ir.VectorType(DOUBLE, WIDTH), ir.VectorType(BIT, WIDTH)


class WideType(types.Type):
    """Base class of types that are eight wide; a plain value converts, the same in all lanes."""

    plain: ClassVar[Any]
    """Kind of the plain values."""

    def __init__(self) -> None:
        super().__init__(f"{type(self).__name__}{WIDTH}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Convert plain values."""
        return Conversion.safe if isinstance(other, self.plain) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Take the place of plain values."""
        return self if isinstance(other, self.plain) else None


class LaneType(WideType):
    """Numba type of eight floats."""

    plain = types.Number


class MaskType(WideType):
    """Numba type of eight truth values."""

    plain = types.Boolean


LANE, MASK = LaneType(), MaskType()


def array_of_lanes(ndim: int) -> Any:
    """Return the type of an array of lanes; loads do not rely on its alignment."""
    return types.Array(LANE, ndim, "C", aligned=False)


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, LANE_VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, MASK_VECTOR)


@lower_cast(types.Number, LaneType)
def _number_to_lanes(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    number = context.cast(builder, value, types.unliteral(fromty), types.float64)
    return _spread(builder, number, LANE_VECTOR)


@lower_cast(types.Boolean, MaskType)
def _boolean_to_mask(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _spread(builder, cgutils.as_bool_bit(builder, value), MASK_VECTOR)


def _spread(builder: Any, value: Any, vector: Any) -> Any:
    """Emit a vector with ``value`` in each lane."""
    unknown = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(unknown, value, INDEX(0))
    zeros = ir.Constant(ir.VectorType(INDEX, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, unknown, zeros)
