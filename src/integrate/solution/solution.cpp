#include "integrate/solution/solution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "expr/print/print.hpp"
#include "integrate/problem/per_equations.hpp"
#include "integrate/solution/regrowth.hpp"

namespace pendula::integrate {
namespace {

void append(std::vector<double>& to, const Vec& values) { to.insert(to.end(), values.begin(), values.end()); }

Vec column(const std::vector<double>& from, int i, int size) {
  return Eigen::Map<const Vec>(from.data() + static_cast<std::ptrdiff_t>(i) * size, size);
}

}  // namespace

void Points::add(const Point& point) {
  t_.push_back(point.t);
  append(x_, point.x);
  append(xdot_, point.xdot);
  append(z_, point.z);
}

Point Points::operator[](int i) const {
  return {t_[i], column(x_, i, n_), column(xdot_, i, n_), column(z_, i, m_)};
}

void Points::get(int i, Point& out) const {
  out.t = t_[i];
  out.x = Eigen::Map<const Vec>(x_.data() + static_cast<std::ptrdiff_t>(i) * n_, n_);
  out.xdot = Eigen::Map<const Vec>(xdot_.data() + static_cast<std::ptrdiff_t>(i) * n_, n_);
  out.z = Eigen::Map<const Vec>(z_.data() + static_cast<std::ptrdiff_t>(i) * m_, m_);
}

int Points::index_at(double t, double rounding) const {
  const auto after = std::upper_bound(t_.begin(), t_.end(), t + rounding);
  return std::max(0, static_cast<int>(after - t_.begin()) - 1);
}

void Points::cut(double t) {
  while (t_.size() > 1 && t_.back() > t) t_.pop_back();
  x_.resize(t_.size() * static_cast<std::size_t>(n_));
  xdot_.resize(t_.size() * static_cast<std::size_t>(n_));
  z_.resize(t_.size() * static_cast<std::size_t>(m_));
}

void Solution::cut(double t) {
  points_.cut(t);
  std::erase_if(events_, [&](const EventRecord& e) { return e.t > t; });
  std::erase_if(methods_in_use_, [&](const MethodInUse& use) { return use.t > t; });
}

Solution::Solution(ProblemPtr problem)
    : problem_(std::move(problem)),
      values_problem_(std::make_shared<Problem>(*problem_)),
      points_(problem_->n(), problem_->m()) {}

void Solution::finish(RunOutcome outcome, const Stats& stats, double seconds) {
  outcome_ = std::move(outcome);
  stats_ = stats;
  seconds_ = seconds;
}

Point Solution::point(int i) const {
  PENDULA_ASSERT(i >= 0 && i < size(), "a point outside the solution");
  return points_[i];
}

Point Solution::final() const {
  if (size() == 0)
    throw Error(text("the solution holds no points: ", status(), " before the first saved time"));
  return point(size() - 1);
}

/// ": the run stopped at t = 0.98: why" if it did not reach the requested end.
std::string Solution::ending_reason() const {
  if (outcome_.ending == Ending::event) return "; an event ended it";
  return outcome_.ending == Ending::stopped ? "; it " + outcome_.message : "";
}

Point Solution::at(double t) const {
  if (size() == 0) return final();  // throws
  auto [first, last] =
      between_ ? between_->interval(points_) : std::pair(points_.t().front(), points_.t().back());
  const double rounding =
      4 * std::numeric_limits<double>::epsilon() * std::max(std::fabs(first), std::fabs(last));
  if (!(t >= first - rounding && t <= last + rounding)) {
    throw Error(text("t = ", rounded(t), " lies outside the solution, which covers ", rounded(first),
                     " ≤ t ≤ ", rounded(last), t > last ? ending_reason() : ""));
  }
  const int i = points_.index_at(t, rounding);
  if (std::fabs(t - points_.t()[i]) <= rounding) return points_[i];
  if (!between_) throw Error("this solution holds its saved points only; ask for these times");
  return between_->at(points_, t);
}

/// Where the arguments of a problem are.
static const std::unordered_map<Expr, int>& argument_places(const Problem& problem) {
  static PerEquations<std::unordered_map<Expr, int>> known;
  return known.of(problem, [&] {
    std::unordered_map<Expr, int> places;
    for (const Expr argument : problem.arguments()) places.emplace(argument, static_cast<int>(places.size()));
    return places;
  });
}

/// One unknown of thousands is asked for in a loop: what it costs does not depend on how many there are.
void Solution::compile(std::span<const Expr> expressions) const {
  if (std::ranges::equal(expressions, last_.expressions) && !last_.expressions.empty()) return;
  const auto& places = argument_places(problem());
  std::vector<Expr> arguments;
  last_.places.clear();
  for (const Expr leaf : leaves(expressions))
    if (const auto at = places.find(leaf); at != places.end()) {
      arguments.push_back(leaf);
      last_.places.push_back(at->second);
    }
  last_.expressions.clear();
  last_.kernel = codegen::Kernel(expressions, arguments);
  last_.arguments.resize(arguments.size());
  last_.expressions.assign(expressions.begin(), expressions.end());
}

void Solution::evaluate_last(const Point& point, double* out) const {
  values_problem_->set_point(point.t, point.x.data(), point.xdot.data(), point.z.data());
  const std::vector<double>& values = values_problem_->values();
  std::ranges::transform(last_.places, last_.arguments.begin(), [&](int place) { return values[place]; });
  last_.kernel(last_.arguments.data(), out);
}

Mat Solution::values(std::span<const Expr> expressions) const {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> result(
      size(), static_cast<Eigen::Index>(expressions.size()));
  compile(expressions);
  for (int i = 0; i < size(); ++i) {
    poll_interrupt();
    evaluate_last(point(i), result.row(i).data());
  }
  return result;
}

Vec Solution::values(std::span<const Expr> expressions, double t) const {
  Vec result(static_cast<Eigen::Index>(expressions.size()));
  compile(expressions);
  evaluate_last(at(t), result.data());
  return result;
}

Vec Solution::values(std::span<const Expr> expressions, const Point& point) const {
  Vec result(static_cast<Eigen::Index>(expressions.size()));
  compile(expressions);
  evaluate_last(point, result.data());
  return result;
}

AdjointGradient Solution::gradient(Expr cost, const std::vector<Expr>& parameters) const {
  if (!outcome_.is_complete())
    throw Error(text("the run has not reached its end (", status(), "): there is no gradient"));
  if (!between_) throw Error("this solution holds its saved points only: there is no gradient");
  const double end = between_->interval(points_).second;
  return adjoint_gradient(std::make_shared<Problem>(*problem_), between_->steps(), at(end), cost, parameters);
}

std::string Solution::str() const {
  if (size() == 0) return "solution: " + status() + "\n";
  Table table({false, false, true});
  const Point end = final();
  for (int i = 0; i < problem().visible_n(); ++i) table.row({problem().x_name(i), "=", rounded(end.x[i])});
  for (int i = 0; i < problem().visible_m(); ++i) table.row({problem().z_name(i), "=", rounded(end.z[i])});
  const std::string step = dt_ > 0 ? text(", dt = ", rounded(dt_, 6)) : "";
  const std::size_t switches = states_in_use_.empty() ? 0 : states_in_use_.size() - 1;
  std::string used;
  if (!states_in_use_.empty())
    used = switches == 0 ? text("  states in use: ", states_in_use_[0].states, "\n")
                         : text("  states in use switched ", switches, switches == 1 ? " time" : " times",
                                " (sol:switches()), at the end: ", states_in_use_.back().states, "\n");
  std::string errors = errors_text().empty() ? "" : "  " + errors_text();
  for (const std::string& remark : {rounding_, not_unique_, untested_})
    if (!remark.empty()) errors += "  " + remark + "\n";
  return text("solution by ", method_, step, ": ", stats_.steps, stats_.steps == 1 ? " step" : " steps",
              " from t = ", rounded(t().front(), 6), " to ", rounded(end.t, 6), ", ", status(), "\n", errors,
              used, table.str(2));
}

double Solution::errors() const {
  if (stats_.errors > Stats::many_errors || !between_ || !outcome_.is_complete()) return stats_.errors;
  if (!beyond_estimates_) beyond_estimates_ = between_->errors_beyond_estimates();
  return stats_.errors + *beyond_estimates_;
}

std::optional<double> Solution::passed_growth() const {
  if (!between_ || !outcome_.is_complete()) return {};
  if (!passed_growth_) passed_growth_ = between_->passed_growth();
  return *passed_growth_;
}

/// "E, I"; "x", of a whole column; of many the first three and how many there are.
static std::string names_of(const std::vector<Expr>& states) {
  constexpr std::size_t most = 4;
  const std::string all = dae::grouped_names(states);
  if (states.size() <= most || std::ranges::count(all, ',') == 0) return all;
  const std::vector<Expr> first(states.begin(), states.begin() + most - 1);
  return text(dae::names_of(first), " and ", states.size() - first.size(), " other states");
}

/// The option with which rtol alone counts for these states, or for all where these are many.
static std::string remedy_for(const std::vector<int>& states, const Problem& problem) {
  constexpr std::size_t most = 3;
  const std::string least = rounded(RegrowthWatch::least_atol, 1);
  if (states.size() > most) return text("atol = ", least);
  std::vector<std::string> entries;
  for (const int i : states) entries.push_back(text("[", problem.x_name(i), "] = ", least));
  return text("atol = { ", join(entries, ", "), " }");
}

/// States that have grown again from below their tolerances.
static std::string regrowth_text(const Regrowth& regrowth, const Problem& problem) {
  std::vector<Expr> states;
  for (const int i : regrowth.states) states.push_back(problem.model().x[i]);
  const std::string when = text(names_of(states), states.size() == 1 ? " was" : " were",
                                " smaller than the tolerance at t = ", rounded(regrowth.t, 4));
  switch (regrowth.effect) {
    case Regrowth::Effect::followed:
      return text(when,
                  " and grew again: the run was made again with steps that keep rtol alone there (atol = ",
                  rounded(regrowth.atol, 1), ")\n");
    case Regrowth::Effect::below_numbers:
      return text(when,
                  " and smaller than the smallest numbers before growing again: an error decides what "
                  "follows; take the logarithm as unknown\n");
    case Regrowth::Effect::unknown:
      break;
  }
  return text(when, " and grew again: an error there decides what follows; take ",
              remedy_for(regrowth.states, problem), "\n");
}

/// A warning about accumulated errors: every step keeps its tolerance, but undamped errors add up.
std::string Solution::errors_text() const {
  if (stats_.rest)
    return text(
        "at t = ", rounded(*stats_.rest, 4),
        " the solution almost stood still before it moved: errors within the tolerances decided where to; take a "
        "smaller atol; sol:check() estimates the error\n");
  if (stats_.regrowth && stats_.regrowth->effect != Regrowth::Effect::followed)
    return regrowth_text(*stats_.regrowth, *problem_);
  if (const std::optional<double> when = passed_growth())
    return text("from t = ", rounded(*when, 4),
                " the solution stays where its neighbours depart, since the method damps what grows within a "
                "step: errors decide whether it should; sol:check() estimates the error\n");
  if (!outcome_.is_complete() || !(errors() > Stats::many_errors)) return "";
  return text("the errors of the steps add up to ", rounded(errors(), 2),
              " tolerances where nothing damps them: sol:check() estimates the error\n");
}

std::string Solution::stats_text() const {
  Table table({false, true});
  const auto row = [&](const char* what, long count) { table.row({what, std::to_string(count)}); };
  table.row({"method", method_});
  row("steps", stats_.steps);
  if (dt_ == 0) row("rejected", stats_.rejected);
  row("evaluations", stats_.evaluations);
  row("Jacobians", stats_.jacobians);
  row("factorisations", stats_.factorisations);
  row("Newton iterations", stats_.newton_iterations);
  if (!states_in_use_.empty()) row("switches of states", static_cast<long>(states_in_use_.size()) - 1);
  std::string result = table.str();
  for (const MethodInUse& use : methods_in_use_)
    result += text(use.name, " from t = ", rounded(use.t, 6), ": ", use.why, "\n");
  for (const std::string& remark : {rounding_, not_unique_, untested_})
    if (!remark.empty()) result += remark + "\n";
  result += errors_text();
  if (stats_.regrowth && stats_.regrowth->effect == Regrowth::Effect::followed)
    result += regrowth_text(*stats_.regrowth, *problem_);
  return result + regimes_text() + borders_text();
}

std::string Solution::regimes_text() const {
  constexpr std::size_t most = 12;  // lines
  const std::size_t count = regimes_in_use_.size(), first = count > most ? count - most : 0;
  std::string result;
  if (first > 0) result = text(count, " regimes, the last of them:\n");
  for (std::size_t k = first; k < count; ++k)
    result +=
        text("regime ", regimes_in_use_[k].regime, " from t = ", rounded(regimes_in_use_[k].t, 6), "\n");
  return result;
}

std::string Solution::borders_text() const {
  constexpr std::size_t most = 12;  // lines
  std::string result;
  if (borders_.size() <= most) {
    for (const BorderInUse& border : borders_)
      result += text("border ", to_text(border.when), " = 0: ", border.treatment, "\n");
    return result;
  }
  const auto through = std::count_if(borders_.begin(), borders_.end(), [](const BorderInUse& border) {
    return border.treatment.find("integrated through") != std::string::npos;
  });
  return text(borders_.size(),
              " borders of piecewise equations: ", static_cast<std::ptrdiff_t>(borders_.size()) - through,
              " located, ", through, " integrated through\n");
}

}  // namespace pendula::integrate
