#include "integrate/event/uniqueness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "dae/model/piecewise.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

/// Does e contain numbers and parameters only?
bool is_fixed(Expr e) {
  const std::vector<Expr> inside = leaves({&e, 1});
  return std::all_of(inside.begin(), inside.end(), [](Expr leaf) {
    return symbol_of(leaf).kind == Kind::parameter || symbol_of(leaf).kind == Kind::constant;
  });
}

/// A bound that only keeps a function in its domain, as in max(u, 0).
bool is_floor(Expr e) {
  return e.is_constant() && std::fabs(constant_value(e)) <= std::numeric_limits<double>::min();
}

/// √u for √max(floor, u), which a step evaluates.
Expr without_floor(Expr root) {
  const Expr bounded = root.operand(0);
  if (bounded.is_constant() || bounded.is_symbol() || bounded.op() != Op::max) return root;
  for (int i : {0, 1})
    if (is_floor(bounded.operand(i)) && !bounded.operand(i).is_zero())
      return substitute(root, {{bounded, bounded.operand(1 - i)}});
  return root;
}

/// A factor that never vanishes: a number, a parameter, exp(v).
bool keeps_sign(Expr e) { return is_fixed(e) || std::abs(dae::sign_of(e)) == 2; }

/// The factor with which a root vanishes and at which it changes its sign: 2 g |h| vanishes with h.
Expr inside(Expr e) {
  for (;;) {
    switch (e.op()) {
      case Op::abs:
      case Op::neg:
        e = e.operand(0);
        continue;
      case Op::max:
      case Op::min:
        if (!is_floor(e.operand(0)) && !is_floor(e.operand(1))) return e;
        e = e.operand(is_floor(e.operand(0)) ? 1 : 0);
        continue;
      case Op::mul:
      case Op::div:
        if (keeps_sign(e.operand(1)))
          e = e.operand(0);
        else if (e.op() == Op::mul && keeps_sign(e.operand(0)))
          e = e.operand(1);
        else
          return e;
        continue;
      default:
        return e;
    }
  }
}

/// Does e contain t, states, numbers and parameters only, states among them?
bool moves_by_states(Expr e, const std::vector<Expr>& states) {
  bool moves = false;
  for (Expr leaf : leaves({&e, 1})) {
    const Kind kind = symbol_of(leaf).kind;
    const bool state = std::find(states.begin(), states.end(), leaf) != states.end();
    if (!state && kind != Kind::time && kind != Kind::parameter && kind != Kind::constant) return false;
    moves = moves || state;
  }
  return moves;
}

/// u, u′, u″ … along the solution, as long as they are functions of t and of states whose derivatives
/// contain no root.
std::vector<Expr> chain_of(Expr u, const dae::FirstOrder& equations) {
  constexpr std::size_t longest = 4;
  std::vector<Expr> chain{u};
  if (!equations.semi_explicit) return chain;
  std::vector<Expr> arguments{time_symbol()};
  arguments.insert(arguments.end(), equations.x.begin(), equations.x.end());
  while (chain.size() < longest) {
    const std::vector<Expr> slopes = gradient(chain.back(), arguments);
    Expr next = slopes[0];
    for (std::size_t i = 0; i < equations.x.size(); ++i)
      if (!slopes[i + 1].is_zero()) next = next + slopes[i + 1] * equations.f[i];
    const std::vector<Expr> nodes = topological({&next, 1});
    if (!moves_by_states(next, equations.x) || std::any_of(nodes.begin(), nodes.end(), dae::is_root)) break;
    chain.push_back(next);
  }
  return chain;
}

}  // namespace

std::vector<UniquenessCheck::Root> UniquenessCheck::roots_of(const Problem& problem) {
  constexpr std::size_t size = 200'000;  // capacity in equations; each entry counts as 1000 more
  static LruCache<std::shared_ptr<const dae::FirstOrder>, std::vector<Root>> known(size);
  const auto equations = problem.shared_model();
  if (const std::vector<Root>* found = known.find(equations)) return *found;
  std::vector<Root> roots;
  for (Expr node : topological(equations->F)) {
    if (!dae::is_root(node)) continue;
    const Expr argument = inside(node.operand(0));
    // a sum of squares, as in lengths, whose gradient vanishes with it
    if (dae::sign_of(argument) != 0) continue;
    if (moves_by_states(argument, equations->x))
      roots.push_back({chain_of(argument, *equations), without_floor(node)});
  }
  return known.insert(equations, std::move(roots), 1000 + equations->F.size());
}

UniquenessCheck::UniquenessCheck(const Problem& problem) : roots_(roots_of(problem)) {
  if (roots_.empty()) return;
  problem_ = std::make_shared<Problem>(problem);  // private copy, since the run sets other points
  states_ = static_cast<Eigen::Index>(problem.model().x.size());
  std::vector<Expr> unknowns{time_symbol()}, outputs;
  unknowns.insert(unknowns.end(), problem.model().x.begin(), problem.model().x.end());
  std::size_t count = 0;
  const auto row_size = static_cast<std::size_t>(states_ + 2);
  for (const Root& root : roots_) {
    first_.push_back(count);
    for (Expr u : root.chain) {
      outputs.push_back(u);
      places_.push_back(count * row_size);
      const std::vector<Expr> slopes = gradient(u, unknowns);
      for (std::size_t i = 0; i < slopes.size(); ++i) {
        if (slopes[i].is_zero()) continue;
        outputs.push_back(slopes[i]);
        places_.push_back(count * row_size + 1 + i);
      }
      ++count;
    }
  }
  kernel_ = codegen::Kernel(outputs, problem.arguments());
  found_.resize(outputs.size());
  out_.assign(count * row_size, 0);
}

void UniquenessCheck::evaluate(const Point& point) {
  problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), found_.data());
  for (std::size_t k = 0; k < places_.size(); ++k) out_[places_[k]] = found_[k];
}

std::string UniquenessCheck::at(RhsSolver& derivative, const Point& point, const Tolerances& tolerances,
                                bool is_root) {
  // Relative to the size of u. The error of a located root is that of its time, 10⁻¹⁰; the step that is then
  // made to it differs from the interpolated one by a part of its tolerance.
  constexpr double of_time = 1e-10, of_step = 0.1;
  const double located = is_root ? std::max(of_time, of_step * tolerances.rtol.maxCoeff()) : of_time;
  Vec unit(states_);
  for (Eigen::Index i = 0; i < states_; ++i)
    unit[i] = std::max(std::fabs(point.x[i]),
                       tolerances.rtol[i] > 0 ? tolerances.atol[i] / tolerances.rtol[i] : 1.0);
  evaluate(point);
  for (std::size_t k = 0; k < roots_.size(); ++k)
    if (is_zero(k, unit, located) && leaves_from(k, derivative, point, unit))
      return text("not unique from t = ", rounded(point.t, 6), " on: ", to_text(roots_[k].chain[0]),
                  " = 0 there, where ", to_text(roots_[k].node),
                  " has an infinite slope; one solution stays, others leave");
  return "";
}

/// Of the last evaluation: are u, u′, u″ … of root k 0 within the error of its location?
bool UniquenessCheck::is_zero(std::size_t k, const Vec& unit, double located) const {
  for (std::size_t i = 0; i < roots_[k].chain.size(); ++i) {
    const double* u = row(k, i);
    const auto weight = Eigen::Map<const Vec>(u + 2, states_).cwiseProduct(unit);
    if (!(std::fabs(u[0]) <= located * weight.cwiseAbs().sum())) return false;
  }
  return true;
}

/// Requires an evaluation at the point, and leaves one.
bool UniquenessCheck::leaves_from(std::size_t k, RhsSolver& derivative, const Point& point, const Vec& unit) {
  const auto m = static_cast<Eigen::Index>(roots_[k].chain.size());
  Vec value(m);
  Mat weight(m, states_);
  for (Eigen::Index i = 0; i < m; ++i) {
    const double* u = row(k, static_cast<std::size_t>(i));
    value[i] = u[0];
    weight.row(i) = Eigen::Map<const Vec>(u + 2, states_).cwiseProduct(unit).transpose();
  }
  // the smallest change of the states, in units of their sizes, that changes u by 1 and keeps u′, u″ …
  const Mat ways = pseudo_inverse(weight.completeOrthogonalDecomposition());
  const Vec direction = unit.cwiseProduct(ways.col(0));
  bool leaves = false;
  if (direction.allFinite()) {
    Point on = point;
    on.x -= unit.cwiseProduct(ways * value);
    leaves = escapes(k, derivative, on, direction, weight.row(0).cwiseAbs().sum());
  }
  evaluate(point);
  return leaves;
}

double UniquenessCheck::rate(std::size_t k, RhsSolver& derivative, Point point) {
  if (!derivative(point.t, point.x.data(), point.xdot.data(), point.z.data())) return std::nan("");
  evaluate(point);
  const double* last = row(k, roots_[k].chain.size() - 1);
  return last[1] + Eigen::Map<const Vec>(last + 2, states_).dot(point.xdot);
}

bool UniquenessCheck::escapes(std::size_t k, RhsSolver& derivative, const Point& on, const Vec& direction,
                              double size) {
  constexpr double far = 1e-5, near = 1e-9;  // relative to the size of u
  constexpr double lowest = 0.1, highest = 0.9, still = 0.01;
  const double here = rate(k, derivative, on);
  for (const double side : {1.0, -1.0}) {
    const auto away = [&](double distance) {
      Point beside = on;
      beside.x += side * distance * size * direction;
      const double outward = side * rate(k, derivative, beside);
      const double u = row(k, 0)[0];
      return side * u > 0 ? outward : -1.0;  // beyond a kink u does not grow as its gradient predicts
    };
    const double wide = away(far), narrow = away(near);
    if (!(wide > 0 && narrow > 0) || !(std::fabs(here) <= still * narrow)) continue;
    const double q = std::log(wide / narrow) / std::log(far / near);
    if (q > lowest && q < highest) return true;
  }
  return false;
}

}  // namespace pendula::integrate
