#include "expr/rewrite/rewrite_patterns.hpp"

#include <algorithm>
#include <unordered_map>

#include "expr/graph/declaration.hpp"
#include "expr/graph/node_map.hpp"

namespace pendula {
namespace {

bool is_variable(Expr e) { return e.is_symbol() && symbol_of(e).kind == Kind::variable; }

/// All bases in the order of declaration; empty if that is not a strict order.
std::optional<std::vector<Expr>> bases_of(const std::vector<Expr>& nodes) {
  std::vector<std::pair<std::uint64_t, Expr>> found;
  for (Expr e : nodes)
    if (e.is_symbol()) found.emplace_back(declaration_of(e), symbol_of(e).base);
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : a.second.id() < b.second.id();
  });
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::vector<Expr> bases;
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (k > 0 && found[k].first == found[k - 1].first) return std::nullopt;
    bases.push_back(found[k].second);
  }
  return bases;
}

}  // namespace

std::optional<Pattern> pattern_of(Expr e) {
  constexpr std::size_t fewest = 6,
                        most = 400;  // choices: smaller ones are simplified as fast as they are compared
  constexpr std::uint32_t variable = 1'000'000, other = 1'000'001;  // not among the operations
  const std::vector<Expr> nodes = topological({&e, 1});
  if (nodes.size() < fewest || nodes.size() > most) return std::nullopt;
  const auto bases = bases_of(nodes);
  if (!bases) return std::nullopt;
  static thread_local NodeMap<std::uint32_t> place;
  place.clear();
  for (std::uint32_t k = 0; k < bases->size(); ++k) place[(*bases)[k]] = k;
  Pattern p;
  for (Expr base : *bases)
    if (is_variable(base)) p.variables.push_back(base);
  std::vector<std::uint32_t>& key = p.key;
  std::uint32_t next = 0;
  static thread_local NodeMap<std::uint32_t> number;
  number.clear();
  for (Expr node : nodes) {
    if (node.op() == Op::solve || node.op() == Op::call) return std::nullopt;
    if (node.is_constant()) {
      key.insert(key.end(), {other, node.id()});
    } else if (node.is_symbol()) {
      const Symbol& s = symbol_of(node);
      if (s.kind == Kind::variable)
        key.insert(key.end(), {variable, place[s.base], static_cast<std::uint32_t>(s.order)});
      else
        key.insert(key.end(), {other, node.id(), place[s.base]});
    } else {
      key.push_back(static_cast<std::uint32_t>(node.op()));
      for (Expr operand : node.operands()) key.push_back(number[operand]);
    }
    number[node] = next++;
  }
  return p;
}

std::optional<Expr> RewrittenPatterns::find(const Pattern& pattern) {
  const std::vector<Node>* program = known_.find(pattern.key);
  if (!program) return std::nullopt;
  std::vector<Expr> values;
  values.reserve(program->size());
  for (const Node& n : *program) {
    if (n.op == Op::symbol) {
      const Expr base = pattern.variables[n.operand[0]];
      values.push_back(n.operand[1] == 0 ? base : derivative_leaf(base, static_cast<int>(n.operand[1])));
    } else if (n.op == Op::constant) {
      touch(n.leaf);
      values.push_back(n.leaf);
    } else {
      const int arity = info(n.op).arity;
      values.push_back(make(n.op, values[n.operand[0]], arity > 1 ? values[n.operand[1]] : Expr(),
                            arity > 2 ? values[n.operand[2]] : Expr()));
    }
  }
  return values.back();
}

void RewrittenPatterns::add(const Pattern& pattern, Expr result) {
  std::vector<Node> program;
  std::unordered_map<Expr, std::uint32_t> number;
  for (Expr node : topological({&result, 1})) {
    Node n{Op::constant, node, {0, 0, 0}};
    if (is_variable(node)) {
      const Symbol& s = symbol_of(node);
      const auto at = std::find(pattern.variables.begin(), pattern.variables.end(), s.base);
      if (at == pattern.variables.end()) return;
      n.op = Op::symbol;
      n.operand[0] = static_cast<std::uint32_t>(at - pattern.variables.begin());
      n.operand[1] = static_cast<std::uint32_t>(s.order);
    } else if (!node.is_constant() && !node.is_symbol()) {
      if (node.op() == Op::solve || node.op() == Op::call) return;
      n.op = node.op();
      const auto operands = node.operands();
      for (std::size_t k = 0; k < operands.size(); ++k) n.operand[k] = number.at(operands[k]);
    }
    number[node] = static_cast<std::uint32_t>(program.size());
    program.push_back(n);
  }
  known_.insert(pattern.key, std::move(program));
}

}  // namespace pendula
