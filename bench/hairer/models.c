// Right-hand sides, as a person writes them for speed, for DOP853 and RADAU5: void f(n, t, y, y', rpar, ipar), and
// Jacobians in band storage, J[i - j + upper + ld*j] = ∂fᵢ/∂yⱼ.
// Equations: bench/problems/*.lua, stdlib/problems/mechanics/squeezer.lua.
#include <math.h>
#include <string.h>

#define RHS(name) void name(const int* n, const double* t, const double* y, double* f, double* rpar, int* ipar)
#define JAC(name) \
  void name(const int* n, const double* t, const double* y, const int* lower, const int* upper, double* J, \
            const int* ld, double* rpar, int* ipar)

RHS(still) { f[0] = 0; }

RHS(arenstorf) {
  const double mu = 0.012277471, nu = 1 - mu;
  const double a = y[0] + mu, b = y[0] - nu, q = y[1] * y[1];
  const double d1 = a * a + q, d2 = b * b + q;
  const double r1 = nu / (d1 * sqrt(d1)), r2 = mu / (d2 * sqrt(d2));
  f[0] = y[2], f[1] = y[3];
  f[2] = y[0] + 2 * y[3] - r1 * a - r2 * b;
  f[3] = y[1] - 2 * y[2] - r1 * y[1] - r2 * y[1];
}

/// x₁ … x₇, y₁ …, u₁ …, v₁ …; masses 1 … 7
RHS(pleiades) {
  enum { N = 7 };
  const double *x = y, *z = y + N;
  memcpy(f, y + 2 * N, 2 * N * sizeof(double));
  double *fx = f + 2 * N, *fy = f + 3 * N;
  for (int i = 0; i < N; ++i) fx[i] = fy[i] = 0;
  for (int i = 0; i < N; ++i)
    for (int j = i + 1; j < N; ++j) {
      const double dx = x[j] - x[i], dy = z[j] - z[i], r2 = dx * dx + dy * dy, r = 1 / (r2 * sqrt(r2));
      fx[i] += (j + 1) * r * dx, fy[i] += (j + 1) * r * dy;
      fx[j] -= (i + 1) * r * dx, fy[j] -= (i + 1) * r * dy;
    }
}

/// Charges on the unit sphere that repel each other, with friction; the multipliers of the sphere are written out:
/// p″ = g - 0.5 p′ - (p·g + |p′|²) p with g = Σ (p - pⱼ)/|p - pⱼ|³. Unknowns: x, y, z, u, v, w of all.
RHS(particles) {
  enum { most = 64 };
  const int N = *n / 6;
  const double *x = y, *Y = y + N, *z = y + 2 * N, *u = y + 3 * N, *v = y + 4 * N, *w = y + 5 * N;
  double gx[most] = {0}, gy[most] = {0}, gz[most] = {0};
  for (int i = 0; i < N; ++i) {
    double sx = gx[i], sy = gy[i], sz = gz[i];
    for (int j = i + 1; j < N; ++j) {
      const double dx = x[i] - x[j], dy = Y[i] - Y[j], dz = z[i] - z[j];
      const double r2 = dx * dx + dy * dy + dz * dz, r = 1 / (r2 * sqrt(r2));
      sx += r * dx, sy += r * dy, sz += r * dz;
      gx[j] -= r * dx, gy[j] -= r * dy, gz[j] -= r * dz;
    }
    gx[i] = sx, gy[i] = sy, gz[i] = sz;
  }
  memcpy(f, y + 3 * N, 3 * N * sizeof(double));
  for (int i = 0; i < N; ++i) {
    const double l = x[i] * gx[i] + Y[i] * gy[i] + z[i] * gz[i] + u[i] * u[i] + v[i] * v[i] + w[i] * w[i];
    f[3 * N + i] = gx[i] - 0.5 * u[i] - l * x[i];
    f[4 * N + i] = gy[i] - 0.5 * v[i] - l * Y[i];
    f[5 * N + i] = gz[i] - 0.5 * w[i] - l * z[i];
  }
}

/// A x = b of two by two, symmetric, in place of b
static void solve2(double a, double b, double d, double* p, double* q) {
  const double det = 1 / (a * d - b * b), x = (d * *p - b * *q) * det;
  *q = (a * *q - b * *p) * det;
  *p = x;
}

/// β, θ, γ, φ, δ, Ω, ε and their velocities; the multipliers by G M⁻¹ Gᵀ, the mass matrix by its blocks of two.
RHS(squeezer) {
  const double m1 = .04325, m2 = .00365, m3 = .02373, m4 = .00706, m5 = .07050, m6 = .00706, m7 = .05498;
  const double i1 = 2.194e-6, i2 = 4.41e-7, i3 = 5.255e-6, i4 = 5.667e-7, i5 = 1.169e-5, i6 = 5.667e-7, i7 = 1.912e-5;
  const double xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072, d = 0.028, da = 0.0115, e = 0.02, ea = 0.01421;
  const double rr = 0.007, ra = 0.00092, ss = 0.035, sa = 0.01874, sb = 0.01043, sc = 0.018, sd = 0.02;
  const double ta = 0.02308, tb = 0.00916, u = 0.04, ua = 0.01228, ub = 0.00449, zf = 0.02, zt = 0.04, fa = 0.01421;
  const double c0 = 4530, l0 = 0.07785, mom = 0.033;
  const double sibe = sin(y[0]), cobe = cos(y[0]), sith = sin(y[1]), coth = cos(y[1]), siga = sin(y[2]), coga = cos(y[2]);
  const double siph = sin(y[3]), coph = cos(y[3]), side = sin(y[4]), code = cos(y[4]);
  const double siom = sin(y[5]), coom = cos(y[5]), siep = sin(y[6]), coep = cos(y[6]);
  const double sibeth = sibe * coth + cobe * sith, cobeth = cobe * coth - sibe * sith;
  const double siphde = siph * code + coph * side, cophde = coph * code - siph * side;
  const double siomep = siom * coep + coom * siep, coomep = coom * coep - siom * siep;
  const double bep = y[7], thp = y[8], php = y[10], dep = y[11], omp = y[12], epp = y[13], gap = y[9];

  const double m11 = m1 * ra * ra + m2 * (rr * rr - 2 * da * rr * coth + da * da) + i1 + i2;
  const double m12 = m2 * (da * da - da * rr * coth) + i2, m22 = m2 * da * da + i2;
  const double m33 = m3 * (sa * sa + sb * sb) + i3;
  const double m44 = m4 * (e - ea) * (e - ea) + i4, m45 = m4 * ((e - ea) * (e - ea) + zt * (e - ea) * siph) + i4;
  const double m55 = m4 * (zt * zt + 2 * zt * (e - ea) * siph + (e - ea) * (e - ea)) + m5 * (ta * ta + tb * tb) + i4 + i5;
  const double m66 = m6 * (zf - fa) * (zf - fa) + i6, m67 = m6 * ((zf - fa) * (zf - fa) - u * (zf - fa) * siom) + i6;
  const double m77 = m6 * ((zf - fa) * (zf - fa) - 2 * u * (zf - fa) * siom + u * u) + m7 * (ua * ua + ub * ub) + i6 + i7;

  const double xd = sd * coga + sc * siga + xb, yd = sd * siga - sc * coga + yb;
  const double lang = sqrt((xd - xc) * (xd - xc) + (yd - yc) * (yd - yc)), force = -c0 * (lang - l0) / lang;
  const double fx = force * (xd - xc), fy = force * (yd - yc);
  double a[7] = {mom - m2 * da * rr * thp * (thp + 2 * bep) * sith,
                 m2 * da * rr * bep * bep * sith,
                 fx * (sc * coga - sd * siga) + fy * (sd * coga + sc * siga),
                 m4 * zt * (e - ea) * dep * dep * coph,
                 -m4 * zt * (e - ea) * php * (php + 2 * dep) * coph,
                 -m6 * u * (zf - fa) * epp * epp * coom,
                 m6 * u * (zf - fa) * omp * (omp + 2 * epp) * coom};

  // rows of G: columns β, θ in all; γ in 0, 1; φ, δ in 2, 3; Ω, ε in 4, 5
  const double gb[2] = {-rr * sibe + d * sibeth, rr * cobe - d * cobeth}, gt[2] = {d * sibeth, -d * cobeth};
  const double gg[2] = {-ss * coga, -ss * siga};
  const double gp[2] = {-e * cophde, -e * siphde}, gd[2] = {-e * cophde + zt * side, -e * siphde - zt * code};
  const double go[2] = {zf * siomep, -zf * coomep}, ge[2] = {zf * siomep - u * coep, -zf * coomep - u * siep};
  // g = -(∂²g/∂q²)(q′, q′)
  const double bt = bep + thp, pd = php + dep, oe = omp + epp;
  const double rb[2] = {rr * cobe * bep * bep - d * cobeth * bt * bt, rr * sibe * bep * bep - d * sibeth * bt * bt};
  double rhs[6] = {rb[0] - ss * siga * gap * gap,
                   rb[1] + ss * coga * gap * gap,
                   rb[0] - e * siphde * pd * pd - zt * code * dep * dep,
                   rb[1] + e * cophde * pd * pd - zt * side * dep * dep,
                   rb[0] - zf * coomep * oe * oe - u * siep * epp * epp,
                   rb[1] - zf * siomep * oe * oe + u * coep * epp * epp};

  // M⁻¹ of the right side and of the columns of Gᵀ, block by block
  solve2(m11, m12, m22, &a[0], &a[1]);
  a[2] /= m33;
  solve2(m44, m45, m55, &a[3], &a[4]);
  solve2(m66, m67, m77, &a[5], &a[6]);
  double b1[2], b2[2], p1[2], p2[2], o1[2], o2[2], g1[2];
  for (int k = 0; k < 2; ++k) {
    b1[k] = gb[k], b2[k] = gt[k], p1[k] = gp[k], p2[k] = gd[k], o1[k] = go[k], o2[k] = ge[k];
    solve2(m11, m12, m22, &b1[k], &b2[k]);
    solve2(m44, m45, m55, &p1[k], &p2[k]);
    solve2(m66, m67, m77, &o1[k], &o2[k]);
    g1[k] = gg[k] / m33;
  }
  double S[6][6];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) {
      const int k = i & 1, l = j & 1;
      double s = gb[k] * b1[l] + gt[k] * b2[l];
      if (i / 2 == j / 2) s += i < 2 ? gg[k] * g1[l] : i < 4 ? gp[k] * p1[l] + gd[k] * p2[l] : go[k] * o1[l] + ge[k] * o2[l];
      S[i][j] = s;
    }
  for (int i = 0; i < 6; ++i) {
    const int k = i & 1;
    double s = gb[k] * a[0] + gt[k] * a[1];
    s += i < 2 ? gg[k] * a[2] : i < 4 ? gp[k] * a[3] + gd[k] * a[4] : go[k] * a[5] + ge[k] * a[6];
    rhs[i] = s - rhs[i];
  }
  for (int j = 0; j < 6; ++j) {  // Cholesky without roots
    for (int k = 0; k < j; ++k)
      for (int i = j; i < 6; ++i) S[i][j] -= S[i][k] * S[j][k] * S[k][k];
    const double r = 1 / S[j][j];
    for (int i = j + 1; i < 6; ++i) S[i][j] *= r;
  }
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < i; ++k) rhs[i] -= S[i][k] * rhs[k];
  for (int i = 5; i >= 0; --i) {
    rhs[i] /= S[i][i];
    for (int k = i + 1; k < 6; ++k) rhs[i] -= S[k][i] * rhs[k];
  }
  memcpy(f, y + 7, 7 * sizeof(double));
  double c[7];
  const double bx = rhs[0] + rhs[2] + rhs[4], by = rhs[1] + rhs[3] + rhs[5];
  c[0] = b1[0] * bx + b1[1] * by, c[1] = b2[0] * bx + b2[1] * by;
  c[2] = g1[0] * rhs[0] + g1[1] * rhs[1];
  c[3] = p1[0] * rhs[2] + p1[1] * rhs[3], c[4] = p2[0] * rhs[2] + p2[1] * rhs[3];
  c[5] = o1[0] * rhs[4] + o1[1] * rhs[5], c[6] = o2[0] * rhs[4] + o2[1] * rhs[5];
  for (int i = 0; i < 7; ++i) f[7 + i] = a[i] - c[i];
}

/// A beam of 40 rigid pieces: angles, then velocities (Hairer & Wanner II, §IV.1: two tridiagonal solutions).
RHS(beam) {
  enum { N = 40 };
  const double *th = y, *om = y + N;
  const double s = sin(*t), force = *t < M_PI ? 1.5 * s * s : 0;
  double v[N], S[N], C[N], w[N], r[N], piv[N], up[N];
  for (int i = 1; i < N; ++i) S[i] = sin(th[i] - th[i - 1]), C[i] = cos(th[i] - th[i - 1]);
  const double n4 = 1.0 * N * N * N * N, n2 = 1.0 * N * N;
  for (int i = 0; i < N; ++i) {
    const double bend = i == 0 ? -3 * th[0] + th[1] : i == N - 1 ? th[N - 2] - th[N - 1] : th[i - 1] - 2 * th[i] + th[i + 1];
    v[i] = n4 * bend + (force != 0 ? n2 * force * (cos(th[i]) + sin(th[i])) : 0);
  }
  for (int i = 0; i < N; ++i) {
    r[i] = om[i] * om[i];
    if (i > 0) r[i] -= S[i] * v[i - 1];
    if (i < N - 1) r[i] += S[i + 1] * v[i + 1];
  }
  for (int i = 0; i < N; ++i) {  // tridiagonal: 1, 2 … 2, 3 and -cos
    double diagonal = i == 0 ? 1 : i == N - 1 ? 3 : 2;
    if (i > 0) diagonal += C[i] * up[i - 1], r[i] += C[i] * r[i - 1];
    piv[i] = 1 / diagonal;
    up[i] = i < N - 1 ? -C[i + 1] * piv[i] : 0;
    r[i] *= piv[i];
  }
  w[N - 1] = r[N - 1];
  for (int i = N - 2; i >= 0; --i) w[i] = r[i] - up[i] * w[i + 1];
  memcpy(f, om, N * sizeof(double));
  for (int i = 0; i < N; ++i) {
    double turn = (i == 0 ? 1 : i == N - 1 ? 3 : 2) * v[i];
    if (i > 0) turn -= C[i] * v[i - 1] + S[i] * w[i - 1];
    if (i < N - 1) turn += -C[i + 1] * v[i + 1] + S[i + 1] * w[i + 1];
    f[N + i] = turn;
  }
}

/// u₁, v₁, u₂, v₂ …
RHS(brusselator) {
  const int N = *n / 2;
  const double D = (N + 1.0) * (N + 1.0) / 50;
  for (int i = 0; i < N; ++i) {
    const double u = y[2 * i], v = y[2 * i + 1], p = u * u * v;
    const double ul = i > 0 ? y[2 * i - 2] : 1, ur = i < N - 1 ? y[2 * i + 2] : 1;
    const double vl = i > 0 ? y[2 * i - 1] : 3, vr = i < N - 1 ? y[2 * i + 3] : 3;
    f[2 * i] = 1 + p - 4 * u + D * (ul - 2 * u + ur);
    f[2 * i + 1] = 3 * u - p + D * (vl - 2 * v + vr);
  }
}
JAC(brusselator_jac) {
  const int N = *n / 2, m = *ld;
  const double D = (N + 1.0) * (N + 1.0) / 50;
  for (int i = 0; i < N; ++i) {
    const double u = y[2 * i], v = y[2 * i + 1];
    double *ju = J + 2 * i * m + 2, *jv = ju + m;  // columns u and v, at their diagonals
    ju[0] = 2 * u * v - 4 - 2 * D, ju[1] = 3 - 2 * u * v, ju[-1] = 0, ju[2] = ju[-2] = D;
    jv[0] = -u * u - 2 * D, jv[-1] = u * u, jv[1] = 0, jv[2] = jv[-2] = D;
  }
}

RHS(burgers) {
  const int N = *n;
  const double c = (N + 1) / 4.0, d = 0.0003 * (N + 1.0) * (N + 1.0);
  for (int i = 0; i < N; ++i) {
    const double l = i > 0 ? y[i - 1] : 0, r = i < N - 1 ? y[i + 1] : 0;
    f[i] = -(r * r - l * l) * c + d * (l - 2 * y[i] + r);
  }
}
JAC(burgers_jac) {
  const int N = *n, m = *ld;
  const double c = (N + 1) / 4.0, d = 0.0003 * (N + 1.0) * (N + 1.0);
  for (int j = 0; j < N; ++j) {
    double* at = J + j * m + 1;
    at[0] = -2 * d, at[1] = 2 * c * y[j] + d, at[-1] = -2 * c * y[j] + d;
  }
}

RHS(heat) {
  const int N = (int)lround(sqrt(*n));
  const double d = (N + 1.0) * (N + 1.0), s = 100 * sin(10 * *t);
  static double shape[200 * 200];
  static int known;
  if (known != N) {
    for (int j = 0; j < N; ++j)
      for (int i = 0; i < N; ++i) {
        const double a = (i + 1.0) / (N + 1) - 0.3, b = (j + 1.0) / (N + 1) - 0.4;
        shape[i + j * N] = exp(-20 * (a * a + b * b));
      }
    known = N;
  }
  for (int j = 0; j < N; ++j) {
    const double *u = y + j * N, *lower = j > 0 ? u - N : 0, *upper = j < N - 1 ? u + N : 0;
    double* to = f + j * N;
    for (int i = 0; i < N; ++i) to[i] = -4 * u[i];
    for (int i = 1; i < N; ++i) to[i] += u[i - 1];
    for (int i = 0; i < N - 1; ++i) to[i] += u[i + 1];
    if (lower) for (int i = 0; i < N; ++i) to[i] += lower[i];
    if (upper) for (int i = 0; i < N; ++i) to[i] += upper[i];
    for (int i = 0; i < N; ++i) to[i] = d * to[i] + s * shape[i + j * N];
  }
}
JAC(heat_jac) {
  const int N = (int)lround(sqrt(*n)), m = *ld;
  const double d = (N + 1.0) * (N + 1.0);
  memset(J, 0, sizeof(double) * m * *n);
  for (int j = 0; j < *n; ++j) {
    double* at = J + j * m + N;
    at[0] = -4 * d;
    if (j % N > 0) at[-1] = d;
    if (j % N < N - 1) at[1] = d;
    if (j >= N) at[-N] = d;
    if (j + N < *n) at[N] = d;
  }
}

/// u₁, v₁, u₂, v₂ …
RHS(akzo) {
  enum { N = 200 };
  const double k = 100, c = 4, dz = 1.0 / N, in = *t < 5 ? 2 : 0;
  for (int j = 0; j < N; ++j) {
    const double z = (j + 1) * dz, q = z - 1, al = 2 * q * q * q / (c * c), be = q * q * q * q / (c * c);
    const double u = y[2 * j], v = y[2 * j + 1], l = j > 0 ? y[2 * j - 2] : in, r = j < N - 1 ? y[2 * j + 2] : u;
    f[2 * j] = (j < N - 1 ? al * (r - l) / (2 * dz) + be * (l - 2 * u + r) / (dz * dz) : 0) - k * u * v;
    f[2 * j + 1] = -k * u * v;
  }
}
JAC(akzo_jac) {
  enum { N = 200 };
  const int m = *ld;
  const double k = 100, c = 4, dz = 1.0 / N;
  memset(J, 0, sizeof(double) * m * *n);
  for (int j = 0; j < N; ++j) {
    const double z = (j + 1) * dz, q = z - 1, al = 2 * q * q * q / (c * c), be = q * q * q * q / (c * c);
    const double u = y[2 * j], v = y[2 * j + 1];
    double *ju = J + 2 * j * m + 2, *jv = ju + m;
    ju[0] = (j < N - 1 ? -2 * be / (dz * dz) : 0) - k * v, ju[1] = -k * v;
    jv[0] = -k * u, jv[-1] = -k * u;
    if (j == N - 1) continue;
    if (j > 0) ju[-2 * m + 2] = be / (dz * dz) - al / (2 * dz);
    ju[2 * m - 2] = be / (dz * dz) + al / (2 * dz);
  }
}

/// Nothing happens after a step.
void silent(const int* nr, const double* told, const double* t, const double* y, const double* cont, const int* lrc,
            const int* n, double* rpar, int* ipar, int* returned) {}
