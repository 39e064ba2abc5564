"""Riccati equations of the collections CAREX and DAREX (Benner, Laub & Mehrmann, TU Chemnitz, 1995) and functions of the
matrices of Ward (SIAM J. Numer. Anal. 14, 1977), Kenney & Laub (SIAM J. Matrix Anal. Appl. 10, 1989) and Frank.

The collections stand in the tests of scipy. A solution is judged by its residual relative to the largest term, at most
100 n ε, by the closed loop, and up to 6 states by its distance to the solution in 60 digits: at most 100 n ε times the
condition of the equation (Kenney & Hewer, SIAM J. Control Optim. 28, 1990). Functions of matrices are compared with 60
digits; the bound is 100 n ε times the amplification of perturbations of 1e-30 of the entries.

Skipped where python3-scipy or python3-mpmath is not installed.   usage: PENDULA=path/to/pendula benchmarks_test.py
"""
import ast
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import oracle
from oracle import lua

oracle.require("mpmath", "numpy", "scipy")
import mpmath as mp
import numpy as np
import scipy.linalg as la

EPS = 2.0**-52
LARGEST = 100  # states; CAREX 4.4 has 421
mp.mp.dps = 60
rng = np.random.default_rng(18)
problems = []  # Lua expression of a matrix, judgement of its value: text of a complaint or None


# ── Riccati equations ──


def collection(function):
    """The list `cases` in a test function of scipy: tuples A, B, Q, R, remark."""
    base = os.path.join(os.path.dirname(la.__file__), "tests")
    source = os.path.join(base, "test_solvers.py")
    if not os.path.exists(source):
        return []
    names = {name: getattr(np, name) for name in dir(np) if not name.startswith("_")}
    names.update(np=np, block_diag=la.block_diag,
                 _load_data=lambda name: dict(np.load(os.path.join(base, "data", name)).items()))
    for node in ast.parse(open(source, encoding="utf-8").read()).body:
        if isinstance(node, ast.FunctionDef) and node.name == function:
            for statement in node.body:
                if isinstance(statement, ast.Assign) and "min_decimal" not in ast.unparse(statement.targets[0]):
                    exec(compile(ast.Module([statement], []), source, "exec"), names)
    return names.get("cases", [])


def extremes():
    """CAREX 2.1, 2.2, 2.5 nearer to the border than the collection has them: A, B, Q, R."""
    for e in (1e-2, 1e-6):
        yield np.diag([1.0, -2]), np.array([[e], [0]]), np.ones((2, 2)), np.eye(1)
        C = np.array([[10.0, 100]])
        yield (np.diag([-0.1, -0.02]), np.array([[0.1, 0], [0.001, 0.01]]), C.T @ C, np.array([[1 + e, 1], [1, 1]]))
    for e in (1, 1e-3):  # X = [2 1; 1 1]
        yield (np.array([[3 - e, 1], [4, 2 - e]]), np.ones((2, 1)),
               np.array([[4 * e - 11, 2 * e - 5], [2 * e - 5, 2 * e - 2]]), np.eye(1))



def terms(continuous, A, B, Q, R, X):
    if continuous:
        return [A.T @ X, X @ A, -X @ B @ la.solve(R, B.T @ X), Q]
    return [A.T @ X @ A, -X, -A.T @ X @ B @ la.solve(R + B.T @ X @ B, B.T @ X @ A), Q]


def refined(continuous, A, B, Q, R, X):
    """Newton's method of Kleinman and Hewer in 60 digits, each step a linear system for the entries of X."""
    n = A.shape[0]
    A, B, Q, R, X = (mp.matrix(m.tolist()) for m in (A, B, Q, R, X))
    for _ in range(8):
        gram = R if continuous else R + B.T * X * B
        K = gram**-1 * (B.T * X if continuous else B.T * X * A)
        loop, right = A - B * K, -(Q + K.T * R * K)
        M = mp.zeros(n * n, n * n)
        for i in range(n):
            for j in range(n):
                for k in range(n):
                    if continuous:  # Σ loopᵏⁱ Xᵏʲ + Xⁱᵏ loopᵏʲ
                        M[i * n + j, k * n + j] += loop[k, i]
                        M[i * n + j, i * n + k] += loop[k, j]
                    else:
                        for m in range(n):
                            M[i * n + j, k * n + m] += loop[k, i] * loop[m, j]
                if not continuous:
                    M[i * n + j, i * n + j] -= 1
        x = mp.lu_solve(M, mp.matrix([right[i, j] for i in range(n) for j in range(n)]))
        last, X = X, mp.matrix(n, n)
        for i in range(n):
            for j in range(n):
                X[i, j] = x[i * n + j]
        if mp.norm(X - last) <= mp.mpf(10)**-40 * mp.norm(X):
            break
    inverse = 1 / la.svdvals(np.array(M.tolist(), float))[-1]
    return np.array(X.tolist(), float), inverse


def riccati(continuous, A, B, Q, R):
    n = A.shape[0]

    def judge(X):
        parts = terms(continuous, A, B, Q, R, X)
        residual = la.norm(sum(parts)) / max(la.norm(part) for part in parts)
        bound = 100 * n * EPS
        K = la.solve(R, B.T @ X) if continuous else la.solve(R + B.T @ X @ B, B.T @ X @ A)
        poles = la.eigvals(A - B @ K)
        edge = poles.real.max() if continuous else np.abs(poles).max() - 1
        if not residual <= bound:
            return f"residual {residual:.1e}, bound {bound:.1e}"
        if not edge <= bound * la.norm(A):
            return f"the loop is unstable by {edge:.1e}"
        if n > 6:
            return None
        exact, inverse = refined(continuous, A, B, Q, R, X)
        condition = inverse * sum(la.norm(part) for part in parts) / la.norm(exact)
        error = la.norm(X - exact) / la.norm(exact)
        if not error <= bound * max(1, condition):
            return f"error {error:.1e}, condition {condition:.1e}"
        return None

    equation = "care" if continuous else "dare"
    problems.append((f"({equation}({lua(A)}, {lua(B)}, {lua(Q)}, {lua(R)}))", judge))


def riccati_equations():
    for continuous, function in ((True, "test_solve_continuous_are"), (False, "test_solve_discrete_are")):
        for case in collection(function):
            A, B, Q, R = (np.atleast_2d(np.asarray(m)) for m in case[:4])
            if any(np.iscomplexobj(m) for m in (A, B, Q, R)) or A.shape[0] > LARGEST:
                continue
            A, B, Q, R = (m.astype(float) for m in (A, B, Q, R))
            riccati(continuous, A, B if B.shape[0] == A.shape[0] else B.T, Q, R)
    for A, B, Q, R in extremes():
        riccati(True, A, B, Q, R)


# ── functions of matrices ──


def amplification(f, A, value):
    """The larger of two: relative change of f over that of A, for perturbations of every entry by parts of 1e-30."""
    size, worst = mp.mpf(10)**-30, mp.mpf(0)
    base = mp.matrix(A.tolist())
    for _ in range(2):
        moved = base.copy()
        for i in range(A.shape[0]):
            for j in range(A.shape[1]):
                moved[i, j] = base[i, j] + size * mp.mpf(float(rng.uniform(-1, 1))) * mp.norm(base, mp.inf)
        worst = max(worst, mp.norm(f(moved) - value) / mp.norm(value) / size)
    return float(worst)


def function(name, f, A):
    value = f(mp.matrix(A.tolist()))
    condition = max(1.0, amplification(f, A, value))
    exact = np.array([[float(mp.re(value[i, j])) for j in range(value.cols)] for i in range(value.rows)])

    def judge(X):
        error, bound = la.norm(X - exact) / la.norm(exact), 100 * A.shape[0] * EPS * condition
        return None if error <= bound else f"error {error:.1e}, bound {bound:.1e}"

    problems.append((f"{name}({lua(A)})", judge))


def root(A):
    """√A by the iteration of Denman and Beavers in 60 digits."""
    Y, Z = A.copy(), mp.eye(A.rows)
    for _ in range(200):
        Y, Z, last = (Y + Z**-1) / 2, (Z + Y**-1) / 2, Y
        if mp.norm(Y - last) <= mp.mpf(10)**-50 * mp.norm(Y):
            break
    return Y


def logarithm(A):
    """log A = 2ᵏ log A^(1/2ᵏ), near I by artanh."""
    count = 0
    while mp.norm(A - mp.eye(A.rows), mp.inf) > mp.mpf("0.1"):
        A, count = root(A), count + 1
    W = (A - mp.eye(A.rows)) * (A + mp.eye(A.rows))**-1
    square, power, total = W * W, W, mp.zeros(A.rows, A.rows)
    for k in range(80):
        total += power / (2 * k + 1)
        power = power * square
    return 2**(count + 1) * total


def exponential(A):
    """e^A by its series in 120 digits, after halving."""
    with mp.workdps(120):
        size, count = mp.norm(A, mp.inf), 0
        while size > 1:
            size, count = size / 2, count + 1
        A = A / mp.mpf(2)**count
        term, total = mp.eye(A.rows), mp.eye(A.rows)
        for k in range(1, 80):
            term = term * A / k
            total += term
        for _ in range(count):
            total = total * total
        return total


def ward():
    yield np.array([[4.0, 2, 0], [1, 4, 1], [1, 1, 4]])
    yield np.array([[29.87942128909879, .7815750847907159, -2.289519314033932],
                    [.7815750847907159, 25.72656945571064, 8.680737820540137],
                    [-2.289519314033932, 8.680737820540137, 34.39400925519054]])
    yield np.array([[-131.0, 19, 18], [-390, 56, 54], [-387, 57, 52]])
    forsythe = np.diag(np.ones(9), 1)
    forsythe[9, 0] = 1e-10
    yield forsythe


def functions():
    for A in ward():
        function("expm", exponential, A)
    # Kenney & Laub (1998), and Dieci & Papini: scaling and squaring goes too far where the upper part is large
    for b in (1e2, 1e6, 1e10):
        function("expm", exponential, np.array([[1, b, b], [0, 0.5, b], [0, 0, -0.25]]))
    function("expm", exponential, np.array([[0, 1e-8], [-1e8, 0]]))
    for e in (1e-3, 1e-7):
        A = np.array([[1 + e, 1e5, 1e4], [0, 1, 1e5], [0, 0, 1]])
        function("logm", logarithm, A)
        function("sqrtm", root, A)
    for n in (4, 8, 12):
        F = np.array([[n - max(i, j) if j >= i - 1 else 0 for j in range(n)] for i in range(n)], float)
        function("sqrtm", root, F)
        if n < 12:
            function("logm", logarithm, F)
    for scale in (1e-9, 1, 1e9):
        function("sqrtm", root, scale * np.array([[4.0, 1, 1], [2, 4, 1], [0, 1, 4]]))
        function("logm", logarithm, scale * np.array([[4.0, 1, 1], [2, 4, 1], [0, 1, 4]]))


def main():
    riccati_equations()
    functions()
    bad = 0
    for value, (expression, judge) in zip(oracle.values([expression for expression, _ in problems]), problems):
        complaint = value if isinstance(value, str) else judge(value)
        if complaint:
            bad += 1
            print(f"{complaint[:200]}\n    {expression[:200]}")
    print(f"{len(problems) - bad} of {len(problems)} classical problems within their bounds")
    return bad > 0


sys.exit(main())
