"""End values of the models in references_test.lua from equations written by hand: scipy, without Pendula.
/usr/bin/python3 tests/parts/references.py prints them."""
import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm, solve_discrete_are

TIGHT = dict(rtol=1e-12, atol=1e-13)


def end(f, x, to, start=0, method="DOP853", **options):
    s = solve_ivp(f, (start, to), x, method=method, **{**TIGHT, **options})
    assert s.success, s.message
    return s.y[:, -1]


def chua():
    L, C1, C2, G, R0, Ga, Gb = 18, 10, 100, 0.565, 0.0125, -0.757576, -0.409091
    f = lambda v: Gb*v + 0.5*(Ga - Gb)*(abs(v + 1) - abs(v - 1))
    right = lambda t, x: [(G*(x[1] - x[0]) - f(x[0]))/C1, (G*(x[0] - x[1]) + x[2])/C2, (-x[1] - R0*x[2])/L]
    return end(right, [4, 0, 0], 200, max_step=0.05)


def furuta():
    m, l, R, J, g, k, Ra, La = 0.1, 0.2, 0.15, 1e-3, 9.81, 0.05, 2, 1e-3

    def right(t, x):
        th, al, w, v, i = x
        s, c = np.sin(al), np.cos(al)
        M = np.array([[J + m*R*R + m*l*l*s*s, -m*R*l*c], [-m*R*l*c, m*l*l]])
        h = np.array([2*m*l*l*s*c*w*v + m*R*l*s*v*v, -m*l*l*s*c*w*w - m*g*l*s])
        a = np.linalg.solve(M, np.array([k*i, 0]) - h)
        return [w, v, a[0], a[1], (1 - Ra*i - k*w)/La]
    return end(right, [0, 0.1, 0, 0, 0], 1, method="Radau", rtol=1e-11)


def three_tanks():
    A, a, g = 0.0154, 5e-5, 9.81
    root = lambda dp: dp/(dp*dp + 1)**0.25
    q = lambda Cd, dp: Cd*a*np.sqrt(2/1000)*root(dp)

    def right(t, h):
        p = 9810*h
        q13, q32, q20 = q(0.5, p[0] - p[2]), q(0.5, p[2] - p[1]), q(0.6, p[1])
        return [(3e-5 - q13)/A, (q32 - q20)/A, (q13 - q32)/A]
    return end(right, [0.4, 0.2, 0.3], 200)


def rectifier(ron=1e-3, goff=1e-6):
    """Bridge with four ideal diodes behind a resistor; states: capacitor, regimes: which pair conducts."""
    C, RL, Ri = 1e-3, 100, 1

    def network(t, v):
        """Currents by trying all 16 combinations of on and off."""
        u = 10*np.sin(2*np.pi*50*t)
        for mask in range(16):
            g = [1/ron if mask >> k & 1 else goff for k in range(4)]
            # nodes: a (behind Ri), b (V.n), plus (v), minus 0; D1 a→plus, D2 minus→a, D3 b→plus, D4 minus→b
            # the source current j from b to a through V and Ri: va - vb = u - Ri j
            M = np.array([[g[0] + g[1], 0, -1], [0, g[2] + g[3], 1], [1, -1, Ri]])
            va, vb, j = np.linalg.solve(M, [g[0]*v, g[2]*v, u])
            drops = [va - v, -va, vb - v, -vb]
            if all((drops[k] > 0) == bool(mask >> k & 1) for k in range(4)):
                return mask, (g[0]*drops[0] + g[2]*drops[2] - v/RL)/C
        raise ValueError
    s = solve_ivp(lambda t, x: [network(t, x[0])[1]], (0, 0.1), [0.0], method="RK45", rtol=1e-10, atol=1e-12, max_step=2e-5)
    return s.y[:, -1]


def buck():
    ron, goff, V, L, C, R = 1e-3, 1e-6, 12, 1e-3, 1e-4, 10

    def node(i, on):
        """Voltage after the switch: the current i leaves, the diode conducts below 0."""
        gs = 1/ron if on else goff
        v = (gs*V - i)/(gs + goff)
        return v if v >= 0 else (gs*V - i)/(gs + 1/ron)
    x, T = np.zeros(2), 1e-4
    for k in range(20):
        for half in (0, 1):
            x = end(lambda t, x: [(node(x[0], half == 0) - x[1])/L, (x[0] - x[1]/R)/C], x, k*T + (half + 1)*T/2,
                    start=k*T + half*T/2, max_step=T/50)
    return x


def h_bridge():
    """DC motor at ±24 V, duty 0.7 of 1 ms, four switches of 10 mOhm: 20 mOhm in the path."""
    R, L, k, J, d = 1 + 0.02, 5e-3, 0.1, 1e-3, 1e-3
    A = np.array([[-R/L, -k/L], [k/J, -d/J]])
    x = np.zeros(2)
    for period in range(100):
        for u, dt in ((24, 7e-4), (-24, 3e-4)):
            rest = np.linalg.solve(A, -np.array([u/L, 0]))
            x = rest + expm(A*dt) @ (x - rest)
    return x


def cylinder():
    """Servo valve and cylinder: opening 0.5 from 0.1 s on; mass 100 kg with damping against a spring."""
    K, ps, V0, Aa, Ab, B, m, d, c, stroke = 1e-8, 1e7, 1e-4, 2e-3, 1e-3, 1e9, 100, 2000, 1e4, 1

    root = lambda dp: dp/(dp*dp + 1)**0.25

    def right(t, x):
        s, v, pa, pb = x
        u = 0.5 if t >= 0.1 else 0
        qa, qb = K*u*root(ps - pa), -K*u*root(pb)
        return [v, (Aa*pa - Ab*pb - d*v - c*s)/m, B*(qa - Aa*v)/(V0 + Aa*s), B*(qb + Ab*v)/(V0 + Ab*(stroke - s))]
    x = [0, 0, 0, 0]
    return end(right, x, 0.5, start=0.1, method="Radau", rtol=1e-11, atol=1e-11)


def quarter_car():
    """Body 300 kg, wheel 40 kg, suspension, tyre that lifts off, bump stop at 0.05 m; a step of 0.1 m."""
    mb, mw, ks, ds, kt, kb, g = 300, 40, 1.5e4, 1200, 1.6e5, 2e5, 9.81

    def right(t, x):
        zb, vb, zw, vw = x                              # from the unloaded places
        gap = zb - zw
        f = -ks*gap - ds*(vb - vw) + max(0, -kb*(gap + 0.25))
        tyre = max(0, -kt*(zw - 0.1))
        return [vb, f/mb - g, vw, (tyre - f)/mw - g]
    zw = -(mb + mw)*g/kt
    return end(right, [zw - mb*g/ks, 0, zw, 0], 1, max_step=2e-4, rtol=1e-10)


def crane():
    M, m, l, g = 50, 20, 3, 9.81

    def right(t, x):
        s, th, v, w = x
        F = 30 if t < 1 else -30 if t < 2 else 0
        A = np.array([[M + m, m*l*np.cos(th)], [np.cos(th), l]])
        a = np.linalg.solve(A, [F + m*l*np.sin(th)*w*w, -g*np.sin(th)])
        return [v, w, a[0], a[1]]
    x = end(right, [0, 0, 0, 0], 1)
    x = end(right, x, 2, start=1 + 1e-13)
    return end(right, x, 5, start=2 + 1e-13)


def lqr_pendulum():
    """Cart 1 kg, bob 0.2 kg on 0.5 m, upright; u = -K x every 0.02 s, K from the sampled linear model."""
    M, m, l, g, Ts = 1, 0.2, 0.5, 9.81, 0.02
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, m*g/M, 0, 0], [0, (M + m)*g/(M*l), 0, 0]])
    B = np.array([[0], [0], [1/M], [1/(M*l)]])
    E = expm(np.block([[A, B], [np.zeros((1, 5))]])*Ts)
    Ad, Bd = E[:4, :4], E[:4, 4:]
    X = solve_discrete_are(Ad, Bd, np.diag([10, 10, 1, 1]), np.eye(1))
    K = np.linalg.solve(1 + Bd.T @ X @ Bd, Bd.T @ X @ Ad)[0]

    def right(t, x, u):
        s, th, v, w = x
        N = np.array([[M + m, -m*l*np.cos(th)], [-np.cos(th), l]])
        a = np.linalg.solve(N, [u - m*l*np.sin(th)*w*w, g*np.sin(th)])
        return [v, w, a[0], a[1]]
    x = np.array([0, 0.2, 0, 0])
    for k in range(100):
        u = -K @ x
        x = end(lambda t, x: right(t, x, u), x, Ts)
    return np.concatenate([K, x])


def inrush():
    """50 Hz, 325 V peak at the zero crossing, R = 1 Ohm; i = psi/L (1 + (psi/psis)^8)."""
    R, L, psis = 1, 1, 1

    def right(t, x):
        psi = x[0]
        return [325*np.sin(2*np.pi*50*t) - R*psi/L*(1 + (psi/psis)**8)]
    psi = end(right, [0.2], 0.01)[0]
    later = end(right, [0.2], 0.2)[0]
    current = lambda psi: psi/L*(1 + (psi/psis)**8)
    return [psi, current(psi), later, current(later)]


def saturated_rlc():
    R, L, psis, C = 0.5, 0.1, 0.05, 1e-3
    return end(lambda t, x: [5*np.cos(60*t) - R*x[0]/L*(1 + (x[0]/psis)**8) - x[1],
                             x[0]/L*(1 + (x[0]/psis)**8)/C], [0, 0], 0.5)


def six_pulse(ron=1e-2, goff=1e-5):
    """Three-phase bridge with line resistance 0.1 Ohm, an R-L load of 10 Ohm and 0.05 H."""
    Rl, R, L = 0.1, 10, 0.05
    n = np.arange(3)

    def load_voltage(t, i):
        u = 100*np.cos(2*np.pi*50*t - 2*np.pi*n/3)
        for mask in range(64):
            g = np.array([1/ron if mask >> k & 1 else goff for k in range(6)])  # upper 0-2, lower 3-5
            # unknown: phase nodes a, b, c, plus, minus, and the star point is 0; currents by conductance
            M, b = np.zeros((5, 5)), np.zeros(5)
            for k in range(3):
                M[k, k] += 1/Rl + g[k] + g[3 + k]
                M[k, 3] -= g[k]
                M[k, 4] -= g[3 + k]
                b[k] = u[k]/Rl
                M[3, 3] += g[k]
                M[3, k] -= g[k]
                M[4, 4] += g[3 + k]
                M[4, k] -= g[3 + k]
            b[3], b[4] = -i, i
            v = np.linalg.solve(M, b)
            drops = np.concatenate([v[:3] - v[3], v[4] - v[:3]])
            if all((drops[k] > 0) == bool(mask >> k & 1) for k in range(6)):
                return v[3] - v[4]
        raise ValueError
    s = solve_ivp(lambda t, x: [(load_voltage(t, x[0]) - R*x[0])/L], (0, 0.01), [0.0], method="RK45", rtol=1e-8, atol=1e-10,
                  max_step=2e-5)
    return s.y[:, -1]


def motor_pid():
    """DC motor, PI controller with limits ±24 V and back calculation, reference 100 rad/s, load from 0.5 s."""
    R, L, k, J, d, K, Ti = 1, 2e-3, 0.1, 1e-3, 1e-4, 0.5, 0.1

    def right(t, x):
        i, w, z = x
        a = K*(100 - w) + z
        u = min(24, max(-24, a))
        load = 0.5 if t > 0.5 else 0
        return [(u - R*i - k*w)/L, (k*i - d*w - load)/J, K/Ti*(100 - w) + (u - a)/Ti]
    x = end(right, [0, 0, 0], 0.5, max_step=1e-4)
    return end(right, x, 1, start=0.5 + 1e-13, max_step=1e-4)


def heat_exchanger():
    """Effectiveness of an ideal counterflow exchanger: UA = 1000, w1 = 500, w2 = 800 W/K (Kays & London)."""
    NTU, C = 2, 500/800
    x = np.exp(-NTU*(1 - C))
    eps = (1 - x)/(1 - C*x)
    return [350 - eps*(350 - 290), 290 + C*eps*(350 - 290)]


def ladder():
    """Three levels of RC cells, 2 × 2 × 2 of them in a row behind 1 V: R = 1, C = 0.1 each."""
    n = 8
    A = np.zeros((n, n))
    b = np.zeros(n)
    for k in range(n):
        A[k, k] -= 10
        if k:
            A[k, k - 1] += 10
            A[k - 1, k] += 10
            A[k - 1, k - 1] -= 10
    b[0] = 10
    rest = np.linalg.solve(A, -b)
    return rest - expm(A*2) @ rest


def slider_crank():
    """Crank 0.1 m (J = 0.01), rod 0.3 m without mass, piston 0.5 kg, no gravity; starts with 20 rad/s."""
    r, l, m, J = 0.1, 0.3, 0.5, 0.01

    def right(t, x):
        th, w = x
        s, c = np.sin(th), np.cos(th)
        root = np.sqrt(l*l - r*r*s*s)
        dx = -r*s - r*r*s*c/root                        # d(place)/d(angle)
        ddx = -r*c - r*r*(c*c - s*s)/root - r**4*s*s*c*c/root**3
        return [w, -m*dx*ddx*w*w/(J + m*dx*dx)]
    return end(right, [0.3, 20], 0.5)


def four_bar():
    """Crank 0.1, coupler 0.4, rocker 0.3, ground 0.35 m; J = 0.01, 0.02, 0.03 about the pivots (coupler: only J and
    its mass 1 kg at the crank pin); crank driven by 0.5 N m."""
    a, b, c, d = 0.1, 0.4, 0.3, 0.35
    J1, J2, J3, m = 0.01, 0.02, 0.03, 1.0

    def angles(th, guess):
        x = np.array(guess)
        for _ in range(50):
            f = np.array([a*np.cos(th) + b*np.cos(x[0]) - d - c*np.cos(x[1]), a*np.sin(th) + b*np.sin(x[0]) - c*np.sin(x[1])])
            Jm = np.array([[-b*np.sin(x[0]), c*np.sin(x[1])], [b*np.cos(x[0]), -c*np.cos(x[1])]])
            x = x - np.linalg.solve(Jm, f)
        return x
    memory = [np.array([0.8, 1.6])]

    def gains(th):
        x = memory[0] = angles(th, memory[0])
        Jm = np.array([[-b*np.sin(x[0]), c*np.sin(x[1])], [b*np.cos(x[0]), -c*np.cos(x[1])]])
        first = np.linalg.solve(Jm, [a*np.sin(th), -a*np.cos(th)])
        second = np.linalg.solve(Jm, [a*np.cos(th) + b*np.cos(x[0])*first[0]**2 - c*np.cos(x[1])*first[1]**2,
                                      a*np.sin(th) + b*np.sin(x[0])*first[0]**2 - c*np.sin(x[1])*first[1]**2])
        return first, second

    def right(t, x):
        first, second = gains(x[0])
        I = J1 + m*a*a + J2*first[0]**2 + J3*first[1]**2
        return [x[1], (0.5 - (J2*first[0]*second[0] + J3*first[1]*second[1])*x[1]**2)/I]
    th, w = end(right, [0.5, 0], 1)
    return [th, w, *angles(th, memory[0])]


def wishbone():
    """Two links on a carrier, spring and damper between the seat and the carrier; constraints differentiated twice."""
    m, J, g, k, d, s0 = 20, 0.5, 9.81, 2e4, 1500, 0.65

    def phi(q):                                          # carrier x, y, angle
        x, y, p = q
        low = np.array([x + 0.15*np.sin(p), y - 0.15*np.cos(p)])
        up = np.array([x - 0.15*np.sin(p), y + 0.15*np.cos(p)]) - np.array([0.1, 0.3])
        return np.array([low @ low - 0.16, up @ up - 0.09])/2

    def jac(q):
        x, y, p = q
        s, c = 0.15*np.sin(p), 0.15*np.cos(p)
        X, Y = x - s - 0.1, y + c - 0.3
        return np.array([[x + s, y - c, (x + s)*c + (y - c)*s], [X, Y, -X*c - Y*s]])

    def right(t, z):
        q, v = z[:3], z[3:]
        G = jac(q)
        e = 1e-6
        gamma = -((jac(q + e*v) - jac(q - e*v))/(2*e)) @ v
        r = q[:2] - np.array([0.1, 0.6])
        s = np.linalg.norm(r)
        f = k*(s - s0) + d*(r @ v[:2])/s
        force = np.array([-f*r[0]/s, -f*r[1]/s - m*g, 0])
        W = np.block([[np.diag([m, m, J]), G.T], [G, np.zeros((2, 2))]])
        a = np.linalg.solve(W, np.concatenate([force, gamma]))[:3]
        return np.concatenate([v, a])
    return end(right, [0.4, 0.15, 0, 0, 0, 0], 0.2, method="RK45", rtol=1e-10, atol=1e-11)[:3]


if __name__ == "__main__":
    for name, value in list(globals().items()):
        if callable(value) and getattr(value, "__module__", "") == "__main__" and name != "end":
            print(name, " ".join(f"{v:.12g}" for v in np.atleast_1d(value())), flush=True)
