"""How others evaluate and invert the same polynomials."""

import time
from collections.abc import Callable

import numpy as np

from surrogates import Surrogate
from surrogates.exports import get

from .harness import Timed

NEWTON_STEPS = 3
"""Of the unrolled inverse: what takes the cases timed to 1e-9; our own stops by itself."""


def casadi_sources(model: Surrogate) -> tuple[dict[str, str], list[Timed]]:
    """C that CasADi generates: monomials as a user would write them, nested as our export writes them, and inverses.

    The inverse is given in both ways that CasADi offers for C: the root finder that it can generate code for, and
    Newton steps unrolled with a symbolic solve.
    """
    import casadi as ca

    x, y = ca.SX.sym("x", len(model.factors)), ca.SX.sym("y", len(model.responses))
    value = _monomials(ca, model, (x - ca.DM(model.factors.centre)) / ca.DM(model.factors.half_range))
    slope = ca.jacobian(value, x)
    scope: dict[str, object] = {}
    exec(compile(get("casadi").render(model, "nested")["nested_casadi.py"], "nested", "exec"), scope)
    nested = scope["forward"](x)  # type: ignore[operator]
    start = ca.DM(model.factors.centre)
    step = start
    for _ in range(NEWTON_STEPS + 1):
        there = ca.substitute([value, slope], [x], [step])
        step = step + ca.solve(there[1], y - there[0])
    residual = ca.Function("residual", {"x": x, "p": y, "g": value - y}, ["x", "p"], ["g"])
    finder = ca.rootfinder("finder", "fast_newton", residual, {"abstol": 1e-10})
    target = ca.MX.sym("y", len(model.responses))
    functions = [
        ca.Function("casadi_forward", [x], [value]),
        ca.Function("casadi_nested", [x], [nested]),
        ca.Function("casadi_both", [x], [value, ca.densify(slope)]),
        ca.Function("casadi_nested_both", [x], [nested, ca.densify(ca.jacobian(nested, x))]),
        ca.Function("casadi_unrolled", [y], [step]),
        ca.Function("casadi_finder", [target], [finder(start, target)]),
    ]
    generator = ca.CodeGenerator("casadi_generated.c", {"with_header": False})
    for function in functions:
        generator.add(function)
    timed = [_timed(f, "y" if f.name() in ("casadi_unrolled", "casadi_finder") else "x") for f in functions]
    return {"casadi_generated.c": generator.dump()}, timed


def _monomials(ca, model: Surrogate, coded):
    products = []
    for exponents in model.terms.exponents:
        product = ca.SX(1)
        for k, e in enumerate(exponents):
            for _ in range(e):
                product = product * coded[k]
        products.append(product)
    return ca.DM(model.coefficients.T) @ ca.vertcat(*products)


def _timed(function, given: str) -> Timed:
    name = function.name()
    work = max(1, function.sz_w() + 100), max(1, function.sz_iw() + 100)
    arguments, results = function.sz_arg() + 10, function.sz_res() + 10
    both = ", J" if function.n_out() == 2 else ""
    return Timed(
        name,
        f"int {name}(const double **arg, double **res, long long int *iw, double *w, int mem);",
        f"static double w[{work[0]}]; static long long int iw[{work[1]}]; "
        f"const double *arg[{arguments}] = {{{given}}}; double *res[{results}] = {{R{both}}}; "
        f"{name}(arg, res, iw, w, 0);",
    )


def ours(model: Surrogate) -> tuple[dict[str, str], list[Timed]]:
    """The C99 export."""
    declaration = '#include "ours.h"'
    m, n = len(model.responses), len(model.factors)
    jacobian = f"(double (*)[{n}])J"
    return get("c99").render(model, "ours"), [
        Timed("ours_forward", declaration, "ours_forward(x, R);"),
        Timed("ours_both", declaration, f"ours_forward_jacobian(x, R, {jacobian});"),
        Timed("ours_inverse", declaration, f"double s[{max(m, n)}]; ours_inverse(y, s); R[0] = s[0];"),
    ]


def interpreted(model: Surrogate, x: np.ndarray) -> dict[str, float]:
    """Nanoseconds of one call for one point: onnxruntime, a scikit-learn pipeline, our Python file."""
    found: dict[str, float] = {}
    one = x[:1].copy()
    try:
        import onnxruntime

        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        content = get("onnx").render(model, "model")["model.onnx"]
        session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
        found["onnxruntime"] = _clocked(lambda: session.run(["responses"], {"settings": one}))
    except (ImportError, ValueError):
        pass
    from sklearn.linear_model import LinearRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures

    degree = int(model.terms.degrees.max())
    pipe = make_pipeline(PolynomialFeatures(degree), LinearRegression()).fit(x, model.predict(x))
    found["scikit-learn"] = _clocked(lambda: pipe.predict(one))
    scope: dict[str, object] = {"__name__": "generated"}
    exec(compile(get("python").render(model, "ours")["ours.py"], "ours", "exec"), scope)
    forward: Callable = scope["forward"]  # type: ignore[assignment]
    found["our Python file"] = _clocked(lambda: forward(one))
    return found


def _clocked(call: Callable[[], object], calls: int = 2000) -> float:
    spent = []
    for _ in range(calls):
        begin = time.perf_counter_ns()
        call()
        spent.append(time.perf_counter_ns() - begin)
    return float(np.median(spent))
