"""Expressions of kernels as expressions of C."""

from __future__ import annotations

import ast
import builtins
import math
import operator
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled.records import Field as RecordField

from . import language as lang
from .language import (
    WORDS,
    ArrayOf,
    Known,
    Pointer,
    RefusedError,
    Value,
    cast,
    chosen,
    negated,
    number_of,
)

ARITHMETIC: dict[type[ast.operator], tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", lang.SUM, operator.add),
    ast.Sub: ("-", lang.SUM, operator.sub),
    ast.Mult: ("*", lang.PRODUCT, operator.mul),
    ast.Div: ("/", lang.PRODUCT, operator.truediv),
    ast.FloorDiv: ("py_floor_divide", lang.ATOM, operator.floordiv),
    ast.Mod: ("py_modulo", lang.ATOM, operator.mod),
    ast.LShift: ("<<", lang.SHIFT, operator.lshift),
    ast.RShift: (">>", lang.SHIFT, operator.rshift),
    ast.BitXor: ("^", lang.BITS, operator.xor),
}
COMPARISONS: dict[type[ast.cmpop], tuple[str, int, Callable[[Any, Any], Any]]] = {
    ast.Lt: ("<", lang.RELATION, operator.lt),
    ast.LtE: ("<=", lang.RELATION, operator.le),
    ast.Gt: (">", lang.RELATION, operator.gt),
    ast.GtE: (">=", lang.RELATION, operator.ge),
    ast.Eq: ("==", lang.EQUAL, operator.eq),
    ast.NotEq: ("!=", lang.EQUAL, operator.ne),
}


class Expressions:
    """Translator of the expressions of one function."""

    def __init__(self, program: Any, function: Any) -> None:
        """Translate for a kernel, a plain Python function."""
        self.program, self.function = program, function
        self.names: dict[str, Value] = {}
        """Values of local names."""
        self.facts: dict[str, bool] = {}
        """Conditions, as dumped syntax, that are known in a part of the function."""

    def translate(self, node: ast.expr) -> Value:
        """Return the value of an expression; `RefusedError` if it is not of the language."""
        if self.facts and (known := self.facts.get(ast.dump(node))) is not None:
            return number_of(known)
        method = getattr(self, f"_{type(node).__name__.lower()}", None)
        if method is None:
            raise RefusedError(
                f"{type(node).__name__} ({ast.unparse(node)})", "use plain arithmetic"
            )
        value: Value = method(node)
        return value

    def _constant(self, node: ast.Constant) -> Value:
        if not isinstance(node.value, (bool, int, float)):
            raise RefusedError(f"the constant {node.value!r}", "use numbers")
        return number_of(node.value)

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.names:
            return self.names[node.id]
        module = self.function.__globals__
        # capacities of arrays: Python's are for any robot, C's are exact
        if node.id in self.program.sizes and node.id in module:
            return number_of(self.program.sizes[node.id])
        if node.id in module:
            return self._known(module[node.id], node.id)
        return Value(Known(getattr(builtins, node.id, None)), node.id)

    def _known(self, value: Any, name: str) -> Value:
        if isinstance(value, bool):
            return number_of(value)
        if isinstance(value, (float, int, np.uint64)):
            # its number is known, but C reads it by its name, too
            text = self.program.named(self.function.__module__, name, value)
            return replace(number_of(value), text=text, rank=lang.ATOM)
        if isinstance(value, tuple) and value and isinstance(value[0], tuple):
            shape = len(value), len(value[0])
            text = self.program.named(self.function.__module__, name, value)
            return Value(ArrayOf(shape, is_table=True), text)
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
        if isinstance(kind, lang.Bundle):
            names = [name for name, _ in kind.items]
            return owner.parts[names.index(node.attr)]
        if not isinstance(kind, Pointer):
            raise RefusedError(
                f"attribute {node.attr!r} of {lang.described(kind)}", "use records and arrays"
            )
        return self.field(owner, node.attr)

    def field(self, owner: Value, name: str) -> Value:
        """Return a field of a record."""
        record = owner.type.record
        declared = record.fields().get(name)
        if declared is None:
            raise RefusedError(f"attribute {name!r} of {record.__name__}", "declare it as a field")
        field = lang.FieldName(record, name)
        self.program.records[id(record)] = record
        arrow = "->" if owner.is_pointer else "."
        text = f"{owner.at(lang.POSTFIX)}{arrow}«{id(record)}:{name}»"
        if not isinstance(declared, RecordField):
            return Value(Pointer(declared), text, lang.POSTFIX, roots=owner.roots, is_pointer=False)
        shape, constant = self.program.shape(record, name), self.program.constants.get(field)
        kind = ArrayOf(shape) if shape else lang.FLOAT
        return Value(kind, text, lang.POSTFIX, constant, owner.roots, frozenset({field}))

    @staticmethod
    def length(array: Value) -> Value:
        """Return the length of an array, which must be known when the code is exported."""
        length = array.type.shape[0]
        if length is None:
            raise RefusedError("the length of a slice with variable ends", "give it as an argument")
        return number_of(length)

    def _subscript(self, node: ast.Subscript) -> Value:
        owner = self.translate(node.value)
        kind, index = owner.type, node.slice
        if isinstance(kind, lang.BlockOf):
            return replace(owner, type=Pointer(kind.record))
        if isinstance(kind, Known) and isinstance(kind.value, Value):  # array.shape[k]
            k = self._place(index)
            array = kind.value
            return number_of(array.type.shape[k]) if k else self.length(array)
        if isinstance(kind, Known) and isinstance(kind.value, tuple):
            return number_of(kind.value[self._place(index)])
        if isinstance(kind, lang.TupleOf):
            return self._item(owner, index)
        if not isinstance(kind, ArrayOf):
            raise RefusedError(f"an element of {lang.described(kind)}", "use arrays and tuples")
        parts = index.elts if isinstance(index, ast.Tuple) else [index]
        for part in parts:
            owner = self._part(owner, part)
        return owner

    def _place(self, index: ast.expr) -> int:
        place = self.translate(index).constant
        if not isinstance(place, int) or place < 0:
            raise RefusedError(f"the index {ast.unparse(index)}", "use a number")
        return place

    def _item(self, owner: Value, index: ast.expr) -> Value:
        place = self.translate(index)
        if owner.type.is_uniform:
            text = f"{owner.at(lang.POSTFIX)}.at[{place.text}]"
            return Value(lang.FLOAT, text, lang.POSTFIX, calls=owner.calls)
        k = self._place(index)
        text = f"{owner.at(lang.POSTFIX)}.item_{k}"
        return Value(owner.type.items[k], text, lang.POSTFIX, calls=owner.calls)

    def _part(self, owner: Value, index: ast.expr) -> Value:
        if isinstance(index, ast.Slice):
            return self._slice(owner, index)
        place = self.translate(index)
        if place.type != lang.INT or (place.constant is not None and place.constant < 0):
            raise RefusedError(f"the index {ast.unparse(index)}", "use an integer from 0 on")
        return self.element(owner, place)

    @staticmethod
    def element(owner: Value, place: Value) -> Value:
        """Return an element, or a row, of an array."""
        text = place.text
        if owner.offset and place.constant is not None and owner.offset.isdigit():
            text = str(int(owner.offset) + place.constant)
        elif owner.offset:
            rest = "" if place.constant == 0 else f" + {place.at(lang.PRODUCT)}"
            text = f"{owner.offset}{rest}"
        rest = owner.type.shape[1:]
        kind = replace(owner.type, shape=rest) if rest else owner.type.item
        element = f"{owner.at(lang.POSTFIX)}[{text}]"
        return replace(owner, type=kind, text=element, rank=lang.POSTFIX, offset="")

    def _slice(self, owner: Value, part: ast.Slice) -> Value:
        if part.lower is None and part.upper is None and part.step is None:
            return owner
        if len(owner.type.shape) > 1 or part.step is not None:
            raise RefusedError("a slice that is not of neighbouring numbers", "copy them in a loop")
        start = self.translate(part.lower) if part.lower else number_of(0)
        stop = self.translate(part.upper) if part.upper else self.length(owner)
        known = None
        if start.constant is not None and stop.constant is not None:
            known = stop.constant - start.constant
        offset = start.text if start.constant != 0 else ""
        if owner.offset:
            offset = f"{owner.offset} + {start.at(lang.PRODUCT)}" if offset else owner.offset
        return replace(owner, type=replace(owner.type, shape=(known,)), offset=offset)

    def _tuple(self, node: ast.Tuple) -> Value:
        items = [self.translate(item) for item in node.elts]
        items = [cast(item, lang.FLOAT) if item.type == lang.INT else item for item in items]
        kind = lang.TupleOf(tuple(item.type for item in items))
        texts, name = ", ".join(item.text for item in items), self.program.tuple_name(kind)
        text = self.program.target.tuple_of(name, texts, kind.is_uniform)
        lang.check_order(items)
        calls = max((item.calls for item in items), default=0)
        return Value(kind, text, lang.POSTFIX, parts=tuple(items), calls=calls)

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        value = self.translate(node.operand)
        if isinstance(node.op, ast.Not):
            return negated((value,))
        if not isinstance(node.op, ast.USub) or value.type not in (lang.FLOAT, lang.INT):
            raise RefusedError(f"the operator of {ast.unparse(node)}", "use plain arithmetic")
        constant = None if value.constant is None else -value.constant
        text = f"-{value.at(lang.UNARY + 1)}"
        return replace(value, text=text, rank=lang.UNARY, constant=constant)

    def _binop(self, node: ast.BinOp) -> Value:
        op, left, right = node.op, self.translate(node.left), self.translate(node.right)
        lang.check_order((left, right))
        calls = max(left.calls, right.calls)
        if isinstance(op, (ast.BitAnd, ast.BitOr)):
            return self._bits(op, left, right)
        if type(op) not in ARITHMETIC:
            raise RefusedError(f"the operator {type(op).__name__}", "write products out")
        sign, rank, function = ARITHMETIC[type(op)]
        kind = lang.FLOAT if isinstance(op, ast.Div) else lang.joined(left.type, right.type)
        if kind not in (lang.FLOAT, lang.INT, lang.UINT):
            raise RefusedError(f"arithmetic of {lang.described(kind)}", "use numbers")
        left, right = cast(left, kind), cast(right, kind)
        constant = None
        if left.constant is not None and right.constant is not None:
            if not (sign == "/" and right.constant == 0):
                constant = function(left.constant, right.constant)
            if kind == lang.INT and constant is not None:
                return number_of(constant)
        if kind == lang.UINT and sign not in ("+", "-", "*", "<<", ">>", "^"):
            raise RefusedError("this operator of unsigned integers", "use shifts and products")
        if kind == lang.INT and sign in "+-" and right.constant == 0:
            return left
        if kind == lang.INT and sign == "+" and left.constant == 0:
            return right
        if sign == "<<" and kind == lang.INT:  # a plain literal is an int, of 32 bits
            left = replace(left, text=f"INT64_C({left.text})") if left.text.isdigit() else left
        if rank == lang.ATOM:
            if kind != lang.INT:
                raise RefusedError("a remainder of floats", "use np.floor")
            text = f"{sign}({left.text}, {right.text})"
        else:
            # (a - b) - c needs no parentheses, a - (b - c) keeps them: roundings stay in order
            text = f"{left.at(rank)} {sign} {right.at(rank + 1)}"
        return Value(kind, text, rank, constant, calls=calls)

    def _bits(self, op: ast.operator, left: Value, right: Value) -> Value:
        sign = "&" if isinstance(op, ast.BitAnd) else "|"
        if left.type == right.type and left.type in (lang.INT, lang.UINT):
            text = f"{left.at(lang.SHIFT)} {sign} {right.at(lang.SHIFT)}"
            return Value(left.type, text, lang.BITS, calls=max(left.calls, right.calls))
        if right.calls == lang.WRITES:  # which && might not call
            raise RefusedError("a kernel that writes, beside | or &", "name its result first")
        return self._logic(isinstance(op, ast.BitAnd), [left, right])

    def _logic(self, is_and: bool, values: list[Value]) -> Value:
        rest: list[Value] = []
        for value in (cast(value, lang.BOOL) for value in values):
            if value.constant is None:
                rest.append(value)
            elif value.constant is not is_and:  # it decides, but what writes is still to be called
                if not any(v.calls == lang.WRITES for v in rest):
                    return number_of(not is_and)
                rest.append(value)
        if len(rest) < 2:
            return rest[0] if rest else number_of(is_and)
        sign, rank = (" && ", lang.AND) if is_and else (" || ", lang.OR)
        texts = [v.text if v.rank == rank else v.at(lang.UNARY) for v in rest]
        return Value(lang.BOOL, sign.join(texts), rank, calls=max(v.calls for v in rest))

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
            raise RefusedError(f"the comparison {type(op).__name__}", "compare numbers")
        sign, rank, function = COMPARISONS[type(op)]
        kind = lang.joined(left.type, right.type)
        left, right = cast(left, kind), cast(right, kind)
        if left.constant is not None and right.constant is not None:
            return number_of(bool(function(left.constant, right.constant)))
        text = f"{left.at(rank + 1)} {sign} {right.at(rank + 1)}"
        lang.check_order((left, right))
        return Value(lang.BOOL, text, rank, calls=max(left.calls, right.calls))

    def _ifexp(self, node: ast.IfExp) -> Value:
        condition = cast(self.translate(node.test), lang.BOOL)
        if condition.constant is not None:
            return self.translate(node.body if condition.constant else node.orelse)
        return chosen((condition, self.translate(node.body), self.translate(node.orelse)))

    def _call(self, node: ast.Call) -> Value:
        if isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
            return self._flattened(node)
        function = self.translate(node.func)
        known = function.type.value if isinstance(function.type, Known) else None
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise RefusedError("a call with keywords or a star", "give arguments by position")
        arguments = tuple(self.translate(argument) for argument in node.args)
        lang.check_order(arguments)
        if known is np.zeros and [a.type for a in arguments[1:]] == [Known(np.uint64)]:
            return Value(ArrayOf((self._place(node.args[0]),), lang.UINT, True), "{0}")
        if known is math.frexp and arguments[0].text.isidentifier():
            number = arguments[0].text
            texts = f"py_mantissa({number}), py_exponent({number})"
            kind = lang.TupleOf((lang.FLOAT, lang.INT))
            name = self.program.tuple_name(kind)
            return Value(kind, self.program.target.tuple_of(name, texts, False), lang.POSTFIX)
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
            raise RefusedError(
                f"a call of {ast.unparse(node.func)}()", "call kernels and exact functions"
            )
        call: Value = self.program.call(body, arguments, self)
        return call

    def _flattened(self, node: ast.Call) -> Value:
        assert isinstance(node.func, ast.Attribute)
        array = self.translate(node.func.value)
        if ast.unparse(node.args[0]) != "-1" or not isinstance(array.type, ArrayOf):
            raise RefusedError("this reshape()", "only reshape(-1) of an array is allowed")
        shape = [size or 0 for size in array.type.shape]
        first = "[0]" * (len(shape) - 1)
        text = f"(&{array.at(lang.POSTFIX)}{first}[0])" if first else array.text
        return replace(array, type=ArrayOf((math.prod(shape),)), text=text)
