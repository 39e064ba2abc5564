// The step size controller of explicit Runge-Kutta pairs, written once for a single
// run and for runs on lanes.
//
// Number is double, or Formula (compiled/formula.hpp): a value of straight-line code, where a condition
// selects instead of branching. Every operation here gives the same bits for both, so that a run on lanes
// takes the steps of a single run wherever its equations give the same bits (docs/decisions/007-*). For that
// reason products are not added to anything (lanes would fuse the two roundings), and ln and exp are those of
// the lanes. Formulas: docs/derivations.md#step-size-control.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "codegen/machine/functions.hpp"
#include "method/step_control.hpp"

namespace pendula::integrate {

// ── the operations on double; formula.hpp has those on Formula ──

inline double choose(bool condition, double yes, double no) { return condition ? yes : no; }
inline bool both(bool a, bool b) { return a && b; }
inline bool either(bool a, bool b) { return a || b; }
inline double lesser(double a, double b) { return a < b ? a : b; }
inline double greater(double a, double b) { return a > b ? a : b; }
/// a b + c in one rounding, as code for lanes has it.
inline double multiply_add(double a, double b, double c) { return std::fma(a, b, c); }
inline double magnitude(double a) { return std::fabs(a); }
inline double square_root(double a) { return std::sqrt(a); }
inline double logarithm(double a) { return codegen::lane_log(a); }
inline double exponential(double a) { return codegen::lane_exp(a); }

// ── the error ──

/// DOP853: its error estimates of orders 5 and 3 combined to one of order 8 (Hairer,
/// Nørsett & Wanner I, §II.10).
template <class Number>
Number combined_error(Number fifth, Number third) {
  const Number size = square_root(multiply_add(0.01, third * third, fifth * fifth));
  return choose(0.0 < fifth, fifth * fifth / size, fifth);
}

// ── the first step ──

/// A first step that is large enough to change t.
template <class Number>
Number visible_step(Number dt, Number t, Number longest) {
  constexpr double digits = 1e4 * std::numeric_limits<double>::epsilon();
  return lesser(greater(dt, digits * magnitude(t)), longest);
}

/// A step in which x changes by a hundredth: from the norms of x and x′. Hairer, Nørsett & Wanner, Solving
/// ODEs I, 2nd ed., §II.4, "Starting Step Size", h₀.
template <class Number>
Number cautious_step(Number size, Number slope, Number t, Number longest) {
  const Number careful = 1e-6 * greater(Number(1.0), longest);
  const Number hundredth = 0.01 * size / slope;
  return visible_step(choose(either(size < 1e-5, slope < 1e-5), careful, hundredth), t, longest);
}

/// The first step, from `cautious` and the larger of the norms of x′ and (estimated) x″. Ibid., h₁.
template <class Number>
Number first_step(Number cautious, Number steepest, Number t, Number longest, int order) {
  const Number power = exponential(logarithm(0.01 / steepest) * (1.0 / order));
  const Number flat = greater(1e-6 * longest, cautious * 1e-3);
  return visible_step(lesser(100.0 * cautious, choose(steepest <= 1e-15, flat, power)), t, longest);
}

/// A planned step, shortened or stretched a little so that the interval ends with a step of decent length,
/// not with one long and one tiny step: by 1 % as in DOPRI5, or in two equal steps.
template <class Number>
Number fitted_step(Number planned, Number left, Number dt_max) {
  const Number dt = lesser(planned, dt_max);
  return choose(left <= dt * 1.01, left, choose(left < dt * 2.0, left * 0.5, dt));
}

// ── the controller ──

/// State of the controller between attempts.
template <class Number>
struct StepState {
  Number dt = 0.0;        ///< of the next attempt
  Number damping = 0.0;   ///< β ln(error of the last accepted step)
  Number repeated = 0.0;  ///< 1: the last attempt was rejected
  Number accepted = 0.0;  ///< steps since the start
  // stiffness test
  Number hits = 0.0;             ///< steps near the edge of the stability region
  Number steps_since_hit = 0.0;  ///< steps away from it since the last hit
  // where stability limits the steps
  Number ceiling = std::numeric_limits<double>::infinity();
  Number since_rejection = 0.0;     ///< accepted steps
  Number rejected_dt = 0.0;         ///< of the last rejection
  Number longest = 0.0;             ///< accepted step since then
  Number similar_rejections = 0.0;  ///< rejections in a row at about the same step size

  static constexpr std::array fields = {&StepState::dt,
                                        &StepState::damping,
                                        &StepState::repeated,
                                        &StepState::accepted,
                                        &StepState::hits,
                                        &StepState::steps_since_hit,
                                        &StepState::ceiling,
                                        &StepState::since_rejection,
                                        &StepState::rejected_dt,
                                        &StepState::longest,
                                        &StepState::similar_rejections};
};

/// Signs of stiffness of a step with a second stage g at its end: sums of squares in units of the tolerance.
template <class Number>
struct StepSigns {
  Number slopes = 0.0, points = 0.0;  ///< of f(x₁) - f(g) and x₁ - g
  Number change = 0.0, size = 0.0;    ///< of x₁′ - x₀′ and x₁′
};

template <class Number>
class StepController {
 public:
  using State = StepState<Number>;
  using Condition = decltype(Number(0.0) < Number(0.0));

  /// unknowns: of the model.
  StepController(const StepRules& rules, int unknowns)
      : rules_(rules), unknowns_(unknowns), large_(unknowns >= many_unknowns) {}
  const StepRules& rules() const { return rules_; }

  State start(Number dt) const {
    State s;
    s.dt = dt;
    s.damping = rules_.beta * std::log(least_error);
    return s;
  }

  /// After an accepted step of length dt ≤ s.dt, with the norm of its error.
  State accept(State s, Number dt, Number error) const {
    const Number log_error = logarithm(error);
    const Number exponent = rules_.exponent * log_error;
    const Number growth = exponential(rules_.beta > 0 ? exponent - s.damping : exponent) * (1 / safety);
    const Number factor = lesser(greater(growth, least_factor(s)), 1 / rules_.slowest);
    const Number proposed = dt / factor;
    const Number kept = choose(0.0 < s.repeated, lesser(proposed, dt), proposed);
    s.since_rejection = s.since_rejection + 1.0;
    if (large_) s.longest = greater(s.longest, dt);
    s.ceiling = s.ceiling * choose(s.since_rejection < soon, 1.002, 1.05);
    const Number next = lesser(kept, s.ceiling);
    s.dt = choose(dt < s.dt * 0.99, greater(next, s.dt), next);  // cut for the end, not for accuracy
    s.damping = rules_.beta * greater(log_error, std::log(least_error));
    s.repeated = 0.0;
    s.accepted = s.accepted + 1.0;
    return s;
  }

  /// After a step of length dt whose error was too large. Where stability limits the steps, the estimate says
  /// so only after the step was too long: the step size would run into the limit every few steps. Once that
  /// has been seen it stays a little below, and tries again later.
  State reject(State s, Number dt, Number error) const {
    const Number factor = exponential(rules_.exponent * logarithm(error)) * (1 / safety);
    Condition limited = is_stiff(s);
    if (large_) {
      const Condition near = both(magnitude(dt - s.rejected_dt) < dt * 0.2, s.longest < dt * 1.2);
      const Number count = choose(both(s.since_rejection <= again, near), s.similar_rejections + 1.0, 0.0);
      s.similar_rejections = choose(s.since_rejection < 1.0, s.similar_rejections, count);
      limited = either(limited, enough_similar_rejections <= s.similar_rejections);
      s.rejected_dt = dt;
      s.longest = 0.0;
    }
    s.ceiling = choose(limited, dt * 0.95, s.ceiling);
    s.since_rejection = 0.0;
    s.dt = dt / lesser(1 / rules_.slowest, factor);
    s.repeated = 1.0;
    return s;
  }

  /// After an attempt that could not be evaluated.
  State undefined(State s, Number dt) const {
    s.dt = dt * 0.25;
    s.repeated = 1.0;
    return s;
  }

  bool watches_stiffness() const { return rules_.stiff_stage.has_value(); }
  static Condition is_stiff(const State& s) { return enough_hits <= s.hits; }

  /// Is the error estimate of a step of length dt to be believed? It is one number, and vanishes by chance
  /// where the stages jump over a pulse or from one oscillation to another. Then x₁ and g, of different
  /// orders, are as far apart as the slopes would take them, or further; where the step follows the
  /// solution, they are much closer.
  Condition resolves(Number dt, const StepSigns<Number>& signs) const {
    constexpr double least = 0.01;  // of x′: it may change and come back
    const double share = rules_.resolution * rules_.resolution;
    const Number slopes = multiply_add(least, signs.size, signs.slopes + signs.change);
    return either(signs.points <= unknowns_, signs.points <= slopes * (dt * dt) * share);
  }
  /// The error of a step that does not.
  static constexpr double unresolved = 1e10;

  /// After an accepted step that accept() has seen: is stability what limits it? The quotient of
  /// f(x₁) - f(g) and x₁ - g estimates λ (Hairer & Wanner II, §IV.2). Where x′ hardly changes in the step,
  /// accuracy would turn it by some tenths; at tight tolerances such steps settle well inside the stability
  /// region. Where it changes by no more than between two stages at one time, its change is the error of the
  /// steps times λ: modes that have died out.
  State watch(State s, Number dt, const StepSigns<Number>& signs) const {
    const double edge = 0.95 * rules_.stability_limit, inside = 0.3 * rules_.stability_limit;
    const Number points = signs.points, h_lambda = signs.slopes * (dt * dt);  // squared, times `points`
    const Condition smooth = signs.change <= smooth_change * smooth_change * signs.size;
    const Condition smooth_but_for_errors = either(smooth, signs.change <= signs.slopes);
    const Condition hit = either(edge * edge * points < h_lambda,
                                 both(inside * inside * points < h_lambda, smooth_but_for_errors));
    const Condition counts = both(both(0.0 < points, 10.0 <= s.accepted), s.hits < enough_hits);
    const Number steps_since_hit =
        choose(both(0.0 < s.hits, counts), s.steps_since_hit + 1.0, s.steps_since_hit);
    const Condition over = steps_to_forget_hits <= steps_since_hit;
    State next = s;
    next.hits = choose(hit, s.hits + 1.0, choose(over, 0.0, s.hits));
    next.steps_since_hit = choose(hit, 0.0, choose(over, 0.0, steps_since_hit));
    s.hits = choose(counts, next.hits, s.hits);
    s.steps_since_hit = choose(counts, next.steps_since_hit, s.steps_since_hit);
    return s;
  }

  static constexpr double enough_hits = 15;  ///< as in DOPRI5 (Hairer & Wanner II, §IV.2)

 private:
  static constexpr double smooth_change = 0.02;  ///< of x′ in a step, relative: below, the step is smooth
  static constexpr double safety = 0.9, least_error = 1e-4, steps_to_forget_hits = 6;  ///< as in DOPRI5
  /// Accepted steps until a new try beyond the ceiling is worth a rejection.
  static constexpr double soon = 60;
  static constexpr double first_steps = 1;  ///< they begin cautiously, and may grow by rules_.fastest
  // In large models rejections again and again at one step size are enough of a sign; in small ones accuracy
  // does the same and costs nothing.
  static constexpr int many_unknowns = 200;
  static constexpr double again = 12, enough_similar_rejections = 8;

  Number least_factor(const State& s) const {
    const Number usual = 1 / rules_.settled_fastest;
    if (rules_.settled_fastest == rules_.fastest) return usual;
    return choose(s.accepted < first_steps, 1 / rules_.fastest, usual);
  }

  StepRules rules_;
  double unknowns_;
  bool large_;
};

}  // namespace pendula::integrate
