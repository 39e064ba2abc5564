#include "dae/pencil/pencil_shuffle.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/rank/modular.hpp"
#include "dae/rank/tracked_elimination.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

/// e x′ = a x + g
struct Row {
  std::string name;
  RationalMatrix e, a;
  Expr g;
  int origin, derivative;
  Combination of;
};

/// (a) … (z), (aa), (ab) …
std::string letters(int k) {
  std::string out;
  for (++k; k > 0; k = (k - 1) / 26) out.insert(out.begin(), static_cast<char>('a' + (k - 1) % 26));
  return "(" + out + ")";
}

Expr combination(const RationalMatrix& row, const std::vector<Expr>& x, int order) {
  Expr sum = 0;
  for (int j = 0; j < row.cols(); ++j)
    if (row(0, j) != 0) sum += Expr(row(0, j)) * derivative_leaf(x[j], order);
  return sum;
}

/// Divides by the common factor, so that the first coefficient is positive (of x′, or of x in a constraint).
void normalise(Row& r, bool divide) {
  mpq_class factor = primitive_factor(r.e.is_zero() ? r.a : r.e);
  if (!divide) factor = sgn(factor);
  if (factor == 1) return;
  r.e = factor * r.e;
  r.a = factor * r.a;
  r.g = simplify(Expr(factor) * r.g);
  for (auto& [equation, q] : r.of) q *= factor;
}

}  // namespace

void add_multiple(Combination& sum, const mpq_class& factor, const Combination& other) {
  for (const auto& [equation, q] : other)
    if (mpq_class& here = sum[equation]; (here += factor * q) == 0) sum.erase(equation);
}

namespace {

class Shuffling {
 public:
  Shuffling(const LinearForm& form, ShuffleScope scope)
      : form_(form), derives_(scope == ShuffleScope::derivation) {
    const VecX g = form.forcing();
    for (int i = 0; i < form.rows(); ++i) {
      Row r{letters(names_++), form.E.row(i), form.A.row(i), g[i], i, 0, {{{0, i}, 1}}};
      normalise(r, false);
      step(ShuffleStep::Kind::given, {}, r);
      active_.push_back(r);
    }
  }

  Shuffle run() {
    // A regular pencil ends after at most n rounds; a singular one yields a row 0 = g earlier.
    result_.regular = form_.rows() == form_.size();
    while (result_.regular) {
      const int rank = eliminate();
      result_.ranks.push_back(rank);
      if (rank == form_.size() || !result_.regular) break;
      differentiate();
      result_.regular = ++round_ <= form_.size();
    }
    if (result_.regular && derives_) solve();
    return std::move(result_);
  }

 private:
  void step(ShuffleStep::Kind kind, std::vector<Multiple> of, const Row& r) {
    if (!derives_) return;
    result_.steps.push_back({kind, round_, std::move(of), r.name, combination(r.e, form_.x, 1),
                             simplify(combination(r.a, form_.x, 0) + r.g)});
  }

  /// The multipliers y of the active rows, the newest row first.
  std::vector<Multiple> multiples(const std::vector<mpq_class>& y) const {
    std::vector<Multiple> list;
    int newest = -1;
    for (std::size_t i = 0; i < y.size(); ++i)
      if (y[i] != 0) newest = static_cast<int>(i);
    if (newest >= 0) list.push_back({y[newest], active_[newest].name});
    for (std::size_t i = 0; i < y.size(); ++i)
      if (y[i] != 0 && static_cast<int>(i) != newest) list.push_back({y[i], active_[i].name});
    return list;
  }

  Row combined(const std::vector<mpq_class>& y) const {
    Row sum{"", RationalMatrix(1, form_.size()), RationalMatrix(1, form_.size()), 0, -1, 0, {}};
    for (std::size_t i = 0; i < y.size(); ++i) {
      if (y[i] == 0) continue;
      sum.e = sum.e + y[i] * active_[i].e;
      sum.a = sum.a + y[i] * active_[i].a;
      sum.g += Expr(y[i]) * active_[i].g;
      add_multiple(sum.of, y[i], active_[i].of);
    }
    sum.g = simplify(sum.g);
    return sum;
  }

  /// Full rank modulo a prime is full rank; found without fractions, which grow with every row.
  bool is_regular() const {
    constexpr int many = 20;
    const int n = form_.size();
    if (n < many) return false;
    std::vector<Entry> entries;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (active_[i].e(0, j) != 0) entries.push_back({i, j, Expr(active_[i].e(0, j))});
    return modular_rank(entries, n, n).rank == n;
  }

  /// Marks every active row whose e depends on earlier ones and replaces it by the remaining constraint.
  int eliminate() {
    const int n = form_.size();
    dependent_.clear();
    if (is_regular()) return n;
    // Independent rows so far, in echelon form, each with the combination of active rows that yields it.
    std::vector<std::pair<RationalMatrix, std::vector<mpq_class>>> echelon;
    std::vector<std::vector<mpq_class>> combinations;
    for (std::size_t i = 0; i < active_.size(); ++i) {
      RationalMatrix e = active_[i].e;
      std::vector<mpq_class> y(active_.size());
      y[i] = 1;
      for (const auto& [row, z] : echelon) {
        int pivot = 0;
        while (row(0, pivot) == 0) ++pivot;
        if (e(0, pivot) == 0) continue;
        const mpq_class factor = e(0, pivot) / row(0, pivot);
        e = e - factor * row;
        for (std::size_t k = 0; k < y.size(); ++k) y[k] -= factor * z[k];
      }
      if (!e.is_zero()) {
        echelon.emplace_back(e, y);
        continue;
      }
      dependent_.push_back(i);
      combinations.push_back(whole(y, i));
    }
    std::vector<Row> replaced;
    for (std::size_t k = 0; k < dependent_.size(); ++k) {
      Row r = combined(combinations[k]);
      const Row& old = active_[dependent_[k]];
      PENDULA_ASSERT(r.e.is_zero(), "a combination of dependent rows keeps derivatives");
      if (r.a.is_zero()) {
        result_.regular = false;
        return n;
      }
      r.name = old.name;
      r.origin = old.origin;
      r.derivative = old.derivative;
      normalise(r, true);
      step(ShuffleStep::Kind::combination, multiples(combinations[k]), r);
      result_.constraints.push_back({r.a, r.g, r.origin, r.derivative, r.of});
      replaced.push_back(std::move(r));
    }
    for (std::size_t k = 0; k < dependent_.size(); ++k) active_[dependent_[k]] = std::move(replaced[k]);
    return n - static_cast<int>(dependent_.size());
  }

  /// Coprime integers, positive for row i.
  static std::vector<mpq_class> whole(std::vector<mpq_class> y, std::size_t i) {
    RationalMatrix row(1, static_cast<int>(y.size()));
    for (std::size_t k = 0; k < y.size(); ++k) row(0, static_cast<int>(k)) = y[k];
    mpq_class factor = primitive_factor(row);
    if (sgn(factor) * sgn(y[i]) < 0) factor = -factor;
    for (mpq_class& q : y) q *= factor;
    return y;
  }

  /// Differentiates the constraints 0 = a x + g; they become the newest active rows a x′ + g′ = 0.
  void differentiate() {
    std::vector<Row> next;
    for (std::size_t i = 0; i < active_.size(); ++i)
      if (std::find(dependent_.begin(), dependent_.end(), i) == dependent_.end()) next.push_back(active_[i]);
    for (std::size_t i : dependent_) {
      const Row& old = active_[i];
      Row r{letters(names_++),
            old.a,
            RationalMatrix(1, form_.size()),
            simplify(-total_derivative(old.g)),
            old.origin,
            old.derivative + 1,
            {}};
      // As a residual e x′ - a x - g the constraint is -(a x + g); its derivative as a row has
      // the opposite sign.
      for (const auto& [equation, q] : old.of) r.of[{equation.first + 1, equation.second}] = -q;
      step(ShuffleStep::Kind::differentiation, {{1, old.name}}, r);
      next.push_back(std::move(r));
    }
    active_ = std::move(next);
  }

  /// x_j′ for the states that the constraints leave free, from the rows that are active at the end.
  void solve() {
    const int n = form_.size(), count = static_cast<int>(result_.constraints.size());
    // The constraints are solved for algebraic variables first, then for the last states.
    std::vector<int> order;
    for (int pass = 0; pass < 2; ++pass)
      for (int j = n - 1; j >= 0; --j)
        if (form_.E.columns(j, 1).is_zero() == (pass == 0)) order.push_back(j);
    RationalMatrix c(count, n);
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < n; ++j) c(i, j) = result_.constraints[i].a(0, order[j]);
    const Reduced r = reduced(c);
    PENDULA_ASSERT(static_cast<int>(r.pivots.size()) == count,
                   "the constraints of a shuffle depend on each other");
    std::vector<bool> solved(static_cast<std::size_t>(n));
    for (int p : r.pivots) solved[order[p]] = true;
    RationalMatrix e(0, n);
    for (const Row& row : active_) {
      RationalMatrix grown(e.rows() + 1, n);
      grown.set(0, 0, e);
      grown.set(e.rows(), 0, row.e);
      e = std::move(grown);
    }
    const auto back = inverse(e);
    PENDULA_ASSERT(back.has_value(), "E is singular at the end of a shuffle");
    for (int j = 0; j < n; ++j)
      if (!solved[j]) keep(j, *back);
    for (const auto& k : result_.constraints)
      result_.explicit_form.emplace_back(Expr(0), simplify(combination(k.a, form_.x, 0) + k.g));
  }

  void keep(int j, const RationalMatrix& back) {
    result_.differential.push_back(j);
    const RationalMatrix row = back.row(j);
    std::vector<mpq_class> y;
    for (int i = 0; i < row.cols(); ++i) y.push_back(row(0, i));
    const mpq_class scale = abs(primitive_factor(row));
    for (mpq_class& q : y) q *= scale;
    Row r = combined(y);
    if (multiples(y).size() > 1) step(ShuffleStep::Kind::solved, multiples(y), r);
    const Expr right = simplify((combination(r.a, form_.x, 0) + r.g) / Expr(scale));
    result_.explicit_form.emplace_back(derivative_leaf(form_.x[j]), right);
  }

  const LinearForm& form_;
  const bool derives_;  ///< steps and the semi-explicit form
  std::vector<Row> active_;
  std::vector<std::size_t> dependent_;  // active rows that are constraints in this round
  int names_ = 0, round_ = 0;
  Shuffle result_;
};

std::string combination_text(const std::vector<Multiple>& of) {
  std::string out;
  for (const Multiple& m : of) {
    const mpq_class size = abs(m.factor);
    const std::string factor = size == 1 ? "" : to_text(Expr(size)) + " ";
    const char* sign = m.factor < 0 ? (out.empty() ? "-" : " - ") : (out.empty() ? "" : " + ");
    out += sign + factor + m.name;
  }
  return out;
}

std::string equation(Expr lhs, Expr rhs) { return to_text(lhs) + " = " + to_text(rhs); }

std::vector<std::string> cells(const ShuffleStep& step) {
  const std::string what = equation(step.lhs, step.rhs);
  switch (step.kind) {
    case ShuffleStep::Kind::given:
      return {step.name, what};
    case ShuffleStep::Kind::differentiation:
      return {"differentiate " + step.of[0].name + ":", what, step.name};
    case ShuffleStep::Kind::combination:
      if (step.of.size() == 1) return {step.name + " has no derivative:", what};
      return {combination_text(step.of) + ":", what, "the new " + step.name};
    case ShuffleStep::Kind::solved:
      break;
  }
  return {combination_text(step.of) + ":", what};
}

}  // namespace

Shuffle shuffle(const LinearForm& form, ShuffleScope scope) { return Shuffling(form, scope).run(); }

std::string describe(const Shuffle& s, const LinearForm& form) {
  std::string out;
  auto step = s.steps.begin();
  const auto section = [&](auto belongs) {
    Table table;
    for (; step != s.steps.end() && belongs(*step); ++step) table.row(cells(*step));
    out += table.str(2);
  };
  section([](const ShuffleStep& x) { return x.kind == ShuffleStep::Kind::given; });
  for (int round = 0; round <= s.rounds(); ++round) {
    out += text("E has rank ", s.ranks[round], " of ", form.size());
    if (round == s.rounds())
      out +=
          text(": regular after ", round, round == 1 ? " shuffle" : " shuffles", ", so the index is ", round);
    out += "\n";
    section([&](const ShuffleStep& x) { return x.round == round; });
  }
  out += "Semi-explicit form:\n";
  for (const auto& [lhs, rhs] : s.explicit_form) out += "  " + equation(lhs, rhs) + "\n";
  return out.substr(0, out.size() - 1);
}

}  // namespace pendula::dae
