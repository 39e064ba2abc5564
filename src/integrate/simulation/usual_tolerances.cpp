#include "integrate/simulation/usual_tolerances.hpp"

#include <algorithm>
#include <cmath>

#include "integrate/problem/rhs_solver.hpp"
#include "integrate/simulation/natural_sizes.hpp"

namespace pendula::integrate {
namespace {

constexpr double usual_share = 1e-3, large_size = 1e3;

/// Sets x′ to 0 where it promises a large size and is gone after a few millionths of the interval: beside a
/// pole it is as large as one likes.
Point without_short_slopes(Point start, const ProblemPtr& problem, double interval) {
  constexpr double short_way = 1e-6, gone = 0.1;  // of the interval; of the slope, that is left
  constexpr int steps = 2;  // the first one may change a speed, the second one what it moves
  const auto promises = [&](Eigen::Index i) {
    const double size = interval * std::fabs(start.xdot[i]);
    return size > large_size && size > std::fabs(start.x[i]);
  };
  std::vector<Eigen::Index> suspects;
  for (Eigen::Index i = 0; i < start.x.size(); ++i)
    if (promises(i)) suspects.push_back(i);
  if (suspects.empty()) return start;
  Stats stats;
  RhsSolver derivative(problem, stats);
  Point there = start;
  bool known = true;
  for (int k = 0; known && k < steps; ++k) {
    there.t += short_way * interval;
    there.x += short_way * interval * there.xdot;
    known = derivative(there.t, there.x.data(), there.xdot.data(), there.z.data());
  }
  for (const Eigen::Index i : suspects)
    if (!known || std::fabs(there.xdot[i]) < gone * std::fabs(start.xdot[i])) start.xdot[i] = 0;
  return start;
}

/// Sets sizes to 0 that come from x′ alone, are far below the largest and prove to be rounding errors: those
/// change completely with the last digits of x. Returns which of the small sizes are genuine.
std::vector<char> without_noise(Vec& size, const ProblemPtr& problem, const Point& start, double interval) {
  constexpr double small = 1e-6, last_digits = 1e-15, clear = 100;
  const double largest = size.maxCoeff();
  const Eigen::Index n = start.x.size();
  std::vector<char> certain(static_cast<std::size_t>(size.size()), 0);
  std::vector<Eigen::Index> suspects;
  for (Eigen::Index i = 0; i < n; ++i)
    if (size[i] > std::fabs(start.x[i]) && size[i] < small * largest) suspects.push_back(i);
  if (suspects.empty()) return certain;
  Stats stats;
  RhsSolver derivative(problem, stats);
  Point there = start;
  for (Eigen::Index i = 0; i < n; ++i) there.x[i] *= 1 + (i % 2 == 0 ? last_digits : -last_digits);
  if (!derivative(there.t, there.x.data(), there.xdot.data(), there.z.data())) return certain;
  for (Eigen::Index i : suspects)
    if (size[i] <= clear * interval * std::fabs(there.xdot[i] - start.xdot[i]))
      size[i] = 0;
    else
      certain[i] = 1;
  return certain;
}

/// The largest x and z in earlier pieces of the run. At a stop their present values may be rounding errors.
Vec sizes_before(const Simulation& simulation, const Problem& problem) {
  const std::unordered_map<Expr, double> known(simulation.start->request.sizes.begin(),
                                               simulation.start->request.sizes.end());
  Vec size = Vec::Zero(problem.n() + problem.m());
  if (known.empty()) return size;
  Eigen::Index i = 0;
  for (const auto* list : {&problem.model().x, &problem.model().z})
    for (Expr leaf : *list) {
      if (const auto at = known.find(leaf); at != known.end()) size[i] = at->second;
      ++i;
    }
  return size;
}

/// atol in units of rtol: a hundredth of the size of the unknown, at most 10⁻³. Otherwise a model in metres
/// with lengths of nanometres would count as at rest.
Vec small_shares(const Vec& size, const std::vector<char>& certain) {
  constexpr double rounding = 1e-12;  // a start that is 0 to within rounding contains no size
  const double largest = size.maxCoeff();
  Vec share(size.size());
  for (Eigen::Index i = 0; i < size.size(); ++i)
    share[i] = std::min(usual_share, 1e-2 * (certain[i] || size[i] > rounding * largest ? size[i] : largest));
  return share;
}

/// Raises atol to a millionth of the size of the unknown if that exceeds 10⁻³. Otherwise a model in
/// nanometres would resolve its zeros to all digits (21 732 steps of a spring pendulum instead of 107).
/// Values that fall by six decades keep their digits. Sizes come from the equations, since much is 0 at a
/// start, but exceed those at the start at most a thousandfold.
void raise_to_large_sizes(Vec& share, const Vec& size, const Vec& natural) {
  constexpr double negligible = 1e-6, believed = 1e3;
  for (Eigen::Index i = 0; i < share.size(); ++i) {
    const double told = size[i] > 0 ? std::min(natural[i], believed * size[i]) : natural[i];
    share[i] = std::max(share[i], negligible * told);
  }
}

bool is_among(const std::vector<Expr>& list, Expr e) {
  return std::find(list.begin(), list.end(), e) != list.end();
}

/// What moves x in a unit of time by its size s: of each unknown z_k max s_i / max |∂F/∂z_k|/|∂F/∂x_i′|, over
/// the rows with both; not finite where there is none. Single x_i may be 0 at the start.
Vec paces(Problem& problem, const Point& start, const Vec& size) {
  const int n = problem.n();
  struct Row {
    int state = -1;
    double mass = 0;
  };
  std::vector<Row> rows(static_cast<std::size_t>(n + problem.m()));
  problem.set_point(start.t, start.x.data(), start.xdot.data(), start.z.data());
  const std::vector<double>& entries = problem.jacobian();
  const std::vector<Problem::Entry>& pattern = problem.pattern();
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const auto [row, column] = pattern[k];
    if (column >= n && column < 2 * n && std::fabs(entries[k]) > rows[row].mass)
      rows[row] = {column - n, std::fabs(entries[k])};
  }
  Vec moved = Vec::Zero(problem.m()), effect = moved;
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const auto [row, column] = pattern[k];
    const Row& at = rows[row];
    if (column < 2 * n || at.state < 0) continue;
    double &size_of_moved = moved[column - 2 * n], &own = effect[column - 2 * n];
    size_of_moved = std::max(size_of_moved, size[at.state]);
    own = std::max(own, std::fabs(entries[k]) / at.mass);
  }
  return moved.cwiseQuotient(effect);
}

/// Multipliers that are 0 on every solution have no size: they count as what moves x by its size in the whole
/// run. With the usual atol a pendulum in form "ggl" took 3400 steps of radau at rtol 10⁻⁹, since the
/// iterations left more open of μ.
void take_paces(Vec& share, const Vec& pace, const std::vector<Expr>& vanishing, const Problem& problem,
                double interval) {
  const std::vector<Expr>& z = problem.model().z;
  for (int k = 0; k < problem.m(); ++k) {
    const double own = pace[k] / interval;
    if (is_among(vanishing, z[k]) && std::isfinite(own) && own > 0) share[problem.n() + k] = own;
  }
}

}  // namespace

double usual_rtol(const Simulation& simulation) { return simulation.rtol.all.value_or(default_rtol); }

Vec usual_atol(const Simulation& simulation, const ProblemPtr& problem, const Point& at) {
  const double from = simulation.plan.from, interval = simulation.plan.to - from;
  const Point start = without_short_slopes(at, problem, interval);
  Vec size(start.x.size() + start.z.size());
  size << start.x.cwiseAbs().cwiseMax(interval * start.xdot.cwiseAbs()), start.z.cwiseAbs();
  const Vec before = sizes_before(simulation, *problem);
  const auto is_known = [&] { return size.size() && size.allFinite() && size.maxCoeff() > 0; };
  std::vector<char> certain(static_cast<std::size_t>(size.size()), 0);
  if (is_known()) certain = without_noise(size, problem, start, interval);
  size = size.cwiseMax(before);
  const double rtol = usual_rtol(simulation);
  if (!is_known()) return Vec::Constant(size.size(), rtol * usual_share);
  const double largest = size.maxCoeff();
  Vec share = small_shares(size, certain);
  if (largest > large_size) {
    Problem own(*problem);
    raise_to_large_sizes(share, size, natural_sizes(own, start, from, interval));
  }
  if (const std::vector<Expr>& vanishing = simulation.start->model->vanishing; !vanishing.empty()) {
    Problem own(*problem);
    take_paces(share, paces(own, start, size + share), vanishing, *problem, interval);
  }
  return rtol * share;
}

Vec multiplier_times(const Simulation& simulation, const ProblemPtr& problem, const Point& start,
                     const std::vector<int>& index) {
  const double from = simulation.plan.from, interval = simulation.plan.to - from;
  const int n = problem->n(), m = problem->m();
  // Sums over stages multiply errors of x. Of 1, 3, 10, 30 the last two take the fewest steps of radau and
  // bdf for a pendulum in form "ggl", rtol 1e-4 … 1e-11.
  constexpr double amplified = 10;
  Vec time = Vec::Ones(n + m);
  // index 3: rounding errors of x, divided by dt², are larger than what its tolerance leaves open
  const bool is_low = std::none_of(index.begin(), index.end(), [](int i) { return i > 2; });
  if (!is_low || !(interval > 0)) return time;
  Problem own(*problem);
  Vec size = natural_sizes(own, start, from, interval);
  for (int i = 0; i < n; ++i)
    if (size[i] == 0) size[i] = std::max(std::fabs(start.x[i]), interval * std::fabs(start.xdot[i]));
  const Vec pace = paces(own, start, size);
  const std::vector<Expr>& vanishing = simulation.start->model->vanishing;
  for (int k = 0; k < m; ++k) {
    if (index[n + k] < 2) continue;
    const bool vanishes = is_among(vanishing, problem->model().z[k]);
    const double own_time = vanishes ? interval : pace[k] / std::max(size[n + k], std::fabs(start.z[k]));
    if (std::isfinite(own_time) && own_time > 0) time[n + k] = amplified * own_time;
  }
  return time;
}

}  // namespace pendula::integrate
