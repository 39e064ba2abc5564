#include "integrate/event/monitor/constraint_rank.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::integrate {

constexpr long most_steps = 32;  // between two inspections of a block whose gradients hardly change

ConstraintRank::ConstraintRank(RankBlock& block, double tolerance)
    : block_(block),
      gradients_(RankBlock::entries(block.block().gradients), block.arguments()),
      gram_(GramFactor::remembered(block.block().gradients.rows, block.block().gradients.columns,
                                   RankBlock::positions(block.block().gradients))),
      numbers_(gradients_.outputs()),
      near_(std::sqrt(tolerance)) {
  const int rows = gram_.rows();
  // measured relative to kernels: 3 operations per fused multiply-add of the factor, 12 per row
  // for its solves
  cost_ = 100 + static_cast<double>(gradients_.operations()) + 3.0 * static_cast<double>(gram_.operations()) +
          12.0 * rows;
  generic_ = RankBlock::generic_direction(rows) / std::sqrt(static_cast<double>(rows));
  last_.u = generic_;
}

void ConstraintRank::start(const Point& point) {
  begin_ = point;
  unit_.clear();
  std::vector<double> units = block_.units_by_inertia(point);
  if (!units.empty()) limit_column_lengths(units, point);
  if (units.empty() && gram_.rows() == 1) units = block_.units_by_size();
  if (!units.empty())
    for (const Entry& e : block_.block().gradients.entries) unit_.push_back(units[e.column]);
  last_.t = point.t;
  last_.size = measure(point, last_.u, last_.w, 8);
  keep_gradients(last_);
  first_ = largest_ = last_.size;
}

/// Scales columns longer than the median down to the median length. Light bodies would otherwise change the
/// direction of G quickly and force frequent inspections, though they cause no loss of rank. Shorter columns
/// keep their length: they may be 0 at the start.
void ConstraintRank::limit_column_lengths(std::vector<double>& units, const Point& point) {
  const auto& matrix = block_.block().gradients;
  gradients_(block_.values(point), numbers_.data());
  Vec row = Vec::Zero(matrix.rows), column = Vec::Zero(matrix.columns);
  const auto squares = [&](std::size_t k) {
    return std::pow(numbers_[k] * units[matrix.entries[k].column], 2);
  };
  for (std::size_t k = 0; k < numbers_.size(); ++k) row[matrix.entries[k].row] += squares(k);
  for (std::size_t k = 0; k < numbers_.size(); ++k)
    if (const Entry& e = matrix.entries[k]; row[e.row] > 0) column[e.column] += squares(k) / row[e.row];
  std::vector<double> lengths(column.begin(), column.end());
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  for (std::size_t j = 0; j < units.size(); ++j)
    if (const double length = column[j]; length > *middle && *middle > 0)
      units[j] *= std::sqrt(*middle / length);
}

double ConstraintRank::measure(const Point& p, Vec& u, Vec& w, int iterations) {
  gradients_(block_.values(p), numbers_.data());
  for (std::size_t k = 0; k < unit_.size(); ++k) numbers_[k] *= unit_[k];
  gram_.factorise(numbers_.data());
  return gram_.least(u, w, iterations);
}

/// Bound on the change of the least singular value: ‖ΔG‖ in the Frobenius norm (Weyl's inequality). For many
/// rows, where that bound is too weak, the change of w.
double ConstraintRank::change(const Inspection& from, const Inspection& to) const {
  if (!is_small()) return (to.w - from.w).norm();
  double square = 0;
  for (std::size_t k = 0; k < to.gradients.size(); ++k)
    square += (to.gradients[k] - from.gradients[k]) * (to.gradients[k] - from.gradients[k]);
  return std::sqrt(square);
}

void ConstraintRank::keep_gradients(Inspection& out) const {
  if (is_small()) out.gradients = gram_.scaled();
}

void ConstraintRank::inspect_point(const Point& point, const Inspection& before, Inspection& next) {
  constexpr double share =
      0.1;  // of the generic direction: the new smallest combination may be orthogonal to the last one
  next.t = point.t;
  next.u = before.u + share * generic_;
  next.u /= next.u.norm();
  next.size = measure(point, next.u, next.w, 2);
  if (next.u.dot(before.u) < 0) {
    next.u *= -1;
    next.w *= -1;
  }
  keep_gradients(next);
}

std::optional<Stop> ConstraintRank::inspect(const Point& point, long steps, const SolutionBetween& between,
                                            const SolutionBetween& nearby) {
  constexpr int deepest = 4;  // halvings of a step
  Inspection& next = next_;
  inspect_point(point, last_, next);
  largest_ = std::max(largest_, next.size);
  const double moved = change(last_, next);
  const double pace = moved > 0 ? 0.5 * next.size / moved * (point.t - last_.t) : forever;
  pace_ = std::min(pace_, pace);
  std::optional<Stop> stop = scan(last_, next, is_small() ? deepest : 0, between, nearby);
  pace_ = pace;
  if (!stop) stop = approaching_zero(next, point, between);
  const double far = static_cast<double>(most_steps);
  steps_to_change_ = moved > 0
                         ? std::lround(std::min(0.5 * next.size / moved * static_cast<double>(steps), far))
                         : most_steps;
  std::swap(last_, next_);
  return stop;
}

/// w is 0 to within the tolerance and decreasing: extrapolates to the time at which it is 0.
std::optional<Stop> ConstraintRank::approaching_zero(const Inspection& next, const Point& point,
                                                     const SolutionBetween& between) {
  if (next.size > near_ * largest_ || next.size >= last_.size) return {};
  const double closed = last_.size - next.size, dt = point.t - last_.t;
  const bool straight = (next.w - last_.w).norm() < 2 * closed;
  double t = straight ? point.t + std::min(dt * next.size / closed, dt) : point.t;
  if (straight) t = extrapolated_zero(next, closed / dt, between).value_or(t);
  if (!is_lost_in_units(point.t, last_.t, between)) return {};
  return Stop{t,
              text(dependent(next.u), " there to within the tolerance, and the equations ",
                   block_.loses(point), RankBlock::remedy()),
              last_.t};
}

/// The zero of |w|, extrapolated from two earlier times. The defect ε of the constraints shifts w by √ε;
/// the times are early enough for that shift to be negligible. Empty where those times are not available or
/// the extrapolation disagrees.
std::optional<double> ConstraintRank::extrapolated_zero(const Inspection& next, double rate,
                                                        const SolutionBetween& between) {
  constexpr double many = 30;  // times √ε
  const double far = many * near_ * largest_ / rate;
  if (next.t - far < begin_.t) return {};
  double size[2];
  for (int k : {0, 1}) {
    Point p;
    if (!RankBlock::reached(next.t - far / (1 + k), between, p)) return {};
    Vec u = next.u, w;
    size[k] = measure(p, u, w, 4);
  }
  if (!(size[0] > size[1] && size[1] > next.size)) return {};
  const double t = next.t - far / 2 + far / 2 * size[1] / (size[0] - size[1]);
  return std::fabs(t - next.t) < far / 4 ? std::optional(t) : std::nullopt;
}

/// Has w reversed its direction between two inspections? The interval is halved where w has changed so much,
/// or so much time has passed, that two reversals are possible.
std::optional<Stop> ConstraintRank::scan(const Inspection& from, const Inspection& to, int depth,
                                         const SolutionBetween& between, const SolutionBetween& nearby) {
  constexpr double same_direction = 0.3;  // cosine; below it u is another combination of rows
  constexpr double safe_change = 0.7;     // of w; 1 is the value at which Weyl's inequality allows a zero
  if (to.u.dot(from.u) > same_direction && to.w.dot(from.w) < 0)
    if (auto stop = bisect(from, to, between, nearby)) return stop;
  const bool near = change(from, to) < safe_change * std::max(from.size, to.size);
  if (depth == 0 || (near && to.t - from.t < 3 * pace_)) return {};
  Point p;
  if (!RankBlock::reached(from.t + (to.t - from.t) / 2, nearby, p)) return {};
  Inspection middle;
  inspect_point(p, from, middle);
  if (auto stop = scan(from, middle, depth - 1, between, nearby)) return stop;
  return scan(middle, to, depth - 1, between, nearby);
}

/// Bisects for the time at which w reverses its direction; at.size is |w| there.
double ConstraintRank::reversal(double low, double high, int halvings, const Inspection& from, Inspection& at,
                                const SolutionBetween& solution) {
  Point p;
  for (int k = 0; k < halvings && high - low > 1e-14 * std::fabs(high); ++k) {
    const double middle = low + (high - low) / 2;
    if (!RankBlock::reached(middle, solution, p)) {  // too close to dependent rows to be solved
      high = middle;
      continue;
    }
    at.u = from.u;
    at.size = measure(p, at.u, at.w, 4);
    if (at.u.dot(from.u) < 0) at.w = -at.w;
    (at.w.dot(from.w) > 0 ? low : high) = middle;
  }
  return low + (high - low) / 2;
}

/// Does w pass through 0 where its direction reverses? Near a point of dependent rows w may turn quickly at
/// constant length instead.
std::optional<Stop> ConstraintRank::bisect(const Inspection& from, const Inspection& to,
                                           const SolutionBetween& between, const SolutionBetween& nearby) {
  Inspection at;
  reversal(from.t, to.t, 6, from, at, nearby);
  if (at.size > std::min(from.size, to.size) / 2) return {};
  const double around = (to.t - from.t) / 4;  // `from` and `to` may be points of the coarse interpolant
  const double t =
      reversal(std::max(from.t - around, last_.t), std::min(to.t + around, next_.t), 30, from, at, between);
  if (!(at.size <= zero_size * std::max(from.size, to.size))) return {};
  if (!is_lost_in_units(t, from.t, between)) return {};
  return Stop{t,
              text(dependent(at.u), " there, and the equations ",
                   block_.loses(RankBlock::just_before(t, from.t, between)), RankBlock::remedy()),
              last_.t};
}

/// Without known masses, gradients of angles and of lengths in micrometres cannot be compared: relative to
/// 10⁶ a 1 looks like 0. In units of the sizes of the unknowns |w| is small only where the rank is lost.
/// These rough units serve for confirmation only: in the search they would change the smallest combination of
/// rows so that a passage through 0 is missed.
bool ConstraintRank::is_lost_in_units(double t, double before, const SolutionBetween& between) const {
  constexpr double small = 0.1;  // relative to the size before: at a passage it is 3e-3 or less, else near 1
  const std::vector<double> units = unit_.empty() ? block_.units_by_size() : std::vector<double>();
  if (units.empty()) return true;
  const auto& matrix = block_.block().gradients;
  GramFactor gram(matrix.rows, matrix.columns, RankBlock::positions(matrix));
  std::vector<double> numbers(numbers_.size());
  const auto size = [&](const Point& p) {
    gradients_(block_.values(p), numbers.data());
    for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] *= units[matrix.entries[k].column];
    gram.factorise(numbers.data());
    Vec u = RankBlock::generic_direction(matrix.rows), w;
    return gram.least(u, w, 8);
  };
  double largest = size(begin_);
  Point p;
  if (RankBlock::reached(before, between, p)) largest = std::max(largest, size(p));
  return !RankBlock::reached(t, between, p) || size(p) <= small * largest;
}

/// "the constraints C₁, C₃ are dependent (∇C₁ - 0.5 ∇C₃ = 0)"
std::string ConstraintRank::dependent(const Vec& u) const {
  Vec share = u;
  for (int i = 0; i < gram_.rows(); ++i) share[i] /= gram_.scale(i);
  Eigen::Index largest = 0;
  u.cwiseAbs().maxCoeff(&largest);
  std::vector<std::string> names;
  std::string sum;
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    if (std::fabs(u[i]) < 1e-2 * std::fabs(u[largest])) continue;
    const std::string& name = block_.block().constraints[i];
    names.push_back(name);
    const double factor = share[i] / share[largest];
    const std::string size = rounded(std::fabs(factor), 2);
    const char* sign = sum.empty() ? (factor < 0 ? "-" : "") : factor < 0 ? " - " : " + ";
    sum += text(sign, size == "1" ? "" : size + " ", "∇", name);
  }
  if (names.size() == 1) return text("the gradient of the constraint ", names[0], " is 0");
  return text("the constraints ", RankBlock::some(names), " are dependent",
              names.size() <= 4 ? text(" (", sum, " = 0)") : "");
}

std::string ConstraintRank::almost_lost(const Point& point) {
  constexpr double almost = 0.1;  // of its value at the start
  Vec u = last_.u, w;
  return measure(point, u, w, 8) <= almost * first_ ? dependent(u) : "";
}

}  // namespace pendula::integrate
