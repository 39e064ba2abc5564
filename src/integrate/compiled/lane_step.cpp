#include "integrate/compiled/lane_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>

#include "codegen/program/program_cache.hpp"
#include "codegen/program/writer.hpp"
#include "integrate/compiled/step_cache.hpp"
#include "method/step_control.hpp"

namespace pendula::integrate {

using codegen::Program;
using codegen::Slot;
using codegen::Writer;

namespace {

using Slots = std::vector<Slot>;
constexpr double eps = std::numeric_limits<double>::epsilon();

/// Operations on values of a program, written like formulas.
class Formulas {
 public:
  explicit Formulas(Writer& w) : w_(w) {}
  Slot number(double value) { return w_.constant(value); }
  Slot add(Slot a, Slot b) { return w_.put(Op::add, a, b); }
  Slot sub(Slot a, Slot b) { return w_.put(Op::sub, a, b); }
  Slot mul(Slot a, Slot b) { return w_.put(Op::mul, a, b); }
  Slot div(Slot a, Slot b) { return w_.put(Op::div, a, b); }
  Slot min(Slot a, Slot b) { return w_.put(Op::min, a, b); }
  Slot max(Slot a, Slot b) { return w_.put(Op::max, a, b); }
  Slot lt(Slot a, Slot b) { return w_.put(Op::lt, a, b); }
  Slot le(Slot a, Slot b) { return w_.put(Op::le, a, b); }
  Slot both(Slot a, Slot b) { return w_.put(Op::both, a, b); }
  Slot either(Slot a, Slot b) { return w_.put(Op::either, a, b); }
  Slot choose(Slot condition, Slot a, Slot b) { return w_.put(Op::ifelse, condition, a, b); }
  Slot f(Op op, Slot a) { return w_.put(op, a); }
  Slot sum(const Slots& list) {
    Slot s = list[0];
    for (std::size_t i = 1; i < list.size(); ++i) s = add(s, list[i]);
    return s;
  }
  /// 0, or NaN if one of the numbers is not finite.
  Slot nothing(const Slots& list) {
    Slots zeros;
    for (Slot v : list) zeros.push_back(mul(v, number(0)));
    return sum(zeros);
  }
  /// ErrorSum::norm.
  Slot norm(const Slots& scaled) {
    Slots squares;
    for (Slot v : scaled) squares.push_back(mul(v, v));
    const Slot mean = div(sum(squares), number(static_cast<double>(scaled.size())));
    if (scaled.size() <= 9) return f(Op::sqrt, mean);
    Slot largest = squares[0];
    for (Slot v : squares) largest = max(largest, v);
    const Slot share = div(largest, number(9));
    return f(Op::sqrt, choose(lt(mean, share), share, mean));
  }

 private:
  Writer& w_;
};

/// Writes the three programs.
class Author {
 public:
  Author(const Problem& problem, const Tableau& rk, bool watch)
      : problem_(problem),
        rk_(rk),
        rules_(rk),
        watch_(watch && rules_.stiff_stage >= 0),
        n_(static_cast<std::size_t>(problem.n())),
        p_(problem.model().p.size()),
        f_(codegen::lower(problem.model().f, problem.arguments())) {}

  Program step();
  Program start();
  Program between();

 private:
  Slots list(const Writer& w, std::size_t first, std::size_t count) const {
    Slots slots;
    for (std::size_t k = 0; k < count; ++k) slots.push_back(w.input(first + k));
    return slots;
  }
  /// f(t, x, p).
  Slots rhs(Writer& w, Slot t, const Slots& x, const Slots& p) const {
    Slots arguments{t};
    arguments.insert(arguments.end(), x.begin(), x.end());
    arguments.insert(arguments.end(), x.begin(), x.end());  // f contains no x′
    arguments.insert(arguments.end(), p.begin(), p.end());
    return w.inlined(f_, arguments);
  }
  struct Stages {
    Slots t;
    std::vector<Slots> x, K;
  };
  Stages stages(Writer& w, Slot t, Slot h, const Slots& x, const Slots& xdot, const Slots& p,
                std::vector<char> wanted) const;
  Slot combination(Writer& w, Slot h, const std::vector<double>& factors, const Stages& s,
                   std::size_t k) const;
  std::vector<double> row(int i) const {
    std::vector<double> r(static_cast<std::size_t>(rk_.stages()), 0);
    for (int j = 0; j < i; ++j) r[j] = rk_.A()(i, j);
    return r;
  }
  std::vector<double> b() const { return {rk_.b().begin(), rk_.b().end()}; }
  std::vector<double> error(const Vec& embedded) const {
    std::vector<double> e = b();
    for (std::size_t j = 0; j < e.size(); ++j) e[j] -= embedded[static_cast<Eigen::Index>(j)];
    return e;
  }

  /// The inputs of a step, by name.
  struct Lane {
    Slots number, given, x, xdot, p, rtol, atol;
  };
  Lane lane_inputs(const Writer& w) const {
    Lane s;
    std::size_t at = 0;
    const auto next = [&](std::size_t count) {
      at += count;
      return list(w, at - count, count);
    };
    s.number = next(lane::numbers), s.x = next(n_), s.xdot = next(n_), s.given = next(lane::given);
    s.p = next(p_), s.rtol = next(n_), s.atol = next(n_);
    return s;
  }
  std::size_t lane_size() const {
    return std::size_t{lane::numbers} + std::size_t{lane::given} + 4 * n_ + p_;
  }
  std::vector<char> wanted() const;
  Slot error_norm(Formulas& o, Writer& w, Slot h, const Stages& s, const Slots& weight) const;
  Slot eigenvalue_seen(Formulas& o, Writer& w, const Stages& s, const Slots& slope,
                       const Slots& weight) const;

  const Problem& problem_;
  const Tableau& rk_;
  ExplicitRules rules_;
  bool watch_;
  std::size_t n_, p_;
  Program f_;
};

Slot Author::combination(Writer& w, Slot h, const std::vector<double>& factors, const Stages& s,
                         std::size_t k) const {
  Slots terms;
  std::vector<double> used;
  for (std::size_t j = 0; j < factors.size(); ++j)
    if (factors[j] != 0) terms.push_back(s.K[j][k]), used.push_back(factors[j]);
  return w.put(Op::mul, h, w.combination(used, terms));
}

/// Those of the wanted stages and of the stages they need.
Author::Stages Author::stages(Writer& w, Slot t, Slot h, const Slots& x, const Slots& xdot, const Slots& p,
                              std::vector<char> wanted) const {
  const auto size = static_cast<std::size_t>(rk_.stages());
  for (std::size_t i = size; i-- > 1;)
    for (std::size_t j = 0; wanted[i] && j < i; ++j)
      if (rk_.A()(static_cast<int>(i), static_cast<int>(j)) != 0) wanted[j] = 1;
  Stages s;
  s.t.resize(size), s.x.resize(size), s.K.resize(size);
  s.t[0] = t, s.x[0] = x, s.K[0] = xdot;
  std::vector<bool> early(problem_.arguments().size(), true);
  std::fill_n(early.begin() + 1, 2 * n_, false);
  for (std::size_t i = 1; i < size; ++i) {
    if (!wanted[i]) continue;
    const double c = rk_.c()[static_cast<Eigen::Index>(i)];
    s.t[i] = w.put(Op::add, t, c == 1 ? h : w.put(Op::mul, w.constant(c), h));
    Slots arguments{s.t[i]};  // what depends on time alone is computed first: functions empty the registers
    arguments.insert(arguments.end(), x.begin(), x.end());
    arguments.insert(arguments.end(), x.begin(), x.end());
    arguments.insert(arguments.end(), p.begin(), p.end());
    w.inline_part(f_, arguments, early);
  }
  for (std::size_t i = 1; i < size; ++i) {
    if (!wanted[i]) continue;
    const auto factors = row(static_cast<int>(i));
    for (std::size_t k = 0; k < n_; ++k)
      s.x[i].push_back(w.put(Op::add, x[k], combination(w, h, factors, s, k)));
    s.K[i] = rhs(w, s.t[i], s.x[i], p);
  }
  return s;
}

/// In: h, t, x, x′, p.
Program Author::between() {
  Writer w(2 + 2 * n_ + p_);
  const Slot h = w.input(0), t = w.input(1);
  const Slots x = list(w, 2, n_), xdot = list(w, 2 + n_, n_), p = list(w, 2 + 2 * n_, p_);
  std::vector<char> wanted;
  for (double weight : rk_.b()) wanted.push_back(weight != 0);
  const Stages s = stages(w, t, h, x, xdot, p, wanted);
  Slots results;
  for (std::size_t k = 0; k < n_; ++k) results.push_back(w.put(Op::add, x[k], combination(w, h, b(), s, k)));
  const Slots slope = rhs(w, w.put(Op::add, t, h), results, p);
  results.insert(results.end(), slope.begin(), slope.end());
  return w.finish(std::move(results));
}

/// Hairer, Nørsett & Wanner I, §II.4, "Starting Step Size", as in ExplicitStepper::first_step.
Program Author::start() {
  Writer w(lane_size());
  Formulas o(w);
  const Lane s = lane_inputs(w);
  const Slot t = s.number[lane::t];
  const Slots slope = rhs(w, t, s.x, s.p);
  const auto norm = [&](const Slots& v) {
    Slots scaled;
    for (std::size_t k = 0; k < n_; ++k)
      scaled.push_back(o.div(v[k], o.add(s.atol[k], o.mul(s.rtol[k], o.f(Op::abs, s.x[k])))));
    return o.norm(scaled);
  };
  const Slot longest = o.min(o.sub(s.given[lane::end], t), s.given[lane::dt_max]);
  const Slot d0 = norm(s.x), d1 = norm(slope), tiny = o.number(1e-5);
  const auto visible = [&](Slot dt) {
    return o.min(o.max(dt, o.mul(o.number(1e4 * eps), o.f(Op::abs, t))), longest);
  };
  const Slot careful = o.mul(o.number(1e-6), o.max(o.number(1), longest));
  const Slot h0 = visible(
      o.choose(o.either(o.lt(d0, tiny), o.lt(d1, tiny)), careful, o.div(o.mul(o.number(0.01), d0), d1)));
  Slots ahead;
  for (std::size_t k = 0; k < n_; ++k) ahead.push_back(o.add(s.x[k], o.mul(h0, slope[k])));
  Slots change = rhs(w, o.add(t, h0), ahead, s.p);
  const Slot defined = o.f(Op::abs, o.nothing(change));  // 0 or NaN
  for (std::size_t k = 0; k < n_; ++k) change[k] = o.sub(change[k], slope[k]);
  const Slot steepest = o.max(d1, o.div(norm(change), h0));
  const Slot power = w.put(Op::pow, o.div(o.number(0.01), steepest), o.number(1.0 / rules_.control_order));
  const Slot h1 = o.choose(o.le(steepest, o.number(1e-15)),
                           o.max(o.mul(o.number(1e-6), longest), o.mul(h0, o.number(1e-3))), power);
  const Slot chosen = o.choose(o.le(defined, o.number(0)), visible(o.min(o.mul(o.number(100), h0), h1)),
                               o.mul(h0, o.number(1e-3)));
  const Slot first = s.given[lane::dt_first];
  Slots results(lane::numbers, o.number(0));
  results[lane::t] = t;
  results[lane::dt] = o.choose(o.lt(o.number(0), first), first, chosen);
  results[lane::log_error] = o.number(std::log(1e-4));
  results.insert(results.end(), s.x.begin(), s.x.end());
  results.insert(results.end(), slope.begin(), slope.end());
  return w.finish(std::move(results));
}

Slot Author::error_norm(Formulas& o, Writer& w, Slot h, const Stages& s, const Slots& weight) const {
  const auto norm = [&](const Vec& embedded) {
    const auto e = error(embedded);
    Slots scaled;
    for (std::size_t k = 0; k < n_; ++k) scaled.push_back(o.mul(combination(w, h, e, s, k), weight[k]));
    return o.norm(scaled);
  };
  const Slot first = norm(*rk_.bhat());
  if (!rk_.bhat2()) return first;
  const Slot third = norm(*rk_.bhat2()), square = o.mul(first, first);
  const Slot both = o.add(square, o.mul(o.number(0.01), o.mul(third, third)));
  return o.choose(o.le(first, o.number(0)), first, o.div(square, o.f(Op::sqrt, both)));
}

/// 1 where h|λ| lies near the edge of the stability region (Hairer & Wanner II, §IV.2).
Slot Author::eigenvalue_seen(Formulas& o, Writer& w, const Stages& s, const Slots& slope,
                             const Slots& weight) const {
  const auto stage = static_cast<std::size_t>(rules_.stiff_stage);
  std::vector<double> factors = b();
  for (std::size_t j = 0; j < stage; ++j) factors[j] -= rk_.A()(rules_.stiff_stage, static_cast<int>(j));
  Slots numerator, denominator;
  const auto square = [&](Slot v, std::size_t k) {
    const Slot scaled = o.mul(v, weight[k]);
    return o.mul(scaled, scaled);
  };
  for (std::size_t k = 0; k < n_; ++k) {
    numerator.push_back(square(o.sub(slope[k], s.K[stage][k]), k));
    Slots terms;
    std::vector<double> used;
    for (std::size_t j = 0; j < factors.size(); ++j)
      if (factors[j] != 0) terms.push_back(s.K[j][k]), used.push_back(factors[j]);
    denominator.push_back(square(w.combination(used, terms), k));
  }
  const double edge = 0.95 * rules_.stability_limit;
  return o.lt(o.mul(o.number(edge * edge), o.sum(denominator)), o.sum(numerator));
}

/// The stages whose slopes a step uses.
std::vector<char> Author::wanted() const {
  const auto size = static_cast<std::size_t>(rk_.stages());
  std::vector<char> wanted(size, 0);
  for (std::size_t j = 0; j < size; ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    wanted[j] = rk_.b()[k] != 0 || rk_.b()[k] != (*rk_.bhat())[k] ||
                (rk_.bhat2() && rk_.b()[k] != (*rk_.bhat2())[k]) ||
                (watch_ && static_cast<int>(j) == rules_.stiff_stage);
  }
  if (rules_.fsal) wanted.back() = 1;
  return wanted;
}

Program Author::step() {
  Writer w(lane_size());
  Formulas o(w);
  const Lane s = lane_inputs(w);
  const Slot t = s.number[lane::t], planned = s.number[lane::dt], end = s.given[lane::end];
  const Slot zero = o.number(0), one = o.number(1), was_rejected = s.number[lane::was_rejected];
  // Stepper::fitted
  const Slot left = o.sub(end, t), dt = o.min(planned, s.given[lane::dt_max]);
  const Slot half = o.mul(left, o.number(0.5));
  const Slot h = o.choose(o.le(left, o.mul(dt, o.number(1.01))), left,
                          o.choose(o.lt(left, o.mul(dt, o.number(2))), half, dt));
  const Stages K = stages(w, t, h, s.x, s.xdot, s.p, wanted());
  Slots x1;
  if (rules_.fsal) {
    x1 = K.x.back();
  } else {
    for (std::size_t k = 0; k < n_; ++k) x1.push_back(o.add(s.x[k], combination(w, h, b(), K, k)));
  }
  const Slot arrived = o.choose(o.le(left, h), end, o.add(t, h));
  const Slots slope = rules_.fsal ? K.K.back() : rhs(w, arrived, x1, s.p);
  Slots weight;
  for (std::size_t k = 0; k < n_; ++k) {
    const Slot larger = o.max(o.f(Op::abs, s.x[k]), o.f(Op::abs, x1[k]));
    weight.push_back(o.div(one, o.add(s.atol[k], o.mul(s.rtol[k], larger))));
  }
  const Slot error = error_norm(o, w, h, K, weight);
  const Slot defined =
      o.both(o.le(error, o.number(std::numeric_limits<double>::max())), o.le(o.nothing(slope), zero));
  const Slot accepted = o.both(o.le(error, one), defined);
  // The controller: err^a / err_old^β = exp(a ln err - β ln err_old)
  const Slot log_error = o.f(Op::log, error), old = s.number[lane::log_error];
  const Slot exponent = o.mul(o.number(rules_.exponent), log_error);
  const Slot safety = o.number(std::log(0.9));
  const Slot plain = o.f(Op::exp, o.sub(exponent, safety));
  const Slot remembered = o.mul(o.number(rules_.beta), old);
  const Slot filtered = rules_.beta > 0 ? o.f(Op::exp, o.sub(o.sub(exponent, remembered), safety)) : plain;
  const Slot longer =
      o.div(h, o.min(o.max(filtered, o.number(1 / rules_.fastest)), o.number(1 / rules_.slowest)));
  const Slot kept = o.choose(was_rejected, o.min(longer, h), longer);
  const Slot shortened = o.lt(h, o.mul(planned, o.number(0.99)));
  const Slot onward = o.choose(shortened, o.max(kept, planned), kept);
  const Slot shorter =
      o.choose(defined, o.div(h, o.min(o.number(1 / rules_.slowest), plain)), o.mul(h, o.number(0.25)));
  // Attention
  const Slot size_of_h = o.f(Op::abs, h);
  const Slot smallest = o.max(o.mul(o.number(10 * eps), o.f(Op::abs, t)), o.number(1e-300));
  const Slot vanished = o.both(o.le(size_of_h, smallest), o.either(o.lt(h, left), was_rejected));
  Slot attention = o.either(o.both(accepted, o.le(s.given[lane::look_at], arrived)), vanished);
  Slots results(lane::numbers, zero);
  if (watch_) {
    const Slot late = o.le(o.number(9), s.number[lane::steps]);
    const Slot seen = o.both(o.both(eigenvalue_seen(o, w, K, slope, weight), accepted), late);
    const Slot hits = o.add(s.number[lane::hits], seen);
    const Slot calm = o.choose(seen, zero, o.add(s.number[lane::calm], accepted));
    results[lane::calm] = calm;
    results[lane::hits] = o.choose(o.le(o.number(6), calm), zero, hits);
    attention = o.either(attention, o.le(o.number(LaneCode::enough_hits), results[lane::hits]));
  }
  results[lane::t] = o.choose(accepted, arrived, t);
  results[lane::dt] = o.choose(accepted, onward, shorter);
  results[lane::log_error] = o.choose(accepted, o.max(log_error, o.number(std::log(1e-4))), old);
  results[lane::was_rejected] = o.sub(one, accepted);
  results[lane::steps] = o.add(s.number[lane::steps], accepted);
  attention = o.either(attention, o.le(s.given[lane::most_steps], results[lane::steps]));
  results[lane::rejected] = o.add(s.number[lane::rejected], results[lane::was_rejected]);
  for (std::size_t k = 0; k < n_; ++k) results.push_back(o.choose(accepted, x1[k], s.x[k]));
  for (std::size_t k = 0; k < n_; ++k) results.push_back(o.choose(accepted, slope[k], s.xdot[k]));
  results.push_back(attention);
  return w.finish(std::move(results));
}

codegen::Key key_of(const Problem& problem, const Tableau& rk, bool watch, int lanes) {
  codegen::Key key{static_cast<std::uint32_t>(lanes), watch, static_cast<std::uint32_t>(rk.stages()),
                   static_cast<std::uint32_t>(problem.n())};
  for (Expr e : problem.model().f) key.push_back(e.id());
  for (Expr e : problem.arguments()) key.push_back(e.id());
  for (int i = 0; i < rk.stages(); ++i) {
    add(key, rk.c()[i]);
    for (int j = 0; j < i; ++j) add(key, rk.A()(i, j));
    add(key, rk.b()[i]), add(key, (*rk.bhat())[i]), add(key, rk.bhat2() ? (*rk.bhat2())[i] : 0);
  }
  return key;
}

}  // namespace

std::shared_ptr<const LaneCode> LaneCode::make(const Problem& problem, const Tableau& rk, bool watch,
                                               int lanes) {
  if (!codegen::Machine::available(lanes)) return nullptr;
  static std::mutex mutex;
  static codegen::Memory<const LaneCode> memory;
  const std::lock_guard lock(mutex);
  const codegen::Key key = key_of(problem, rk, watch, lanes);
  if (auto known = memory.find(key)) return known;
  Author author(problem, rk, watch);
  const Program step = author.step();
  if (step.instructions.size() > longest) return nullptr;
  auto code = std::make_shared<LaneCode>();
  code->lanes_ = lanes, code->n_ = problem.n(), code->p_ = static_cast<int>(problem.model().p.size());
  constexpr auto fused = codegen::Rounding::fused;
  code->step_ = codegen::Machine::compile(step, lanes, fused);
  code->start_ = codegen::Machine::compile(author.start(), lanes, fused);
  code->between_ = codegen::Machine::compile(author.between(), lanes, fused);
  if (!code->step_ || !code->start_ || !code->between_) return nullptr;
  memory.add(key, code, step.instructions.size());
  return code;
}

std::size_t LaneCode::workspace_size() const {
  return std::max({step_->workspace_size(), start_->workspace_size(), between_->workspace_size()});
}

}  // namespace pendula::integrate
