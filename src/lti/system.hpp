// Linear time-invariant systems: state space, matrices of fractions, or zeros, poles and gain.
//
//   x′ = A x + B u,  y = C x + D u       G(s) = C (sI - A)⁻¹ B + D
//   xₖ₊₁ = A xₖ + B uₖ, yₖ = C xₖ + D uₖ  with a sampling time Ts > 0 and z in place of s
//
// A system is an immutable value. Entries are expressions: rational numbers stay exact, parameters stay
// symbols, doubles are doubles (matrices.hpp). References: Kailath, Linear Systems (1980); Åström &
// Wittenmark, Computer-Controlled Systems, 3rd ed. (1997).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lti/polynomial.hpp"

namespace pendula::lti {

enum class Form { ss, tf, zpk };

struct StateSpace {
  MatX A, B, C, D;
  int order() const { return static_cast<int>(A.rows()); }
};

/// gain · Π (s - zᵢ) / Π (s - pᵢ)
struct Factored {
  Expr gain = 0;
  std::vector<std::pair<Expr, Expr>> zeros,
      poles;  ///< real and imaginary parts; complex ones in conjugate pairs
};

struct System {
  Form form = Form::ss;
  int outputs = 1, inputs = 1;
  StateSpace ss;              ///< form ss
  std::vector<Fraction> tf;   ///< form tf: outputs × inputs, row by row
  std::vector<Factored> zpk;  ///< form zpk: the same
  Expr Ts = 0;                ///< 0: continuous time
  std::vector<std::string> state_names, input_names, output_names;  ///< empty: x₁ …, u₁ …, y₁ …
  std::vector<std::string> notes;  ///< printed under the system: what is left out, where it was linearised

  bool continuous() const { return Ts.is_zero(); }
  bool siso() const { return inputs == 1 && outputs == 1; }
  const char* variable() const { return continuous() ? "s" : "z"; }
  const Fraction& fraction(int i, int j) const { return tf[i * inputs + j]; }
};
using SystemPtr = std::shared_ptr<const System>;

// ── making; all throw Error in the user's words ──

/// Sizes must agree: A n×n, B n×m, C p×n, D p×m.
System make_ss(MatX A, MatX B, MatX C, MatX D, Expr Ts = 0);
/// Denominators must not vanish.
System make_tf(std::vector<Fraction> entries, int outputs, int inputs, Expr Ts = 0);
System make_zpk(std::vector<Factored> entries, int outputs, int inputs, Expr Ts = 0);
/// A matrix of gains.
System make_gain(const MatX& D, Expr Ts = 0);
/// e, a rational function of the symbol s, as a fraction.
Fraction fraction_of(Expr e, Expr s);

std::string state_name(const System& g, int i);
std::string input_name(const System& g, int j);
std::string output_name(const System& g, int i);

// ── parameters ──

/// Every expression in the system.
std::vector<Expr> entries(const System& g);
Field field(const System& g);
System substitute(const System& g, const Substitution& values);
/// Parameters replaced by their default values, constants such as √2 by doubles: field exact or numeric.
System with_numbers(const System& g);

// ── conversion ──

/// C (sI - A)⁻¹ B + D by Faddeev and LeVerrier, exact for rational matrices and for doubles (rounded at the
/// end). Common factors of exact and symbolic entries are cancelled, with a note; they belong to modes that
/// are uncontrollable or unobservable.
System to_tf(const System& g);
/// Of a fraction the controllable canonical form (phase variables); of several inputs or outputs a minimal
/// realisation made from these. Throws Error where a numerator has a higher degree than its denominator
System to_ss(const System& g);
/// Zeros and poles must have values.
System to_zpk(const System& g);
/// The number of states of to_ss without cancellation.
int order(const System& g);

// ── values ──

/// G at an expression (a symbol or a number). Throws Error at a pole
MatX value(const System& g, Expr s);
/// G at a complex number, in doubles; parameters have their values.
ComplexMat value(const System& g, Complex s);
/// G(0), in discrete time G(1). Throws Error "infinite" where that is a pole
MatX dcgain(const System& g);

// ── connections ──

System series(const System& second,
              const System& first);  ///< second · first: the output of `first` is the input of `second`
System parallel(const System& a, const System& b);
/// y = g1 u₁, u₁ = u + sign · g2 y. Throws Error "algebraic loop" where I - sign D₂D₁ is singular
System feedback(const System& g1, const System& g2, int sign = -1);
System negative(const System& g);
/// throws  Error where D is singular and g is in state space
System inverse(const System& g);
System power(const System& g, int n);
System append(const System& a, const System& b);  ///< block diagonal
/// A matrix of systems as one.
System assemble(const std::vector<std::vector<System>>& blocks);
/// The channels from inputs `in` to outputs `out` (from 0).
System select(const System& g, const std::vector<int>& out, const std::vector<int>& in);

// ── text (describe.cpp) ──
std::string describe(const System& g);
std::string latex(const System& g);

}  // namespace pendula::lti
