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
  static constexpr std::uint32_t chunk_bits = 14;
  T& operator[](std::uint32_t i) { return chunks_[i >> chunk_bits][i & ((1u << chunk_bits) - 1)]; }
  const T& operator[](std::uint32_t i) const {
    return chunks_[i >> chunk_bits][i & ((1u << chunk_bits) - 1)];
  }
  std::uint32_t push(T value) {
    if (size_ >> chunk_bits >= chunks_.size()) chunks_.push_back(std::make_unique<T[]>(1u << chunk_bits));
    (*this)[size_] = std::move(value);
    return size_++;
  }
  std::uint32_t size() const { return size_; }

 private:
  std::vector<std::unique_ptr<T[]>> chunks_;
  std::uint32_t size_ = 0;
};

struct Node {
  Op op;
  std::array<Expr, 3> operand;  // of a leaf or call: operand[0].id() indexes the table that describes it
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

  /// The node of an operation, made on first use. Requires an operation or a component of a linear system.
  Expr intern(const Node& n);
  /// A new node for entry `place` of the table of symbols or of calls.
  Expr leaf(Op op, std::uint32_t place) { return Expr::at(nodes_.push({op, {Expr::at(place), {}, {}}})); }

  /// The node of a number, made on first use.
  Expr exact(const mpq_class& q);
  Expr whole(long value);  ///< the same without arithmetic of GMP where |value| ≤ 16
  Expr inexact(double value);
  const Constant& constant(Expr e) const { return constants_[nodes_[e.id()].operand[0].id()]; }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
  static constexpr long most_whole = 16;

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

  Expr add(Constant c);
  void grow();

  Arena<Node> nodes_;
  Arena<Constant> constants_;
  std::vector<std::uint32_t> table_ = std::vector<std::uint32_t>(1 << 12, none);  ///< open addressing
  std::unordered_set<std::uint32_t, ValueHash, SameValue> exact_{64, ValueHash{this}, SameValue{this}};
  std::unordered_map<std::uint64_t, Expr> inexact_;  ///< by their bits
  std::array<std::uint32_t, 2 * most_whole + 1> whole_;
};

}  // namespace pendula
