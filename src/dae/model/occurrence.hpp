// Where the leaves of a set occur in expressions that share their parts.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_set>

#include "base/limits/stack.hpp"
#include "expr/graph/graph.hpp"
#include "expr/graph/node_map.hpp"

namespace pendula::dae {

/// Of every expression below some others: which leaf of a set it contains. One pass, although the rows of an
/// explicit model may share all they consist of.
class Occurrence {
 public:
  Occurrence(std::span<const Expr> outputs, const std::unordered_set<Expr>& set) {
    for (Expr node : topological(outputs)) {
      std::uint32_t& here = which_[node];
      if (node.is_symbol() || node.op() == Op::call) here = set.count(node) ? node.id() + 1 : none;
      if (node.is_symbol() || node.is_constant()) continue;
      for (Expr x : node.operands()) {
        const std::uint32_t there = which_[x];
        std::uint32_t& now = which_[node];
        now = now == none || now == there ? there : there == none ? now : several;
      }
    }
  }
  bool any(Expr e) { return which_[e] != none; }
  std::optional<Expr> only(Expr e) {
    const std::uint32_t w = which_[e];
    return w == none || w == several ? std::nullopt : std::optional(Expr::at(w - 1));
  }

  /// e = slope · leaf + rest, where that can be read off sums and products; leaf is the only one of the set.
  struct Line {
    Expr slope, rest;
  };
  std::optional<Line> line(Expr e) {
    check_stack();
    if (!any(e)) return Line{Expr(0), e};
    if (e.is_symbol()) return Line{Expr(1), Expr(0)};
    if (e.op() != Op::add && e.op() != Op::sub && e.op() != Op::neg && e.op() != Op::mul && e.op() != Op::div)
      return std::nullopt;
    const auto a = line(e.operand(0));
    if (!a) return std::nullopt;
    if (e.op() == Op::neg) return Line{-a->slope, -a->rest};
    const Expr left = e.operand(0), right = e.operand(1);
    if (e.op() == Op::div)
      return any(right) ? std::nullopt : std::optional(Line{a->slope / right, a->rest / right});
    if (e.op() == Op::mul && !any(right)) return Line{a->slope * right, a->rest * right};
    const auto b = line(right);
    if (!b || (e.op() == Op::mul && any(left))) return std::nullopt;
    if (e.op() == Op::mul) return Line{left * b->slope, left * b->rest};
    return e.op() == Op::add ? Line{a->slope + b->slope, a->rest + b->rest}
                             : Line{a->slope - b->slope, a->rest - b->rest};
  }

 private:
  static constexpr std::uint32_t none = 0, several = 0xffffffff;
  NodeMap<std::uint32_t> which_;
};

}  // namespace pendula::dae
