#include "lti/linearize.hpp"

#include <algorithm>
#include <cmath>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/model/lineage.hpp"
#include "dae/pencil/pencil.hpp"
#include "dae/reduce/reduce.hpp"
#include "expr/linalg/linalg.hpp"
#include "expr/print/print.hpp"

namespace pendula::lti {
namespace {

constexpr int most_pencil = 60;      // unknowns up to which elimination is exact: a choice, as numbers grow
constexpr double dependent = 1e-11;  // of the first pivot: rounding leaves n ε

/// Replaces a computed value, accurate to the tolerance of the start (1e-10), by a short decimal nearby if
/// there is one.
Expr snapped(double v, double scale) {
  constexpr double rounding = 1e-14;  // 45 ε of the largest value
  if (std::fabs(v) <= rounding * scale) return 0;
  constexpr int known = 12, typed = 8;  // digits: of a value at the tolerance; of numbers that people write
  const std::string digits = pendula::rounded(v, known);
  const auto significant =
      std::count_if(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  return significant <= typed ? parse_number(digits) : Expr(v);
}

/// The values of all leaves of the model at the start.
class Point {
 public:
  Point(const dae::Model& model, const dae::ConsistentState& at) {
    double scale = 1;
    for (const auto& [leaf, v] : at.values) scale = std::max(scale, std::fabs(v));
    for (const auto& [leaf, v] : at.values) values_[leaf] = snapped(v, scale);
    for (const dae::LedgerRow& row : at.rows)
      if (row.origin == dae::Origin::fixed) values_[row.leaf] = Expr(row.value);
    constexpr double last_bits = 1e-15;  // 4.5 ε: the parameter was used as it is
    for (const auto& [p, v] : model.values) {
      const auto used = at.values.find(p);
      if (used == at.values.end() ||
          std::fabs(number(v) - used->second) <= last_bits * std::fabs(used->second))
        values_[p] = v;
    }
    values_[time_symbol()] = Expr(at.t);
    for (Expr s : model.states())
      if (const auto v = values_.find(derivative_leaf(s)); v != values_.end())
        motion_ = std::max(motion_, std::fabs(number(v->second)));
    motion_ /= scale;
  }
  /// Starts are solved to 10⁻¹⁰ of the values; x′ may be 100 times as uncertain.
  bool at_rest() const { return motion_ <= 1e-8; }

  /// Evaluates entries at the point.
  std::vector<Expr> operator()(const std::vector<Expr>& list) const {
    std::vector<Expr> out = substitute(list, values_);
    for (Expr& e : out)
      if (!e.is_constant()) e = constant(e);
    return out;
  }

 private:
  Expr constant(Expr e) const {
    for (Expr leaf : leaves({&e, 1})) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind == Kind::parameter)
        throw Error(
            text("the parameter '", s.name, "' has no value; give it one with sys:with{ ", s.name, " = 1 }"));
      if (s.kind != Kind::constant) throw Error(text("the start has no value for '", to_text(leaf), "'"));
    }
    const double v = evaluate({&e, 1}, {})[0];
    if (!std::isfinite(v)) throw Failure("a derivative of the model is not finite at this point");
    return Expr(v);
  }
  Substitution values_;
  double motion_ = 0;
};

/// ∂(F, h) by groups of leaves; rows: equations, then outputs.
struct Expansion {
  std::vector<Expr> states, top, algebraic, inputs;
  MatX by_state, by_top, by_algebraic, by_input;
  int equations = 0, outputs = 0;
  bool explicit_time = false;
};

void check_inputs(const dae::Model& model, const std::vector<Expr>& inputs) {
  std::vector<std::string> names;
  for (Expr u : model.inputs) names.push_back(symbol_of(u).name);
  for (Expr u : inputs) {
    const Symbol& s = symbol_of(u);
    const bool known =
        std::find(model.inputs.begin(), model.inputs.end(), s.base) != model.inputs.end() ||
        std::find(model.parameters.begin(), model.parameters.end(), u) != model.parameters.end();
    if (!known)
      throw Error(text("'", to_text(u), "' is neither an input nor a parameter of the model.",
                       did_you_mean(s.name, names),
                       names.empty() ? "" : " (inputs: " + join(names, ", ") + ")"));
  }
}

Expansion expand(const dae::Model& model, const Point& point, const std::vector<Expr>& inputs,
                 const std::vector<Expr>& outputs) {
  Expansion x;
  x.states = model.states();
  x.top = model.top_derivatives();
  x.algebraic = model.algebraic();
  x.inputs = inputs;
  x.equations = static_cast<int>(model.residuals.size());
  x.outputs = static_cast<int>(outputs.size());
  std::vector<Expr> all = model.residuals;
  all.insert(all.end(), outputs.begin(), outputs.end());
  // Derivatives of inputs that occur in the model are separate inputs.
  for (Expr leaf : leaves(all))
    if (symbol_of(leaf).order > 0 &&
        std::find(inputs.begin(), inputs.end(), symbol_of(leaf).base) != inputs.end() &&
        std::find(x.inputs.begin(), x.inputs.end(), leaf) == x.inputs.end())
      x.inputs.push_back(leaf);
  std::vector<Expr> columns;
  for (const auto* list : {&x.states, &x.top, &x.algebraic, &x.inputs})
    columns.insert(columns.end(), list->begin(), list->end());
  columns.push_back(time_symbol());
  for (std::size_t k = 0; k < outputs.size(); ++k)
    for (Expr leaf : leaves({&outputs[k], 1})) {
      const Symbol& s = symbol_of(leaf);
      if (s.kind == Kind::variable && std::find(columns.begin(), columns.end(), leaf) == columns.end())
        throw Error(text("the output ", to_text(outputs[k]), " contains '", to_text(leaf),
                         "', which is not an unknown of the model"));
    }
  const auto entries = sparse_jacobian(all, columns);
  std::vector<Expr> values;
  for (const Entry& e : entries) values.push_back(e.value);
  values = point(values);
  const auto rows = static_cast<Index>(all.size());
  MatX J = MatX::Zero(rows, static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < entries.size(); ++k) J(entries[k].row, entries[k].column) = values[k];
  Index first = 0;
  const auto take = [&](const std::vector<Expr>& list) {
    const auto n = static_cast<Index>(list.size());
    first += n;
    return MatX(J.middleCols(first - n, n));
  };
  x.by_state = take(x.states);
  x.by_top = take(x.top);
  x.by_algebraic = take(x.algebraic);
  x.by_input = take(x.inputs);
  for (Index i = 0; i < rows; ++i) x.explicit_time = x.explicit_time || !J(i, J.cols() - 1).is_zero();
  return x;
}

/// Is a matrix of doubles regular after equilibration?
bool regular(const MatX& m) {
  if (m.rows() == 0) return true;
  if (field(m) == Field::exact && m.rows() <= most_pencil)
    return linalg::rank(m) == static_cast<int>(m.rows());
  Mat a = numbers(m);
  for (Index i = 0; i < a.rows(); ++i)
    if (const double size = a.row(i).lpNorm<Eigen::Infinity>(); size > 0) a.row(i) /= size;
  for (Index j = 0; j < a.cols(); ++j)
    if (const double size = a.col(j).lpNorm<Eigen::Infinity>(); size > 0) a.col(j) /= size;
  Eigen::FullPivLU<Mat> lu(a);
  lu.setThreshold(dependent);
  return lu.rank() == a.rows();
}

/// Index ≤ 1: δ(x′, z) = -[∂F/∂(x′, z)]⁻¹ (∂F/∂x δx + ∂F/∂u δu).
System solved(const Expansion& x) {
  const auto n = static_cast<Index>(x.states.size()), d = static_cast<Index>(x.top.size()),
             m = static_cast<Index>(x.inputs.size());
  const MatX G = hstack(x.by_top, x.by_algebraic);
  const MatX right = hstack(x.by_state, x.by_input);
  const auto P = solve(G.topRows(x.equations), scaled(-1, right.topRows(x.equations)));
  if (!P) throw Error("the linearised equations cannot be solved for x′ and z at this point");
  MatX A = MatX::Zero(n, n), B = MatX::Zero(n, m);
  for (Index i = 0; i < n; ++i) {
    const Expr next = derivative_leaf(x.states[i]);
    const auto state = std::find(x.states.begin(), x.states.end(), next);
    if (state != x.states.end()) {
      A(i, state - x.states.begin()) = 1;
      continue;
    }
    const auto top = std::find(x.top.begin(), x.top.end(), next) - x.top.begin();
    PENDULA_ASSERT(top < d, "a state without derivative");
    A.row(i) = P->row(top).head(n);
    B.row(i) = P->row(top).tail(m);
  }
  const MatX h = product(G.bottomRows(x.outputs), *P) + right.bottomRows(x.outputs);
  System g = make_ss(A, B, h.leftCols(n), h.rightCols(m));
  for (Expr s : x.states) g.state_names.push_back(to_text(s));
  return g;
}

/// E w′ = A w + B u for w = (states, z, y): ties, equations, outputs.
dae::LinearForm linear_form(const Expansion& x) {
  const int n = static_cast<int>(x.states.size()), nz = static_cast<int>(x.algebraic.size()),
            m = static_cast<int>(x.inputs.size());
  const int size = n + nz + x.outputs, ties = n - static_cast<int>(x.top.size()),
            rows = ties + x.equations + x.outputs;
  dae::LinearForm f;
  f.E = f.A = dae::RationalMatrix(rows, size);
  f.B = dae::RationalMatrix(rows, m);
  const auto column_of = [&](Expr leaf) {
    return static_cast<int>(std::find(x.states.begin(), x.states.end(), leaf) - x.states.begin());
  };
  int row = 0;
  for (int i = 0; i < n; ++i)
    if (const int next = column_of(derivative_leaf(x.states[i])); next < n) {
      f.E(row, i) = 1;
      f.A(row++, next) = 1;
    }
  PENDULA_ASSERT(row == ties, "states and their derivatives do not tie up");
  std::vector<int> lower;  // the state whose derivative is top[k]
  for (Expr top : x.top) {
    const Symbol& s = symbol_of(top);
    lower.push_back(column_of(s.order == 1 ? s.base : derivative_leaf(s.base, s.order - 1)));
  }
  const auto bt = rational(x.by_top), bs = rational(x.by_state), bz = rational(x.by_algebraic),
             bu = rational(x.by_input);
  for (int i = 0; i < x.equations + x.outputs; ++i, ++row) {
    for (std::size_t k = 0; k < lower.size(); ++k) f.E(row, lower[k]) += bt(i, static_cast<int>(k));
    for (int j = 0; j < n; ++j) f.A(row, j) = -bs(i, j);
    for (int j = 0; j < nz; ++j) f.A(row, n + j) = -bz(i, j);
    for (int j = 0; j < m; ++j) f.B(row, j) = -bu(i, j);
    if (i >= x.equations) f.A(row, n + nz + i - x.equations) = 1;
  }
  f.x = x.states;
  f.x.insert(f.x.end(), x.algebraic.begin(), x.algebraic.end());
  const auto extra = symbol_vector(Kind::variable, "y_linearized", x.outputs);
  f.x.insert(f.x.end(), extra.begin(), extra.end());
  f.f = VecX::Zero(rows);
  for (int i = 0; i < rows; ++i) {
    f.origin.push_back(std::pair(i, 0));
    f.label.push_back(text("(", i + 1, ")"));
  }
  return f;
}

/// Independent rows of t (one per state), in their order, with the states in `first` preferred.
std::vector<int> independent_rows(const Mat& t, int states, const std::vector<bool>& first) {
  const Index k = t.cols();
  Mat basis(0, k);
  std::vector<int> chosen;
  for (const bool wanted : {true, false})
    for (int i = 0; i < states && static_cast<Index>(chosen.size()) < k; ++i) {
      if (first[i] != wanted) continue;
      Eigen::RowVectorXd r = t.row(i);
      const double size = r.norm();
      if (size == 0) continue;
      for (int pass = 0; pass < 2; ++pass) r -= (r * basis.transpose()) * basis;
      constexpr double dependent_row = 1e-7;  // keeps half of the digits of the new coordinates
      if (r.norm() <= dependent_row * size) continue;
      basis.conservativeResize(basis.rows() + 1, k);
      basis.bottomRows(1) = r.normalized();
      chosen.push_back(i);
    }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

dae::RationalMatrix rows_of(const dae::RationalMatrix& m, const std::vector<int>& rows) {
  dae::RationalMatrix out(static_cast<int>(rows.size()), m.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) out.set(static_cast<int>(i), 0, m.row(rows[i]));
  return out;
}

/// The slow part of the pencil, in coordinates that are variables of the model.
System by_pencil(const Expansion& x, const std::vector<Expr>& outputs) {
  const dae::LinearForm form = linear_form(x);
  if (form.size() > most_pencil)
    throw Error(text("a model of higher index with ", form.size(), " unknowns is too large here (at most ",
                     most_pencil, "); linearise sys:reduce(\"ode\") or sys:reduce(\"minimal\")"));
  const dae::Pencil p = dae::pencil(form);
  if (!p.regular)
    throw Error(
        "the linearisation at this point is singular: it does not determine a motion for every start; "
        "sys:structure() says where");
  const int k = p.dof, rest = form.size() - k, n = static_cast<int>(x.states.size()),
            y = form.size() - x.outputs;
  const dae::RationalMatrix SB = p.S * form.B, fast = SB.block(k, 0, rest, SB.cols());
  const dae::RationalMatrix T1 = p.T.columns(0, k), T2 = p.T.columns(k, rest);
  // x₂ = -Σ Nⁱ (S B)₂ u⁽ⁱ⁾
  std::vector<dae::RationalMatrix> jumps;
  dae::RationalMatrix power = fast;
  for (int i = 0; i < std::max(1, p.index); ++i, power = p.N * power) jumps.push_back(T2 * power);
  std::vector<bool> smooth(static_cast<std::size_t>(n), true);
  for (int i = 0; i < n; ++i)
    for (const auto& jump : jumps) smooth[i] = smooth[i] && jump.row(i).is_zero();
  for (int i = 0; i < x.outputs; ++i)
    for (std::size_t d = 1; d < jumps.size(); ++d)
      if (!jumps[d].row(y + i).is_zero())
        throw Error(text(
            "the output ", to_text(outputs[i]),
            " depends on derivatives of the input: the system is not proper; choose outputs that do not"));
  const std::vector<int> rows = independent_rows(numbers(dae::expressions(T1)), n, smooth);
  if (static_cast<int>(rows.size()) != k)
    throw Error("the variables of the model do not determine its linearisation");
  const dae::RationalMatrix R = rows_of(T1, rows);
  const auto back = dae::inverse(R);
  if (!back) throw Error("the variables of the model do not determine its linearisation");
  const dae::RationalMatrix A = R * p.J * *back, B = R * SB.block(0, 0, k, SB.cols()),
                            C = T1.block(y, 0, x.outputs, k) * *back;
  System g = make_ss(dae::expressions(A), dae::expressions(B), dae::expressions(C),
                     dae::expressions(mpq_class(-1) * jumps[0].block(y, 0, x.outputs, SB.cols())));
  const bool exact = common(common(field(x.by_state), field(x.by_top)),
                            common(field(x.by_algebraic), field(x.by_input))) == Field::exact;
  if (!exact)
    for (MatX* m : {&g.ss.A, &g.ss.B, &g.ss.C, &g.ss.D}) {
      const Mat v = numbers(*m);
      constexpr double rounding = 1e-13;  // 450 ε of the largest entry
      const double noise = v.size() ? rounding * v.lpNorm<Eigen::Infinity>() : 0;
      *m = expressions(Mat(v.unaryExpr([&](double e) { return std::fabs(e) <= noise ? 0.0 : e; })));
    }
  std::vector<std::string> moved;
  for (int i : rows) {
    g.state_names.push_back(to_text(x.states[i]));
    if (!smooth[i]) moved.push_back(g.state_names.back());
  }
  g.notes.push_back(text("index ", p.index, ": ", k, k == 1 ? " state" : " states", " of ", n,
                         " variables move freely; the others follow from the constraints"));
  if (!moved.empty()) g.notes.push_back("without the parts that jump with the inputs: " + join(moved, ", "));
  return g;
}

dae::ConsistentStatePtr start_of_relative(const dae::ModelPtr& low, const dae::ConsistentState& at) {
  dae::StartRequest request;
  request.t = at.t;
  request.keep_invariants = false;
  for (Expr leaf : low->states())
    if (const auto v = at.value_for(*low, leaf)) request.fix.push_back({leaf, *v});
  for (Expr leaf : low->algebraic())
    if (const auto v = at.value_for(*low, leaf)) request.guess.push_back({leaf, *v});
  for (Expr u : low->inputs)
    for (int order = 0; order < 4; ++order)
      if (const auto it = at.values.find(derivative_leaf(u, order)); it != at.values.end())
        request.inputs[derivative_leaf(u, order)] = Expr(it->second);
  for (Expr p : low->parameters)
    if (const auto it = at.values.find(p); it != at.values.end()) request.parameters[p] = Expr(it->second);
  return dae::init(low, request);
}

/// A basis of the kernel of the constraints' Jacobian J (states in columns).
MatX tangent(const MatX& J, int n) {
  if (J.rows() == 0) return MatX::Identity(n, n);
  if (field(J) == Field::exact && n <= most_pencil) return dae::expressions(dae::kernel(rational(J)));
  Eigen::FullPivLU<Mat> lu(numbers(J));
  lu.setThreshold(dependent);
  return expressions(Mat(lu.kernel()));
}

/// Away from rest, uses the form "acc" x′ = f(x), whose solutions stay on 0 = C(x). Deviations are tangent to
/// it, δx = V δξ with some of the variables as ξ, and δξ′ follows from the rows of f for these variables.
System along_trajectory(const dae::ModelPtr& model, const dae::ConsistentState& at,
                        const LinearizeRequest& request) {
  // the rows of a form "array" that was made elsewhere may be singular here, and so would be a form of them
  const dae::ModelPtr low = dae::reduce(dae::original(model), "acc");
  const dae::ConsistentStatePtr start = start_of_relative(low, at);
  LinearizeRequest again = request;
  if (again.inputs.empty()) again.inputs = model->inputs;
  System g = linearize(low, *start, again);
  const std::vector<Expr> states = low->states();
  std::vector<Expr> conditions, columns = states;
  for (const dae::Constraint& c : low->invariants) conditions.push_back(c.residual);
  columns.insert(columns.end(), again.inputs.begin(), again.inputs.end());
  const auto entries = sparse_jacobian(conditions, columns);
  std::vector<Expr> values;
  for (const Entry& e : entries) values.push_back(e.value);
  values = Point(*low, *start)(values);
  const int n = static_cast<int>(states.size());
  MatX J = MatX::Zero(static_cast<Index>(conditions.size()), n);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    if (entries[k].column < n)
      J(entries[k].row, entries[k].column) = values[k];
    else if (!values[k].is_zero())
      throw Error(text("away from an equilibrium a constraint that depends on the input ",
                       to_text(columns[entries[k].column]), " has no state space here; linearise at rest"));
  }
  MatX V = tangent(J, n);
  const std::vector<int> rows = independent_rows(numbers(V), n, std::vector<bool>(states.size(), true));
  const auto k = static_cast<Index>(rows.size());
  if (k != V.cols()) throw Error("the variables of the model do not determine its linearisation");
  MatX R(k, k), A(k, n), B(k, g.inputs);
  for (Index i = 0; i < k; ++i) R.row(i) = V.row(rows[i]);
  V = product(V, *solve(R, MatX::Identity(k, k)));
  std::vector<std::string> names;
  for (Index i = 0; i < k; ++i) {
    const int row = rows[i];
    A.row(i) = g.ss.A.row(row);
    B.row(i) = g.ss.B.row(row);
    names.push_back(g.state_names[row]);
  }
  System h = make_ss(tidy(product(A, V)), B,
                     request.outputs.empty() ? MatX(MatX::Identity(k, k)) : tidy(product(g.ss.C, V)),
                     request.outputs.empty() ? MatX(MatX::Zero(k, g.inputs)) : g.ss.D);
  h.state_names = names;
  h.input_names = g.input_names;
  h.output_names = request.outputs.empty() ? names : g.output_names;
  h.notes = g.notes;
  h.notes.insert(h.notes.begin(), text(k, k == 1 ? " state" : " states", " of ", n,
                                       " variables move freely; the others follow from the constraints"));
  return h;
}

}  // namespace

System linearize(const dae::ModelPtr& model, const dae::ConsistentState& at,
                 const LinearizeRequest& request) {
  const std::vector<Expr> inputs = request.inputs.empty() ? model->inputs : request.inputs;
  check_inputs(*model, inputs);
  const Point point(*model, at);
  std::vector<Expr> outputs;
  for (Expr e : request.outputs) outputs.push_back(dae::resolve(*model, e));
  Expansion x = expand(*model, point, inputs, outputs);
  if (x.equations != static_cast<int>(x.top.size() + x.algebraic.size()))
    throw Error(text("the model has ", x.equations, " equations for ", x.top.size() + x.algebraic.size(),
                     " unknowns; sys:structure() names the parts that are over- and under-determined"));
  const bool direct = regular(hstack(x.by_top, x.by_algebraic).topRows(x.equations));
  if (!direct && !point.at_rest()) return along_trajectory(model, at, request);
  System g = direct ? solved(x) : by_pencil(x, outputs);
  for (Expr u : x.inputs) g.input_names.push_back(to_text(u));
  g.output_names = request.output_names;
  if (request.outputs.empty()) {  // the states themselves
    const int n = g.ss.order();
    g.ss.C = MatX::Identity(n, n);
    g.ss.D = MatX::Zero(n, g.inputs);
    g.outputs = n;
    g.output_names = g.state_names;
  } else if (g.output_names.empty()) {
    for (Expr e : request.outputs) g.output_names.push_back(to_text(e));
  }
  if (x.inputs.size() > inputs.size())
    g.notes.push_back("derivatives of inputs count as inputs of their own");
  if (!point.at_rest())
    g.notes.push_back(text("no equilibrium: deviations from the trajectory at t = ",
                           pendula::rounded(at.t, 6), ", frozen there"));
  else if (x.explicit_time)
    g.notes.push_back(text("the equations depend on t, which is frozen at ", pendula::rounded(at.t, 6)));
  return g;
}

}  // namespace pendula::lti
