// The forms that simplify and expand work in: collected forms with rules at every product, function and sum.
#pragma once

#include "expr/normal/normal.hpp"

namespace pendula {

/// Multiplies out what can be multiplied out. The largest result has `limit` terms.
class Expander : public NormalForms {
 public:
  explicit Expander(std::size_t limit) : limit_(limit) {}

 protected:
  SumId rewritten_product(Term term) override;  ///< throws Error beyond the limit
  std::size_t limit_;
  double made_ = 0;  ///< products formed so far
};

/// The terms of a sum in textbook order; a term is found by its factors in constant time.
class OrderedTerms {
 public:
  static constexpr std::size_t nowhere = static_cast<std::size_t>(-1);
  explicit OrderedTerms(std::vector<Term> terms);
  std::size_t size() const { return terms_.size(); }
  const Term& operator[](std::size_t k) const { return terms_[k]; }
  /// The first place but `except` of this term, of a term with these factors; `nowhere` if there is none.
  std::size_t place_of(const Term& wanted, std::size_t except) const;
  std::size_t place_of_factors(const Term& wanted, std::size_t except) const;

 private:
  std::vector<Term> terms_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> places_;  ///< by a hash of the atoms, ascending
};

class Simplifier : public NormalForms {
 public:
  // ── what the rules use ──
  /// The value of a sum that is a number.
  std::optional<Number> constant(SumId s) const;
  /// The atom of a sum that is 1·atom.
  std::optional<AtomId> lone_atom(SumId s) const;
  /// Whether the first term in textbook order is negative.
  bool leads_negative(SumId s) const;
  bool is_function(AtomId a, Op op) const { return atom(a).kind == AtomKind::function && atom(a).op == op; }
  /// Whether atom^exponent cannot be negative where it is defined.
  bool never_negative(const Factor& f) const;
  SumId absolute(SumId s) { return function(Op::abs, {s}); }
  SumId rooted(SumId s, const mpq_class& exponent);
  SumId minus(SumId s) { return scaled(s, -1); }
  Term with_factor(Term term, AtomId atom, const mpq_class& exponent) const;
  /// The multiple of π among the terms of a sum.
  std::optional<std::size_t> term_of_pi(const Sum& sum);
  SumId function(Op op, std::vector<SumId> args) override;
  SumId power(SumId base, SumId exponent) override;

  // ── searching for something shorter (rewrite_search.cpp) ──
  /// The product multiplied out, or nothing beyond `limit` terms.
  std::optional<Sum> multiplied_out(const Term& term, std::size_t limit);
  /// The quotient a/b of two sums if it is a polynomial in their atoms.
  std::optional<SumId> exact_quotient(SumId a, SumId b);

 protected:
  Term take_common(Sum& terms) const override;
  void multiply_root(Term& term, SumId base, const mpq_class& exponent) override;
  SumId rewritten_product(Term term) override;
  SumId rewritten_sum(SumId s) override;

 private:
  bool turn_positive(Term& term);
  struct Shifted {
    SumId rest = 0;
    mpq_class half_turns;
    bool turned = false;
  };
  Shifted shifted(SumId angle);
  std::optional<SumId> exchanged_base(SumId base, SumId exponent);
  SumId by_sum_rules(SumId s);
  std::optional<Sum> by_squares(const OrderedTerms& terms);
  std::optional<Sum> by_angle_sums(const OrderedTerms& terms);
  std::optional<Sum> by_tangents(const OrderedTerms& terms);
  std::optional<Sum> by_logarithms(const OrderedTerms& terms);
  std::optional<Sum> by_arcs(const OrderedTerms& terms);
  std::optional<Sum> by_extremes(const OrderedTerms& terms);
  std::optional<SumId> with_single_angles(SumId s);
  std::optional<SumId> with_common_shift(SumId s);
  std::optional<SumId> with_common_base(SumId s);
  std::optional<SumId> with_logarithms(SumId s);
  std::vector<SumId> with_related_arguments(SumId s);  ///< what these four find
  std::optional<SumId> perfect_power(SumId base, const mpq_class& exponent);
  std::optional<SumId> over_common_denominator(SumId s);
  std::optional<SumId> in_factors(SumId s);
  void expanded(SumId s, std::vector<SumId>& candidates);
  void grouped(SumId s, std::vector<SumId>& candidates);
  SumId with_grouped(const Sum& terms, const std::vector<Factor>& common,
                     const std::vector<std::size_t>& members);

  std::unordered_map<SumId, SumId> rewritten_;
  double work_ = 0;  // terms made in search of shorter forms
};

// ── rules as data (rewrite_rules.cpp) ──────────────────────────────────────────────────────────────────────

/// op(args) as something simpler, or nothing.
struct FunctionRule {
  const char* name;
  std::optional<SumId> (*apply)(Simplifier& s, Op op, const std::vector<SumId>& args);
};
/// Changes the factors of a product; returns whether it did.
struct ProductRule {
  const char* name;
  bool (*apply)(Simplifier& s, Term& term);
};
/// α f(x)² + β g(x)² = 1.
struct SquareRule {
  const char* name;
  Op f, g;
  int alpha, beta;
};

std::span<const FunctionRule> function_rules();
std::span<const ProductRule> product_rules();
std::span<const SquareRule> square_rules();

}  // namespace pendula
