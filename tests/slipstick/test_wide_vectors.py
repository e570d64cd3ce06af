import numba
import numpy as np
import pytest
from llvmlite import binding

from slipstick import wide_vectors
from slipstick.wide_vectors import WideCompiler


def scaled(values: np.ndarray, result: np.ndarray) -> None:
    for i in range(len(values)):
        result[i] = 3.0 * values[i] * values[i] + 1.0


def machine_code(**options: object) -> tuple[str, np.ndarray]:
    compiled = numba.njit(**options)(scaled)
    result = np.empty(1001)
    compiled(np.arange(1001.0), result)
    return "".join(compiled.inspect_asm().values()), result


def test_results_are_those_of_usual_code() -> None:
    assert np.array_equal(machine_code(pipeline_class=WideCompiler)[1], 3.0 * np.arange(1001.0)**2 + 1.0)


@pytest.mark.skipif(not binding.get_host_cpu_features().get("avx512f"), reason="this processor has no AVX-512")
@pytest.mark.parametrize("width", ["512", "256"])
def test_loops_use_vectors_of_the_stated_width(width: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert '"512"' in wide_vectors._WIDTH
    monkeypatch.setattr(wide_vectors, "_WIDTH", wide_vectors._WIDTH.replace("512", width))
    assert ("zmm" in machine_code(pipeline_class=WideCompiler)[0]) == (width == "512")
