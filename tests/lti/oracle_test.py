"""Linear systems against scipy: random systems and the classical ill-conditioned examples.

Riccati and Lyapunov equations, sampling, responses, norms, placements; CAREX (Benner, Laub & Mehrmann, TU Chemnitz,
1995) and DAREX examples with known solutions; exponentials of Ward (SIAM J. Numer. Anal. 14, 1977), square roots and
logarithms of matrices as in Kenney & Laub (SIAM J. Matrix Anal. Appl. 10, 1989). Skipped where python3-scipy is not
installed.   usage: PENDULA=path/to/pendula oracle_test.py [number of systems, 50]
"""
import os
import sys
from fractions import Fraction

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import oracle
from oracle import lua

oracle.require("numpy", "scipy")
import numpy as np
import scipy.linalg as la
import scipy.signal as sig

COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 50
rng = np.random.default_rng(18)
problems, checks = [], []


def ask(expression, check):
    """expression: Lua that gives a number or a matrix; check(value) -> relative error."""
    problems.append(expression)
    checks.append(check)


def close(reference):
    return lambda value: la.norm(value - reference) / max(1e-300, la.norm(reference))


def random_systems():
    for _ in range(COUNT):
        n, m, p = rng.integers(1, 8), rng.integers(1, 3), rng.integers(1, 3)
        A = rng.normal(size=(n, n)) * 10 ** rng.uniform(-2, 2)
        A -= (max(la.eigvals(A).real.max(), 0) + 0.1 * la.norm(A)) * np.eye(n)
        B, C = rng.normal(size=(n, m)), rng.normal(size=(p, n))
        yield A, B, C, np.zeros((p, m))


def care_residual(A, B, Q, R):
    def error(X):
        terms = [A.T @ X, X @ A, X @ B @ la.solve(R, B.T @ X), Q]
        return la.norm(terms[0] + terms[1] - terms[2] + terms[3]) / max(la.norm(t) for t in terms)
    return error


def one_system(A, B, C, D):
    n, m = B.shape
    G = f"ss({lua(A)}, {lua(B)}, {lua(C)}, {lua(D)})"
    Q, R = np.eye(n), np.eye(m)
    Ts = 0.5 / max(1e-9, np.abs(la.eigvals(A)).max())
    ask(f"(care({lua(A)}, {lua(B)}, 1, 1))", care_residual(A, B, Q, R))
    Ad, Bd, *_ = sig.cont2discrete((A, B, C, D), Ts, "zoh")
    ask(f"(dare({lua(Ad)}, {lua(Bd)}, 1, 1))", close(la.solve_discrete_are(Ad, Bd, Q, R)))
    ask(f"lyap({lua(A)}, {lua(Q)})", close(la.solve_continuous_lyapunov(A, -Q)))
    ask(f"dlyap({lua(Ad)}, {lua(Q)})", close(la.solve_discrete_lyapunov(Ad, Q)))
    ask(f"expm({lua(A * Ts)})", close(la.expm(A * Ts)))
    for method, name in (("zoh", "zoh"), ("foh", "foh"), ("bilinear", "tustin")):
        reference = sig.cont2discrete((A, B, C, D), Ts, method)
        z = np.exp(0.7j)
        value = reference[2] @ la.solve(z * np.eye(n) - reference[0], reference[1]) + reference[3]
        ask(f"c2d({G}, {Ts!r}, '{name}'):freqresp{{{0.7 / Ts!r}}}.mag(1, 1)", close(np.abs(value[:1, :1])))
    P = la.solve_continuous_lyapunov(A, -B @ B.T)
    ask(f"{G}:norm(2)", close(np.array([[np.sqrt(np.trace(C @ P @ C.T))]])))
    w = np.logspace(-3, 3, 4000) * np.abs(la.eigvals(A)).max()
    peak = max(la.svdvals(C @ la.solve(1j * x * np.eye(n) - A, B))[0] for x in [0, *w[::10]])
    ask(f"({G}:norm('inf'))", lambda value: max(0.0, 1 - value[0, 0] / peak))  # a grid sees less than the maximum
    t = np.linspace(0, 5 / np.abs(la.eigvals(A).real).max(), 5)
    step = la.solve(A, (la.expm(A * t[-1]) - np.eye(n)) @ B[:, :1])
    times = "{" + ", ".join(repr(v) for v in t) + "}"
    ask(f"{G}:step({times}).y(5, 1)", close(np.array([[(C @ step)[0, 0]]])))
    poles = -np.sort(rng.uniform(0.5, 3, n)) * la.norm(A) / np.sqrt(n)
    if n >= 2 and m == 1:
        return
    wanted = "{" + ", ".join(repr(float(v)) for v in poles) + "}"
    ask(f"(place({lua(A)}, {lua(B)}, {wanted}))",
        lambda K: la.norm(np.sort(la.eigvals(A - B @ np.atleast_2d(K)).real) - np.sort(poles)) / la.norm(poles) / 1e4)


def symmetric(A, B, Q, R=None):
    """care(A, B, Q, R) by its residual."""
    R = np.eye(B.shape[1]) if R is None else R
    ask(f"(care({lua(A)}, {lua(B)}, {lua(Q)}, {lua(R)}))", care_residual(A, B, Q, R))


def entrywise(X):
    """Every entry relative to itself, those that are zero to the largest."""
    size = np.where(X == 0, np.abs(X).max(), np.abs(X))
    return lambda v: np.abs((v - X) / size).max()


def carex():
    """Numbers of the collection; 1.1, 1.2 and 2.1 are in classical()."""
    A = np.array([[0, 1, 0, 0], [0, -1.89, 0.39, -5.53], [0, -0.034, -2.98, 2.43], [0.034, -0.0011, -0.99, -0.21]])
    B = np.array([[0, 0], [0.36, -1.6], [-0.95, -0.032], [0.03, 0]])
    Q = np.array([[2.313, 2.727, 0.688, 0.023], [2.727, 4.271, 1.148, 0.323], [0.688, 1.148, 0.313, 0.102],
                  [0.023, 0.323, 0.102, 0.083]])
    symmetric(A, B, Q)  # 1.3: an aircraft
    A = np.diag([-0.991, -1.051, -1.118, -1.548, -1.640, -1.721, -1.823, -1.943])
    A += np.diag([0.529, 0.596, 0.596, 0.718, 0.799, 0.901, 1.021], 1)
    A += np.diag([0.522, 0.522, 0.522, 0.922, 0.922, 0.922, 0.922], -1)
    B = 1e-3 * np.array([[3.84, 4.00, 37.60, 3.08, 2.36, 2.88, 3.08, 3.00],
                         [-2.88, -3.04, -2.80, -2.32, -3.32, -3.82, -4.12, -3.96]]).T
    Q = np.diag([1, 1, 1, 1, 0.1, 0.1, 0.1, 0.1])
    Q[0, 4] = Q[4, 0] = Q[2, 5] = Q[5, 2] = 0.5
    Q[0, 7] = Q[7, 0] = Q[1, 4] = Q[4, 1] = 0.1
    symmetric(A, B, Q)  # 1.4: a distillation column
    C = np.array([[10.0, 100]])
    for e in (1e-2, 1e-4):  # 2.2: R nearly singular
        symmetric(np.diag([-0.1, -0.02]), np.array([[0.1, 0], [0.001, 0.01]]), C.T @ C, np.array([[1 + e, 1], [1, 1]]))
    for e in (1e-6, 1, 1e6):  # 2.3: A nearly zero, or large
        r = np.sqrt(1 + 2 * e)
        ask(f"(care({{{{0, {e!r}}}, {{0, 0}}}}, {{0, 1}}, 1, 1))", entrywise(np.array([[r / e, 1], [1, r]])))
    for e in (1, 1e-3, 1e-7):  # 2.4: poles of the loop near the axis
        x = 0.5 * (2 * (e + 1) + np.sqrt(2 * (e + 1) ** 2 + 2) + np.sqrt(2) * e)
        y = x / (x - (e + 1))
        ask(f"(care({{{{{1 + e!r}, 1}}, {{1, {1 + e!r}}}}}, {lua(np.eye(2))}, {lua(e * e * np.eye(2))}, 1))",
            entrywise(np.array([[x, y], [y, x]])))
    V = np.eye(3) - 2 / 3 * np.ones((3, 3))
    for e in (1, 1e3, 1e6):  # 2.6: badly scaled
        A, Q = V @ np.diag([e, 2 * e, 3 * e]) @ V, V @ np.diag([1 / e, 1, e]) @ V
        X = V @ np.diag([e**2 + np.sqrt(e**4 + 1), 2 * e**2 + np.sqrt(4 * e**4 + e),
                         3 * e**2 + np.sqrt(9 * e**4 + e**2)]) @ V
        ask(f"(care({lua(A)}, {lua(np.eye(3))}, {lua(Q)}, {lua(e * np.eye(3))}))", close(X))
    for e in (1, 1e-3, 1e-6):  # 2.7: a magnetic tape drive, time constants far apart
        A = np.array([[0, 0.4, 0, 0], [0, 0, 0.345, 0], [0, -0.524 / e, -0.465 / e, 0.262 / e], [0, 0, 0, -1 / e]])
        symmetric(A, np.array([[0], [0], [0], [1 / e]]), np.diag([1.0, 0, 1, 0]))
    for e in (1, 1e-3, 1e-6):  # 2.8: closed loop with poles near the axis
        A = np.array([[-e, 1, 0, 0], [-1, -e, 0, 0], [0, 0, e, 1], [0, 0, -1, e]])
        symmetric(A, np.ones((4, 1)), np.ones((4, 4)))
    N = 10  # 3.1: a string of vehicles
    A, B, Q = np.zeros((2 * N - 1, 2 * N - 1)), np.zeros((2 * N - 1, N)), np.zeros((2 * N - 1, 2 * N - 1))
    for k in range(N):
        A[2 * k, 2 * k], B[2 * k, k] = -1, 1
        if k < N - 1:
            A[2 * k + 1, 2 * k], A[2 * k + 1, 2 * k + 2], Q[2 * k + 1, 2 * k + 1] = 1, -1, 10
    symmetric(A, B, Q)
    n = 32  # 3.2: circulant
    A = -2 * np.eye(n) + np.roll(np.eye(n), 1, 0) + np.roll(np.eye(n), -1, 0)
    symmetric(A, np.eye(n), np.eye(n))
    n = 21  # 4.1: a chain of integrators; x_1n = √(q r)
    ask(f"(care({lua(np.eye(n, k=1))}, {lua(np.eye(n)[:, -1:])}, {lua(np.diag(np.eye(n)[0]))}, {{{{4}}}}))(1, {n})",
        close(np.array([[2.0]])))


def darex():
    ask("(dare({{4, 3}, {-4.5, -3.5}}, {1, -1}, {{9, 6}, {6, 4}}, {{1}}))",
        close((1 + np.sqrt(5)) / 2 * np.array([[9, 6], [6, 4]])))  # 1.1
    A, B = np.diag([0.9512, 0.9048]), np.array([[4.877, 4.877], [-1.1895, 3.569]])
    Q, R = np.diag([0.005, 0.02]), np.diag([1 / 3, 3])
    ask(f"(dare({lua(A)}, {lua(B)}, {lua(Q)}, {lua(R)}))", close(la.solve_discrete_are(A, B, Q, R)))  # 1.2
    ask("(dare({{2, -1}, {1, 0}}, {1, 0}, {{0, 0}, {0, 1}}, {{0}}))", close(np.eye(2)))  # 1.3: R = 0
    for e in (1, 1e3, 1e6):  # 2.3
        ask(f"(dare({{{{0, {e!r}}}, {{0, 0}}}}, {{0, 1}}, 1, 1))", entrywise(np.diag([1, 1 + e * e])))
    V = np.eye(3) - 2 / 3 * np.ones((3, 3))
    for e in (1, 1e6):  # 2.4: badly scaled
        X = V @ np.diag([e, e * (1 + np.sqrt(5)) / 2, e * (9 + np.sqrt(85)) / 2]) @ V
        ask(f"(dare({lua(V @ np.diag([0, 1, 3]) @ V)}, {lua(np.eye(3))}, {lua(e * np.eye(3))}, {lua(e * np.eye(3))}))",
            close(X))
    n = 40  # 4.1: a delay line
    ask(f"(dare({lua(np.eye(n, k=1))}, {lua(np.eye(n)[:, -1:])}, 1, 1))", close(np.diag(np.arange(1.0, n + 1))))


def kenney_laub():
    """Triangular, with eigenvalues 1e-7 apart and norm 1e5: the logarithm by its series in rational numbers."""
    M = [[Fraction(1e-7 + 1) - 1, Fraction(10**5), Fraction(10**4)], [0, 0, Fraction(10**5)], [0, 0, 0]]
    power, log = M, [[Fraction(0)] * 3 for _ in range(3)]
    for k in range(1, 12):
        log = [[log[i][j] + Fraction((-1) ** (k + 1), k) * power[i][j] for j in range(3)] for i in range(3)]
        power = [[sum(power[i][l] * M[l][j] for l in range(3)) for j in range(3)] for i in range(3)]
    log = np.array([[float(v) for v in row] for row in log])
    A = np.array([[1 + 1e-7, 1e5, 1e4], [0, 1, 1e5], [0, 0, 1]])
    ask(f"logm({lua(A)})", close(log))
    ask(f"sqrtm({lua(A)})", lambda X: la.norm(X @ X - A) / la.norm(X) ** 2)
    ask(f"expm({lua(log)})", close(A))
    for n in (4, 8):  # Frank's matrices: eigenvalues with condition numbers up to 1e5
        F = np.array([[n - max(i, j) if j >= i - 1 else 0 for j in range(n)] for i in range(n)], float)
        ask(f"sqrtm({lua(F)})", lambda X, F=F: la.norm(X @ X - F) / la.norm(X) ** 2)
        ask(f"expm(logm({lua(F)}))", lambda X, F=F: la.norm(X - F) / la.norm(F) / 1e3)


def classical():
    ask("(care({{0, 1}, {0, 0}}, {0, 1}, {{1, 0}, {0, 2}}, {{1}}))", close(np.array([[2, 1], [1, 2]])))  # CAREX 1.1
    ask("(care({{4, 3}, {-4.5, -3.5}}, {1, -1}, {{9, 6}, {6, 4}}, {{1}}))",
        close((1 + np.sqrt(2)) * np.array([[9, 6], [6, 4]])))  # CAREX 1.2
    for e in (1e-1, 1e-3, 1e-6):  # CAREX 2.1: nearly uncontrollable
        r = np.sqrt(1 + e * e)
        X = np.array([[(1 + r) / e**2, 1 / (2 + r)], [0, 0]])
        X[1, 0], X[1, 1] = X[0, 1], 0.25 * (1 - e**2 * X[0, 1] ** 2)
        ask(f"(care({{{{1, 0}}, {{0, -2}}}}, {{{e!r}, 0}}, {{{{1, 1}}, {{1, 1}}}}, {{{{1}}}}))",
            lambda v, X=X: np.abs((v - X) / X).max())
    carex()
    darex()
    ward = [np.array([[4, 2, 0], [1, 4, 1], [1, 1, 4]]),
            np.array([[29.87942128909879, .7815750847907159, -2.289519314033932],
                      [.7815750847907159, 25.72656945571064, 8.680737820540137],
                      [-2.289519314033932, 8.680737820540137, 34.39400925519054]]),
            np.array([[-131.0, 19, 18], [-390, 56, 54], [-387, 57, 52]])]
    exact = [np.array([[147.866622446369, 183.765138646367, 71.797032399996],
                       [127.781085523181, 183.765138646367, 91.882569323184],
                       [127.781085523181, 163.679601723179, 111.968106246371]]), None,
             np.array([[-1.50964415879218, 0.3678794391096522, 0.1353352811751005],
                       [-5.632570799891, 1.471517758499875, 0.406005843524598],
                       [-4.934938326088, 1.103638317328798, 0.541341126763207]])]
    for A, E in zip(ward, exact):
        ask(f"expm({lua(A)})", close(la.expm(A) if E is None else E))
    for scale in (1e-9, 1, 1e9):
        A = scale * np.array([[4.0, 1, 1], [2, 4, 1], [0, 1, 4]])
        ask(f"sqrtm({lua(A)})", lambda X, A=A: la.norm(X @ X - A) / la.norm(A))
    kenney_laub()


def main():
    for system in random_systems():
        one_system(*system)
    classical()
    bad, worst = 0, 0.0
    for value, expression, check in zip(oracle.values(problems), problems, checks):
        error = float("inf") if isinstance(value, str) else float(check(value))
        worst = max(worst, error if np.isfinite(error) else 0)
        if not error <= 1e-8:
            bad += 1
            if bad <= 5:
                print(f"{error:.2e}: {expression[:300]}\n    {str(value)[:200]}")
    print(f"{len(problems) - bad} of {len(problems)} agree with scipy; largest error {worst:.1e}")
    return bad > 0


sys.exit(main())
