#include "dae/reduce.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank.hpp"
#include "expr/print.hpp"
#include "expr/rewrite.hpp"

namespace pendula::dae {
namespace {

Signature signature(const Model& m) {
  std::unordered_map<Expr, int> number;
  for (std::size_t j = 0; j < m.variables.size(); ++j) number[m.variables[j].leaf] = static_cast<int>(j);
  Signature sigma;
  for (Expr r : m.residuals) {
    std::unordered_map<int, int> highest;
    for (Expr leaf : leaves({&r, 1})) {
      const Symbol& s = symbol_of(leaf);
      if (const auto it = number.find(s.base); it != number.end()) {
        const auto [entry, made] = highest.try_emplace(it->second, s.order);
        if (!made) entry->second = std::max(entry->second, s.order);
      }
    }
    std::vector<SignatureEntry> row;
    for (const auto& [j, order] : highest) row.push_back({j, order});
    std::sort(row.begin(), row.end(), [](auto& a, auto& b) { return a.variable < b.variable; });
    sigma.push_back(std::move(row));
  }
  return sigma;
}

/// J_ij = ∂F_i/∂x_j^{(d_j - c_i)}; equal to ∂F_i^{(c_i)}/∂x_j^{(d_j)} by Griewank's lemma (Pryce 2001, eq.
/// (3.2)).
MatX system_jacobian(const Model& m, const Offsets& o) {
  const auto n = static_cast<Eigen::Index>(m.variables.size());
  MatX J = MatX::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    std::vector<Expr> x;
    std::vector<Eigen::Index> where;
    for (Eigen::Index j = 0; j < n; ++j)
      if (const int k = o.d[j] - o.c[i]; k >= 0)
        x.push_back(derivative_leaf(m.variables[j].leaf, k)), where.push_back(j);
    const auto row = gradient(m.residuals[i], x);
    for (std::size_t k = 0; k < row.size(); ++k) J(i, where[k]) = row[k];
  }
  return J;
}

std::string primes(int k) {
  std::string out;
  for (int i = 0; i < k; ++i) out += "′";
  return out;
}

std::string column_text(const VecX& v) { return v.size() == 1 ? to_text(v[0]) : vector_to_text(v); }

std::string constraint_label(const Model& m, std::size_t residual, int k) {
  const auto [block, row] = m.origin[residual];
  if (m.mechanics && row < m.mechanics->C.size() && block == static_cast<int>(m.blocks.size()) - 1)
    return (m.mechanics->C.size() == 1 ? "C" : "C" + subscript(row + 1)) + primes(k);
  return m.label(residual) + primes(k);
}

/// Rows x_j′ = f whose right side needs no algebraic variable: what may be put in for x_j′ anywhere.
Substitution kinematics(const Model& m) {
  const auto z = m.algebraic(), top = m.top_derivatives();
  std::unordered_set<Expr> unknown(z.begin(), z.end());
  unknown.insert(top.begin(), top.end());
  Substitution known;
  for (const Solved& row : solved_rows(m)) {
    const auto inside = leaves({&row.f, 1});
    if (std::none_of(inside.begin(), inside.end(), [&](Expr leaf) { return unknown.count(leaf) > 0; }))
      known[row.derivative] = row.f;
  }
  return known;
}

/// One reduction in progress: differentiates blocks, records constraints and the story.
class Differentiation {
 public:
  Differentiation(const ModelPtr& model, const Offsets& o) : m_(*model), o_(o), known_(kinematics(*model)) {
    std::size_t first = 0;
    for (std::size_t b = 0; b < m_.blocks.size(); ++b) {
      const auto rows = static_cast<std::size_t>(m_.blocks[b].lhs.size());
      reduce_block(b, first, rows);
      first += rows;
    }
  }

  std::vector<Block> blocks;
  std::vector<Constraint> constraints;
  std::vector<std::string> trace;

 private:
  bool substituted(std::size_t i) const {
    const auto top = m_.top_derivatives();
    for (Expr leaf : leaves({&m_.residuals[i], 1}))
      if (known_.count(leaf)) return std::find(top.begin(), top.end(), leaf) != top.end();
    return false;
  }

  int times(std::size_t i) const { return substituted(i) ? 0 : o_.c[i]; }

  void reduce_block(std::size_t b, std::size_t first, std::size_t rows) {
    int most = 0;
    bool uniform = true;
    for (std::size_t r = 0; r < rows; ++r)
      most = std::max(most, times(first + r)), uniform = uniform && times(first + r) == times(first);
    if (most == 0) return blocks.push_back(m_.blocks[b]);
    VecX residual = column(std::span(m_.residuals).subspan(first, rows));
    for (Eigen::Index r = 0; r < residual.size(); ++r)  // 0 = C reads better than 0 = -C
      if (m_.blocks[b].lhs[r].is_zero()) residual[r] = m_.blocks[b].rhs[r];
    trace.push_back(text("(", b + 1, ")  0 = ", column_text(residual),
                         uniform ? text("   is differentiated ", most == 1   ? "once"
                                                                 : most == 2 ? "twice"
                                                                             : text(most, " times"))
                                 : ""));
    for (int k = 0; k < most; ++k) {
      for (std::size_t r = 0; r < rows; ++r) {
        if (k >= times(first + r)) continue;
        Expr& e = residual[static_cast<Eigen::Index>(r)];
        constraints.push_back(
            {e, static_cast<int>(b), static_cast<int>(r), k, constraint_label(m_, first + r, k)});
        e = simplify(substitute(total_derivative(e), known_));
      }
      trace.push_back(text("     ",
                           k == 0 ? "d/dt" : text("d", superscript(k + 1), "/dt", superscript(k + 1)),
                           ":  0 = ", column_text(residual)));
    }
    const std::string note =
        text("(", b + 1, ")", most == 1 ? " differentiated" : text(" differentiated ", most, " times"));
    blocks.push_back({VecX::Zero(residual.size()), residual, uniform ? note : ""});
  }

  const Model& m_;
  const Offsets& o_;
  Substitution known_;
};

std::string names_of(const std::vector<Expr>& list) {
  std::vector<std::string> names;
  for (Expr e : list) names.push_back(to_text(e));
  return join(names, ", ");
}

void describe_substitutions(const Model& m, std::vector<std::string>& lines) {
  for (const auto& solved : solved_rows(m)) {
    const auto known = kinematics(m);
    if (!known.count(solved.derivative)) continue;
    const int block = m.origin[solved.residual].first;
    const std::string line = text("with (", block + 1, ")  ", column_text(m.blocks[block].lhs), " = ",
                                  column_text(m.blocks[block].rhs));
    if (std::find(lines.begin(), lines.end(), line) == lines.end()) lines.push_back(line);
  }
}

}  // namespace

MatX top_jacobian(const Model& m) {
  std::vector<Expr> unknowns = m.top_derivatives();
  const auto z = m.algebraic();
  unknowns.insert(unknowns.end(), z.begin(), z.end());
  return jacobian(m.residuals, unknowns);
}

Analysis analyse(const Model& m) {
  if (m.residuals.size() != m.variables.size()) {
    std::vector<Expr> unknowns;
    for (const Variable& v : m.variables) unknowns.push_back(v.leaf);
    throw Error(text("the model has ", m.residuals.size(), " equations for ", m.variables.size(),
                     " unknowns (", names_of(unknowns),
                     "): ", m.residuals.size() < m.variables.size() ? "add equations" : "remove equations"));
  }
  Analysis a;
  a.offsets = offsets(signature(m), static_cast<int>(m.variables.size()));
  if (!a.offsets.unmatched.empty()) return a;
  a.rank = generic_rank(system_jacobian(m, a.offsets));
  a.regular = a.rank == static_cast<int>(m.variables.size());
  if (!a.regular) return a;
  a.index = a.offsets.index();
  a.dof = a.offsets.value;
  if (a.index > 1 || a.offsets.value < static_cast<int>(m.states().size())) {
    const Differentiation d(std::make_shared<Model>(m), a.offsets);
    a.constraints = d.constraints;
  }
  a.constraints.insert(a.constraints.begin(), m.invariants.begin(), m.invariants.end());
  a.dof -= static_cast<int>(m.invariants.size());
  return a;
}

Analysis require_regular(const Model& m) {
  Analysis a = analyse(m);
  if (!a.offsets.unmatched.empty()) {
    std::vector<std::string> rows;
    for (int i : a.offsets.unmatched)
      rows.push_back(m.label(static_cast<std::size_t>(i)) + " " +
                     m.equation_text(static_cast<std::size_t>(i)));
    throw Failure(
        text("the model is structurally singular: no unknown is left for equation ", join(rows, "; ")));
  }
  if (!a.regular)
    throw Failure(text("the system Jacobian of the structural analysis is singular (rank ", a.rank, " of ",
                       m.variables.size(), "): the structural index ", a.offsets.index(),
                       " would be wrong, so no index is given"));
  return a;
}

ModelPtr reduce_acc(const ModelPtr& model) {
  const Analysis a = require_regular(*model);
  if (a.index <= 1 && a.offsets.value == static_cast<int>(model->states().size())) return model;
  Differentiation d(model, a.offsets);
  ModelOptions options;
  options.name = model->name;
  options.form = "acc";
  options.parent = model;
  options.relations = model->relations;
  options.invariants = model->invariants;
  options.invariants.insert(options.invariants.end(), d.constraints.begin(), d.constraints.end());
  options.mechanics = model->mechanics;
  for (const Variable& v : model->variables) (v.order ? options.x : options.z).push_back(v.leaf);
  options.u = model->inputs;
  options.trace = std::move(d.trace);
  describe_substitutions(*model, options.trace);
  ModelPtr low = make_model(std::move(d.blocks), options);
  const MatX J = top_jacobian(*low);
  const int rank = generic_rank(J);
  if (rank < J.rows())
    throw Failure(text("differentiating did not lower the index to 1: the Jacobian with respect to (",
                       names_of(low->top_derivatives()), low->algebraic().empty() ? "" : ", ",
                       names_of(low->algebraic()), ") has rank ", rank, " of ", J.rows()));
  auto done = std::make_shared<Model>(*low);
  done->trace.push_back(text("The Jacobian with respect to (", names_of(low->top_derivatives()),
                             low->algebraic().empty() ? "" : ", ", names_of(low->algebraic()), ") has rank ",
                             rank, " of ", J.rows(), ": index ",
                             low->algebraic().empty() && low->kind != Kind::fully_implicit ? 0 : 1, "."));
  std::vector<std::string> conditions;
  for (const Constraint& c : done->invariants) conditions.push_back(c.label + " = 0");
  done->trace.push_back(
      "The new model no longer imposes them, so the start must satisfy: " + join(conditions, ", ") + ".");
  return done;
}

std::vector<std::string> reduction_forms() { return {"acc"}; }

ModelPtr reduce(const ModelPtr& model, const std::string& form) {
  if (form.empty() || form == "acc") return reduce_acc(model);
  throw Error(text("unknown form '", form, "'.", did_you_mean(form, reduction_forms()),
                   " Forms: ", join(reduction_forms(), ", ")));
}

std::string trace(const Model& m) {
  std::string story = m.parent ? trace(*m.parent) : "";
  for (const std::string& line : m.trace) story += line + "\n";
  return story;
}

}  // namespace pendula::dae
