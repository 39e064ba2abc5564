// Stability. For exact numbers it is decided exactly: Sturm chains over the rationals count the zeros of the
// characteristic polynomial on each side of the axis (or circle). For rounded numbers the verdict says that
// it is limited by rounding.
#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/generic/generic.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {

std::vector<Expr> routh(const Polynomial& p) {
  const auto n = p.size();
  std::vector<std::vector<Expr>> rows(2);
  for (std::size_t k = 0; k < n; ++k) rows[k % 2].push_back(p[n - 1 - k]);
  std::vector<Expr> first;
  for (std::size_t i = 0; i < n; ++i) {
    if (i >= 2) {
      const auto &a = rows[i - 2], &b = rows[i - 1];
      std::vector<Expr> c;
      for (std::size_t k = 0; k + 1 < a.size(); ++k)
        c.push_back(simplify((b[0] * a[k + 1] - a[0] * (k + 1 < b.size() ? b[k + 1] : Expr(0))) / b[0]));
      rows.push_back(std::move(c));
    }
    if (rows[i].empty() || rows[i][0].is_zero())
      throw Error(text("Routh's array has a zero in its first column (row ", i + 1,
                       "): there are poles on or symmetric to the imaginary axis"));
    first.push_back(rows[i][0]);
  }
  return first;
}

namespace {

using Rationals = dae::Polynomial;

constexpr double accuracy = 1e-10;  // of computed poles, relative to them or to the unit circle

/// Is the eigenvalue λ of A semisimple, that is, without chains of generalised eigenvectors?
bool semisimple(const System& g, const dae::Mode& mode) {
  if (mode.multiplicity == 1) return true;
  if (g.form != Form::ss && g.siso()) return false;
  const System s = to_ss(g);
  const int n = s.ss.order();
  const Mat A = numbers(s.ss.A);
  const ComplexMat m =
      linalg::similar(A, linalg::balancing(A)).cast<Complex>() - mode.value * ComplexMat::Identity(n, n);
  Eigen::JacobiSVD<ComplexMat> svd(m);
  svd.setThreshold(accuracy);
  return n - svd.rank() == mode.multiplicity;
}

// ── zeros of a polynomial by half-planes ──

int sign(const mpq_class& x) { return sgn(x); }

/// The sign of p for s → ±∞, or at 0.
int sign_at(const Rationals& p, int where) {
  if (where == 0) return sign(p.front());
  return sign(p.back()) * (where < 0 && p.size() % 2 == 0 ? -1 : 1);
}

/// Counts sign changes along Sturm's chain a, b, -rem(a, b), … From one point to another (-1: -∞, 0, 1: ∞)
/// their number decreases by Cauchy's index of b/a (Gantmacher, The Theory of Matrices II, §XV.2).
int cauchy_index(Rationals a, Rationals b, int from, int to) {
  int index = 0, last_from = 0, last_to = 0;
  const auto count = [&](const Rationals& p) {
    const int here = sign_at(p, from), there = sign_at(p, to);
    if (here != 0 && here * last_from < 0) ++index;
    if (there != 0 && there * last_to < 0) --index;
    if (here != 0) last_from = here;
    if (there != 0) last_to = there;
  };
  count(a);
  while (!b.empty()) {
    count(b);
    Rationals rest = dae::divide(a, b).remainder;
    for (mpq_class& c : rest) c = -c;
    a = std::move(b);
    b = std::move(rest);
  }
  return index;
}

/// Real zeros x < 0 with multiplicity. Requires p(0) ≠ 0.
int negative_zeros(Rationals p) {
  int count = 0;
  while (p.size() > 1) {
    const Rationals slope = dae::derivative(p);
    count += cauchy_index(p, slope, -1, 0);
    p = dae::gcd(p, slope);
  }
  return count;
}

/// The numbers of zeros to the right of the imaginary axis, and on it.
struct Sides {
  int right = 0, on = 0;
};

/// Zeros symmetric to the axis are those of gcd(p(s), p(-s)), a polynomial in s². The cofactor has no zero on
/// the axis, and Cauchy's index along it counts its zeros (Gantmacher, §XV.3).
Sides sides(Rationals p) {
  Sides all;
  while (p.size() > 1 && p.front() == 0) {
    p.erase(p.begin());
    ++all.on;
  }
  if (p.size() < 2) return all;
  Rationals mirror = p;
  for (std::size_t k = 1; k < p.size(); k += 2) mirror[k] = -mirror[k];
  const Rationals symmetric = dae::gcd(p, mirror), rest = dae::divide(p, symmetric).quotient;
  Rationals squares;
  for (std::size_t k = 0; k < symmetric.size(); k += 2) squares.push_back(symmetric[k]);
  const int on = 2 * negative_zeros(squares);
  all.on += on;
  all.right += (static_cast<int>(symmetric.size()) - 1 - on) / 2;
  const int n = static_cast<int>(rest.size()) - 1;
  Rationals f(rest.size()), g(rest.size());  // a₀ωⁿ - a₂ωⁿ⁻² + …, a₁ωⁿ⁻¹ - a₃ωⁿ⁻³ + …
  for (int k = 0; k <= n; ++k)
    (k % 2 == 0 ? f : g)[n - k] = k % 4 < 2 ? rest[n - k] : mpq_class(-rest[n - k]);
  while (!g.empty() && g.back() == 0) g.pop_back();
  all.right += n == 0 ? 0 : (n - cauchy_index(f, g, -1, 1)) / 2;
  return all;
}

/// (1 - w)ⁿ p((1 + w)/(1 - w)): maps the unit disc to the left half-plane and -1 to infinity.
Rationals from_disc(const Rationals& p) {
  Rationals sum(p.size());
  for (std::size_t k = 0; k < p.size(); ++k) {
    Rationals term{p[k]};
    for (std::size_t j = 0; j + 1 < p.size(); ++j) term = dae::product(term, {1, j < k ? 1 : -1});
    for (std::size_t j = 0; j < term.size(); ++j) sum[j] += term[j];
  }
  while (!sum.empty() && sum.back() == 0) sum.pop_back();
  return sum;
}

/// The counts for a system of exact numbers.
std::optional<Sides> exact_sides(const System& g) {
  if (g.form != Form::ss && !g.siso()) return exact_sides(to_ss(g));
  if (g.form == Form::ss && g.ss.order() > most_exact_states) return {};
  if (g.form == Form::ss && field(g.ss.A) != Field::exact) return {};
  const Polynomial p = g.form == Form::ss    ? characteristic(g)
                       : g.form == Form::zpk ? from_zeros(g.zpk[0].poles)
                                             : g.tf[0].den;
  if (field(p) != Field::exact || degree(p) > most_exact_states) return {};
  const Rationals q = rational(p);
  if (g.continuous()) return sides(q);
  const Rationals w = from_disc(q);
  Sides s = sides(w);
  s.on += static_cast<int>(q.size() - w.size());
  return s;
}

// ── the verdict ──

std::string part_text(const dae::Mode& m, bool imaginary) {
  constexpr int readable = 16;  // characters, as many as a number of 16 digits
  const double v = imaginary ? m.value.imag() : m.value.real();
  if (!m.exact) return pendula::rounded(v, 6);
  const std::string exact = pendula::to_text(imaginary ? m.exact->second : m.exact->first);
  return exact.size() <= readable && exact.find('e') == std::string::npos ? exact : pendula::rounded(v, 6);
}

std::string mode_text(const dae::Mode& m) {
  if (m.value.imag() == 0) return part_text(m, false);
  std::string im = part_text(m, true);
  const bool minus = im[0] == '-';
  if (minus) im.erase(0, 1);
  im = im == "1" ? "i" : im + " i";
  if (m.value.real() == 0) return (minus ? "-" : "") + im;
  return part_text(m, false) + (minus ? " - " : " + ") + im;
}

enum class Place { inside, on, outside };

/// The location of every pole: by exact counts if available, assigned to the rightmost poles first; otherwise
/// with a tolerance of 1e-10 relative to the axis or circle.
std::vector<Place> places(const std::vector<dae::Mode>& list, const std::optional<Sides>& known,
                          bool continuous) {
  const auto distance = [&](const dae::Mode& m) {
    return continuous ? m.value.real() : std::abs(m.value) - 1;
  };
  std::vector<Place> where(list.size(), Place::inside);
  if (known) {
    std::vector<std::size_t> order(list.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return distance(list[a]) > distance(list[b]); });
    int counted = 0;
    for (const std::size_t k : order) {
      where[k] = counted < known->right               ? Place::outside
                 : counted < known->right + known->on ? Place::on
                                                      : Place::inside;
      counted += list[k].multiplicity;
    }
    return where;
  }
  for (std::size_t k = 0; k < list.size(); ++k) {
    const double x = distance(list[k]), tol = accuracy * (continuous ? std::abs(list[k].value) : 1);
    where[k] = x > tol ? Place::outside : std::fabs(x) <= tol ? Place::on : Place::inside;
  }
  return where;
}

}  // namespace

Stability stability(const System& g) {
  Stability s;
  const std::vector<Expr> all = entries(g);
  bool missing = false;
  for (Expr leaf : leaves(all))
    missing = missing || (symbol_of(leaf).kind == Kind::parameter && !symbol_of(leaf).value);
  if (missing) {
    if (!g.continuous()) defaults(all);  // throws an error that names parameters without value
    s.symbolic = true;
    s.routh = routh(characteristic(g));
    return s;
  }
  const System values = with_numbers(g);
  const auto known = exact_sides(values);
  const std::vector<dae::Mode> list = poles(values);
  const std::vector<Place> where = places(list, known, g.continuous());
  std::vector<std::string> outside, on, repeated;
  for (std::size_t k = 0; k < list.size(); ++k) {
    dae::Mode m = list[k];
    if (m.value.imag() < 0) continue;
    if (where[k] == Place::outside) outside.push_back(mode_text(m));
    if (where[k] != Place::on) continue;
    auto& which = semisimple(values, m) ? on : repeated;
    if (g.continuous()) m.value.real(0);
    which.push_back(mode_text(m));
  }
  const std::string v = g.variable(), to_rounding = known ? "" : ", to rounding",
                    axis = (g.continuous() ? "on the imaginary axis" : "on the unit circle") + to_rounding;
  if (!outside.empty()) {
    s.verdict = "unstable";
    s.reason = text(g.continuous() ? "in the right half plane: " : "outside the unit circle: ", v, " = ",
                    join(outside, ", "));
  } else if (!repeated.empty()) {
    s.verdict = "unstable";
    s.reason = text("a repeated pole ", axis, ": ", v, " = ", join(repeated, ", "));
  } else if (!on.empty()) {
    s.verdict = "stable, not asymptotically";
    s.reason = text("simple poles ", axis, ": ", v, " = ", join(on, ", "));
  } else {
    s.verdict = "asymptotically stable";
    s.asymptotic = true;
    s.reason = g.continuous() ? "all poles have negative real parts" : "all poles lie inside the unit circle";
  }
  return s;
}

std::string describe(const Stability& s) {
  if (!s.symbolic) return s.verdict + ": " + s.reason;
  std::vector<std::string> list;
  for (Expr e : s.routh)
    if (!(e.is_constant() && constant_value(e) > 0)) list.push_back(pendula::to_text(e) + " > 0");
  return "asymptotically stable if and only if " + join(list, ", ") + " (Routh)";
}

}  // namespace pendula::lti
