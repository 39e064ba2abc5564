#include "integrate/event/uniqueness.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/lru_cache.hpp"
#include "base/text.hpp"
#include "dae/analysis/determinant_factors.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

/// Numbers and parameters.
bool is_fixed(Expr e) {
  const std::vector<Expr> inside = leaves({&e, 1});
  return std::all_of(inside.begin(), inside.end(), [](Expr leaf) {
    return symbol_of(leaf).kind == Kind::parameter || symbol_of(leaf).kind == Kind::constant;
  });
}

/// What a root vanishes with, and what changes its sign there: 2 g |h| vanishes with h.
Expr inside(Expr e) {
  for (;;) {
    switch (e.op()) {
      case Op::abs:
      case Op::neg:
        e = e.operand(0);
        continue;
      case Op::max:
      case Op::min:
        if (!e.operand(0).is_zero() && !e.operand(1).is_zero()) return e;
        e = e.operand(e.operand(0).is_zero() ? 1 : 0);
        continue;
      case Op::mul:
      case Op::div:
        if (is_fixed(e.operand(1)))
          e = e.operand(0);
        else if (e.op() == Op::mul && is_fixed(e.operand(0)))
          e = e.operand(1);
        else
          return e;
        continue;
      default:
        return e;
    }
  }
}

bool is_root(Expr e) {
  if (e.op() == Op::sqrt) return true;
  if (e.op() != Op::pow || !e.operand(1).is_constant()) return false;
  const double q = constant_value(e.operand(1));
  return q > 0 && q < 1;
}

}  // namespace

std::vector<UniquenessCheck::Root> UniquenessCheck::roots_of(const Problem& problem) {
  constexpr std::size_t size = 200'000;  // in equations; an entry counts as 1000 more
  static LruCache<std::shared_ptr<const dae::FirstOrder>, std::vector<Root>> known(size);
  const auto equations = problem.shared_model();
  if (const std::vector<Root>* found = known.find(equations)) return *found;
  std::vector<Root> roots;
  for (Expr node : topological(equations->F)) {
    if (!is_root(node)) continue;
    const Expr argument = inside(node.operand(0));
    // a sum of squares, as in lengths: its gradient vanishes with it
    if (dae::sign_of(argument) != 0) continue;
    const auto holds = [&](const std::vector<Expr>& list, Expr leaf) {
      return std::find(list.begin(), list.end(), leaf) != list.end();
    };
    bool moves = false, known_there = true;
    for (Expr leaf : leaves({&argument, 1})) {
      const Kind kind = symbol_of(leaf).kind;
      const bool state = holds(equations->x, leaf);
      moves = moves || state;
      known_there =
          known_there && (state || kind == Kind::time || kind == Kind::parameter || kind == Kind::constant);
    }
    if (moves && known_there) roots.push_back({argument, node});
  }
  return known.insert(equations, std::move(roots), 1000 + equations->F.size());
}

UniquenessCheck::UniquenessCheck(const Problem& problem) : roots_(roots_of(problem)) {
  if (roots_.empty()) return;
  problem_ = std::make_shared<Problem>(problem);  // the run places other points
  std::vector<Expr> unknowns{time_symbol()}, outputs;
  unknowns.insert(unknowns.end(), problem.model().x.begin(), problem.model().x.end());
  for (const Root& root : roots_) {
    outputs.push_back(root.argument);
    const std::vector<Expr> slopes = gradient(root.argument, unknowns);
    outputs.insert(outputs.end(), slopes.begin(), slopes.end());
  }
  kernel_ = codegen::Kernel(outputs, problem.arguments());
  out_.resize(outputs.size());
}

void UniquenessCheck::evaluate(const Point& point) {
  problem_->place(point.t, point.x.data(), point.xdot.data(), point.z.data());
  kernel_(problem_->values().data(), out_.data());
}

std::string UniquenessCheck::at(RhsSolver& derivative, const Point& point, const Tolerances& tolerances) {
  constexpr double located = 1e-10;  // of the size of u: what a root of it is off by
  if (roots_.empty()) return "";
  const Eigen::Index n = point.x.size();
  evaluate(point);
  const std::vector<double> here = out_;
  for (std::size_t k = 0; k < roots_.size(); ++k) {
    const double* row = here.data() + k * static_cast<std::size_t>(n + 2);
    const Eigen::Map<const Vec> slopes(row + 2, n);
    Vec weight(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double least = tolerances.rtol[i] > 0 ? tolerances.atol[i] / tolerances.rtol[i] : 1.0;
      weight[i] = std::max(std::fabs(point.x[i]), least) * slopes[i];
    }
    const double size = weight.cwiseAbs().sum();
    if (!(std::fabs(row[0]) <= located * size)) continue;
    // the shortest way to u = 1, each state in units of its size
    Vec direction = Vec::Zero(n);
    for (Eigen::Index i = 0; i < n; ++i)
      if (slopes[i] != 0) direction[i] = weight[i] * weight[i] / (slopes[i] * weight.squaredNorm());
    Point on = point;
    on.x -= row[0] * direction;
    if (escapes(k, derivative, on, direction, size)) {
      return text("not unique from t = ", rounded(point.t, 6), " on: ", to_text(roots_[k].argument),
                  " = 0 there, where ", to_text(roots_[k].node),
                  " has an infinite slope; one solution stays, others leave");
    }
  }
  return "";
}

double UniquenessCheck::rate(std::size_t k, RhsSolver& derivative, Point point) {
  if (!derivative(point.t, point.x.data(), point.xdot.data(), point.z.data())) return std::nan("");
  evaluate(point);
  const Eigen::Index n = point.x.size();
  const double* row = out_.data() + k * static_cast<std::size_t>(n + 2);
  return row[1] + Eigen::Map<const Vec>(row + 2, n).dot(point.xdot);
}

bool UniquenessCheck::escapes(std::size_t k, RhsSolver& derivative, const Point& on, const Vec& direction,
                              double size) {
  constexpr double far = 1e-5, near = 1e-9;  // of the size of u
  constexpr double lowest = 0.1, highest = 0.9, still = 0.01;
  const double here = rate(k, derivative, on);
  for (const double side : {1.0, -1.0}) {
    const auto away = [&](double distance) {
      Point beside = on;
      beside.x += side * distance * size * direction;
      const double outward = side * rate(k, derivative, beside);
      const double u = out_[k * out_.size() / roots_.size()];
      return side * u > 0 ? outward : -1.0;  // beyond a kink u does not grow as its gradient says
    };
    const double wide = away(far), narrow = away(near);
    if (!(wide > 0 && narrow > 0) || !(std::fabs(here) <= still * narrow)) continue;
    const double q = std::log(wide / narrow) / std::log(far / near);
    if (q > lowest && q < highest) return true;
  }
  return false;
}

}  // namespace pendula::integrate
