#include "integrate/event/monitor/rank_block.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "dae/model/lineage.hpp"
#include "expr/graph/derivative.hpp"

namespace pendula::integrate {

constexpr std::size_t most_names = 6;

RankBlock::RankBlock(const dae::LargeBlock& block, const ProblemPtr& problem, std::function<Vec()> sizes)
    : block_(block), given_(problem), values_(problem->values()), sizes_(std::move(sizes)) {
  if (!problem->model().u.empty()) own_ = std::make_shared<Problem>(*problem);
}

std::vector<double> RankBlock::units_by_inertia(const Point& point) {
  std::vector<double> units(block_.inertia.size());
  codegen::Kernel(block_.inertia, arguments())(values(point), units.data());
  for (double& unit : units) unit = 1 / std::sqrt(std::fabs(unit));
  const bool known =
      std::all_of(units.begin(), units.end(), [](double u) { return u > 0 && std::isfinite(u); });
  return known ? units : std::vector<double>();
}

std::vector<double> RankBlock::units_by_size() const {
  if (!sizes_) return {};
  const Vec sizes = sizes_();
  const dae::FirstOrder& form = given_->model();
  std::vector<Expr> unknowns = form.x;
  unknowns.insert(unknowns.end(), form.z.begin(), form.z.end());
  std::vector<double> units;
  for (Expr leaf : block_.moved) {
    double size = 0;
    for (int order = symbol_of(leaf).order - 1; order >= 0 && !(size > 0); --order) {
      const Expr state = derivative_leaf(symbol_of(leaf).base, order);  // y″ is v′ where the state v is y′
      const auto at = std::find(unknowns.begin(), unknowns.end(), state);
      if (at != unknowns.end() && at - unknowns.begin() < sizes.size()) size = sizes[at - unknowns.begin()];
    }
    units.push_back(size);
  }
  const bool known = std::all_of(units.begin(), units.end(), [](double size) { return size > 0; });
  return known ? units : std::vector<double>();
}

const double* RankBlock::values(const Point& p) {
  if (own_) {
    own_->set_point(p.t, p.x.data(), p.xdot.data(), p.z.data());
    return own_->values().data();
  }
  const auto n = p.x.size();
  double* to = values_.data();
  to[0] = p.t;
  std::copy_n(p.x.data(), n, to + 1);
  std::copy_n(p.xdot.data(), n, to + 1 + n);
  std::copy_n(p.z.data(), p.z.size(), to + 1 + 2 * n);
  return to;
}

void RankBlock::take_parameters(const Problem& problem) {
  if (own_) own_->take_parameters(problem);
  const auto n = static_cast<std::ptrdiff_t>(problem.model().p.size());
  std::copy_n(problem.values().end() - n, n, values_.end() - n);
}

Vec RankBlock::generic_direction(int size) {
  Vec v(size);
  for (int i = 0; i < size; ++i) v[i] = 1 + 0.3 * std::sin(1.0 + i);
  return v;
}

std::string RankBlock::loses(const Point& point) {
  const int n = block_.all.rows;
  const codegen::Kernel kernel(entries(block_.all), arguments());
  std::vector<double> numbers(kernel.outputs());
  kernel(values(point), numbers.data());
  LinearSolver<double> J, transposed;
  J.analyse(n, positions(block_.all));
  transposed.analyse(n, positions(block_.all, true));
  std::vector<Expr> names;
  if (J.factorise(numbers.data()) && transposed.factorise(numbers.data())) {
    Vec v = generic_direction(n);
    for (int k = 0; k < 3 && v.allFinite() && v.norm() > 0; ++k) {
      v /= v.norm();
      transposed.solve(v.data());
      v /= v.norm();
      J.solve(v.data());
    }
    const double largest = v.cwiseAbs().maxCoeff();
    for (int j = 0; j < n; ++j)
      if (std::fabs(v[j]) > 5e-2 * largest) names.push_back(block_.determined[j]);
  }
  if (names.empty()) names = block_.determined;
  return "no longer determine " + (names.size() <= most_names
                                       ? dae::grouped_names(names)
                                       : text(dae::grouped_names({names.begin(), names.begin() + most_names}),
                                              ", … (", names.size(), " in all)"));
}

std::string RankBlock::equations_lose(const Point& point) {
  return text("the equations ", some(block_.equations), " ", loses(point));
}

std::string RankBlock::remedy() {
  return "; the motion may branch there: start again beyond it, init{ fix = …, from = t } on the branch meant, "
         "or continue without monitoring: guards = false";
}

Point RankBlock::just_before(double t, double from, const SolutionBetween& between) {
  Point p;
  for (const double part : {1e-5, 1e-3, 1e-1})
    if (reached(t - part * (t - from), between, p)) return p;
  between(from, p);
  return p;
}

bool RankBlock::reached(double t, const SolutionBetween& between, Point& out) {
  try {
    between(t, out);
    return true;
  } catch (const Failure&) {
    return false;
  }
}

std::vector<Position> RankBlock::positions(const dae::LargeBlock::Matrix& m, bool transposed) {
  std::vector<Position> list;
  for (const Entry& e : m.entries)
    list.push_back(transposed ? Position{e.column, e.row} : Position{e.row, e.column});
  return list;
}

std::vector<Expr> RankBlock::entries(const dae::LargeBlock::Matrix& m) {
  std::vector<Expr> list;
  for (const Entry& e : m.entries) list.push_back(e.value);
  return list;
}

std::string RankBlock::some(const std::vector<std::string>& words) {
  if (words.size() <= most_names) return join(words, ", ");
  return text(join(std::vector<std::string>(words.begin(), words.begin() + most_names), ", "), ", … (",
              words.size(), " in all)");
}

}  // namespace pendula::integrate
