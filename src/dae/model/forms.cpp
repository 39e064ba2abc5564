#include "dae/model/forms.hpp"

#include <algorithm>
#include <unordered_set>

#include "base/error.hpp"
#include "base/limits/stack.hpp"
#include "base/text.hpp"
#include "dae/model/derivation_markup.hpp"
#include "dae/model/equation_lines.hpp"
#include "dae/model/first_order.hpp"
#include "dae/model/lineage.hpp"
#include "dae/model/make_model.hpp"
#include "dae/model/model_key.hpp"
#include "dae/model/solved_rows.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// The entries of x, z or u. Throws Error naming an entry that is no variable or occurs twice.
std::vector<Expr> variables(const char* what, const VecX& v) {
  std::vector<Expr> list;
  std::unordered_set<Expr> known;
  for (Expr e : v) {
    const bool is_input = what[0] == 'u' && e.is_symbol() && symbol_of(e).kind == Kind::input;
    if (!is_input && (!e.is_symbol() || symbol_of(e).kind != Kind::variable))
      throw Error(text(what, " must be made of variables (var \"", what, "\"), got '", to_text(e), "'"));
    if (!known.insert(e).second) throw Error(text(what, " contains ", to_text(e), " twice"));
    list.push_back(e);
  }
  return list;
}

VecX derivative(const VecX& x) {
  return x.unaryExpr([](Expr e) { return derivative_leaf(e); });
}

/// The model declared as implicit, although its rows could be solved for x′.
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
  options.x = variables("x", x);
  options.z = variables("z", z);
  options.u = variables("u", u);
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
  options.x = variables("x", x);
  options.z = variables("z", z);
  options.u = variables("u", u);
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
  options.x = variables("x", x);
  options.u = variables("u", u);
  VecX right = A * x;
  if (B.size()) right += B * u;
  return make_model({{E * derivative(x), right, ""}}, std::move(options));
}

/// The model with a last line of its derivation that needs the finished model.
template <class Line>
static ModelPtr with_last_line(const ModelPtr& model, Line line) {
  auto copy = std::make_shared<Model>(*model);
  copy->trace.push_back(line(*model));
  return copy;
}

/// The counts "n_x = 2, n_z = 1, n_u = 1; F has m = 3 rows: …" that explain m = n_x + n_z.
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

/// left - right, as everywhere; for 0 = g it is g.
static VecX residual_of(const Block& b) {
  VecX residual = b.lhs - b.rhs;
  for (Index i = 0; i < residual.size(); ++i)
    if (b.lhs[i].is_zero()) residual[i] = b.rhs[i];
  return residual;
}

ModelPtr to_implicit(const ModelPtr& model) {
  ModelOptions options = child_of(model);
  options.trace.push_back("F(x′, x, z, u) = left side - right side of every equation, and g of 0 = g");
  std::vector<Block> blocks;
  for (const Block& b : model->blocks)
    blocks.push_back({VecX::Zero(b.lhs.size()), residual_of(b), b.note, b.rewritten});
  return with_last_line(as_implicit(make_model(std::move(blocks), std::move(options))),
                        [](const Model& m) { return counts(m); });
}

/// The usual name of a derivative: ω₁ for θ₁; v if it is the only one, else v_x.
static std::string velocity_name(const std::string& name, bool alone) {
  constexpr std::string_view angle = "theta";
  if (name.starts_with(angle)) return "omega" + name.substr(angle.size());
  return alone ? "v" : "v_" + name;
}

static ModelPtr made_first_order(const ModelPtr& model) {
  ModelOptions options = child_of(model);
  Substitution lower;
  std::vector<Block> blocks;
  auto used = used_names(*model);
  const auto list_of_groups = groups(*model);
  const bool alone = std::count_if(list_of_groups.begin(), list_of_groups.end(),
                                   [](const Group& g) { return g.order > 1; }) == 1;
  for (const Group& g : list_of_groups) {
    std::vector<Expr> below = g.leaves;
    for (int k = 1; k < g.order; ++k) {
      const std::string plain = g.name + "_dot" + (k > 1 ? std::to_string(k) : "");
      const std::string name = fresh_name(used, k == 1 ? velocity_name(g.name, alone) : plain, plain);
      used.insert(name);
      const std::vector<Expr> v = new_variable_like(g, name);
      Block tie{VecX(static_cast<Index>(v.size())), column(v), ""};
      for (std::size_t i = 0; i < v.size(); ++i) {
        tie.lhs[i] = derivative_leaf(below[i]);
        lower[derivative_leaf(g.leaves[i], k)] = v[i];
        if (k + 1 == g.order) lower[derivative_leaf(g.leaves[i], g.order)] = derivative_leaf(v[i]);
      }
      options.trace.push_back(text("Introduce ", formula(ref(tie.rhs), " = ", ref(tie.lhs)), "."));
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

ModelPtr to_first_order(const ModelPtr& model) {
  static PerModel<ModelPtr> known;
  return known.of(model, [&] { return made_first_order(model); });
}

/// The equations without derivatives with their original signs.
static std::vector<Block> algebraic_blocks(const Model& m) {
  const auto top = m.top_derivatives();
  const std::unordered_set<Expr> derivatives(top.begin(), top.end());
  std::vector<Block> list;
  for (const Block& b : m.blocks) {
    std::vector<Expr> sides(b.lhs.begin(), b.lhs.end());
    sides.insert(sides.end(), b.rhs.begin(), b.rhs.end());
    const auto inside = leaves(sides);
    if (std::none_of(inside.begin(), inside.end(), [&](Expr e) { return derivatives.count(e) > 0; }))
      list.push_back(b);
  }
  return list;
}

/// (a + b)/m as a/m + b/m.
static Expr distributed(Expr above, Expr below) {
  check_stack();
  switch (above.op()) {
    case Op::add:
      return distributed(above.operand(0), below) + distributed(above.operand(1), below);
    case Op::sub:
      return distributed(above.operand(0), below) - distributed(above.operand(1), below);
    case Op::neg:
      return -distributed(above.operand(0), below);
    default:
      return simplify(above / below);
  }
}

/// Splits the quotients of the right side into terms if that yields names of vectors: v′ = F/m - z p/m
/// - g e₃.
static Block by_terms(Block b) {
  if (b.lhs.size() == 1 || rows_per_line(b.lhs, b.rhs) > 1) return b;
  const VecX terms = b.rhs.unaryExpr([](Expr e) {
    if (e.op() == Op::div) return distributed(e.operand(0), e.operand(1));
    if (e.op() == Op::neg && e.operand(0).op() == Op::div)
      return -distributed(e.operand(0).operand(0), e.operand(0).operand(1));
    return e;
  });
  if (rows_per_line(b.lhs, terms) > 1) b.rhs = terms;
  return b;
}

/// x′ = f, 0 = g by rows, if every derivative has a row of its own and occurs in no other.
static std::optional<std::vector<Block>> solved_form(const Model& m) {
  const FirstOrder fo = first_order(m);
  if (!fo.semi_explicit) return {};
  std::unordered_map<Expr, Expr> f;
  for (std::size_t i = 0; i < fo.x.size(); ++i) f[fo.x[i]] = fo.f[i];
  std::vector<Block> blocks;
  for (const Group& g : groups(m)) {
    if (g.order == 0) continue;
    Block b{derivative(column(g.leaves)), VecX(static_cast<Index>(g.leaves.size())), ""};
    for (std::size_t i = 0; i < g.leaves.size(); ++i) b.rhs[i] = simplify(f.at(g.leaves[i]));
    blocks.push_back(by_terms(std::move(b)));
  }
  if (fo.g.empty()) return blocks;
  const auto written = algebraic_blocks(m);
  std::size_t rows = 0;
  for (const Block& b : written) rows += static_cast<std::size_t>(b.lhs.size());
  if (rows == fo.g.size())
    blocks.insert(blocks.end(), written.begin(), written.end());
  else
    blocks.push_back({VecX::Zero(static_cast<Index>(fo.g.size())), column(fo.g), ""});
  return blocks;
}

/// Blocks in which all rows are solved for a derivative, with these solutions.
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

/// Is every row already x′ = f or 0 = g?
static bool reads_semi_explicit(const Model& m) {
  const auto top = m.top_derivatives();
  const std::unordered_set<Expr> derivatives(top.begin(), top.end());
  for (const Block& b : m.blocks)
    for (Index i = 0; i < b.lhs.size(); ++i) {
      const Expr sides[] = {derivatives.count(b.lhs[i]) ? Expr(0) : b.lhs[i], b.rhs[i]};
      for (Expr leaf : leaves(sides))
        if (derivatives.count(leaf)) return false;
    }
  return true;
}

/// x′ = M⁻¹ r written out. The rows with derivatives must be few and linear in them with a regular matrix
/// M(x, t). Holds the rows and the matrix.
struct SolvedForDerivatives {
  std::vector<Block> blocks;
  MatX M;
};

static std::optional<SolvedForDerivatives> solved_for_derivatives(const Model& m) {
  constexpr Index largest = 4;  // size up to which a solution is a readable formula
  const auto top = m.top_derivatives();
  const std::unordered_set<Expr> derivatives(top.begin(), top.end());
  const auto has_derivative = [&](Expr e) {
    const auto inside = leaves({&e, 1});
    return std::any_of(inside.begin(), inside.end(), [&](Expr leaf) { return derivatives.count(leaf) > 0; });
  };
  std::vector<Expr> rows, g, coupled;
  Substitution known;
  for (const Solved& row : solved_rows(m))
    if (!has_derivative(row.f)) known[row.derivative] = row.f;
  for (Expr x : top)
    if (!known.count(x)) coupled.push_back(x);
  for (Expr residual : m.residuals) {
    if (!has_derivative(residual)) {
      g.push_back(residual);
      continue;
    }
    const Expr rest = substitute(residual, known);
    if (has_derivative(rest)) rows.push_back(rest);
  }
  const auto n = static_cast<Index>(coupled.size());
  if (n == 0 || n > largest || rows.size() != coupled.size()) return {};
  const MatX M = jacobian(rows, coupled).unaryExpr([](Expr e) { return simplify(e); });
  if (std::any_of(M.reshaped().begin(), M.reshaped().end(), has_derivative) || linalg::rank(M) < n) return {};
  Substitution none;
  for (Expr x : coupled) none[x] = Expr(0);
  const MatX solution = linalg::solve(M, -column(substitute(rows, none)));
  const VecX unknowns = column(coupled);
  for (Index i = 0; i < n; ++i) known[unknowns[i]] = simplify(solution(i, 0));
  SolvedForDerivatives result{{}, M};
  for (const Group& group : groups(m)) {
    if (group.order == 0) continue;
    Block b{derivative(column(group.leaves)), VecX(static_cast<Index>(group.leaves.size())), ""};
    for (Index i = 0; i < b.lhs.size(); ++i) b.rhs[i] = simplify(known.at(b.lhs[i]));
    result.blocks.push_back(std::move(b));
  }
  const auto written = algebraic_blocks(m);
  result.blocks.insert(result.blocks.end(), written.begin(), written.end());
  return result;
}

ModelPtr to_semi_explicit(const ModelPtr& given) {
  const ModelPtr model = to_first_order(given);
  if (model->kind == ModelKind::ode && reads_semi_explicit(*model)) return model;
  if (model->kind == ModelKind::semi_explicit && !model->mass_matrix && reads_semi_explicit(*model))
    return model;
  ModelOptions options = child_of(model);
  if (model->residuals.size() == model->variables.size())
    if (auto solved = solved_form(*model)) {
      options.trace.push_back("Solve each row for the derivative it contains: x′ = f, 0 = g");
      return make_model(std::move(*solved), std::move(options));
    }
  if (model->mass_matrix || (model->kind == ModelKind::implicit_ode && given->mechanics))
    if (auto solved = solved_for_derivatives(*model)) {
      options.trace.push_back("Solve the rows that contain derivatives for them:  " + formula("M x′ = r") +
                              "  with");
      options.trace.push_back("     " + formula("M = ", ref(solved->M)));
      return make_model(std::move(solved->blocks), std::move(options));
    }
  std::vector<Block> blocks;
  const SolvedBlocks solved = solved_blocks(*model);
  Substitution known = solved.derivative;  // for the other rows: x′ -> f where it is solved for, else x′ -> δ
  auto used = used_names(*model);
  for (const Group& g : groups(*model)) {
    if (g.order == 0 || known.count(derivative_leaf(g.leaves[0]))) continue;
    const std::string name = fresh_name(used, "delta_" + g.name, "delta_" + g.name + "_");
    used.insert(name);
    const std::vector<Expr> d = new_variable_like(g, name);
    Block tie{VecX(static_cast<Index>(d.size())), column(d), ""};
    for (std::size_t i = 0; i < d.size(); ++i) {
      const Expr derivative = derivative_leaf(g.leaves[i]);
      tie.lhs[i] = derivative;
      known[derivative] = options.relations[derivative] = d[i];
    }
    options.trace.push_back("Introduce the algebraic variable " + column_text(tie.rhs) + " = " +
                            column_text(tie.lhs));
    blocks.push_back(std::move(tie));
  }
  for (std::size_t b = 0; b < model->blocks.size(); ++b) {
    const Block& block = model->blocks[b];
    if (solved.whole[b])
      blocks.push_back(block);
    else
      blocks.push_back(
          {VecX::Zero(block.lhs.size()), mapped(residual_of(block), known), block.note, block.rewritten});
  }
  return with_last_line(make_model(std::move(blocks), std::move(options)), [](const Model& m) {
    const std::size_t n = m.states().size(), z = m.algebraic().size();
    return text("x′ = f, 0 = g with n_x = ", n, ", n_z = ", z, ": g has ", m.residuals.size() - n,
                m.residuals.size() == n + z ? " rows, as many as there are algebraic variables" : " rows");
  });
}

}  // namespace pendula::dae
