// Starting values for the prediction-error search, all by linear least squares.
#include <algorithm>
#include <cmath>

#include "sysid/fit/pem.hpp"
#include "sysid/regression/structured.hpp"

namespace pendula::sysid {
namespace {

/// The record with other signals.
IdData with_signals(const IdData& like, const Vec& y, const Mat& u) {
  IdData d = like;
  d.y = y;
  d.u = u;
  d.y_names = {"y"};
  d.u_names.assign(static_cast<std::size_t>(u.cols()), "u");
  return d;
}

Vec regress(const IdData& d, const Orders& orders) {
  const Regressor regressor(d, 0, orders, InitialCondition::drop);
  return regressor.rows() > 0 ? solve_regression(regressor).theta : Vec(Vec::Zero(regressor.columns()));
}

/// p_k ρᵏ with the largest ρ ≤ 1 of a sequence for which the polynomial is stable.
Vec stabilised(Vec p) {
  constexpr double shrink = 0.95;
  constexpr int most = 200;  // 0.95⁻²⁰⁰ = 28000: the modulus of zeros that end inside the circle
  for (int tries = 0; tries < most && !stable(p); ++tries) {
    double factor = 1;
    for (Index k = 1; k < p.size(); ++k) p[k] *= factor *= shrink;
  }
  if (!stable(p)) p.tail(p.size() - 1).setZero();
  return p;
}

/// Filters every experiment of a signal, initially at rest.
Vec filtered_parts(const IdData& d, const Vec& num, const Vec& den, const Vec& x) {
  Vec out(x.size());
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from;
    filter(num, den, x.data() + from, n, out.data() + from);
  }
  return out;
}

/// Innovations of y given u by a long ARX model; zero for rows without a complete past.
Vec innovations(const IdData& d, int order) {
  Orders o;
  o.na = order;
  o.nb.assign(static_cast<std::size_t>(d.inputs()), order);
  o.nk.assign(o.nb.size(), 0);
  o.nf.assign(o.nb.size(), 0);
  const Regressor regressor(d, 0, o, InitialCondition::drop);
  Vec e = Vec::Zero(d.samples());
  if (regressor.rows() <= regressor.columns()) return e;
  const Polynomials p = polynomials_of(solve_regression(regressor).theta, o);
  e = filtered_parts(d, p.A, Vec::Ones(1), d.y.col(0));
  for (std::size_t i = 0; i < p.B.size(); ++i)
    e -= filtered_parts(d, p.B[i], Vec::Ones(1), d.u.col(static_cast<Index>(i)));
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k];
    e.segment(from, std::min<Index>(order, d.end(k) - from)).setZero();
  }
  return e;
}

/// A and B by ARX; then y = -A.. + B u + C ê (Hannan & Rissanen).
void equation_error_start(const IdData& d, const Orders& orders, const Vec& e, Polynomials& p) {
  Orders o = orders;
  o.nc = o.nd = 0;
  for (int& f : o.nf) f = 0;
  IdData with = d;
  if (orders.nc > 0) {
    with.u.conservativeResize(Eigen::NoChange, d.inputs() + 1);
    with.u.rightCols(1) = e;
    with.u_names.push_back("e");
    o.nb.push_back(orders.nc);
    o.nk.push_back(1);
    o.nf.push_back(0);
  }
  if (o.parameters() == 0) return;
  const Polynomials found = polynomials_of(regress(with, o), o);
  p.A = found.A;
  for (std::size_t i = 0; i < p.B.size(); ++i) p.B[i] = found.B[i];
  if (orders.nc > 0) {
    Vec C = found.B.back();
    C[0] = 1;
    p.C = stabilised(C);
  }
}

/// Steiglitz–McBride for one input: y ≈ B/F u.
void rational_start(const IdData& d, const Vec& y, Index input, const Orders& orders, Vec& B, Vec& F,
                    int rounds) {
  const auto i = static_cast<std::size_t>(input);
  Orders o;
  o.na = orders.nf[i], o.nb = {orders.nb[i]}, o.nk = {orders.nk[i]}, o.nf = {0};
  const Vec u = d.u.col(input), unity = Vec::Ones(1);
  double best = (y - filtered_parts(d, B, F, u)).squaredNorm();
  Vec now = F;
  for (int round = 0; round < rounds; ++round) {
    const IdData pre = with_signals(d, filtered_parts(d, unity, now, y), filtered_parts(d, unity, now, u));
    const Polynomials found = polynomials_of(regress(pre, o), o);
    now = stabilised(found.A);
    const double sse = (y - filtered_parts(d, found.B[0], now, u)).squaredNorm();
    if (std::isfinite(sse) && sse < best) {
      best = sse;
      B = found.B[0];
      F = now;
    }
  }
}

void rational_starts(const IdData& d, const Orders& orders, Polynomials& p, int rounds) {
  const Index sweeps = d.inputs() > 1 ? 3 : 1;
  const Vec y = filtered_parts(d, p.A, Vec::Ones(1), d.y.col(0));
  for (std::size_t i = 0; i < p.B.size(); ++i) p.B[i].setZero();
  for (Index sweep = 0; sweep < sweeps; ++sweep)
    for (Index i = 0; i < d.inputs(); ++i) {
      Vec rest = y;
      for (Index j = 0; j < d.inputs(); ++j)
        if (j != i) rest -= filtered_parts(d, p.B[j], p.F[j], d.u.col(j));
      rational_start(d, rest, i, orders, p.B[i], p.F[i], rounds);
    }
}

/// C and D from v = C/D e.
void noise_start(const IdData& d, const Orders& orders, int order, Polynomials& p) {
  Vec v = filtered_parts(d, p.A, Vec::Ones(1), d.y.col(0));
  for (std::size_t i = 0; i < p.B.size(); ++i)
    v -= filtered_parts(d, p.B[i], p.F[i], d.u.col(static_cast<Index>(i)));
  const IdData series = with_signals(d, v, Mat(v.size(), 0));
  const Vec e = innovations(series, order);
  Orders o;
  o.na = orders.nd;
  Mat u(v.size(), orders.nc > 0 ? 1 : 0);
  if (orders.nc > 0) u.col(0) = e, o.nb = {orders.nc}, o.nk = {1}, o.nf = {0};
  if (o.parameters() == 0) return;
  const Polynomials found = polynomials_of(regress(with_signals(d, v, u), o), o);
  p.D = stabilised(found.A);
  if (orders.nc > 0) {
    Vec C = found.B[0];
    C[0] = 1;
    p.C = stabilised(C);
  }
}

/// The first k + 1 coefficients of p, zero-padded.
Vec resized(const Vec& p, Index k) {
  Vec out = Vec::Zero(k + 1);
  out.head(std::min(k + 1, p.size())) = p.head(std::min(k + 1, p.size()));
  return out;
}

/// The poles of an ARX model of the order of the largest F: its A becomes every F and D.
Vec equation_error_poles(const IdData& d, const Orders& orders, Polynomials p) {
  Orders o = orders;
  o.nc = o.nd = 0;
  o.na = std::max(orders.na, *std::max_element(orders.nf.begin(), orders.nf.end()));
  for (int& f : o.nf) f = 0;
  const Polynomials found = polynomials_of(regress(d, o), o);
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    p.B[i] = found.B[i];
    p.F[i] = stabilised(resized(found.A, orders.nf[i]));
  }
  p.D = stabilised(resized(found.A, orders.nd));
  return parameters_of(p, orders);
}

std::vector<StartingValues> distinct(std::vector<StartingValues> list) {
  std::vector<StartingValues> out;
  for (StartingValues& v : list)
    if (std::none_of(out.begin(), out.end(), [&](const auto& o) { return o.theta == v.theta; }))
      out.push_back(std::move(v));
  return out;
}

}  // namespace

std::vector<StartingValues> starting_values(const IdData& data, Index output, const Orders& orders) {
  IdData d = data;
  d.y = data.y.col(output);
  d.y_names = {"y"};
  const Index sum = orders.parameters() + orders.memory();
  // choices: long enough to approximate 1/C and 1/F, with 8 rows per coefficient; at most 60, as the work
  // grows with the square
  const int order = static_cast<int>(
      std::clamp<Index>(d.samples() / (8 * (1 + d.inputs())), 1, std::min<Index>(2 * sum + 10, 60)));
  bool rational = false;
  for (const int f : orders.nf) rational = rational || f > 0;
  const auto fresh = [&] { return polynomials_of(Vec::Zero(orders.parameters()), orders); };
  std::vector<StartingValues> out;
  if (!rational && orders.nd == 0) {
    Polynomials p = fresh();
    equation_error_start(d, orders, orders.nc > 0 ? innovations(d, order) : Vec(), p);
    out.push_back({parameters_of(p, orders), "innovations of a long ARX model"});
    if (orders.nc > 0) {
      p = fresh();
      Orders plain = orders;
      plain.nc = 0;
      equation_error_start(d, plain, {}, p);
      p.C = Vec::Zero(orders.nc + 1);
      p.C[0] = 1;
      out.push_back({parameters_of(p, orders), "ARX with C = 1"});
    }
    return out;
  }
  // rounds of Steiglitz and McBride: 12 is a choice; one round is another start, as more may diverge
  for (const int rounds : {12, 1}) {
    Polynomials p = fresh();
    if (rational) {
      rational_starts(d, orders, p, rounds);
    } else {
      Orders plain = orders;
      plain.nc = plain.nd = 0;
      equation_error_start(d, plain, {}, p);
    }
    if (orders.nc > 0 || orders.nd > 0) noise_start(d, orders, order, p);
    out.push_back({parameters_of(p, orders), !rational     ? "ARX"
                                             : rounds == 1 ? "one step of Steiglitz and McBride"
                                                           : "Steiglitz and McBride"});
  }
  if (rational) out.push_back({equation_error_poles(d, orders, fresh()), "the poles of an ARX model"});
  if (orders.nc + orders.nd > 0) {  // without a noise model
    Polynomials p = polynomials_of(out[0].theta, orders);
    p.C = fresh().C;
    p.D = fresh().D;
    out.push_back({parameters_of(p, orders), "no noise model"});
  }
  return distinct(std::move(out));
}

}  // namespace pendula::sysid
