#include "method/tableau.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "method/stability.hpp"

namespace pendula::integrate {
namespace {

constexpr int most_stages = 256;  // a choice: A of 256 bits per entry takes 4 MB

/// The sum as an exact fraction, such as 4/3, or as a double.
std::string sum_text(std::span<const Expr> terms, const Real& value) {
  Expr sum;
  for (Expr term : terms) sum += term;
  const mpq_class* exact = exact_value(sum);
  return exact ? exact->get_str() : rounded(nearest_double(value), 12);
}

std::vector<Expr> row(const MatX& A, Eigen::Index i) {
  std::vector<Expr> result(static_cast<std::size_t>(A.cols()));
  for (Eigen::Index j = 0; j < A.cols(); ++j) result[j] = A(i, j);
  return result;
}

Real row_sum(const Coefficients& rk, int i) {
  Real sum(0, rk.bits);
  for (int j = 0; j < rk.stages(); ++j) sum += rk.A(i, j);
  return sum;
}

/// A tolerance that accounts for cancellation: unit × the largest sum of absolute values.
Real slack(const Coefficients& rk, const RealVector& terms) {
  Real size(1, rk.bits);
  for (const Real& term : terms) size += abs(term);
  return Real(size * rk.unit);
}

}  // namespace

Tableau::Tableau(TableauData data) : data_(std::move(data)) {
  check_sizes();
  evaluate_entries();
  check_sums();
  round();
  check_claims();
}

Tableau::Tableau(TableauData data, Coefficients coefficients)
    : data_(std::move(data)), coefficients_(std::move(coefficients)) {
  check_sizes();
  PENDULA_ASSERT(coefficients_.stages() == data_.b.size(), "coefficients do not fit their tableau");
  check_sums();
  round();
  check_claims();
}

void Tableau::check_sizes() const {
  const auto s = data_.A.rows();
  if (s == 0) throw Error(text(subject(), ": A is empty; it needs one row per stage"));
  if (data_.A.cols() != s) {
    throw Error(text(subject(), ": A has ", s, " rows and ", data_.A.cols(), " columns; it must be square"));
  }
  if (s > most_stages) throw Error(text(subject(), ": ", s, " stages; the limit is ", most_stages));
  const auto check = [&](const VecX& v, const char* what) {
    if (v.size() == s) return;
    throw Error(text(subject(), ": ", what, " has ", v.size(), v.size() == 1 ? " entry" : " entries",
                     ", but A has ", s, s == 1 ? " row" : " rows"));
  };
  check(data_.b, "b");
  if (data_.c) check(*data_.c, "c");
  if (data_.bhat) check(*data_.bhat, "bhat");
  if (data_.bhat2) check(*data_.bhat2, "bhat2");
  constexpr double largest = 1e6;  // larger ones are mistakes: steps would not depend on the tolerance
  if (!(data_.error_scale > 0 && data_.error_scale < largest))
    throw Error(text(subject(), ": error_scale = ", rounded(data_.error_scale),
                     "; it multiplies the estimated error, for example error_scale = 2"));
  if (data_.error_scale != 1 && !data_.bhat)
    throw Error(text(subject(), ": error_scale multiplies the error that bhat gives; bhat is missing"));
}

void Tableau::evaluate_entries() {
  const int s = static_cast<int>(data_.A.rows());
  double error = 0;
  Coefficients& rk = coefficients_;
  rk.bits = 256;  // twice the 128 bits to which exact conditions are tested
  const auto value = [&](Expr e, const auto&... place) {
    try {
      return precise_value(e, rk.bits, error);
    } catch (const Error& refusal) {
      throw Error(text(subject(), ": ", pendula::text(place...), " is not a number (", refusal.what(), ")"));
    }
  };
  const auto column = [&](const VecX& v, const char* letter) {
    RealVector result;
    for (int i = 0; i < s; ++i) result.push_back(value(v[i], letter, "[", i + 1, "]"));
    return result;
  };
  rk.A = RealMatrix(s, rk.bits);
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j) rk.A(i, j) = value(data_.A(i, j), "A[", i + 1, "][", j + 1, "]");
  rk.b = column(data_.b, "b");
  if (data_.bhat) rk.bhat = column(*data_.bhat, "bhat");
  if (data_.bhat2) rk.bhat2 = column(*data_.bhat2, "bhat2");
  if (!data_.c) {
    data_.c = VecX(s);
    for (int i = 0; i < s; ++i)
      for (int j = 0; j < s; ++j) (*data_.c)[i] += data_.A(i, j);
  }
  rk.c = column(*data_.c, "c");
  const double exact = std::ldexp(1.0, -static_cast<int>(rk.bits) / 2);
  // sums of s typed coefficients err by s roundings; 2⁻⁴⁹ = 16 · 2⁻⁵³ is that of doubles
  rk.unit = error > 0 ? std::clamp(16 * error, exact, 0x1p-49) : exact;
}

void Tableau::check_sums() const {
  const Coefficients& rk = coefficients_;
  for (int i = 0; i < rk.stages(); ++i) {
    const Real sum = row_sum(rk, i);
    RealVector terms;
    for (int j = 0; j < rk.stages(); ++j) terms.push_back(rk.A(i, j));
    if (abs(sum - rk.c[i]) <= slack(rk, terms)) continue;
    const Expr c = (*data_.c)[i];
    throw Error(text(subject(), ": row ", i + 1, " of A sums to ", sum_text(row(data_.A, i), sum), ", but c[",
                     i + 1, "] = ", sum_text(std::span(&c, 1), rk.c[i])));
  }
  const auto check_weights = [&](const VecX& exact, const RealVector& b, const char* what) {
    Real sum(0, rk.bits);
    for (const Real& weight : b) sum += weight;
    if (abs(sum - 1) <= slack(rk, b)) return;
    throw Error(text(subject(), ": ", what, " sums to ", sum_text(entries(exact), sum), ", not 1"));
  };
  check_weights(data_.b, rk.b, "b");
  if (data_.bhat) check_weights(*data_.bhat, rk.bhat, "bhat");
  if (data_.bhat2) check_weights(*data_.bhat2, rk.bhat2, "bhat2");
}

Tableau Tableau::proved() const {
  TableauData data = data_;
  data.proved = false;
  return Tableau(std::move(data), coefficients_);
}

void Tableau::check_claims() {
  if (data_.proved && data_.order) {
    order_ = *data_.order;
    return check_dense();
  }
  order_ = algebraic_order(coefficients_, coefficients_.b);
  if (data_.order && *data_.order != order_) {
    throw Error(
        text(subject(), ": order ", *data_.order, " is claimed, but the order conditions give ", order_));
  }
  check_dense();
  if (!data_.embedded) return;
  if (!data_.bhat) throw Error(text(subject(), ": embedded = ", *data_.embedded, " needs the weights bhat"));
  if (*data_.embedded != embedded_order()) {
    throw Error(text(subject(), ": embedded order ", *data_.embedded,
                     " is claimed, but the order conditions give ", embedded_order()));
  }
}

int Tableau::embedded_order() const { return algebraic_order(coefficients_, coefficients_.bhat); }

// The stages of the interpolant extend the tableau by explicit stages; its order is determined like that
// of any tableau.
void Tableau::check_dense() {
  if (!data_.dense) return derive_dense();
  const DenseData& dense = *data_.dense;
  const int s = stages(), e = static_cast<int>(dense.c.size());
  if (dense.A.rows() != e || (e > 0 && dense.A.cols() != s + e) || dense.b.rows() != s + e ||
      dense.b.cols() == 0)
    throw Error(text(subject(), ": dense needs one list of coefficients for each of the ", s + e, " stages"));
  const Coefficients& rk = coefficients_;
  Coefficients all = rk;
  all.A = RealMatrix(s + e, rk.bits);
  double error = 0;
  const auto value = [&](Expr entry) { return precise_value(entry, rk.bits, error); };
  for (int i = 0; i < s + e; ++i)
    for (int j = 0; j < s + e; ++j) {
      if (i < s && j < s) all.A(i, j) = rk.A(i, j);
      if (i >= s) all.A(i, j) = value(dense.A(i - s, j));
    }
  for (int i = 0; i < e; ++i) all.c.push_back(value(dense.c[i]));
  if (error > 0) all.unit = std::clamp(16 * error, all.unit, 0x1p-49);
  for (int i = s; i < s + e; ++i) {
    if (abs(row_sum(all, i) - all.c[i]) <= 16 * all.unit * (1 + s + e)) continue;
    throw Error(text(subject(), ": row ", i - s + 1, " of dense.A does not sum to dense.c[", i - s + 1, "]"));
  }
  std::vector<RealVector> columns;
  dense_ = DenseOutput{Mat(e, s + e), Vec(e), Mat(s + e, dense.b.cols()), 0};
  for (Eigen::Index k = 0; k < dense.b.cols(); ++k) {
    columns.emplace_back();
    for (int i = 0; i < s + e; ++i) {
      columns.back().push_back(value(dense.b(i, k)));
      dense_->b(i, k) = nearest_double(columns.back().back());
    }
  }
  for (int i = 0; i < e; ++i) {
    dense_->c[i] = nearest_double(all.c[s + i]);
    for (int j = 0; j < s + e; ++j) dense_->A(i, j) = nearest_double(all.A(s + i, j));
  }
  if (data_.proved && dense.order) {
    dense_->order = *dense.order;
    return;
  }
  dense_->order = continuous_order(all, columns, dense.order.value_or(order_));
  if (dense.order && dense_->order != *dense.order) {
    throw Error(text(subject(), ": dense output of order ", *dense.order,
                     " is claimed, but the order conditions give ", dense_->order));
  }
}

/// bᵢ(θ) = ∫₀^θ ℓᵢ: the collocation polynomial itself, of order s between the mesh points.
void Tableau::derive_dense() {
  constexpr int most = 20;  // with more nodes the coefficients in powers of θ cancel in doubles
  const int s = stages();
  if (s > most || !is_collocation()) return;
  const Coefficients& rk = coefficients_;
  dense_ = DenseOutput{Mat(0, s), Vec(0), Mat(s, s), s};
  for (int j = 0; j < s; ++j) {
    RealVector ell(1, Real(1, rk.bits));  // coefficients of ∏ (τ - cᵢ)/(cⱼ - cᵢ)
    for (int i = 0; i < s; ++i) {
      if (i == j) continue;
      const Real scale(rk.c[j] - rk.c[i]);
      ell.push_back(Real(0, rk.bits));
      for (std::size_t k = ell.size(); k-- > 0;)
        ell[k] = ((k > 0 ? ell[k - 1] : Real(0, rk.bits)) - rk.c[i] * ell[k]) / scale;
    }
    for (int k = 0; k < s; ++k) dense_->b(j, k) = nearest_double(Real(ell[k] / (k + 1)));
  }
}

void Tableau::round() {
  const int s = coefficients_.stages();
  const auto column = [&](const RealVector& v) {
    Vec result(s);
    for (int i = 0; i < s; ++i) result[i] = rounded_coefficient(v[i]);
    return result;
  };
  A_.resize(s, s);
  for (int i = 0; i < s; ++i)
    for (int j = 0; j < s; ++j) A_(i, j) = rounded_coefficient(coefficients_.A(i, j));
  b_ = column(coefficients_.b);
  c_ = column(coefficients_.c);
  if (data_.bhat) bhat_ = column(coefficients_.bhat);
  if (data_.bhat) compared_ = data_.error_scale == 1 ? *bhat_ : b_ + data_.error_scale * (*bhat_ - b_);
  if (data_.bhat2) bhat2_ = column(coefficients_.bhat2);
}

bool Tableau::is_explicit() const { return A_.triangularView<Eigen::Upper>().toDenseMatrix().isZero(0); }

bool Tableau::is_diagonally_implicit() const {
  return A_.triangularView<Eigen::StrictlyUpper>().toDenseMatrix().isZero(0) && !is_explicit();
}

bool Tableau::is_singly_diagonally_implicit() const {
  if (!is_diagonally_implicit()) return false;
  const Coefficients& rk = coefficients_;
  const int first = starts_explicit() ? 1 : 0;
  for (int i = first; i < stages(); ++i)
    if (!equal(rk.A(i, i), rk.A(first, first), rk)) return false;
  return true;
}

bool Tableau::starts_explicit() const { return c_[0] == 0 && A_.row(0).isZero(0); }

bool Tableau::is_stiffly_accurate() const {
  const Coefficients& rk = coefficients_;
  const int last = stages() - 1;
  for (int j = 0; j <= last; ++j)
    if (!equal(rk.A(last, j), rk.b[j], rk)) return false;
  return equal(rk.c[last], Real(1, rk.bits), rk);
}

bool Tableau::is_symplectic() const {
  const Coefficients& rk = coefficients_;
  for (int i = 0; i < stages(); ++i) {
    for (int j = 0; j <= i; ++j) {
      const Real left(rk.b[i] * rk.A(i, j) + rk.b[j] * rk.A(j, i)), right(rk.b[i] * rk.b[j]);
      if (!equal(left, right, rk)) return false;
    }
  }
  return true;
}

// The adjoint method has a*ᵢⱼ = b_{s+1-j} - a_{s+1-i,s+1-j} and b*ⱼ = b_{s+1-j}
// (Geometric Integration, Thm V.2.3).
bool Tableau::is_symmetric() const {
  const Coefficients& rk = coefficients_;
  const int last = stages() - 1;
  for (int i = 0; i <= last; ++i) {
    if (!equal(rk.b[i], rk.b[last - i], rk)) return false;
    for (int j = 0; j <= last; ++j)
      if (!equal(Real(rk.A(i, j) + rk.A(last - i, last - j)), rk.b[j], rk)) return false;
  }
  return true;
}

namespace {

using Property = std::pair<std::string, std::function<bool(const Tableau&)>>;

const std::vector<Property>& property_table() {
  static const std::vector<Property> table = {
      {"explicit", &Tableau::is_explicit},
      {"implicit", &Tableau::is_implicit},
      {"diagonally implicit", &Tableau::is_diagonally_implicit},
      {"singly diagonally implicit", &Tableau::is_singly_diagonally_implicit},
      {"explicit first stage", &Tableau::starts_explicit},
      {"FSAL", &Tableau::is_fsal},
      {"stiffly accurate", &Tableau::is_stiffly_accurate},
      {"collocation", &Tableau::is_collocation},
      {"A-stable", [](const Tableau& rk) { return Stability(rk).is_a_stable(); }},
      {"A(α)-stable", [](const Tableau& rk) { return Stability(rk).alpha_degrees() > 0; }},
      {"L-stable", [](const Tableau& rk) { return Stability(rk).is_l_stable(); }},
      {"I-stable", [](const Tableau& rk) { return std::isinf(Stability(rk).imaginary_limit()); }},
      {"algebraically stable", &is_algebraically_stable},
      {"symplectic", &Tableau::is_symplectic},
      {"symmetric", &Tableau::is_symmetric},
  };
  return table;
}

}  // namespace

const std::vector<std::string>& Tableau::properties() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const Property& property : property_table()) list.push_back(property.first);
    return list;
  }();
  return names;
}

namespace {

/// Letters only, in lower case, so that hyphens and capitals do not matter: "L
/// stable", "l-stable", "symplektic".
std::string plain(const std::string& words) {
  std::string result;
  for (char c : words)
    if (!std::isspace(static_cast<unsigned char>(c)) && c != '-' && c != '_')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

const std::vector<std::pair<std::string, std::string>>& synonyms() {
  static const std::vector<std::pair<std::string, std::string>> table = {
      {"dirk", "diagonally implicit"},
      {"sdirk", "singly diagonally implicit"},
      {"erk", "explicit"},
      {"a(alpha)stable", "A(α)-stable"},
      {"bstable", "algebraically stable"},
      {"firstsameaslast", "FSAL"},
      {"reversible", "symmetric"},
      {"firststageexplicit", "explicit first stage"},
  };
  return table;
}

}  // namespace

bool Tableau::is(const std::string& property) const {
  std::string wanted = plain(property);
  for (const auto& [other, name] : synonyms())
    if (wanted == other) wanted = plain(name);
  for (const auto& [name, holds] : property_table())
    if (plain(name) == wanted) return holds(*this);
  throw Error(text("unknown property '", property, "'.", did_you_mean(property, properties()),
                   " Known are: ", join(properties(), ", ")));
}

}  // namespace pendula::integrate
