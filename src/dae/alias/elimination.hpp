// Equations and unknowns during elimination.
#pragma once

#include <cstddef>
#include <optional>
#include <queue>
#include <tuple>
#include <vector>

#include "dae/alias/affine_row.hpp"
#include "dae/alias/occurrences.hpp"
#include "dae/model/model.hpp"

namespace pendula::dae {

struct Definition {
  int unknown;
  Expr meaning;  ///< in unknowns of which some may be eliminated later
};

/// Pivots in the order of their costs, until none is left; see eliminate().
class Elimination {
 public:
  explicit Elimination(const Model& model);
  void run();

  const std::vector<AffineRow>& rows() const { return rows_; }
  const UnknownNumbers& numbers() const { return numbers_; }
  bool is_active(std::size_t row) const { return active_[row]; }
  bool changed(std::size_t row) const { return changed_[row]; }
  const std::vector<Definition>& definitions() const { return definitions_; }

 private:
  struct Candidate {
    long cost;
    int depth, row, unknown;
    bool operator<(const Candidate& other) const {  // the queue's top is the largest
      return std::tuple(-cost, depth, -row, unknown) <
             std::tuple(-other.cost, other.depth, -other.row, other.unknown);
    }
  };

  /// May a differentiated x be replaced? Derivatives that come in through its definition must not outnumber
  /// those of x that go: how many do, or nothing.
  std::optional<int> raised_orders(const AffineRow& row, int x, int times) const;
  /// Unknowns with a guess are left to Newton's method, unless states give their value.
  bool follows_from_states(const AffineRow& row, int x) const;
  /// A state that events reset may only be replaced by another state.
  bool loses_reset(const AffineRow& row, int x) const;
  std::optional<Candidate> candidate(int row, int x) const;
  void consider(int row, int unknown);
  void consider_row(int row);
  /// x = … as a row, from row `row`, which is used up by it.
  AffineRow defined(int row, int x) const;
  /// Without eliminated unknowns.
  Expr in_remaining(Expr e) const;
  AffineRow derivative(const AffineRow& e) const;
  void eliminate(int row, int x);
  void pass_guard(int x, const AffineRow& e);
  void write_into_others(int x, const AffineRow& e);
  /// A product may be linear now that a factor is known: cos(phi) f with the angle of a frame at rest.
  void read_again(AffineRow& row) const;
  /// Unknowns that occur in fewer rows now may have become cheap to eliminate.
  void reconsider(int unknown);

  const Model& model_;
  UnknownNumbers numbers_;
  std::vector<AffineRow> rows_;
  std::vector<char> active_, changed_;
  Occurrences occurrences_;
  std::vector<char> wanted_;   ///< 1: has a value at the start, 2: a guess
  std::vector<char> guarded_;  ///< reset by an event
  std::vector<int> seen_;
  int stamp_ = 0;
  std::priority_queue<Candidate> queue_;
  std::vector<Definition> definitions_;
  Substitution meanings_;  ///< the same as definitions_
  Substitution known_;     ///< eliminated, and without unknowns
};

}  // namespace pendula::dae
