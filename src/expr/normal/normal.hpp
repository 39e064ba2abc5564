// The collected form of expressions: what the printer lays out and what simplify works on.
//
//   sum   = Σ coefficient · Π atomᵉ        coefficient: exact rational or double, e: rational
//   atom  = a leaf, a function of sums, an unspecified function, a power with a symbolic exponent, or a sum
//   in parentheses
//
// Like terms and powers of equal atoms are collected, quotients are negative exponents, products of sums are
// not multiplied out, and a sum in parentheses gives its common rational factor away: (2x + 2y)/2 is x + y.
//
// Forms of one session are interned: equal sums have equal ids. Sums and products of the graph are flattened
// by one reverse sweep over their region, which adds up coefficients (exponents) along all paths; so neither
// depth nor sharing matters, and the work is linear except where terms must be copied. That copying is
// bounded: beyond the bound a sum stays an atom.
#pragma once

#include <functional>
#include <memory>
#include <unordered_map>

#include "expr/graph/graph.hpp"

namespace pendula {

/// Terms that one session may copy out of shared sums, which may have 2ⁿ of them; 4·10⁶ are some 0.4 GB.
inline constexpr double copy_limit = 4e6;
/// Longer coefficients and exponents keep their node whole: n times doubled, x + x has the coefficient 2ⁿ.
inline constexpr std::size_t weight_bits = 4096;
/// The largest denominator that a reader takes for one: 9.81 is not read as 981/100, and √9.81 is kept.
inline constexpr long simple_denominator = 20;

/// A rational, or a double where only that is known. Doubles
/// are read as simple rationals like everywhere (graph.hpp).
class Number {
 public:
  Number(long value = 0) : exact_(value), value_(static_cast<double>(value)) {}
  explicit Number(const mpq_class& value) : exact_(value), value_(value.get_d()) {}
  static Number approximate(double value);
  static Number of(Expr constant);

  bool exact() const { return is_exact_; }
  const mpq_class& rational() const { return exact_; }  ///< requires exact()
  double value() const { return value_; }
  int sign() const { return is_exact_ ? sgn(exact_) : value_ < 0 ? -1 : value_ > 0; }
  bool is(long k) const { return is_exact_ && exact_ == k; }
  Expr expr() const { return is_exact_ ? Expr(exact_) : Expr(value_); }

  friend Number operator+(const Number& a, const Number& b);
  friend Number operator*(const Number& a, const Number& b);
  friend Number operator-(const Number& a) { return Number(-1) * a; }
  friend bool operator==(const Number& a, const Number& b) {
    return a.is_exact_ == b.is_exact_ && (a.is_exact_ ? a.exact_ == b.exact_ : a.value_ == b.value_);
  }
  /// aⁿ, or nothing where it is infinite or unreasonably long.
  static std::optional<Number> power(const Number& a, const mpz_class& n);

 private:
  mpq_class exact_;
  double value_ = 0;
  bool is_exact_ = true;
};

using AtomId = std::uint32_t;
using SumId = std::uint32_t;

struct Factor {
  AtomId atom;
  mpq_class exponent;
  friend bool operator==(const Factor&, const Factor&) = default;
};

struct Term {
  Number coefficient;
  std::vector<Factor> factors;  ///< by atom id, exponents not zero
  friend bool operator==(const Term&, const Term&) = default;
};

using Sum = std::vector<Term>;  ///< by factors, coefficients not zero; empty is 0

/// Properties of an atom or a sum that ordering and eliding use.
struct Traits {
  int order = 0;   ///< highest time derivative in it
  int level = -1;  ///< 2 has variables, 1 has inputs or t, 0 has parameters, -1 numbers only
  int depth = 0;
  double tokens = 0;  ///< length when written out as a tree; arcus functions and what is irregular count more
  double degree = 0;  ///< in leaves of that level, outside functions: x sin(x) has degree 1, 1/x degree -1
  void include(const Traits& part);
};

enum class AtomKind : std::uint8_t { leaf, call, function, power, sum, opaque };

struct Atom {
  AtomKind kind;
  Op op;                    ///< of a function
  Expr node;                ///< the leaf, call, or what was too large to be taken apart (opaque)
  std::vector<SumId> args;  ///< of a function or call; base and exponent of a power; the sum itself
  Traits traits;
};

/// Sort key of a term, computed once per term.
struct TermKey {
  Traits traits;
  std::vector<Factor> leaves[3];  ///< leaf factors by level, highest derivative first
};

class NormalForms {
 public:
  NormalForms() { intern(Sum{}); }
  virtual ~NormalForms() = default;

  /// The collected form of e. Cost: linear in the nodes of e, and in the terms copied (bounded).
  SumId form(Expr e);

  const Sum& sum(SumId id) const { return *sums_[id].terms; }
  const Traits& traits(SumId id) const { return sums_[id].traits; }
  const Atom& atom(AtomId id) const { return atoms_[id]; }

  // ── algebra ──
  SumId intern(Sum terms);  ///< sorts, collects
  AtomId intern(Atom atom);
  AtomId leaf_atom(Expr leaf);
  AtomId sum_atom(SumId sum);
  AtomId function_atom(Op op, std::vector<SumId> args);
  AtomId power_atom(SumId base, SumId exponent);
  SumId number(const Number& value) { return intern(Sum{Term{value, {}}}); }
  SumId single(AtomId atom, const mpq_class& exponent = 1) {
    return intern(Sum{Term{1, {{atom, exponent}}}});
  }
  /// Multiplies `term` by base^exponent, constants and common factors taken out where that is possible.
  void multiply(Term& term, SumId base, const mpq_class& exponent);
  /// A product as a sum: ±(a + b) is written out, everything else is one term.
  SumId product(Term term);
  /// The rational c for which sum/c has small whole coefficients: gcd of numerators over lcm of denominators.
  Number content(const Sum& terms) const;
  /// A sum in parentheses to a positive whole power.
  bool multiplies_out(const Factor& f) const;
  bool multiplies_out(const Term& t) const;
  /// The product of two terms, settled.
  Term times(const Term& a, const Term& b);
  void collect(Term& term) const;  ///< factors in order, equal atoms together
  SumId scaled(SumId sum, const Number& by);

  /// The expression of a form: terms and factors in textbook order.
  Expr build(SumId sum);

  // ── textbook order (normal_order.cpp) ──
  TermKey key(const Term& term) const;
  bool term_before(const Term& a, const TermKey& ka, const Term& b, const TermKey& kb) const;
  bool factor_before(const Factor& a, const Factor& b) const;
  std::vector<Factor> ordered_factors(const Term& term) const;
  std::vector<Term> ordered_terms(SumId sum) const;
  const std::vector<std::uint32_t>& order_of(SumId sum) const;  ///< positions in textbook order
  int compare(AtomId a, AtomId b, int depth = 0) const;
  int compare_sums(SumId a, SumId b, int depth) const;
  int factor_rank(const Factor& f) const;
  Traits traits_of(const Term& term) const;

 protected:
  // Where simplify and expand (rewrite_forms.hpp) come in; the printer leaves things as they are.
  virtual SumId function(Op op, std::vector<SumId> args);  ///< √x is x^(1/2) everywhere
  virtual SumId power(SumId base, SumId exponent) { return single(power_atom(base, exponent)); }
  /// base^exponent for an exponent that is not whole.
  virtual void multiply_root(Term& term, SumId base, const mpq_class& exponent);
  /// Takes a common factor out of a sum of several terms; returns it, and leaves the rest in `terms`.
  virtual Term take_common(Sum& terms) const { return {take_content(terms), {}}; }
  virtual SumId rewritten_product(Term term) { return finished_product(std::move(term)); }
  virtual SumId rewritten_sum(SumId sum) { return sum; }

  Number take_content(Sum& terms) const;
  SumId finished_product(Term term);
  /// Equal atoms together, sums of one term dissolved.
  void settle(Term& term);
  std::vector<SumId> below(SumId root, const std::function<bool(SumId)>& skip) const;

 private:
  struct Interned {
    const Sum* terms;
    Traits traits;
  };
  enum class Role : std::uint8_t { sum, product, other };
  static Role role(Expr e);
  double irregular_tokens(const Factor& f) const;
  SumId form_of_head(Expr e);
  SumId form_of_sum(Expr e);
  SumId form_of_product(Expr e);
  SumId form_of_other(Expr e);
  std::vector<Expr> region(Expr head) const;
  bool inside(Expr operand, Role r) const { return role(operand) == r && !memo_.contains(operand); }
  Expr build(AtomId atom, const mpq_class& exponent) const;
  Expr build_term(const Term& term, bool turned) const;  // without its sign; turned: with the sign of its sum
  bool turns(const Term& term) const;
  bool turns(const Factor& f) const;
  void append(Sum& terms, SumId part, const mpz_class& weight);

  double copied_ = 0;  // terms copied so far
  std::unordered_map<Expr, SumId> memo_;
  std::unordered_map<SumId, Expr> built_;
  mutable std::unordered_map<SumId, std::vector<std::uint32_t>> order_;
  std::vector<Interned> sums_;
  std::vector<Atom> atoms_;
  std::unordered_multimap<std::size_t, SumId> sum_table_;
  std::unordered_multimap<std::size_t, AtomId> atom_table_;
  std::vector<std::unique_ptr<Sum>> storage_;
};

}  // namespace pendula
