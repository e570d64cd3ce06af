"""A tile of a matrix product whose sums stay in vector registers, written as LLVM code.

numba compiles a loop over columns to vector instructions, but loads and stores the sums in each step of the inner
index. OpenBLAS keeps a tile of them in registers instead, which numba cannot be told to (Van Zee and van de Geijn,
ACM Trans. Math. Softw. 41, 14, 2015). After a change of this file, empty the cache of numba, which watches only the
files of the functions that it stores.
"""

from typing import Any

from llvmlite import binding, ir
from numba.core import types
from numba.extending import intrinsic

_FEATURES = binding.get_host_cpu_features()
_BYTES, ROWS = (64, 8) if _FEATURES.get("avx512f") else (32, 4) if _FEATURES.get("avx") else (16, 4)
"""Bytes of a vector, and rows of a tile: with 32 registers (AVX-512) there is space for 8, with 16 for 4."""
_VECTORS = 3
ROW_BYTES = _VECTORS * _BYTES
"""Bytes of a row of a tile, which are 24 columns of double precision with AVX-512."""
_INDEX = ir.IntType(64)


def _declare_types(context: Any, left: types.Array, right: types.Array, result: types.Array, row: types.Integer,
                   column: types.Integer) -> Any:
    return types.void(left, right, result, row, column), _multiply_tile


multiply_tile: Any = intrinsic(_declare_types)
"""Set the tile of `result` that begins at `row` and `column` to that of the product `left` @ `right`.

The arrays have one type and the shapes (m, k), (k, n) and (m, n), where k is at least 1; the rows of `right` and
`result` are contiguous. Every entry is one sum in the order of the inner index, from 0, with fused operations.
"""


def _multiply_tile(context: Any, builder: ir.IRBuilder, signature: Any, arguments: Any) -> Any:
    number = context.get_value_type(signature.args[0].dtype)
    bits = context.get_abi_sizeof(number) * 8
    vector = ir.VectorType(number, 8 * _BYTES // bits)
    name = f"llvm.fmuladd.v{vector.count}f{bits}"
    fused = builder.module.globals.get(name) or ir.Function(
        builder.module, ir.FunctionType(vector, [vector] * 3), name)
    left, right, result = (_Matrix(context, builder, kind, value)
                           for kind, value in zip(signature.args[:3], arguments[:3], strict=True))
    row, column = (context.cast(builder, value, kind, types.intp)
                   for kind, value in zip(signature.args[3:], arguments[3:], strict=True))
    rows = [builder.add(row, _INDEX(r)) for r in range(ROWS)]
    places = [builder.add(column, _INDEX(v * vector.count)) for v in range(_VECTORS)]
    before, loop, after = builder.block, builder.append_basic_block("inner"), builder.append_basic_block("store")
    builder.branch(loop)
    builder.position_at_end(loop)
    inner, sums = builder.phi(_INDEX), [[builder.phi(vector) for _ in places] for _ in rows]
    terms = [right.load(inner, place, vector) for place in places]
    added = []
    for r in range(ROWS):
        single = builder.insert_element(ir.Constant(vector, ir.Undefined), left.load(rows[r], inner, number),
                                        ir.IntType(32)(0))
        factor = builder.shuffle_vector(single, ir.Constant(vector, ir.Undefined),
                                        ir.Constant(ir.VectorType(ir.IntType(32), vector.count), None))
        added.append([builder.call(fused, [factor, term, old]) for term, old in zip(terms, sums[r], strict=True)])
    following = builder.add(inner, _INDEX(1))
    inner.add_incoming(_INDEX(0), before)
    inner.add_incoming(following, loop)
    for olds, news in zip(sums, added, strict=True):
        for old, new in zip(olds, news, strict=True):
            old.add_incoming(ir.Constant(vector, None), before)
            old.add_incoming(new, loop)
    builder.cbranch(builder.icmp_signed("<", following, left.columns), loop, after)
    builder.position_at_end(after)
    for r in range(ROWS):
        for place, total in zip(places, added[r], strict=True):
            result.store(total, rows[r], place)
    return context.get_dummy_value()


class _Matrix:
    """Access to a two-dimensional array of numba, of any layout."""

    def __init__(self, context: Any, builder: ir.IRBuilder, kind: types.Array, value: Any) -> None:
        array = context.make_array(kind)(context, builder, value)
        self.builder, self.data = builder, builder.bitcast(array.data, ir.IntType(8).as_pointer())
        self.columns = builder.extract_value(array.shape, 1)
        self.strides = [builder.extract_value(array.strides, axis) for axis in range(2)]
        self.itemsize = context.get_abi_sizeof(context.get_value_type(kind.dtype))

    def _at(self, row: Any, column: Any, kind: ir.Type) -> Any:
        offset = self.builder.add(self.builder.mul(row, self.strides[0]), self.builder.mul(column, self.strides[1]))
        return self.builder.bitcast(self.builder.gep(self.data, [offset]), kind.as_pointer())

    def load(self, row: Any, column: Any, kind: ir.Type) -> Any:
        return self.builder.load(self._at(row, column, kind), align=self.itemsize)

    def store(self, value: Any, row: Any, column: Any) -> None:
        self.builder.store(value, self._at(row, column, value.type), align=self.itemsize)
