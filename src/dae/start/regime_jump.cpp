#include "dae/start/regime_jump.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/text.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {

double value_at(Expr e, PointValues values) {
  for (Expr leaf : leaves({&e, 1}))
    if (symbol_of(leaf).kind == Kind::variable) values.try_emplace(leaf, 0.0);
  return pendula::evaluate({&e, 1}, values)[0];
}

double Sizes::operator()(Expr leaf) const {
  if (const auto at = of.find(leaf); at != of.end()) return std::fabs(at->second);
  const Symbol& symbol = symbol_of(leaf);
  const auto base = of.find(symbol.base);
  return symbol.order == 0 || base == of.end() ? 0 : std::fabs(base->second) * std::pow(rate, symbol.order);
}

double size_of(Expr e, const PointValues& values, const Sizes& sizes) {
  double sum = 0;
  for (Expr leaf : leaves({&e, 1}))
    if (const double size = sizes(leaf); size > 0)
      sum += std::fabs(value_at(partial(e, leaf), values)) * size;
  return sum;
}

namespace {

/// Solves for a jump x⁺ = x⁻ + Δx with impulses Λ of z.
class JumpSystem {
 public:
  /// sizes: largest magnitudes of the states so far; close: tolerance of the equations relative
  /// to their terms.
  JumpSystem(const std::vector<Expr>& conditions, const FirstOrder& form, PointValues before,
             const LeafValues& sizes, double close)
      : conditions_(conditions), form_(form), close_(close), values_(std::move(before)) {
    for (Expr leaf : leaves(form.F)) values_.try_emplace(leaf, 0.0);
    n_ = static_cast<Eigen::Index>(form.x.size());
    m_ = static_cast<Eigen::Index>(form.z.size());
    const Mat all = jacobian(form.F, unknowns_of_impulses());
    E_ = all.leftCols(n_);
    B_ = all.rightCols(m_);
    sizes_.of = values_;
    for (const auto& [leaf, size] : sizes) sizes_.of[leaf] = std::max(size, sizes_(leaf));
    size_ = Vec(n_);
    for (Eigen::Index i = 0; i < n_; ++i) size_[i] = sizes_(form.x[i]);
    // the unit of an impulse is the one that changes the states by their sizes
    impulse_size_ = Vec::Zero(m_);
    const Vec momentum = E_.cwiseAbs() * size_;
    for (Eigen::Index j = 0; j < m_; ++j)
      for (Eigen::Index i = 0; i < B_.rows(); ++i)
        if (B_(i, j) != 0) impulse_size_[j] = std::max(impulse_size_[j], momentum[i] / std::fabs(B_(i, j)));
  }

  /// Empty if no impulse leads to the conditions, or if the equations leave the jump open; in the second case
  /// `why` is set.
  std::optional<Jump> solve(std::string& why) {
    const PointValues start = values_;
    std::optional<Jump> jump = with_first_factors_ = with_factors();
    if (!jump || !jump->jumps) return jump;
    const std::vector<Entry> changed = changed_factors(start, *jump);
    if (changed.empty()) return jump;
    for (const Entry& e : changed)
      if (e.column >= n_ || !is_exact(e.row)) {
        const Expr of = e.column < n_ ? form_.xdot[e.column] : form_.z[e.column - n_];
        why = text("the factor of ", to_text(of), " in the equations, ", truncated_text(e.value),
                   ", changes during the impulse, and they do not tell how: write them with states whose "
                   "derivatives have constant factors (charge, momentum)");
        return {};
      }
    values_ = start;
    takes_means_ = true;
    return with_factors();
  }

  /// After solve(): the jump with the factors constant at their values before it.
  const std::optional<Jump>& with_first_factors() const { return with_first_factors_; }

 private:
  std::optional<Jump> with_factors() {
    const auto rows = static_cast<Eigen::Index>(conditions_.size());
    Jump jump{Vec::Zero(n_), {}, {}};
    if (rows == 0) return jump;
    Vec impulse = Vec::Zero(m_);
    const PointValues start = values_;
    constexpr double obeyed = 1e-13;  // of the terms: ten times their rounding
    // Newton's method doubles the digits per step; with means it is a fixed-point iteration.
    constexpr int quadratic = 20, fixed_point = 60;
    const int most = obeys_conditions(obeyed) ? 0 : takes_means_ ? fixed_point : quadratic;
    for (int k = 0; k < most; ++k) {
      if (takes_means_) take_means(start, jump.change);
      const Vec G = residuals();
      Mat K = Mat::Zero(E_.rows() + rows, n_ + m_);
      K.topLeftCorner(E_.rows(), n_) = E_;
      K.topRightCorner(E_.rows(), m_) = B_;
      K.bottomLeftCorner(rows, n_) = jacobian(conditions_, form_.x);
      Vec right(K.rows());
      right << -(E_ * jump.change + B_ * impulse), -G;
      const Vec step = least_step(K, right);
      jump.change += step.head(n_);
      impulse += step.tail(m_);
      move(start, jump.change);
      const auto is_small = [](const Vec& d, const Vec& whole, const Vec& size) {
        return ((d.cwiseAbs() - rounding_of_sums * (whole.cwiseAbs() + size)).array() <= 0).all();
      };
      if (is_small(step.head(n_), jump.change, size_) && is_small(step.tail(m_), impulse, impulse_size_))
        break;
    }
    if (takes_means_) take_means(start, jump.change);
    if (!satisfies_equations(jump.change, impulse)) return {};
    for (int k = 0; k < 3; ++k) {  // removes errors of rounding and of the steps by minimal corrections
      jump.change -= jacobian(conditions_, form_.x).completeOrthogonalDecomposition().solve(residuals());
      move(start, jump.change);
    }
    constexpr double stops = 1e-12;  // of a state: 4500 ε, what the steps leave of one that becomes 0
    for (Eigen::Index i = 0; i < n_; ++i)
      if (const double x = start.at(form_.x[i]); std::fabs(x + jump.change[i]) <= stops * std::fabs(x))
        jump.change[i] = -x;
    for (Eigen::Index i = 0; i < n_; ++i) {
      jump.jumps = jump.jumps || is_jump(i, jump.change);
      jump.impulses[form_.xdot[i]] = jump.change[i];
      jump.sizes[form_.xdot[i]] = size_[i];
    }
    for (Eigen::Index j = 0; j < m_; ++j) {
      jump.impulses[form_.z[j]] = impulse[j];
      jump.sizes[form_.z[j]] = impulse_size_[j];
    }
    return jump;
  }

  /// Entries of ∂F/∂(x′, z) that change during the jump, in columns with a jump or impulse. States that do
  /// not jump differ by errors only, as at the position where a rope becomes taut.
  std::vector<Entry> changed_factors(const PointValues& start, const Jump& jump) {
    constexpr double visible = 1e-9;  // of a factor: far above its rounding
    Vec change = jump.change;
    for (Eigen::Index i = 0; i < n_; ++i)
      if (!is_jump(i, change)) change[i] = 0;
    std::vector<Entry> changed;
    for (const Entry& e : sparse_jacobian(form_.F, unknowns_of_impulses())) {
      const Expr of = e.column < n_ ? form_.xdot[e.column] : form_.z[e.column - n_];
      if (std::fabs(jump.impulses.at(of)) <= rounding_of_sums * jump.sizes.at(of)) continue;
      move(start, 0 * change);
      const double before = value_at(e.value, values_);
      for (const double part : {0.5, 1.0}) {
        move(start, part * change);
        const double now = value_at(e.value, values_);
        if (std::fabs(now - before) <= visible * (std::fabs(now) + std::fabs(before))) continue;
        changed.push_back(e);
        break;
      }
    }
    move(start, jump.change);
    return changed;
  }

  bool is_jump(Eigen::Index i, const Vec& change) const { return std::fabs(change[i]) > close_ * size_[i]; }

  /// Are the factors of x′ in a row the gradient of a function of x, so that their integral does not depend
  /// on the path?
  bool is_exact(int row) const {
    std::vector<Expr> factors(form_.x.size(), Expr(0));
    for (const Entry& e : sparse_jacobian({&form_.F[row], 1}, form_.xdot)) factors[e.column] = e.value;
    for (std::size_t j = 0; j < factors.size(); ++j)
      for (std::size_t k = 0; k < j; ++k)
        if (!simplify(partial(factors[j], form_.x[k]) - partial(factors[k], form_.x[j])).is_zero())
          return false;
    return true;
  }

  /// Replaces E by its mean along the straight path: Gauss quadrature of order 10 on four parts (Abramowitz &
  /// Stegun 1964, table 25.4).
  void take_means(const PointValues& start, const Vec& change) {
    constexpr int parts = 4;
    constexpr double nodes[] = {-0.9061798459386640, -0.5384693101056831, 0, 0.5384693101056831,
                                0.9061798459386640};
    constexpr double weights[] = {0.2369268850561891, 0.4786286704993665, 0.5688888888888889,
                                  0.4786286704993665, 0.2369268850561891};
    Mat mean = Mat::Zero(E_.rows(), E_.cols());
    for (int part = 0; part < parts; ++part)
      for (int k = 0; k < 5; ++k) {
        move(start, (part + (1 + nodes[k]) / 2) / parts * change);
        mean += weights[k] / (2 * parts) * jacobian(form_.F, form_.xdot);
      }
    E_ = mean;
    move(start, change);
  }

  std::vector<Expr> unknowns_of_impulses() const {
    std::vector<Expr> list = form_.xdot;
    list.insert(list.end(), form_.z.begin(), form_.z.end());
    return list;
  }
  Mat jacobian(const std::vector<Expr>& rows, const std::vector<Expr>& columns) const {
    Mat J = Mat::Zero(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
    for (const Entry& e : sparse_jacobian(rows, columns)) J(e.row, e.column) = value_at(e.value, values_);
    return J;
  }
  Vec residuals() const {
    Vec G(static_cast<Eigen::Index>(conditions_.size()));
    for (Eigen::Index i = 0; i < G.size(); ++i) G[i] = value_at(conditions_[i], values_);
    return G;
  }
  void move(const PointValues& start, const Vec& change) {
    for (Eigen::Index i = 0; i < n_; ++i) values_[form_.x[i]] = start.at(form_.x[i]) + change[i];
  }
  /// Are both parts of the equations satisfied?
  bool satisfies_equations(const Vec& change, const Vec& impulse) const {
    const Vec r = E_ * change + B_ * impulse;
    const Vec size =
        E_.cwiseAbs() * (size_ + change.cwiseAbs()) + B_.cwiseAbs() * (impulse_size_ + impulse.cwiseAbs());
    for (Eigen::Index i = 0; i < r.size(); ++i)
      if (!(std::fabs(r[i]) <= close_ * size[i])) return false;
    return obeys_conditions(close_);
  }
  bool obeys_conditions(double share) const {
    const Vec G = residuals();
    for (Eigen::Index i = 0; i < G.size(); ++i)
      if (!(std::fabs(G[i]) <= share * size_of(conditions_[i], values_, sizes_))) return false;
    return true;
  }
  /// The minimum-norm solution of the equilibrated system K y = right; values at the rounding level become 0.
  static Vec least_step(const Mat& K, const Vec& right) {
    const auto inverse = [](double s) { return s > 0 ? 1 / s : 1.0; };
    const Vec row = K.rowwise().norm().unaryExpr(inverse);
    const Mat scaled = row.asDiagonal() * K;
    const Vec column = scaled.colwise().norm().transpose().unaryExpr(inverse);
    const Vec y = Mat(scaled * column.asDiagonal())
                      .completeOrthogonalDecomposition()
                      .solve(Vec(row.cwiseProduct(right)));
    const double least = rounding_of_sums * y.cwiseAbs().maxCoeff();
    return y.unaryExpr([&](double v) { return std::fabs(v) <= least ? 0.0 : v; }).cwiseProduct(column);
  }

  const std::vector<Expr>& conditions_;
  const FirstOrder& form_;
  double close_;
  PointValues values_;
  Sizes sizes_;
  Eigen::Index n_ = 0, m_ = 0;
  Mat E_, B_;
  bool takes_means_ = false;
  std::optional<Jump> with_first_factors_;
  Vec size_, impulse_size_;  ///< of x, of Λ
};

}  // namespace

namespace {

/// An impact at the end of which sliding bodies are at rest.
struct Rest {
  struct Friction {
    Expr impulse, normal;  ///< Γ, and the z whose impulse is Λ
    double turns;          ///< the share of the impact, with the original signs, at which s = 0
  };
  FirstOrder form;               ///< with Γ in place of sign(s) z
  std::vector<Expr> conditions;  ///< including 0 = s
  std::vector<Friction> list;
};

PointValues moved(PointValues values, const FirstOrder& form, const Vec& change) {
  for (std::size_t i = 0; i < form.x.size(); ++i) values[form.x[i]] += change[i];
  return values;
}

/// The signs with a factor z that change during a jump; empty if one of them has several such factors.
std::optional<Rest> rest_after(const std::vector<Expr>& conditions, const FirstOrder& form,
                               const PointValues& before, const Jump& jump) {
  const PointValues after = moved(before, form, jump.change);
  Rest rest{form, conditions, {}};
  for (Expr node : topological(form.F)) {
    if (node.op() != Op::sign || value_at(node, before) == value_at(node, after)) continue;
    const std::vector<Expr> none = substitute(rest.form.F, {{node, Expr(0)}}),
                            one = substitute(rest.form.F, {{node, Expr(1)}});
    std::vector<Expr> friction;
    for (std::size_t i = 0; i < none.size(); ++i) friction.push_back(simplify(one[i] - none[i]));
    const std::vector<Entry> entries = sparse_jacobian(friction, form.z);
    if (entries.empty()) continue;  // a finite force
    const Expr impulse = symbol(Kind::slot, text("friction_impulse_", rest.list.size() + 1));
    rest.form.F = none;
    for (const Entry& e : entries) {
      if (e.column != entries.front().column) return {};
      rest.form.F[e.row] += e.value * impulse;
    }
    rest.form.z.push_back(impulse);
    rest.conditions.push_back(node.operand(0));
    const double from = value_at(node.operand(0), before), to = value_at(node.operand(0), after);
    rest.list.push_back({impulse, form.z[entries.front().column], from / (from - to)});
  }
  return rest.list.empty() ? std::nullopt : std::optional(rest);
}

}  // namespace

std::optional<Jump> jump_onto(const std::vector<Expr>& conditions, const FirstOrder& form, PointValues before,
                              const LeafValues& sizes, double close, std::string& why) {
  JumpSystem system(conditions, form, before, sizes, close);
  const auto sliding = system.solve(why);
  if (sliding || why.empty()) return sliding;
  const Jump& first = *system.with_first_factors();
  const auto rest = rest_after(conditions, form, before, first);
  if (!rest) return {};
  // From s = 0 on friction holds if it can. The remaining impulse may exceed its limit even if the whole
  // impulse does not.
  constexpr double together = 1e-9;
  const double share = rest->list.front().turns;
  std::string unknown;
  const auto solve_from = [&](const PointValues& point) {
    return JumpSystem(rest->conditions, rest->form, point, sizes, close).solve(unknown);
  };
  const auto jump = solve_from(before), held = solve_from(moved(before, form, share * first.change));
  const auto is_held = [&](const Rest::Friction& f) {
    const double most =
        std::fabs(held->impulses.at(f.normal)) + close * std::fabs(jump->impulses.at(f.normal));
    return std::fabs(f.turns - share) <= together && std::fabs(held->impulses.at(f.impulse)) <= most;
  };
  if (!jump || !held || !std::all_of(rest->list.begin(), rest->list.end(), is_held)) return {};
  why.clear();
  return jump;
}

}  // namespace pendula::dae
