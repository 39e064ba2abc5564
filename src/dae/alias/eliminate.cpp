#include "dae/alias/eliminate.hpp"

#include <algorithm>
#include <span>
#include <unordered_map>
#include <utility>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/alias/elimination.hpp"
#include "dae/alias/written_sum.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/truncated_text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"

namespace pendula::dae {
namespace {

/// Every eliminated unknown in terms of the remaining ones. A definition may contain unknowns eliminated
/// before or after it; those are expanded first.
Substitution relations_of(const Elimination& e) {
  std::unordered_map<Expr, Expr> meanings;
  for (const Definition& d : e.definitions()) meanings[e.numbers().leaf(d.unknown)] = d.meaning;
  Substitution relations;
  // a leaf, and whether the leaves of its definition have been handled
  std::vector<std::pair<Expr, bool>> todo;
  for (auto it = e.definitions().rbegin(); it != e.definitions().rend(); ++it)
    todo.emplace_back(e.numbers().leaf(it->unknown), false);
  while (!todo.empty()) {
    auto& [leaf, ready] = todo.back();
    const Expr here = leaf, meaning = meanings.at(leaf);
    if (relations.count(here) != 0) {
      todo.pop_back();
    } else if (ready) {
      todo.pop_back();
      relations[here] = substitute(meaning, relations);
    } else {
      ready = true;
      for (Expr inside : leaves({&meaning, 1}))
        if (meanings.count(inside) != 0 && relations.count(inside) == 0) todo.emplace_back(inside, false);
    }
  }
  return relations;
}

/// A row written as: top derivatives = the rest, or 0 = …
Block written_row(const AffineRow& row, const Elimination& e, const Substitution& relations) {
  const UnknownNumbers& numbers = e.numbers();
  std::vector<AffineRow::Term> terms = row.terms;
  std::stable_sort(terms.begin(), terms.end(), [&](const auto& a, const auto& b) {
    return numbers.order(a.unknown) > numbers.order(b.unknown);
  });
  const int top = terms.empty() ? 0 : numbers.order(terms[0].unknown);
  const Expr rest = substitute(row.rest, relations);
  const bool turn = !terms.empty() && is_negative(terms[0].coefficient);
  Expr left = 0, right = turn ? rest : -rest;
  std::vector<std::pair<Expr, Expr>> others;
  for (const AffineRow::Term& t : terms) {
    const Expr c = turn ? -t.coefficient : t.coefficient, leaf = numbers.leaf(t.unknown);
    if (top > 0 && numbers.order(t.unknown) == top)
      left += scaled(c, leaf);
    else
      others.emplace_back(c, leaf);
  }
  right = without_terms(right, others);
  Block block;
  block.lhs = VecX::Constant(1, left);
  block.rhs = VecX::Constant(1, right);
  return block;
}

[[noreturn]] void refuse_row(const Model& m, std::size_t i, Expr value) {
  const std::string note = m.blocks[m.origin[i].first].note;
  throw Error(
      text("equation ", m.label(i), note.empty() ? "" : " (" + note + ")", ", ", m.equation_text(i), ", ",
           value.is_zero() ? "follows from the others: it is redundant, and some unknown has no equation"
                           : text("contradicts the others: with them it reads 0 = ", truncated_text(value))));
}

std::vector<Block> remaining_blocks(const Model& m, const Elimination& e, const Substitution& relations) {
  std::vector<Block> blocks;
  for (std::size_t i = 0; i < e.rows().size(); ++i) {
    if (!e.is_active(i)) continue;
    const auto [block, row] = m.origin[i];
    const Block& source = m.blocks[block];
    const AffineRow& r = e.rows()[i];
    Block made;
    if (e.changed(i)) {
      made = written_row(r, e, relations);
      if (r.terms.empty() && r.inside.empty()) refuse_row(m, i, made.rhs[0]);
    } else {
      made.lhs = VecX::Constant(1, source.lhs[row]);
      made.rhs = VecX::Constant(1, source.rhs[row]);
    }
    made.note = !source.note.empty() ? source.note : "from " + m.label(i);
    blocks.push_back(std::move(made));
  }
  return blocks;
}

/// The model with these parameters replaced by 0; relations keep their values.
ModelPtr without(const ModelPtr& model, std::span<const Expr> zeros) {
  Substitution put_in;
  ModelOptions options = child_of(model);
  options.form.clear();
  options.mechanics.reset();
  for (Expr p : zeros) {
    put_in[p] = Expr(0);
    options.values[p] = Expr(0);
    options.trace.push_back(text("substituted:  ", to_text(p), " = 0"));
  }
  move_invariants(options, put_in);
  for (const auto& [leaf, meaning] : put_in) options.relations[leaf] = meaning;
  std::vector<Block> blocks = model->blocks;
  for (Block& block : blocks) {
    block.lhs = mapped(block.lhs, put_in);
    block.rhs = mapped(block.rhs, put_in);
  }
  return make_model(std::move(blocks), options);
}

}  // namespace

ModelPtr eliminate(const ModelPtr& original, std::span<const Expr> zeros) {
  const ModelPtr model = zeros.empty() ? original : without(original, zeros);
  Elimination e(*model);
  e.run();
  if (e.definitions().empty()) return model;
  const Substitution relations = relations_of(e);
  ModelOptions options = child_of(model);
  options.form.clear();
  options.mechanics.reset();
  move_invariants(options, relations);
  constexpr std::size_t most_lines = 500;  // of the trace: a reader's limit
  std::size_t count = 0;
  for (const Definition& d : e.definitions()) {
    const Expr leaf = e.numbers().leaf(d.unknown);
    if (e.numbers().order(d.unknown) == 0 && ++count <= most_lines)
      options.trace.push_back(text("eliminated:  ", to_text(leaf), " = ", truncated_text(d.meaning)));
  }
  if (count > most_lines) options.trace.push_back(text("… ", count, " unknowns eliminated in all"));
  for (const auto& [leaf, meaning] : relations) options.relations[leaf] = meaning;
  return make_model(remaining_blocks(*model, e, relations), options);
}

}  // namespace pendula::dae
