// Where the nodes of the graph are kept: operations and constants, each of them once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "expr/graph/graph.hpp"
#include "expr/graph/mix.hpp"

namespace pendula {

/// Growing array with stable addresses: operands() hands out spans that survive the making of new nodes.
template <class T>
class Arena {
 public:
  /// A choice: chunks are made and given back as a whole; those of nodes are 16 KB.
  static constexpr std::uint32_t chunk_bits = 10, chunk = 1u << chunk_bits;
  T& operator[](std::uint32_t i) { return chunks_[i >> chunk_bits][i & (chunk - 1)]; }
  const T& operator[](std::uint32_t i) const { return chunks_[i >> chunk_bits][i & (chunk - 1)]; }

  std::uint32_t push(T value) {
    if (size_ >> chunk_bits >= chunks_.size()) chunks_.push_back(std::make_shared<T[]>(chunk));
    (*this)[size_] = std::move(value);
    return size_++;
  }

  std::uint32_t size() const { return size_; }

  /// Calls visit(i, entry) for every entry, the last one first; what was given back is left out.
  template <class Visit>
  void each_from_last(const Visit& visit) {
    for (std::uint32_t c = static_cast<std::uint32_t>(chunks_.size()); c-- > 0;) {
      if (chunks_[c] == nothing_) continue;
      for (std::uint32_t i = std::min(chunk, size_ - c * chunk); i-- > 0;)
        visit(c * chunk + i, chunks_[c][i]);
    }
  }

  /// Gives back the chunks without an entry in use; the last one, which is not full, stays.
  template <class Used>
  void give_back_unless(const Used& used) {
    if (!nothing_) nothing_ = std::make_shared<T[]>(chunk);
    for (std::uint32_t c = 0; c < size_ >> chunk_bits; ++c)
      if (std::none_of(&chunks_[c][0], &chunks_[c][0] + chunk, used)) chunks_[c] = nothing_;
  }

 private:
  std::vector<std::shared_ptr<T[]>> chunks_;
  std::shared_ptr<T[]> nothing_;  ///< in the place of chunks that were given back
  std::uint32_t size_ = 0;
};

struct Node {
  static constexpr auto nothing = static_cast<Op>(255);

  Op op = nothing;
  std::array<Expr, 3> operand;  // of a leaf or call: operand[0].id() indexes the table that describes it
  std::uint16_t first = 0, last = 0;  ///< windows in which it was made, and made or asked for the last time
};

/// A number: exact, or known as a double alone.
struct Constant {
  std::optional<mpq_class> exact;
  double value = 0;
};

class NodeStore {
 public:
  NodeStore();

  const Node& operator[](std::uint32_t id) const { return nodes_[id]; }
  std::uint32_t size() const { return nodes_.size(); }
  std::uint32_t in_use() const { return in_use_; }  ///< what was not given back
  std::uint16_t window() const { return window_; }
  void touch(std::uint32_t id) { nodes_[id].last = window_; }

  /// The node of an operation, made on first use. Requires an operation or a component of a linear system.
  Expr intern(const Node& n);
  /// A new node for entry `place` of the table of symbols or of calls.
  Expr leaf(Op op, std::uint32_t place) { return push({op, {Expr::at(place), {}, {}}}); }

  /// The node of a number, made on first use.
  Expr exact(const mpq_class& q);
  Expr whole(long value);  ///< the same without arithmetic of GMP where |value| ≤ 16
  Expr inexact(double value);

  /// Begins a window: from here on nodes are made and touched in it. False where the
  /// numbers are at their end.
  bool begin_window();
  /// Gives back all nodes that were not touched in this window, that were not made before the end and touched
  /// since the beginning of one of `windows`, and that no node which stays has as an operand. Ids are not
  /// used again. Cost: O(nodes in use).
  void give_back(const std::vector<std::uint16_t>& windows);
  const Constant& constant(Expr e) const { return constants_[nodes_[e.id()].operand[0].id()]; }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
  static constexpr long most_whole = 16;  ///< whole numbers to ±16 are found by index: exponents, factors
  static constexpr std::size_t least_room = 1 << 12;  ///< places of an empty table, 16 KB

  /// Exact constants by their value: elements are nodes, and a number may be looked up.
  struct ValueHash {
    using is_transparent = void;
    const NodeStore* store;
    std::size_t operator()(const mpq_class& q) const;
    std::size_t operator()(std::uint32_t id) const { return (*this)(*store->constant(Expr::at(id)).exact); }
  };
  struct SameValue {
    using is_transparent = void;
    const NodeStore* store;
    bool operator()(std::uint32_t a, std::uint32_t b) const { return a == b; }
    bool operator()(const mpq_class& q, std::uint32_t id) const {
      return q == *store->constant(Expr::at(id)).exact;
    }
    bool operator()(std::uint32_t id, const mpq_class& q) const { return (*this)(q, id); }
  };

  Expr push(Node n);
  Expr add(Constant c);
  Expr touched(std::uint32_t id);
  void touch_operands(const Node& n);
  void free(std::uint32_t id, Node& n);
  void fill_table(std::size_t size);

  Arena<Node> nodes_;
  Arena<Constant> constants_;
  std::vector<std::uint32_t> free_constants_;  ///< places whose numbers were given back
  std::uint32_t in_use_ = 0, nodes_in_table_ = 0;
  std::uint16_t window_ = 0;
  std::vector<std::uint32_t> table_ = std::vector<std::uint32_t>(least_room, none);  ///< open addressing
  std::unordered_set<std::uint32_t, ValueHash, SameValue> exact_{64, ValueHash{this}, SameValue{this}};
  std::unordered_map<std::uint64_t, Expr> inexact_;  ///< by their bits
  std::array<std::uint32_t, 2 * most_whole + 1> whole_;
};

}  // namespace pendula
