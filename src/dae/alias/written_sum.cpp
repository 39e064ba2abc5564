#include "dae/alias/written_sum.hpp"

#include <cstddef>
#include <unordered_map>

#include "base/limits/stack.hpp"
#include "dae/alias/affine_row.hpp"

namespace pendula::dae {

bool is_negative(Expr c) {
  return c.op() == Op::neg || c == Expr(-1) || (c.is_constant() && constant_value(c) < 0);
}

namespace {

/// A summand ±part·x of a term.
struct Member {
  std::size_t term;
  Expr x;
  bool minus;
};
using Term = std::pair<Expr, Expr>;

class WrittenSum {
 public:
  explicit WrittenSum(const std::vector<Term>& terms) : terms_(terms) {
    for (std::size_t k = 0; k < terms.size(); ++k) split(terms[k].first, true, k);
    for (std::size_t i = 0; i < parts_.size(); ++i) join(parts_[i]);
  }

  Expr added_to(Expr sum) {
    std::vector<std::vector<Expr>> groups(terms_.size());  // indexed by the first term of each group
    std::vector<bool> shares(terms_.size());
    for (Expr part : parts_) {
      const std::vector<Member>& members = users_[part];
      if (members.size() < 2 || part.is_constant()) continue;
      groups[members.front().term].push_back(part);
      for (const Member& m : members) shares[m.term] = true;
    }
    for (std::size_t k = 0; k < terms_.size(); ++k) {
      for (Expr part : groups[k]) sum = with_group(sum, part);
      const auto& [coefficient, x] = terms_[k];
      const Expr c = shares[k] ? rest_of(k) : coefficient;
      sum = is_negative(c) ? sum + scaled(-c, x) : sum - scaled(c, x);
    }
    return sum;
  }

 private:
  /// The summands of a coefficient, each with its sign.
  void split(Expr c, bool minus, std::size_t term) {
    check_stack();
    if (c.op() == Op::neg) {
      split(c.operand(0), !minus, term);
    } else if (c.op() == Op::add || c.op() == Op::sub) {
      split(c.operand(0), minus, term);
      split(c.operand(1), (c.op() == Op::sub) != minus, term);
    } else {
      std::vector<Member>& members = users_[c];
      if (members.empty()) parts_.push_back(c);
      members.push_back({term, terms_[term].second, minus});
    }
  }

  /// Writes k/n v next to k u as k (u - v/n): behind a gear, the angle difference across a spring.
  void join(Expr part) {
    std::vector<Member>& own = users_[part];
    if (own.size() != 1 || part.is_constant()) return;
    Expr base = part, x = own.front().x;
    constexpr int deepest = 3;  // quotients: gears behind each other
    for (int depth = 0; depth < deepest && base.op() == Op::div; ++depth) {
      x = x / base.operand(1);
      base = base.operand(0);
      const auto found = users_.find(base);
      if (found == users_.end() || found->second.empty() || base.is_constant()) continue;
      std::vector<Member>& members = found->second;
      auto at = members.begin();
      while (at != members.end() && at->term < own.front().term) ++at;
      members.insert(at, {own.front().term, x, own.front().minus});
      own.clear();
      return;
    }
  }

  Expr with_group(Expr sum, Expr part) {
    const std::vector<Member>& members = users_[part];
    const bool turned = members.front().minus;
    Expr inner = 0;
    for (bool subtracted : {false, true})
      for (const Member& m : members)
        if ((m.minus != turned) == subtracted) inner = subtracted ? inner - m.x : inner + m.x;
    return turned ? sum - scaled(part, inner) : sum + scaled(part, inner);
  }

  /// The part of a coefficient that no group contains.
  Expr rest_of(std::size_t term) {
    Expr left = 0;
    for (Expr part : parts_) {
      const std::vector<Member>& members = users_[part];
      if (members.size() > 1 && !part.is_constant()) continue;
      for (const Member& m : members)
        if (m.term == term) left = m.minus ? left + part : left - part;
    }
    return left;
  }

  const std::vector<Term>& terms_;
  std::vector<Expr> parts_;  ///< in the order in which they occur
  std::unordered_map<Expr, std::vector<Member>> users_;
};

}  // namespace

Expr without_terms(Expr sum, const std::vector<std::pair<Expr, Expr>>& terms) {
  return WrittenSum(terms).added_to(sum);
}

}  // namespace pendula::dae
