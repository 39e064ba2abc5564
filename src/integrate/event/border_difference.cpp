#include "integrate/event/border_difference.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "base/limits/stack.hpp"

namespace pendula::integrate {
namespace {

class Differences {
 public:
  /// Adds the parts of factor (above - below).
  void collect(Expr above, Expr below, Expr factor) {
    check_stack();
    if (above == below || !seen_.insert({above.id(), below.id(), factor.id()}).second) return;
    std::vector<Term> terms = different_terms(above, below);
    Expr rest(0);
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const auto [term, count] = terms[i];
      if (count == 0) continue;
      bool found = false;
      for (std::size_t j = i + 1; j < terms.size() && !found; ++j) {
        if (terms[j].count != -count) continue;
        found = look_through(term, terms[j].e, factor * Expr(count));
        if (found) terms[j].count = 0;
      }
      if (!found) rest += Expr(count) * term;
    }
    if (rest.is_constant() && constant_value(rest) == 0) return;
    if (const auto both = cases_of(rest); both && splits_ < most_splits) {
      ++splits_;
      for (Expr one : *both) collect(one, 0, factor);
    } else {
      parts.push_back(factor * rest);
    }
  }

  std::vector<Expr> parts;

 private:
  struct Term {
    Expr e;
    int count;
  };

  static constexpr int most_splits = 200;

  /// A sum one of whose terms is {p if c, else q} or a multiple of it: with p and with q in its place.
  static std::optional<std::array<Expr, 2>> cases_of(Expr sum) {
    Expr others(0);
    std::optional<std::array<Expr, 2>> cases;
    for (const auto& [e, count] : different_terms(sum, 0)) {
      if (!cases && (cases = cases_of_term(e)))
        for (Expr& one : *cases) one *= Expr(count);
      else
        others += Expr(count) * e;
    }
    if (cases)
      for (Expr& one : *cases) one += others;
    return cases;
  }
  static std::optional<std::array<Expr, 2>> cases_of_term(Expr e) {
    if (e.op() == Op::ifelse) return std::array{e.operand(1), e.operand(2)};
    const int factors = e.op() == Op::mul ? 2 : e.op() == Op::div ? 1 : 0;
    for (int i = 0; i < factors; ++i) {
      const Expr choice = e.operand(i), other = e.operand(1 - i);
      if (choice.op() != Op::ifelse) continue;
      return std::array{make(e.op(), choice.operand(1), other), make(e.op(), choice.operand(2), other)};
    }
    return {};
  }

  /// The terms of a sum that are not in the other one as well.
  static std::vector<Term> different_terms(Expr above, Expr below) {
    std::unordered_map<Expr, std::size_t> place;
    std::vector<Term> terms;
    std::vector<Term> open{{below, -1}, {above, 1}};
    while (!open.empty()) {
      const auto [e, sign] = open.back();
      open.pop_back();
      if (e.op() == Op::neg) {
        open.push_back({e.operand(0), -sign});
      } else if (e.op() == Op::add || e.op() == Op::sub) {
        open.push_back({e.operand(1), e.op() == Op::add ? sign : -sign});
        open.push_back({e.operand(0), sign});
      } else if (const auto [at, is_new] = place.emplace(e, terms.size()); is_new) {
        terms.push_back({e, sign});
      } else {
        terms[at->second].count += sign;
      }
    }
    return terms;
  }

  /// If two terms have their condition, a factor or their divisor in common: collects what is left.
  bool look_through(Expr a, Expr b, Expr factor) {
    if (a.op() != b.op() || a.is_symbol() || a.is_constant()) return false;
    if (a.op() == Op::ifelse && a.operand(0) == b.operand(0)) {
      collect(a.operand(1), b.operand(1), factor);
      collect(a.operand(2), b.operand(2), factor);
      return true;
    }
    if (a.op() == Op::div && a.operand(1) == b.operand(1)) {
      collect(a.operand(0), b.operand(0), factor / a.operand(1));
      return true;
    }
    if (a.op() != Op::mul) return false;
    for (const auto [i, j] : {std::array{0, 0}, {0, 1}, {1, 0}, {1, 1}})
      if (a.operand(i) == b.operand(j)) {
        collect(a.operand(1 - i), b.operand(1 - j), factor * a.operand(i));
        return true;
      }
    return false;
  }

  std::set<std::array<std::uint32_t, 3>> seen_;
  int splits_ = 0;
};

}  // namespace

std::vector<Expr> differences(Expr above, Expr below) {
  Differences all;
  all.collect(above, below, Expr(1));
  return std::move(all.parts);
}

}  // namespace pendula::integrate
