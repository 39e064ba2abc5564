#include "dae/model/forms.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/solved_rows.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

std::vector<Expr> list(const VecX& v) { return {v.data(), v.data() + v.size()}; }

VecX derivative(const VecX& x) {
  return x.unaryExpr([](Expr e) {
    if (!e.is_symbol() || symbol_of(e).kind != Kind::variable)
      throw Error(text("x must be made of variables (var \"x\"), got '", to_text(e), "'"));
    return derivative_leaf(e);
  });
}

/// The model under the name of the form it is written in, though its rows could be solved for x′.
ModelPtr as_implicit(const ModelPtr& model) {
  if (model->kind == ModelKind::fully_implicit || model->kind == ModelKind::implicit_ode) return model;
  auto copy = std::make_shared<Model>(*model);
  copy->kind = model->kind == ModelKind::ode ? ModelKind::implicit_ode : ModelKind::fully_implicit;
  return copy;
}

void check_size(const char* what, Index got, Index wanted, const char* per, const char* of) {
  if (got == wanted) return;
  throw Error(text(what, " has ", got, got == 1 ? " row" : " rows", ", but there ",
                   wanted == 1 ? "is 1 " : text("are ", wanted, " "), per, wanted == 1 ? "" : "s", " in ",
                   of));
}

}  // namespace

ModelPtr semi_explicit(const VecX& x, const VecX& z, const VecX& u, const VecX& f, const VecX& g,
                       std::string name) {
  check_size("f", f.size(), x.size(), "state", "x");
  ModelOptions options;
  options.name = std::move(name);
  options.x = list(x);
  options.z = list(z);
  options.u = list(u);
  std::vector<Block> blocks;
  if (x.size()) blocks.push_back({derivative(x), f, ""});
  if (g.size()) blocks.push_back({VecX::Zero(g.size()), g, ""});
  ModelPtr m = make_model(std::move(blocks), std::move(options));
  if (m->kind != ModelKind::semi_explicit && m->kind != ModelKind::ode)
    throw Error("f and g of a semi-explicit model must not contain derivatives; write dae.implicit{ F = … }");
  return m;
}

ModelPtr implicit(const VecX& x, const VecX& z, const VecX& u, const VecX& F, std::string name) {
  ModelOptions options;
  options.name = std::move(name);
  options.x = list(x);
  options.z = list(z);
  options.u = list(u);
  return as_implicit(make_model({{VecX::Zero(F.size()), F, ""}}, std::move(options)));
}

ModelPtr linear(const MatX& E, const MatX& A, const MatX& B, VecX x, VecX u, std::string name) {
  const Index n = E.cols();
  if (A.rows() != E.rows() || A.cols() != n)
    throw Error(text("E is ", E.rows(), "×", n, ", but A is ", A.rows(), "×", A.cols(),
                     "; both must have the same size"));
  if (x.size() == 0) x = column(newly_declared(symbol_vector(Kind::variable, "x", static_cast<int>(n))));
  check_size("x", x.size(), n, "column", "E");
  if (B.size() && B.rows() != E.rows()) throw Error(text("B has ", B.rows(), " rows, but E has ", E.rows()));
  if (B.size() && u.size() == 0)
    u = column(newly_declared(symbol_vector(Kind::input, "u", static_cast<int>(B.cols()))));
  if (u.size()) check_size("u", u.size(), B.cols(), "column", "B");
  ModelOptions options;
  options.name = std::move(name);
  options.x = list(x);
  options.u = list(u);
  VecX right = A * x;
  if (B.size()) right += B * u;
  return make_model({{E * derivative(x), right, ""}}, std::move(options));
}

/// The same model with a last line of its derivation, which needs the finished model.
template <class Line>
static ModelPtr with_last_line(const ModelPtr& model, Line line) {
  auto copy = std::make_shared<Model>(*model);
  copy->trace.push_back(line(*model));
  return copy;
}

/// "n_x = 2, n_z = 1, n_u = 1; F has m = 3 rows: …", why m = n_x + n_z.
static std::string counts(const Model& m) {
  const std::size_t n = m.top_derivatives().size(), z = m.algebraic().size(), u = m.inputs.size(),
                    rows = m.residuals.size();
  std::string out = text("n = n_x = ", n, ", n_z = ", z, u ? text(", n_u = ", u) : "",
                         ": x′ has as many entries as x, and F has m = ", rows);
  if (rows == n + z)
    out +=
        " = n_x + n_z rows, one for each of the unknowns x′ and z, so that ∂F/∂(x′, z) is square and can be "
        "nonsingular (implicit function theorem)";
  else
    out += text(" rows for the ", n + z, " unknowns x′ and z: m should be n_x + n_z");
  return out;
}

ModelPtr to_implicit(const ModelPtr& model) {
  ModelOptions options = child_of(model);
  options.trace.push_back("F(x′, x, z, u) = right side - left side of every equation");
  std::vector<Block> blocks;
  for (const Block& b : model->blocks)
    blocks.push_back({VecX::Zero(b.lhs.size()), b.rhs - b.lhs, b.note, b.rewritten});
  return with_last_line(as_implicit(make_model(std::move(blocks), std::move(options))),
                        [](const Model& m) { return counts(m); });
}

ModelPtr to_first_order(const ModelPtr& model) {
  ModelOptions options = child_of(model);
  Substitution lower;
  std::vector<Block> blocks;
  auto used = used_names(*model);
  for (const Group& g : groups(*model)) {
    std::vector<Expr> below = g.leaves;
    for (int k = 1; k < g.order; ++k) {
      const std::string preferred = g.name.size() == 1 && g.name == "q" && k == 1
                                        ? "v"
                                        : g.name + "_dot" + (k > 1 ? std::to_string(k) : "");
      const std::string name =
          fresh_name(used, k == 1 ? (used.count("v") ? preferred : "v") : preferred, preferred);
      used.insert(name);
      const std::vector<Expr> v = new_variable_like(g, name);
      Block tie{VecX(static_cast<Index>(v.size())), column(v), ""};
      for (std::size_t i = 0; i < v.size(); ++i) {
        tie.lhs[static_cast<Index>(i)] = derivative_leaf(below[i]);
        lower[derivative_leaf(g.leaves[i], k)] = v[i];
        if (k + 1 == g.order) lower[derivative_leaf(g.leaves[i], g.order)] = derivative_leaf(v[i]);
      }
      options.trace.push_back("introduce " + column_text(tie.rhs) + " = " + column_text(tie.lhs));
      blocks.push_back(std::move(tie));
      below = v;
    }
  }
  if (blocks.empty()) return model;
  move_invariants(options, lower);
  for (const auto& [leaf, meaning] : lower) options.relations[leaf] = meaning;
  if (options.mechanics) options.mechanics.reset();
  for (const Block& b : model->blocks)
    blocks.push_back({mapped(b.lhs, lower), mapped(b.rhs, lower), b.note, b.rewritten});
  return make_model(std::move(blocks), std::move(options));
}

/// x′ = f, 0 = g by rows, where every derivative has a row of its own and occurs in no other.
static std::optional<std::vector<Block>> solved_form(const Model& m) {
  const FirstOrder fo = first_order(m);
  if (!fo.semi_explicit) return {};
  std::unordered_map<Expr, Expr> f;
  for (std::size_t i = 0; i < fo.x.size(); ++i) f[fo.x[i]] = fo.f[i];
  std::vector<Block> blocks;
  for (const Group& g : groups(m)) {
    if (g.order == 0) continue;
    Block b{derivative(column(g.leaves)), VecX(static_cast<Index>(g.leaves.size())), ""};
    for (std::size_t i = 0; i < g.leaves.size(); ++i)
      b.rhs[static_cast<Index>(i)] = simplify(f.at(g.leaves[i]));
    blocks.push_back(std::move(b));
  }
  if (!fo.g.empty()) blocks.push_back({VecX::Zero(static_cast<Index>(fo.g.size())), column(fo.g), ""});
  return blocks;
}

/// Blocks all of whose rows are solved for a derivative, and what these derivatives are.
struct SolvedBlocks {
  std::vector<char> whole;
  Substitution derivative;
};

static SolvedBlocks solved_blocks(const Model& m) {
  std::vector<Index> solved_in(m.blocks.size(), 0);
  for (const Solved& row : solved_rows(m)) ++solved_in[m.origin[row.residual].first];
  SolvedBlocks result;
  for (std::size_t b = 0; b < m.blocks.size(); ++b)
    result.whole.push_back(solved_in[b] == m.blocks[b].lhs.size());
  for (const Solved& row : solved_rows(m))
    if (result.whole[m.origin[row.residual].first]) result.derivative[row.derivative] = row.f;
  return result;
}

ModelPtr to_semi_explicit(const ModelPtr& given) {
  const ModelPtr model = to_first_order(given);
  if (model->kind == ModelKind::ode || (model->kind == ModelKind::semi_explicit && !model->mass_matrix))
    return model;
  ModelOptions options = child_of(model);
  if (model->residuals.size() == model->variables.size())
    if (auto solved = solved_form(*model)) {
      options.trace.push_back("solve each row for the derivative it contains: x′ = f, 0 = g");
      return make_model(std::move(*solved), std::move(options));
    }
  std::vector<Block> blocks;
  const SolvedBlocks solved = solved_blocks(*model);
  Substitution known = solved.derivative;  // in the other rows: x′ -> f where it is solved for, else x′ -> δ
  auto used = used_names(*model);
  for (const Group& g : groups(*model)) {
    if (g.order == 0 || known.count(derivative_leaf(g.leaves[0]))) continue;
    const std::string name = fresh_name(used, "delta_" + g.name, "delta_" + g.name + "_");
    used.insert(name);
    const std::vector<Expr> d = new_variable_like(g, name);
    Block tie{VecX(static_cast<Index>(d.size())), column(d), ""};
    for (std::size_t i = 0; i < d.size(); ++i) {
      const Expr derivative = derivative_leaf(g.leaves[i]);
      tie.lhs[static_cast<Index>(i)] = derivative;
      known[derivative] = options.relations[derivative] = d[i];
    }
    options.trace.push_back("introduce the algebraic variable " + column_text(tie.rhs) + " = " +
                            column_text(tie.lhs));
    blocks.push_back(std::move(tie));
  }
  for (std::size_t b = 0; b < model->blocks.size(); ++b) {
    const Block& block = model->blocks[b];
    if (solved.whole[b])
      blocks.push_back(block);
    else
      blocks.push_back(
          {VecX::Zero(block.lhs.size()), mapped(block.rhs - block.lhs, known), block.note, block.rewritten});
  }
  return with_last_line(make_model(std::move(blocks), std::move(options)), [](const Model& m) {
    const std::size_t n = m.states().size(), z = m.algebraic().size();
    return text("x′ = f, 0 = g with n_x = ", n, ", n_z = ", z, ": g has ", m.residuals.size() - n,
                m.residuals.size() == n + z ? " rows, as many as there are algebraic variables" : " rows");
  });
}

}  // namespace pendula::dae
