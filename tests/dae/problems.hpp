// Small reference problems with known index, shared by the tests of dae.
#pragma once

#include <utility>
#include <vector>

#include "dae/model/make_model.hpp"
#include "dae/model/model.hpp"

namespace pendula::problems {

inline Expr unknown(const std::string& name) { return symbol(Kind::variable, name); }
inline Expr known(const std::string& name) { return symbol(Kind::input, name); }
inline Expr parameter(const std::string& name) { return symbol(Kind::parameter, name); }

inline dae::ModelPtr model(const std::vector<std::pair<Expr, Expr>>& equations,
                           dae::ModelOptions options = {}) {
  std::vector<dae::Block> blocks;
  for (const auto& [l, r] : equations) {
    dae::Block b;
    b.lhs.resize(1), b.rhs.resize(1);
    b.lhs << l;
    b.rhs << r;
    blocks.push_back(b);
  }
  return dae::make_model(std::move(blocks), std::move(options));
}

/// scripts/exam/problem3.lua, (d): E x′ = x with x = α e^{t/2} (1, 1, 2).
inline dae::ModelPtr exam_3d() {
  const Expr x1 = unknown("x1"), x2 = unknown("x2"), x3 = unknown("x3");
  const auto d = [](Expr x) { return derivative_leaf(x); };
  return model({{d(x1) + d(x2), x1}, {d(x3), x2}, {d(x1) + d(x2) + d(x3), x3}});
}

/// The lecture's E x′ = x + B u with nilpotent E.
inline dae::ModelPtr nilpotent() {
  const Expr x1 = unknown("x1"), x2 = unknown("x2"), x3 = unknown("x3");
  return model({{derivative_leaf(x2), x1}, {derivative_leaf(x3), x2}, {0, x3 + known("u")}});
}

/// The lecture's isothermal stirred tank.
inline dae::ModelPtr cstr() {
  const Expr V = unknown("V"), A = unknown("C_A"), B = unknown("C_B"), C = unknown("C_C"),
             R1 = unknown("R_1"), R2 = unknown("R_2"), Fa = known("F_a"), F = known("F_out"),
             A0 = parameter("C_A0"), K = parameter("K_eq"), k2 = parameter("k_2");
  const auto d = [](Expr x) { return derivative_leaf(x); };
  return model({{d(V), Fa - F},
                {d(A), Fa / V * (A0 - A) - R1},
                {d(B), -Fa / V * B + R1 - R2},
                {d(C), -Fa / V * C + R2},
                {0, A - B / K},
                {0, R2 - k2 * B}});
}

/// Reißig, Martinson & Barton, Differential–algebraic equations of index 1 may have an arbitrarily high
/// structural index, SIAM J. Sci. Comput. 21(6), 2000: structural 3, true 1.
inline dae::ModelPtr reissig() {
  std::vector<Expr> x, f;
  for (int i = 1; i <= 5; ++i)
    x.push_back(unknown("x" + std::to_string(i))), f.push_back(known("f" + std::to_string(i)));
  const auto d = [&](int i) { return derivative_leaf(x[i - 1]); };
  return model({{d(2) + d(3) + x[0], f[0]},
                {d(2) + d(3) + x[1], f[1]},
                {d(4) + d(5) + x[2], f[2]},
                {d(4) + d(5) + x[3], f[3]},
                {x[4], f[4]}});
}

/// Sum of both: x = t + sin t, hence y = 0.
inline dae::ModelPtr hidden_sum() {
  const Expr x = unknown("x"), y = unknown("y"), t = time_symbol();
  return model({{-derivative_leaf(x, 2) - y, sin(t)}, {derivative_leaf(x, 2) + x + y, t}});
}

inline dae::ModelPtr pendulum() {
  const Expr x = unknown("x"), y = unknown("y"), z = unknown("lambda"), g(9.81);
  return model(
      {{derivative_leaf(x, 2), -z * x}, {derivative_leaf(y, 2), -z * y - g}, {0, x * x + y * y - 1}});
}

/// docs/benchmarks.md#transistor-amplifier: M y′ + f(t, y) = 0 with singular M.
inline dae::ModelPtr transistor_amplifier() {
  std::vector<Expr> y, d;
  for (int i = 1; i <= 8; ++i)
    y.push_back(unknown("y" + std::to_string(i))), d.push_back(derivative_leaf(y.back()));
  const Expr Ub(6), Uf(0.026), al(0.99), be(1e-6), R0(1000), R(9000), t = time_symbol();
  const auto C = [](int k) { return Expr(k) / 1000000; };
  const auto g = [&](Expr v) { return be * (exp(v / Uf) - Expr(1)); };
  const Expr Ue = Expr(0.1) * sin(Expr(200) * pi() * t), one(1);
  return model({{C(1) * (d[0] - d[1]), -(y[0] - Ue) / R0},
                {C(1) * (d[1] - d[0]), -(y[1] / R + (y[1] - Ub) / R + (one - al) * g(y[1] - y[2]))},
                {C(2) * d[2], -(y[2] / R - g(y[1] - y[2]))},
                {C(3) * (d[3] - d[4]), -((y[3] - Ub) / R + al * g(y[1] - y[2]))},
                {C(3) * (d[4] - d[3]), -(y[4] / R + (y[4] - Ub) / R + (one - al) * g(y[4] - y[5]))},
                {C(4) * d[5], -(y[5] / R - g(y[4] - y[5]))},
                {C(5) * (d[6] - d[7]), -((y[6] - Ub) / R + al * g(y[4] - y[5]))},
                {C(5) * (d[7] - d[6]), -(y[7] / R)}});
}

}  // namespace pendula::problems
