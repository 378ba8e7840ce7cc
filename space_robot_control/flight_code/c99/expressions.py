"""Expressions of kernels as expressions of C."""

from __future__ import annotations

import ast
import builtins
import operator
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any, Protocol

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record

from .language import (
    AND,
    ATOM,
    BITS,
    BOOL,
    EQUAL,
    FLOAT,
    INT,
    OR,
    POSTFIX,
    PRODUCT,
    RELATION,
    SHIFT,
    SUM,
    UNARY,
    ArrayOf,
    BlockOf,
    Bundle,
    Field,
    Known,
    Pointer,
    Refusal,
    TupleOf,
    Value,
    cast,
    described,
    joined,
    number_of,
)
from .words import WORDS, chosen, negated

ARITHMETIC: dict[type[ast.operator], tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", SUM, operator.add),
    ast.Sub: ("-", SUM, operator.sub),
    ast.Mult: ("*", PRODUCT, operator.mul),
    ast.Div: ("/", PRODUCT, operator.truediv),
    ast.FloorDiv: ("sr_floor_divide", ATOM, operator.floordiv),
    ast.Mod: ("sr_modulo", ATOM, operator.mod),
    ast.LShift: ("<<", SHIFT, operator.lshift),
    ast.RShift: (">>", SHIFT, operator.rshift),
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Lt: ("<", RELATION, operator.lt),
    ast.LtE: ("<=", RELATION, operator.le),
    ast.Gt: (">", RELATION, operator.gt),
    ast.GtE: (">=", RELATION, operator.ge),
    ast.Eq: ("==", EQUAL, operator.eq),
    ast.NotEq: ("!=", EQUAL, operator.ne),
}


class Program(Protocol):
    """What expressions ask of the whole export."""

    sizes: dict[str, int]

    def shape(self, record: type[Record], name: str) -> tuple[int, ...]:
        """Return the shape of a field."""

    def constant(self, field: Field) -> float | None:
        """Return the number of a field that never changes; None if it does."""

    def named(self, module: str, name: str, number: float) -> str:
        """Return the text of a module's constant."""

    def tuple_name(self, kind: TupleOf) -> str:
        """Return the name of a struct."""

    def call(self, function: Any, arguments: dict[str, Value], inside: Any) -> Value:
        """Return the call of a kernel."""


class Expressions:
    """Translator of the expressions of one function."""

    def __init__(self, program: Program, function: Any) -> None:
        """Translate for a kernel, a plain Python function."""
        self.program, self.function = program, function
        self.names: dict[str, Value] = {}
        """Values of local names."""
        self.facts: dict[str, bool] = {}
        """Conditions, as dumped syntax, that are known in a part of the function."""

    def translate(self, node: ast.expr) -> Value:
        """Return the value of an expression.

        Raises:
            Refusal: it is not of the language.
        """
        if self.facts and (known := self.facts.get(ast.dump(node))) is not None:
            return number_of(known)
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise Refusal(f"{type(node).__name__} ({ast.unparse(node)})", "use plain arithmetic")
        value: Value = method(node)
        return value

    def _constant(self, node: ast.Constant) -> Value:
        if not isinstance(node.value, (bool, int, float)):
            raise Refusal(f"the constant {node.value!r}", "use numbers")
        return number_of(node.value)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.names:
            return self.names[node.id]
        module = self.function.__globals__
        if node.id in self.program.sizes and node.id in module:
            return number_of(self.program.sizes[node.id])
        if node.id in module:
            return self._known(module[node.id], node.id)
        return Value(Known(getattr(builtins, node.id, None)), node.id)

    def _known(self, value: Any, name: str) -> Value:
        if isinstance(value, bool):
            return number_of(value)
        if isinstance(value, (float, int)):
            text = self.program.named(self.function.__module__, name, value)
            return Value(FLOAT if isinstance(value, float) else INT, text, ATOM, value)
        return Value(Known(value), name)

    def _attribute(self, node: ast.Attribute) -> Value:
        owner = self.translate(node.value)
        kind = owner.type
        if isinstance(kind, Known) and isinstance(kind.value, ModuleType):
            value = getattr(kind.value, node.attr)
            is_number = isinstance(value, float)
            return number_of(value) if is_number else Value(Known(value), node.attr)
        if isinstance(kind, ArrayOf) and node.attr == "size":
            return self.length(owner)
        if isinstance(kind, ArrayOf) and node.attr == "shape":
            return Value(Known(owner), "shape")
        if isinstance(kind, Bundle):
            names = [name for name, _ in kind.items]
            return owner.parts[names.index(node.attr)]
        if not isinstance(kind, Pointer):
            raise Refusal(f"attribute {node.attr!r} of {described(kind)}", "use records and arrays")
        return self.field(owner, node.attr)

    def field(self, owner: Value, name: str) -> Value:
        """Return a field of a record."""
        record = owner.type.record
        declared = record.fields().get(name)
        if declared is None:
            raise Refusal(f"attribute {name!r} of {record.__name__}", "declare it as a field")
        field = Field(record, name)
        arrow = "->" if owner.is_pointer else "."
        text = f"{owner.at(POSTFIX)}{arrow}\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}"
        text += f"{id(record)}:{name}\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}"
        if not isinstance(declared, RecordField):
            return Value(Pointer(declared), text, POSTFIX, roots=owner.roots, is_pointer=False)
        shape = self.program.shape(record, name)
        constant = self.program.constant(field)
        if not shape:
            return Value(FLOAT, text, POSTFIX, constant, owner.roots, frozenset({field}))
        return Value(ArrayOf(shape), text, POSTFIX, constant, owner.roots, frozenset({field}))

    def length(self, array: Value) -> Value:
        """Return the length of an array."""
        length = array.type.shape[0]
        if length is not None:
            return number_of(length)
        return Value(INT, array.size or self.missing_length(array), ATOM)

    def missing_length(self, array: Value) -> str:
        """Return the text of an array's length that is not known yet.

        Raises:
            Refusal: the array has no length.
        """
        raise Refusal(f"the length of {array.text}", "give the length as an argument")

    def _subscript(self, node: ast.Subscript) -> Value:
        owner = self.translate(node.value)
        kind, index = owner.type, node.slice
        if isinstance(kind, BlockOf):
            return replace(owner, type=Pointer(kind.record))
        if isinstance(kind, Known) and isinstance(kind.value, Value):  # array.shape[k]
            k = self._place(index)
            array = kind.value
            return number_of(array.type.shape[k]) if k else self.length(array)
        if isinstance(kind, Known) and isinstance(kind.value, tuple):
            return number_of(kind.value[self._place(index)])
        if isinstance(kind, TupleOf):
            return self._item(owner, index)
        if not isinstance(kind, ArrayOf):
            raise Refusal(f"an element of {described(kind)}", "use arrays and tuples")
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        for part in parts:
            owner = self._part(owner, part)
        return owner

    def _place(self, index: ast.expr) -> int:
        place = self.translate(index).constant
        if not isinstance(place, int) or place < 0:
            raise Refusal(f"the index {ast.unparse(index)}", "use a number")
        return place

    def _item(self, owner: Value, index: ast.expr) -> Value:
        place = self.translate(index)
        if owner.type.is_uniform:
            text = f"{owner.at(POSTFIX)}.at[{place.text}]"
            return Value(FLOAT, text, POSTFIX, calls=owner.calls)
        k = self._place(index)
        return Value(owner.type.items[k], f"{owner.at(POSTFIX)}.item_{k}", POSTFIX)

    def _part(self, owner: Value, index: ast.expr) -> Value:
        length, *rest = owner.type.shape
        if isinstance(index, ast.Slice):
            return self._slice(owner, index)
        place = self.translate(index)
        if place.type != INT:
            raise Refusal(f"the index {ast.unparse(index)}", "use an integer")
        if place.constant is not None and place.constant < 0:
            raise Refusal(f"the index {place.constant}", "count from the beginning")
        text = place.text
        if owner.offset:
            text = owner.offset if place.constant == 0 else f"{owner.offset} + {place.at(PRODUCT)}"
            if place.constant is not None and owner.offset.isdigit():
                text = str(int(owner.offset) + place.constant)
        kind = ArrayOf(tuple(rest)) if rest else FLOAT
        element = f"{owner.at(POSTFIX)}[{text}]"
        return replace(owner, type=kind, text=element, rank=POSTFIX, offset="", size="")

    def _slice(self, owner: Value, part: ast.Slice) -> Value:
        if part.lower is None and part.upper is None and part.step is None:
            return owner
        if len(owner.type.shape) > 1 or part.step is not None:
            raise Refusal("a slice that is not of neighbouring numbers", "copy them in a loop")
        start = self.translate(part.lower) if part.lower else number_of(0)
        stop = self.translate(part.upper) if part.upper else self.length(owner)
        known, size = None, ""
        if start.constant is not None and stop.constant is not None:
            known = stop.constant - start.constant
        elif start.constant == 0:
            size = stop.text
        else:
            size = f"{stop.at(SUM)} - {start.at(PRODUCT)}"
        offset = start.text if start.constant != 0 else ""
        if owner.offset:
            offset = f"{owner.offset} + {start.at(PRODUCT)}" if offset else owner.offset
        return replace(owner, type=ArrayOf((known,)), offset=offset, size=size)

    def _tuple(self, node: ast.Tuple) -> Value:
        return self.tuple_of([self.translate(item) for item in node.elts])

    def tuple_of(self, items: list[Value]) -> Value:
        """Return a tuple of values."""
        items = [cast(item, FLOAT) if item.type == INT else item for item in items]
        kind = TupleOf(tuple(item.type for item in items))
        texts = ", ".join(item.text for item in items)
        inside = f"{{{{{texts}}}}}" if kind.is_uniform else f"{{{texts}}}"
        text = f"({self.program.tuple_name(kind)}){inside}"
        calls = any(item.calls for item in items)
        return Value(kind, text, POSTFIX, parts=tuple(items), calls=calls)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        value = self.translate(node.operand)
        if isinstance(node.op, ast.Not):
            return negated((value,))
        if not isinstance(node.op, ast.USub) or value.type not in (FLOAT, INT):
            raise Refusal(f"the operator of {ast.unparse(node)}", "use plain arithmetic")
        constant = None if value.constant is None else -value.constant
        text = f"-{value.at(UNARY + 1)}"
        return replace(value, text=text, rank=UNARY, constant=constant)

    def _binop(self, node: ast.BinOp) -> Value:
        return self.operation(node.op, self.translate(node.left), self.translate(node.right))

    def operation(self, op: ast.operator, left: Value, right: Value) -> Value:
        """Return ``left op right``."""
        calls = left.calls or right.calls
        if isinstance(op, (ast.BitAnd, ast.BitOr)):
            return self._bits(op, left, right)
        if type(op) not in ARITHMETIC:
            raise Refusal(f"the operator {type(op).__name__}", "write products out")
        sign, rank, function = ARITHMETIC[type(op)]
        kind = FLOAT if isinstance(op, ast.Div) else joined(left.type, right.type)
        if kind not in (FLOAT, INT):
            raise Refusal(f"arithmetic of {described(kind)}", "use numbers")
        left, right = cast(left, kind), cast(right, kind)
        constant = None
        if left.constant is not None and right.constant is not None:
            if not (sign == "/" and right.constant == 0):
                constant = function(left.constant, right.constant)
            if kind == INT and constant is not None:
                return number_of(constant)
        if kind == INT and sign in "+-" and right.constant == 0:
            return left
        if sign == "<<":
            left = replace(left, text=f"INT64_C({left.text})") if left.text.isdigit() else left
        if rank == ATOM:
            if kind != INT:
                raise Refusal("a remainder of floats", "use np.floor")
            text = f"{sign}({left.text}, {right.text})"
        else:
            text = f"{left.at(rank)} {sign} {right.at(rank + 1)}"
        return Value(kind, text, rank, constant, calls=calls)

    def _bits(self, op: ast.operator, left: Value, right: Value) -> Value:
        sign = "&" if isinstance(op, ast.BitAnd) else "|"
        if left.type == INT and right.type == INT:
            return Value(INT, f"{left.at(SHIFT)} {sign} {right.at(SHIFT)}", BITS)
        return self._logic(isinstance(op, ast.BitAnd), [left, right])

    def _logic(self, is_and: bool, values: list[Value]) -> Value:
        """Return a conjunction or disjunction; C evaluates no more of it than Python."""
        rest = []
        for value in (cast(value, BOOL) for value in values):
            if value.constant is None:
                rest.append(value)
            elif value.constant is not is_and:
                return (
                    number_of(not is_and)
                    if not rest
                    else self._joined(is_and, [*rest, number_of(not is_and)])
                )
        return self._joined(is_and, rest) if rest else number_of(is_and)

    @staticmethod
    def _joined(is_and: bool, values: list[Value]) -> Value:
        if len(values) == 1:
            return values[0]
        sign, rank = (" && ", AND) if is_and else (" || ", OR)
        texts = [v.text if v.rank == rank else v.at(UNARY) for v in values]
        return Value(BOOL, sign.join(texts), rank, calls=any(v.calls for v in values))

    def _boolop(self, node: ast.BoolOp) -> Value:
        values = [self.translate(value) for value in node.values]
        return self._logic(isinstance(node.op, ast.And), values)

    def _compare(self, node: ast.Compare) -> Value:
        values = [self.translate(value) for value in (node.left, *node.comparators)]
        pairs = zip(values, node.ops, values[1:], strict=False)
        return self._logic(True, [self._comparison(*pair) for pair in pairs])

    @staticmethod
    def _comparison(left: Value, op: ast.cmpop, right: Value) -> Value:
        if type(op) not in COMPARISONS:
            raise Refusal(f"the comparison {type(op).__name__}", "compare numbers")
        sign, rank, function = COMPARISONS[type(op)]
        kind = joined(left.type, right.type)
        left, right = cast(left, kind), cast(right, kind)
        if left.constant is not None and right.constant is not None:
            return number_of(bool(function(left.constant, right.constant)))
        text = f"{left.at(rank + 1)} {sign} {right.at(rank + 1)}"
        return Value(BOOL, text, rank, calls=left.calls or right.calls)

    def _ifexp(self, node: ast.IfExp) -> Value:
        condition = cast(self.translate(node.test), BOOL)
        if condition.constant is not None:
            return self.translate(node.body if condition.constant else node.orelse)
        return chosen((condition, self.translate(node.body), self.translate(node.orelse)))

    def _call(self, node: ast.Call) -> Value:
        function = self.translate(node.func)
        known = function.type.value if isinstance(function.type, Known) else None
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise Refusal("a call with keywords or a star", "give arguments by position")
        arguments = tuple(self.translate(argument) for argument in node.args)
        known = getattr(known, "kernel", known)  # of a RecordFunction
        if known is len:
            return self.length(arguments[0])
        try:
            word = WORDS.get(known)
        except TypeError:
            word = None
        if word is not None:
            return word(arguments)
        body = getattr(known, "py_func", None)
        if body is None:
            raise Refusal(
                f"a call of {ast.unparse(node.func)}()", "call kernels and exact functions"
            )
        return self.program.call(body, arguments, self)
