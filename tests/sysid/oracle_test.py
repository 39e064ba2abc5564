"""Identification against scipy and statsmodels on the recordings in scripts/data.

OE, ARMAX and BJ models from rest: scipy's least squares on the prediction errors, begun at estimates of its own, may not
find a lower loss than ours, and begun at ours none lower by 1e-9; standard deviations from complex steps of its filters. AR models and
Ljung-Box statistics: statsmodels, where it is installed. Skipped where python3-scipy is not installed.

usage: PENDULA=path/to/pendula oracle_test.py
"""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import oracle

oracle.require("numpy", "scipy")
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter
try:
    from statsmodels.stats.diagnostic import acorr_ljungbox
    from statsmodels.tsa.ar_model import AutoReg
except ImportError:
    acorr_ljungbox = AutoReg = None

DATA = os.path.join(os.environ.get("PENDULA_ROOT", "."), "scripts", "data")
RECORDS = {"hairdryer": ("u_voltage", "y_temp", 0.08), "heating": ("u_volt", "y_degC", 2), "gasfurnace": ("u_gasrate", "y_co2", 9)}
# record, estimator, na, nb, nc, nd, nf, nk
MODELS = [
    ("hairdryer", "oe", 0, 2, 0, 0, 2, 3), ("hairdryer", "armax", 2, 2, 2, 0, 0, 3), ("hairdryer", "bj", 0, 2, 2, 2, 2, 3),
    ("heating", "oe", 0, 2, 0, 0, 2, 1), ("heating", "armax", 2, 2, 2, 0, 0, 1), ("heating", "bj", 0, 2, 1, 1, 2, 1),
    ("gasfurnace", "oe", 0, 3, 0, 0, 1, 3), ("gasfurnace", "armax", 2, 3, 1, 0, 0, 3), ("gasfurnace", "bj", 0, 3, 0, 2, 1, 3),
]


def record(name):
    u, y, _ = RECORDS[name]
    with open(os.path.join(DATA, name + ".csv"), encoding="utf-8") as f:
        head = f.readline().strip().split(",")
        rows = np.array([[float(v) for v in line.split(",")] for line in f if line.strip()])
    signals = rows[:, head.index(y)], rows[:, head.index(u)]
    return [s - s.mean() for s in signals]


def parts(theta, orders):
    """A, B, C, D, F in the order in which θ is printed: a, b, c, d, f."""
    na, nb, nc, nd, nf, nk = orders
    cuts = np.cumsum([na, nb, nc, nd])
    a, b, c, d, f = np.split(np.asarray(theta), cuts)
    one = lambda p: np.r_[1.0, p]
    return one(a), np.r_[np.zeros(nk), b], one(c), one(d), one(f)


def errors(theta, y, u, orders):
    A, B, C, D, F = parts(theta, orders)
    for p in (C, F):
        if len(p) > 1 and np.abs(np.roots(p)).max() >= 1:
            return np.full(len(y), 1e3 * np.abs(y).max())
    w = lfilter(B, F, u) if len(F) > 1 else lfilter(B, [1.0], u)
    e = lfilter(A, [1.0], y) - w
    return lfilter(D, C, e)


def jacobian(theta, y, u, orders):
    """Exact to rounding: the imaginary part of a complex step."""
    step = 1e-30j * np.eye(len(theta))
    return np.array([errors(theta + e, y, u, orders).imag / 1e-30 for e in step]).T


def starts(y, u, orders):
    """A and F from ARX, the noise from nothing, and the same with random changes."""
    na, nb, nc, nd, nf, nk = orders
    n = max(na, nf)
    first = max(n, nb + nk - 1)
    Phi = np.array([[*(-y[t - 1 - i] for i in range(n)), *(u[t - nk - i] for i in range(nb))] for t in range(first, len(y))])
    theta = np.linalg.lstsq(Phi, y[first:], rcond=None)[0]
    rng = np.random.default_rng(18)
    for spread in (0, 0.02, 0.05, 0.05, 0.1):
        poles = theta[:n] * (1 + spread * rng.normal(size=n))
        yield np.r_[poles[:na], theta[n:], np.zeros(nc + nd), poles[:nf]]


def search(start, y, u, orders):
    return least_squares(errors, start, args=(y, u, orders), method="trf", x_scale="jac", xtol=1e-14, ftol=1e-15,
                         gtol=1e-14, max_nfev=400)


def model_complaint(words, model):
    name, kind, *orders = model
    y, u = record(name)
    count = sum(orders[:5])
    theta, std, loss = np.array(words[:count]), np.array(words[count:2 * count]), words[2 * count]
    own = np.mean(errors(theta, y, u, orders)**2)
    if abs(own - loss) > 1e-9 * loss:
        return f"loss {loss:.9g}, by scipy's filters {own:.9g}"
    there = search(theta, y, u, orders)
    if 2 * there.cost / len(y) < loss * (1 - 1e-9):
        return f"no minimum: {loss:.9g}, scipy goes on to {2 * there.cost / len(y):.9g}"
    best = min(2 * search(start, y, u, orders).cost / len(y) for start in starts(y, u, orders))
    if best < loss * (1 - 1e-6):
        return f"loss {loss:.9g}, scipy's own search finds {best:.9g}"
    sigma2 = loss * len(y) / (len(y) - count)
    J = jacobian(theta, y, u, orders)
    expected = np.sqrt(sigma2 * np.diag(np.linalg.inv(J.T @ J)))
    if not np.allclose(std, expected, rtol=1e-6):
        return f"deviations {std}, from scipy's filters {expected}"
    return None


def ar_complaint(words, name, order):
    y, _ = record(name)
    if AutoReg is None:
        return None
    fit = AutoReg(y, lags=order, trend="n", old_names=False).fit()
    theta, Q, p = np.array(words[:order]), words[order], words[order + 1]
    if not np.allclose(-theta, fit.params, rtol=1e-8, atol=1e-10):
        return f"θ {theta}, statsmodels {-fit.params}"
    table = acorr_ljungbox(fit.resid, lags=[25], model_df=order, return_df=True)
    if not np.allclose([Q, p], [table.lb_stat.iloc[0], table.lb_pvalue.iloc[0]], rtol=1e-6, atol=1e-12):
        return f"Q, p = {Q}, {p}, statsmodels {table.values}"
    return None


def script():
    out = ["local function show(...) local r = {} for _, v in ipairs { ... } do if type(v) == 'number' then r[#r + 1] = "
           "('%.17g'):format(v) else for i = 1, #v do r[#r + 1] = ('%.17g'):format(v[i]) end end end "
           "print(table.concat(r, ' ')) end"]
    for name, (u, y, Ts) in RECORDS.items():
        path = os.path.join(DATA, name + ".csv")
        out.append(f"{name} = iddata.read({path!r}, {{ y = {y!r}, u = {u!r}, Ts = {Ts} }}):detrend()")
    for name, kind, *orders in MODELS:
        options = ", ".join(f"{k} = {v}" for k, v in zip(("na", "nb", "nc", "nd", "nf", "nk"), orders) if v or k == "nk")
        out.append(f"do local m = {kind}({name}, {{ {options}, ic = 'zero' }}) show(m.theta, m.std, m.loss) end")
    for name in RECORDS:
        for order in (2, 5):
            out.append(f"do local d = iddata {{ y = {name}.y, Ts = {name}.Ts }} local m = arx(d, {{ na = {order} }}) "
                       "local t = m:validate(d).ljung_box show(m.theta, t.Q, t.p) end")
    return "\n".join(out) + "\n"


def main():
    checks = [(str(model), lambda words, model=model: model_complaint(words, model)) for model in MODELS]
    checks += [(f"AR({order}) of {name}", lambda words, name=name, order=order: ar_complaint(words, name, order))
               for name in RECORDS for order in (2, 5)]
    lines = [[float(v) for v in line.split()] for line in oracle.lines_of(script(), len(checks), 300)]
    bad = 0
    for words, (what, check) in zip(lines, checks):
        complaint = check(words)
        if complaint:
            bad += 1
            print(f"{what}: {complaint}")
    print(f"{len(checks) - bad} of {len(checks)} estimates agree with scipy"
          + (" and statsmodels" if AutoReg else "; statsmodels is not installed"))
    return bad > 0


sys.exit(main())
