#include "integrate/event/monitor/rank_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "integrate/solve/gram_factor.hpp"

namespace pendula::integrate {
namespace {

constexpr int longest_wait = 32;  // steps
constexpr int small = 8;          // rows: what is watched more often than its cost would say
constexpr double share = 0.006;   // of the time of a step
constexpr double lost = 3e-3;     // a size beside those at the ends of the interval: 0 to interpolation
constexpr std::size_t most_names = 6;
constexpr double forever = std::numeric_limits<double>::infinity();
constexpr int dense = 24;  // rows of a Jacobian that is not worth a sparse factorisation

std::vector<Position> positions_of(const dae::LargeBlock::Matrix& m, bool transposed = false) {
  std::vector<Position> list;
  for (const Entry& e : m.entries)
    list.push_back(transposed ? Position{e.column, e.row} : Position{e.row, e.column});
  return list;
}

std::vector<Expr> values_of(const dae::LargeBlock::Matrix& m) {
  std::vector<Expr> list;
  for (const Entry& e : m.entries) list.push_back(e.value);
  return list;
}

std::string some(const std::vector<std::string>& words) {
  if (words.size() <= most_names) return join(words, ", ");
  return text(join(std::vector<std::string>(words.begin(), words.begin() + most_names), ", "), ", … (",
              words.size(), " in all)");
}

}  // namespace

/// One block with its numbers.
class RankWatch::Part {
 public:
  Part(const dae::LargeBlock& block, const ProblemPtr& problem, double tolerance)
      : block_(block), given_(problem), near_(std::sqrt(tolerance)) {
    if (!problem->model().u.empty()) problem_ = std::make_shared<Problem>(*problem);  // it evaluates inputs
    values_ = problem->values();
    if (const auto& G = block.gradients; G.rows > 0) {
      gradients_ = codegen::Kernel(values_of(G), problem->arguments());
      gram_ = GramFactor::remembered(G.rows, G.columns, positions_of(G));
      gradients_cost_ = 100 + static_cast<double>(gradients_.operations()) +
                        3.0 * static_cast<double>(gram_->operations()) + 12.0 * G.rows;
      last_.u = Vec::Constant(G.rows, 1 / std::sqrt(static_cast<double>(G.rows)));
      for (int i = 0; i < G.rows; ++i) last_.u[i] *= 1 + 0.3 * std::sin(1.0 + i);
    }
    if (const auto& J = block.jacobian; J.rows > 0) {
      jacobian_ = codegen::Kernel(values_of(J), problem->arguments());
      lu_.analyse(J.rows, positions_of(J),
                  J.rows <= dense ? LinearSolver<double>::Road::dense : LinearSolver<double>::Road::sparse);
      const double n = J.rows;
      jacobian_cost_ = static_cast<double>(jacobian_.operations()) +
                       (n <= dense ? 8 * n * n * n : 120.0 * static_cast<double>(jacobian_.outputs()));
    }
  }

  void start(const Point& point) {
    last_.t = t_sign_ = point.t;
    if (gram_) last_.size = measure(point, last_.u, last_.w, 8), remember(last_);
    first_size_ = largest_ = last_.size;
    if (block_.jacobian.rows > 0) sign_ = determinant(point, log_);
    first_log_ = log_;
  }

  /// `steps` since the last look.
  std::optional<Hit> look(const Point& point, long steps, bool full, const Between& between) {
    std::optional<Hit> hit;
    if (gram_) hit = look_at_gradients(point, steps, between);
    if (block_.jacobian.rows > 0 && (full || (since_ += steps) >= rest_)) {
      since_ = 0;
      const auto other = look_at_sign(point, between);
      if (other && (!hit || other->t < hit->t)) hit = other;
    }
    return hit;
  }

  /// Steps to wait, for `operations` in a step.
  long wait(double operations) {
    const auto affordable = [&](double cost) {
      return static_cast<long>(std::min(cost / (share * operations), 1000.0)) + 1;
    };
    long steps = longest_wait;
    if (gram_) {
      long least = affordable(gradients_cost_);
      if (gram_->rows() <= small) least = 1;
      steps = std::max(least, std::min<long>(steps, geometric_));
    }
    if (block_.jacobian.rows > 0) {
      rest_ = affordable(jacobian_cost_);
      if (!gram_) steps = std::max(1L, rest_);
    }
    return steps;
  }

  /// When to look again, whatever the number of steps.
  double due() const { return gram_ && gram_->rows() <= small ? last_.t + pace_ : forever; }

  std::string almost_lost(const Point& point) {
    constexpr double almost = 0.1;
    Vec u = last_.u, w;
    if (gram_ && measure(point, u, w, 8) <= almost * first_size_)
      return text(". Near there ", dependent(u), ", and the equations ", loses(point));
    double log = 0;
    if (block_.jacobian.rows > 0 && (determinant(point, log) == 0 || log < first_log_ + std::log(almost)))
      return text(". Near there the equations ", some(block_.equations), " ", loses(point));
    return "";
  }

 private:
  /// [t, x, x′, z, u, p] at a point.
  const double* place(const Point& p) {
    if (problem_) {
      problem_->place(p.t, p.x.data(), p.xdot.data(), p.z.data());
      return problem_->values().data();
    }
    const auto n = p.x.size();
    double* to = values_.data();
    to[0] = p.t;
    std::copy_n(p.x.data(), n, to + 1);
    std::copy_n(p.xdot.data(), n, to + 1 + n);
    std::copy_n(p.z.data(), p.z.size(), to + 1 + 2 * n);
    return to;
  }

  double measure(const Point& p, Vec& u, Vec& w, int iterations) {
    numbers_.resize(std::max(numbers_.size(), gradients_.outputs()));
    gradients_(place(p), numbers_.data());
    gram_->factorise(numbers_.data());
    return gram_->least(u, w, iterations);
  }

  int determinant(const Point& p, double& log) {
    numbers_.resize(std::max(numbers_.size(), jacobian_.outputs()));
    jacobian_(place(p), numbers_.data());
    if (!lu_.factorise(numbers_.data())) return log = -1e300, 0;
    return lu_.determinant(log);
  }

  /// The smallest combination of gradients at a time.
  struct Look {
    double t = 0, size = 0;
    Vec u, w;
    std::vector<double> gradients;  ///< of a small block
  };

  /// What the least singular value may have changed by: ‖ΔG‖ (Weyl's inequality), Frobenius norm; for many
  /// rows, where that says little, the change of w.
  double change(const Look& from, const Look& to) const {
    if (gram_->rows() > small) return (to.w - from.w).norm();
    double square = 0;
    for (std::size_t k = 0; k < to.gradients.size(); ++k)
      square += (to.gradients[k] - from.gradients[k]) * (to.gradients[k] - from.gradients[k]);
    return std::sqrt(square);
  }

  void remember(Look& look) const {
    if (gram_->rows() <= small) look.gradients = gram_->scaled();
  }

  void look_again(const Point& point, const Look& before, Look& next) {
    next.t = point.t;
    next.u = before.u;
    next.size = measure(point, next.u, next.w, 2);
    if (next.u.dot(before.u) < 0) next.u *= -1, next.w *= -1;
    remember(next);
  }

  std::optional<Hit> look_at_gradients(const Point& point, long steps, const Between& between) {
    Look& next = next_;
    look_again(point, last_, next);
    largest_ = std::max(largest_, next.size);
    const double moved = change(last_, next);
    constexpr int deepest = 4;
    const double now = moved > 0 ? 0.5 * next.size / moved * (point.t - last_.t) : forever;
    pace_ = std::min(pace_, now);
    std::optional<Hit> hit = scan(last_, next, gram_->rows() <= small ? deepest : 0, between);
    pace_ = now;
    if (!hit && next.size <= near_ * largest_ && next.size < last_.size) {
      const double closed = last_.size - next.size, dt = point.t - last_.t;
      const double t =
          (next.w - last_.w).norm() < 2 * closed ? point.t + std::min(dt * next.size / closed, dt) : point.t;
      hit = Hit{t, text(dependent(next.u), " there to within the tolerance, and the equations ", loses(point),
                        remedy())};
    }
    geometric_ = moved > 0 ? std::lround(std::min(0.5 * next.size / moved * static_cast<double>(steps),
                                                  static_cast<double>(longest_wait)))
                           : longest_wait;
    std::swap(last_, next_);
    return hit;
  }

  /// Has w reversed between two looks? Where it has changed so much, or so much time has passed, that it
  /// might have done so twice, the time between them is halved.
  std::optional<Hit> scan(const Look& from, const Look& to, int depth, const Between& between) {
    constexpr double kept = 0.3, much = 0.7;
    if (to.u.dot(from.u) > kept && to.w.dot(from.w) < 0)
      if (auto hit = narrow_gradients(from, to, between)) return hit;
    const bool near = change(from, to) < much * std::max(from.size, to.size);
    if (depth == 0 || (near && to.t - from.t < 3 * pace_)) return {};
    Point p;
    if (!reached(from.t + (to.t - from.t) / 2, between, p)) return {};
    Look middle;
    look_again(p, from, middle);
    if (auto hit = scan(from, middle, depth - 1, between)) return hit;
    return scan(middle, to, depth - 1, between);
  }

  static bool reached(double t, const Between& between, Point& out) {
    try {
      between(t, out);
      return true;
    } catch (const Failure&) {
      return false;
    }
  }

  /// w reverses: where it passes 0, if it does (near a point of dependent rows it turns quickly).
  std::optional<Hit> narrow_gradients(const Look& from, const Look& to, const Between& between) {
    double low = from.t, high = to.t;
    Look at;
    Point p;
    for (int k = 0; k < 30 && high - low > 1e-14 * std::fabs(high); ++k) {
      const double middle = low + (high - low) / 2;
      if (!reached(middle, between, p)) {  // so near to dependent rows, or behind them, nothing is solvable
        high = middle;
        continue;
      }
      at.u = from.u;
      at.size = measure(p, at.u, at.w, 4);
      if (at.u.dot(from.u) < 0) at.w = -at.w;
      (at.w.dot(from.w) > 0 ? low : high) = middle;
      if (k == 5 && at.size > std::min(from.size, to.size) / 2) return {};  // it only turned
    }
    if (!(at.size <= lost * std::max(from.size, to.size))) return {};
    const double t = low + (high - low) / 2;
    return Hit{
        t, text(dependent(at.u), " there, and the equations ", loses(near(t, from.t, between)), remedy())};
  }

  /// The sign of det J now and at a few times since the last look: where an unknown has jumped from one
  /// branch to another in a step, it differs between them.
  std::optional<Hit> look_at_sign(const Point& point, const Between& between) {
    double log = 0;
    const int sign = determinant(point, log);
    std::optional<Hit> hit;
    if (sign != 0 && sign_ != 0) {
      const int samples = block_.jacobian.rows <= dense ? 7 : 1;
      Point p;
      for (int k = 1; k <= samples && !hit; ++k) {
        double here = 0;
        const double t = t_sign_ + (point.t - t_sign_) * k / (samples + 1);
        if (!reached(t, between, p)) break;
        if (const int other = determinant(p, here); other != 0 && other != sign_)
          hit = narrow_sign(t, std::max(here, log), between);
      }
      if (!hit && sign != sign_) hit = narrow_sign(point.t, log, between);
    }
    sign_ = sign, log_ = log, t_sign_ = point.t;
    return hit;
  }

  std::optional<Hit> narrow_sign(double end, double end_log, const Between& between) {
    double low = t_sign_, high = end, log = end_log;
    Point p;
    for (int k = 0; k < 40 && high - low > 1e-14 * std::fabs(high); ++k) {
      const double middle = low + (high - low) / 2;
      const bool same = reached(middle, between, p) && determinant(p, log) == sign_;
      (same ? low : high) = middle;
    }
    if (!(log <= std::max(log_, end_log) + std::log(lost))) return {};
    const double t = low + (high - low) / 2;
    return Hit{
        t, text("the equations ", some(block_.equations), " ", loses(near(t, t_sign_, between)), remedy())};
  }

  /// A point just before t, where the block can be solved.
  Point near(double t, double from, const Between& between) {
    Point p;
    for (const double part : {1e-5, 1e-3, 1e-1})
      if (reached(t - part * (t - from), between, p)) return p;
    between(from, p);
    return p;
  }

  /// "the constraints C₁, C₃ are dependent (∇C₁ - 0.5 ∇C₃ = 0)"
  std::string dependent(const Vec& u) const {
    Vec share = u;
    for (int i = 0; i < gram_->rows(); ++i) share[i] /= gram_->scale(i);
    Eigen::Index largest = 0;
    u.cwiseAbs().maxCoeff(&largest);
    std::vector<std::string> names;
    std::string sum;
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      if (std::fabs(u[i]) < 1e-2 * std::fabs(u[largest])) continue;
      const std::string& name = block_.constraints[i];
      names.push_back(name);
      const double factor = share[i] / share[largest];
      const std::string size = rounded(std::fabs(factor), 2);
      sum += text(sum.empty()  ? (factor < 0 ? "-" : "")
                  : factor < 0 ? " - "
                               : " + ",
                  size == "1" ? "" : size + " ", "∇", name);
    }
    if (names.size() == 1) return text("the gradient of the constraint ", names[0], " is 0");
    return text("the constraints ", some(names), " are dependent",
                names.size() <= 4 ? text(" (", sum, " = 0)") : "");
  }

  /// "no longer determine λ₁, λ₂": the null vector of the block's Jacobian near there.
  std::string loses(const Point& point) {
    const int n = block_.all.rows;
    const codegen::Kernel kernel(values_of(block_.all), given_->arguments());
    std::vector<double> values(kernel.outputs());
    kernel(place(point), values.data());
    LinearSolver<double> J, transposed;
    J.analyse(n, positions_of(block_.all));
    transposed.analyse(n, positions_of(block_.all, true));
    std::vector<Expr> names;
    if (J.factorise(values.data()) && transposed.factorise(values.data())) {
      Vec v(n);
      for (int i = 0; i < n; ++i) v[i] = 1 + 0.3 * std::sin(1.0 + i);
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
    return "no longer determine " +
           (names.size() <= most_names ? dae::grouped_names(names)
                                       : text(dae::grouped_names({names.begin(), names.begin() + most_names}),
                                              ", … (", names.size(), " in all)"));
  }

  static std::string remedy() {
    return "; the motion may branch there: start anew behind it, init{ fix = …, from = t } on the branch "
           "meant, or go on unwatched with guards = false";
  }

  const dae::LargeBlock& block_;
  ProblemPtr given_, problem_;  ///< problem_: a copy where there are inputs
  std::vector<double> values_;
  codegen::Kernel gradients_, jacobian_;
  std::optional<GramFactor> gram_;
  LinearSolver<double> lu_;
  std::vector<double> numbers_;
  Look last_, next_;  ///< next_: kept for its storage
  double near_;       ///< of the size: closer, errors of the tolerance decide on which branch it goes on
  double t_sign_ = 0, largest_ = 0, first_size_ = 0, log_ = 0, first_log_ = 0;
  double pace_ = forever;                          ///< time in which w changes by half its length
  double gradients_cost_ = 0, jacobian_cost_ = 0;  ///< of a look, in operations
  int sign_ = 0;
  long geometric_ = 1, since_ = 0, rest_ = 1;
};

RankWatch::RankWatch(const ProblemPtr& problem, const std::vector<dae::LargeBlock>& blocks, double tolerance)
    : given_(problem), blocks_(&blocks), tolerance_(std::min(tolerance, 1e-6)) {
  parts_.resize(blocks.size());
}
RankWatch::~RankWatch() = default;
RankWatch::RankWatch(RankWatch&&) noexcept = default;

void RankWatch::start(const Point& point) {
  if (parts_.empty()) return;
  first_ = point;
  wait_ = ready_ ? 1 : 2;
  steps_ = 0;
  if (ready_)
    for (auto& part : parts_) part->start(point);
}

std::optional<RankWatch::Hit> RankWatch::look(const Point& point, bool last, const Stats& stats,
                                              const Between& between) {
  if (!ready_) {
    ready_ = true;
    operations_ = static_cast<double>(given_->operations());
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      parts_[k] = std::make_unique<Part>((*blocks_)[k], given_, tolerance_);
      parts_[k]->start(first_);
    }
    steps_ = 0;
  }
  const long since = std::max(1L, stats.steps - steps_);
  const double operations = static_cast<double>(stats.evaluations) / std::max(1L, stats.steps) * operations_;
  steps_ = stats.steps;
  wait_ = 1'000'000, due_ = forever;
  std::optional<Hit> first;
  for (auto& part : parts_) {
    const auto hit = part->look(point, since, last, between);
    if (hit && (!first || hit->t < first->t)) first = hit;
    wait_ = std::min(wait_, part->wait(std::max(operations, 1.0)));
    due_ = std::min(due_, part->due());
  }
  return first;
}

std::string RankWatch::almost_lost(const Point& point) {
  if (parts_.empty()) return "";
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    if (!ready_) {
      parts_[k] = std::make_unique<Part>((*blocks_)[k], given_, tolerance_);
      parts_[k]->start(first_);
    }
    const std::string found = parts_[k]->almost_lost(point);
    if (!found.empty()) return found;
  }
  return "";
}

}  // namespace pendula::integrate
