"""Statements of kernels as statements of C; local names are declared later, by `.program`."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache, reduce
from typing import Any

from . import language as lang
from .expressions import Expressions
from .language import ArrayOf, Known, Pointer, RefusedError, Value, cast, number_of

RESERVED = re.compile(
    "auto|case|char|const|default|do|double|enum|extern|goto|inline|long|register|restrict|short|"
    "signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile"
)
INDENT = "    "
MARK = "§"
"""Stands around a local name where it gets a value."""
TRANSPARENT = ("any_lane", "all_lanes", "uniform", "bool")
"""Words that give a truth value as it is."""


class Statements(Expressions):
    """Translator of the statements of one function."""

    def __init__(
        self,
        program: Any,
        function: Any,
        tree: ast.FunctionDef,
        file: str,
        kinds: Sequence[lang.Type],
    ) -> None:
        """Translate the body of ``tree``, the syntax of ``function``, for types of arguments."""
        super().__init__(program, function)
        self.tree, self.file = tree, file
        self.first_line = function.__code__.co_firstlineno
        self.own = {argument.arg for argument in tree.args.args}
        """Names of its arguments."""
        self._taken = {*names_in([tree]), *self.own}
        self.types: dict[str, lang.Type] = {}
        """Types of local names; they grow from pass to pass until they hold all values."""
        self.result: lang.Type = None
        self.lines: list[str] = []
        self.written: set[str] = set()
        """Local names whose memory is written."""
        self.stores: set[lang.FieldName] = set()
        """Fields that are written."""
        self._roots: dict[str, frozenset[str]] = {}
        self._depth = 1
        self._counter: dict[str, int] = {}
        self.parameters: list[tuple[str, lang.Type]] = []
        self.arguments: list[tuple[str, ...]] = []
        """Names of the parameters in C that each argument becomes."""
        for argument, kind in zip(tree.args.args, kinds, strict=True):
            before = len(self.parameters)
            self.names[argument.arg] = self._parameter(argument.arg, kind)
            self.types[argument.arg] = kind
            self.arguments.append(tuple(name for name, _ in self.parameters[before:]))

    def _parameter(self, name: str, kind: lang.Type) -> Value:
        if isinstance(kind, Known):
            is_number = isinstance(kind.value, (bool, int))
            bound = number_of(kind.value) if is_number else Value(kind, name)
            return replace(bound, is_bound=is_number)
        if isinstance(kind, lang.Bundle):
            parts: dict[str, Value] = {}
            for item, of in kind.items:
                if isinstance(of, lang.FieldOf):
                    owner = parts[of.item]
                    pointer = replace(owner, type=Pointer(owner.type.record))
                    parts[item] = self.field(pointer, of.name)
                else:
                    parts[item] = self._parameter(f"{name}_{item}", of)
            return Value(kind, name, parts=tuple(parts.values()))
        if kind != lang.EMPTY:  # C has no such arrays
            self.parameters.append((name, kind))
        return Value(kind, name, roots=frozenset({name}))

    def body(self) -> None:
        """Translate all statements."""
        try:
            self.assigned = assigned_in(self.tree)
        except RefusedError as refusal:
            raise self.refused(self.tree, refusal) from None
        self._block(self.tree.body)

    def refused(self, node: ast.AST, refusal: RefusedError) -> lang.NotInSubsetError:
        """Return the error for a refused construct."""
        line = self.first_line + getattr(node, "lineno", 1) - 1
        return lang.NotInSubsetError(self.file, line, refusal.construct, refusal.instead)

    def emit(self, line: str) -> None:
        """Add a line."""
        self.lines.append(f"{INDENT * self._depth}{line}")

    def _block(self, statements: Sequence[ast.stmt]) -> bool:
        before, is_left = self.facts, False
        for statement in statements:
            kind = type(statement).__name__.lower()
            try:
                method = getattr(self, f"_{kind}_statement", None)
                if method is None:
                    raise RefusedError(kind, "use if, for and while")
                is_left = bool(method(statement))
            except RefusedError as refusal:
                raise self.refused(statement, refusal) from None
            if is_left:
                break
        self.facts = before
        return is_left

    def _learn(self, test: ast.expr, is_true: bool) -> None:
        while True:
            if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
                test, is_true = test.operand, not is_true
            elif isinstance(test, ast.Call) and ast.unparse(test.func) in TRANSPARENT:
                test = test.args[0]
            else:
                break
        # what a call returns or an attribute holds may be another value the next time
        is_plain = not any(isinstance(n, (ast.Call, ast.Attribute)) for n in ast.walk(test))
        names = names_in([test])
        if is_plain and names.keys() <= self.names.keys() and all(map(self._is_steady_name, names)):
            self.facts = {**self.facts, ast.dump(test): is_true}

    def _is_steady_name(self, name: str) -> bool:
        most = 0 if name in self.own else 1
        return self.names[name].type == lang.BOOL and self.assigned[name] <= most

    # assignments

    def _assign_statement(self, node: ast.Assign) -> None:
        if len(node.targets) == 1 and isinstance(node.targets[0], ast.Tuple):
            self._assign_together(node.targets[0], node.value)
            return
        value = self.translate(node.value)
        # a = b = f() calls once
        if len(node.targets) > 1 and (value.calls or isinstance(value.type, lang.TupleOf)):
            value = self._named("value", value)
        for target in node.targets:
            self._assign(target, value)

    def _annassign_statement(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self._assign(node.target, self.translate(node.value))

    def _assign_together(self, target: ast.Tuple, source: ast.expr) -> None:
        if not isinstance(source, ast.Tuple):
            value = self.translate(source)
            if isinstance(value.type, ArrayOf):
                for k, part in enumerate(target.elts):
                    self._assign(part, self.element(value, number_of(k)))
                return
            if not isinstance(value.type, lang.TupleOf):
                raise RefusedError(f"unpacking {lang.described(value.type)}", "return tuples")
            name = value.text
            if value.calls or not name.isidentifier():
                name = self._named("result", value).text
            for k, (part, kind) in enumerate(zip(target.elts, value.type.items, strict=True)):
                item = f"{name}.at[{k}]" if value.type.is_uniform else f"{name}.item_{k}"
                self._assign(part, Value(kind, item, lang.POSTFIX))
            return
        values = [self.translate(part) for part in source.elts]
        # Python evaluates all values before it stores the first: C needs names for those that
        # earlier targets change
        for k in range(1, len(values)):
            written = [ast.unparse(earlier) for earlier in target.elts[:k]]
            mentioned = {ast.unparse(n) for n in ast.walk(source.elts[k])}
            stores = any("[" in target or "." in target for target in written)
            loads = values[k].calls or "[" in values[k].text or "->" in values[k].text
            touched = bool(mentioned & set(written)) or (stores and loads)
            if touched and not isinstance(values[k].type, (Pointer, ArrayOf)):
                values[k] = self._named("later", values[k])
        for part, value in zip(target.elts, values, strict=True):
            self._assign(part, value)

    def _assign(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Tuple):
            raise RefusedError("nested unpacking", "unpack one tuple after the other")
        if isinstance(target, ast.Name):
            self._assign_name(target.id, value)
        else:
            self._store(self.translate(target), value)

    def _assign_name(self, name: str, value: Value) -> None:
        kind = lang.joined(self.types.get(name), value.type) if name in self.types else value.type
        self.types[name] = kind
        if isinstance(kind, Known):
            self.names[name] = value
            return
        if isinstance(kind, lang.Scalar):
            value = cast(value, kind)
        is_once = self.assigned[name] == 1 and name not in self.own
        known = value.constant if is_once and kind in (lang.FLOAT, lang.INT, lang.BOOL) else None
        roots = frozenset({name}) | value.roots | self._roots.get(name, frozenset())
        self._roots[name] = roots
        local = Value(kind, name, constant=known, roots=roots, fields=value.fields)
        # an integer or truth value that is known is written as a number, and decides branches
        if known is not None and kind == lang.INT:
            local = replace(number_of(known), roots=frozenset())
        elif known is not None and kind == lang.BOOL:
            local = number_of(known)
        elif isinstance(kind, ArrayOf) and value.constant is not None and is_once:
            local = replace(local, constant=value.constant)
        self.names[name] = local
        text = value.address if isinstance(kind, (ArrayOf, Pointer)) else value.text
        self.emit(f"{MARK}{name}{MARK} = {text};")

    def write(self, place: Value) -> None:
        """Note that the memory of a value is written."""
        self.written |= place.roots
        self.stores |= place.fields

    def _store(self, place: Value, value: Value) -> None:
        self.write(place)
        if not isinstance(place.type, ArrayOf):
            self.emit(f"{place.text} = {cast(value, place.type).text};")
            return
        if isinstance(value.type, ArrayOf) and place.type.shape[0] is None:
            place = replace(place, type=value.type)
        length = self.length(place).constant
        if length == 0:
            return
        item = Value(lang.INT, self._fresh("item"))
        self.emit(f"for (int64_t {item.text} = 0; {item.text} < {length}; ++{item.text}) {{")
        self._depth += 1
        is_copied = isinstance(value.type, ArrayOf)
        self._store(self.element(place, item), self.element(value, item) if is_copied else value)
        self._depth -= 1
        self.emit("}")

    def _augassign_statement(self, node: ast.AugAssign) -> None:
        old, new = self.translate(node.target), self.translate(node.value)
        sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}.get(type(node.op))
        if sign is None or isinstance(old.type, ArrayOf):
            raise RefusedError("this augmented assignment", "write out the assignment")
        if isinstance(node.target, ast.Name):
            kind = self.types[node.target.id] = lang.joined(old.type, new.type)
        else:
            kind = lang.FLOAT
            self.write(old)
        self.emit(f"{old.text} {sign}= {cast(new, kind).text};")

    # control flow

    def _if_statement(self, node: ast.If) -> bool:
        condition = cast(self.translate(node.test), lang.BOOL)
        if condition.constant is not None:
            return self._block(node.body if condition.constant else node.orelse)
        known = self.facts
        self.emit(f"if ({condition.text}) {{")
        self._learn(node.test, True)
        is_left = self._inside(node.body)
        self.facts = known
        if not node.orelse:
            self.emit("}")
            if is_left:
                self._learn(node.test, False)
            return False
        self._learn(node.test, False)
        first, lines = len(self.lines), self.lines
        is_left = self._inside(node.orelse) and is_left
        self.facts = known
        # an else with nothing but one chain of ifs becomes "else if"
        level = INDENT * (self._depth + 1)
        heads = [line[len(level) :] for line in lines[first:] if line[len(level) :][:1] != " "]
        if heads and heads[0][:4] == "if (" and all(head[:1] == "}" for head in heads[1:]):
            lines[first:] = [line.removeprefix(INDENT) for line in lines[first:]]
            lines[first] = f"{INDENT * self._depth}}} else {lines[first].strip()}"
            if not any(head == "} else {" for head in heads):  # MISRA 15.7
                lines[-1:] = [f"{INDENT * self._depth}}} else {{"]
                self.emit(f"{INDENT}/* Nothing. */")
                self.emit("}")
            return is_left
        if lines[first:]:
            lines.insert(first, f"{INDENT * self._depth}}} else {{")
        self.emit("}")
        return is_left

    def _inside(self, statements: Sequence[ast.stmt]) -> bool:
        self._depth += 1
        is_left = self._block(statements)
        self._depth -= 1
        return is_left

    def _while_statement(self, node: ast.While) -> None:
        condition = cast(self.translate(node.test), lang.BOOL)
        if condition.constant is False:
            return
        self.emit(f"while ({condition.text}) {{")
        self._inside(node.body)
        self.emit("}")

    def _for_statement(self, node: ast.For) -> None:
        if isinstance(node.iter, ast.Tuple):
            self._over_tuple(node, node.iter)
            return
        call = node.iter
        is_range = isinstance(call, ast.Call) and ast.unparse(call.func) == "range"
        if not (isinstance(call, ast.Call) and is_range and isinstance(node.target, ast.Name)):
            raise RefusedError(f"a loop over {ast.unparse(node.iter)}", "use range() or a tuple")
        name = node.target.id
        ends = [ast.Constant(0), *call.args] if len(call.args) == 1 else call.args
        start, stop, *steps = (cast(self.translate(a), lang.INT) for a in ends)
        by = steps[0].constant if steps else 1
        if by not in (1, -1):
            raise RefusedError("a loop with another step than 1 or -1", "compute the index")
        is_known = start.constant is not None and stop.constant is not None
        # a loop without turns: a base may have no wheels, and C has no arrays of length 0
        if is_known and (stop.constant - start.constant) * by <= 0:
            return
        # Python evaluates a range's end once, C before every turn of its loop
        stop_text = stop.at(lang.SUM)
        if stop.constant is None and not self._is_steady(ends[1], node):
            stop_text = self._fresh("end")
            self.emit(f"const int64_t {stop_text} = {stop.text};")
        # loops that count by _ may be nested
        shown = self._fresh("round") if name == "_" else name
        self.names[name] = Value(lang.INT, shown)
        sign, change = ("<", "++") if by == 1 else (">", "--")
        self.emit(
            f"for (int64_t {shown} = {start.text}; {shown} {sign} {stop_text}; {change}{shown}) {{"
        )
        self._inside(node.body)
        self.emit("}")

    @staticmethod
    def _is_steady(bound: ast.expr, loop: ast.For) -> bool:
        nodes = list(ast.walk(bound))
        if any(isinstance(n, (ast.Attribute, ast.Subscript, ast.Call)) for n in nodes):
            return False
        return not names_in([bound]).keys() & names_in(loop.body, stored=True).keys()

    def _over_tuple(self, node: ast.For, items: ast.Tuple) -> None:
        rows = [row.elts if isinstance(row, ast.Tuple) else [row] for row in items.elts]
        targets = node.target.elts if isinstance(node.target, ast.Tuple) else [node.target]
        index = self._fresh("row")
        lists: list[tuple[str, lang.Type, str]] = []
        for k, target in enumerate(targets):
            values = [self.translate(row[k]) for row in rows]
            kind = reduce(lang.joined, (value.type for value in values))
            table = self._fresh(f"{ast.unparse(target)}s")
            texts = ", ".join(cast(value, kind).text for value in values)
            self.emit(f"const {kind.name} {table}[{len(rows)}] = {{{texts}}};")
            lists.append((ast.unparse(target), kind, table))
        self.emit(f"for (int64_t {index} = 0; {index} < {len(rows)}; ++{index}) {{")
        self._depth += 1
        for name, kind, table in lists:
            self.names[name] = Value(kind, name)
            self.emit(f"const {kind.name} {name} = {table}[{index}];")
        self._block(node.body)
        self._depth -= 1
        self.emit("}")

    def _return_statement(self, node: ast.Return) -> bool:
        if node.value is None:
            self.result = lang.VOID
            self.emit("return;")
            return True
        value = self.translate(node.value)
        self.result = lang.joined(self.result, value.type)
        if isinstance(self.result, lang.Scalar):
            value = cast(value, self.result)
        elif not isinstance(value.type, lang.TupleOf):
            raise RefusedError(f"returning {lang.described(value.type)}", "write into an argument")
        self.emit(f"return {value.text};")
        return True

    def _expr_statement(self, node: ast.Expr) -> None:
        if isinstance(node.value, ast.Constant):  # a docstring
            return
        value = self.translate(node.value)
        if value.text:
            self.emit(f"{'' if value.type == lang.VOID else '(void)'}{value.text};")

    def _pass_statement(self, node: ast.Pass) -> None:
        pass

    def _leave_statement(self, node: ast.stmt) -> bool:
        self.emit(f"{type(node).__name__.lower()};")
        return True

    _break_statement = _continue_statement = _leave_statement

    def _named(self, name: str, value: Value) -> Value:
        fresh = self._fresh(name)
        self.emit(f"const {self.program.declaration(value.type, fresh)} = {value.text};")
        return replace(value, text=fresh, rank=lang.ATOM, calls=0)

    def _fresh(self, name: str) -> str:
        while True:
            count = self._counter[name] = self._counter.get(name, 0) + 1
            fresh = name if count == 1 else f"{name}_{count}"
            if fresh not in self._taken:
                return fresh


def names_in(nodes: Iterable[ast.AST], stored: bool = False) -> Counter[str]:
    """Return how often names are mentioned; ``stored``: how often they get a value."""
    return sum((_names_in(node, stored) for node in nodes), Counter[str]())


@cache
def _names_in(node: ast.AST, stored: bool) -> Counter[str]:
    names = (n for n in ast.walk(node) if isinstance(n, ast.Name))
    return Counter(n.id for n in names if not stored or isinstance(n.ctx, ast.Store))


@cache
def assigned_in(tree: ast.FunctionDef) -> Counter[str]:
    """Return how often names get a value in a function; refuse names that C cannot have so."""
    inside: Counter[str] = Counter()
    for loop in (n for n in ast.walk(tree) if isinstance(n, ast.For)):
        for name in names_in([loop.target]):
            if name in names_in(loop.body, stored=True) and name != "_":
                raise RefusedError(f"{name!r} set beside its loop", "use another name")
            inside[name] += names_in([loop])[name]
    mentioned = names_in([tree])
    for name in filter(RESERVED.fullmatch, mentioned):
        raise RefusedError(f"the name {name!r}", "C has it: use another one")
    for name, count in inside.items():
        if mentioned[name] != count and name != "_":
            raise RefusedError(f"{name!r} outside of its loop", "use another name")
    return names_in([tree], stored=True)
