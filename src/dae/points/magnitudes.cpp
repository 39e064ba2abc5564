#include "dae/points/magnitudes.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "expr/graph/derivative.hpp"

namespace pendula::dae {
namespace {

using Index = Eigen::Index;

/// log |e| = constant + Σ coefficient · log s_j; nothing where the size is not known (a factor 0).
struct Form {
  std::map<Index, double> slope;
  double constant = 0;

  void add(double factor, const Form& other) {
    for (const auto& [j, c] : other.slope) slope[j] += factor * c;
    constant += factor * other.constant;
  }
};
using Size = std::optional<Form>;

class Magnitude {
 public:
  Magnitude(const std::vector<Expr>& unknowns, const std::unordered_map<Expr, double>& known)
      : known_(known) {
    for (std::size_t j = 0; j < unknowns.size(); ++j) column_[unknowns[j]] = static_cast<Index>(j);
  }

  std::vector<Form> equations;  ///< each should be 0

  void visit(const std::vector<Expr>& rows, std::size_t equations_among_them) {
    for (Expr e : topological(rows)) size_[e] = size(e);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      terms_of(rows[i], row_terms_.emplace_back());
      if (i < equations_among_them) balance(row_terms_.back());
    }
  }

  /// The largest term of row i.
  double row_unit(std::size_t i, const Vec& log_unit) const {
    double largest = -INFINITY;
    for (const Form& term : row_terms_[i]) {
      double value = term.constant;
      for (const auto& [j, c] : term.slope) value += c * log_unit[j];
      largest = std::max(largest, value);
    }
    return std::isfinite(largest) ? std::exp(largest) : 1;
  }

 private:
  static Size number(double value) {
    if (value == 0 || !std::isfinite(value)) return {};
    return Form{{}, std::log(std::fabs(value))};
  }

  void terms_of(Expr e, std::vector<Form>& out) {
    std::vector<Expr> open{e};
    constexpr std::size_t most_terms = 20000;  // a sum that shares its parts may have any number of them
    while (!open.empty() && out.size() < most_terms) {
      const Expr next = open.back();
      open.pop_back();
      if (next.op() == Op::add || next.op() == Op::sub) {
        open.push_back(next.operand(1));
        open.push_back(next.operand(0));
      } else if (next.op() == Op::neg) {
        open.push_back(next.operand(0));
      } else if (const Size& s = size_.at(next)) {
        out.push_back(*s);
      }
    }
    drop_negligible(out);
  }

  /// Without terms in the same unknowns as another one that are 10¹⁰ times smaller: cos(π/2) = 6e-17 of a sum with sin x
  /// says nothing about sizes.
  static void drop_negligible(std::vector<Form>& terms) {
    constexpr double negligible = 23;  // log 10¹⁰
    const auto smaller = [](const Form& a, const Form& b) { return a.constant < b.constant; };
    const auto [least, most] = std::minmax_element(terms.begin(), terms.end(), smaller);
    if (terms.empty() || most->constant - least->constant < negligible) return;
    std::map<std::map<Index, double>, double> largest;
    for (const Form& term : terms) {
      const auto [it, is_new] = largest.try_emplace(term.slope, term.constant);
      if (!is_new) it->second = std::max(it->second, term.constant);
    }
    std::erase_if(terms,
                  [&](const Form& term) { return term.constant < largest.at(term.slope) - negligible; });
  }

  static Form mean(const std::vector<Form>& terms) {
    Form m;
    for (const Form& term : terms) m.add(1.0 / static_cast<double>(terms.size()), term);
    return m;
  }

  void balance(const std::vector<Form>& terms) {
    if (terms.size() < 2) return;
    constexpr std::size_t most = 64;  // a sum of thousands of terms would couple all of them with all
    const Form m = terms.size() <= most ? mean(terms) : terms[0];
    for (const Form& term : terms) {
      Form e = term;
      e.add(-1, m);
      equations.push_back(std::move(e));
    }
  }

  Size sum(Expr e) {
    std::vector<Form> terms;
    terms_of(e, terms);
    if (terms.empty()) return {};
    balance(terms);
    return terms.size() <= 64 ? mean(terms) : terms[0];
  }

  Size leaf(Expr e) const {
    if (const auto j = column_.find(e); j != column_.end()) return Form{{{j->second, 1}}, 0};
    if (const auto v = known_.find(e); v != known_.end()) return number(v->second);
    if (symbol_of(e).value) return number(pendula::evaluate({&e, 1}, {})[0]);
    return {};
  }

  Size of(Expr e) { return is_sum(e) ? sum(e) : size_.at(e); }
  static bool is_sum(Expr e) { return e.op() == Op::add || e.op() == Op::sub; }

  Size size(Expr e) {
    switch (e.op()) {
      case Op::constant:
        return number(constant_value(e));
      case Op::symbol:
        return leaf(e);
      case Op::add:
      case Op::sub:
        return {};  // when it is a factor or an argument: of()
      case Op::neg:
      case Op::abs:
        return of(e.operand(0));
      case Op::mul:
      case Op::div: {
        Size a = of(e.operand(0)), b = of(e.operand(1));
        if (!a || !b) return {};
        a->add(e.op() == Op::mul ? 1 : -1, *b);
        return a;
      }
      case Op::pow:
      case Op::sqrt: {
        const Size a = of(e.operand(0));
        const bool constant = e.op() == Op::sqrt || e.operand(1).is_constant();
        if (!a || !constant) return Form{};
        Form result;
        result.add(e.op() == Op::sqrt ? 0.5 : constant_value(e.operand(1)), *a);
        return result;
      }
      case Op::min:
      case Op::max:
        return of(e.operand(0));
      case Op::ifelse:
        return of(e.operand(1));
      case Op::call:
      case Op::solve:
        return {};
      default:
        break;
    }
    if (info(e.op()).arity == 1)  // arguments of transcendental functions have no unit
      if (Size a = of(e.operand(0)); a && !a->slope.empty()) equations.push_back(*a);
    return Form{};
  }

  const std::unordered_map<Expr, double>& known_;
  std::unordered_map<Expr, Index> column_;
  std::unordered_map<Expr, Size> size_;
  std::vector<std::vector<Form>> row_terms_;
};

/// min Σ weight |equation|, by reweighted least squares; what nothing determines stays at 0.
Vec least_absolute(const std::vector<Form>& equations, const std::vector<double>& weight, Index n) {
  constexpr double slight = 1e-12;  // holds what is not determined, moves nothing else
  constexpr int sweeps = 5;
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t i = 0; i < equations.size(); ++i)
    for (const auto& [j, c] : equations[i].slope) entries.emplace_back(static_cast<Index>(i), j, c);
  const auto rows = static_cast<Index>(equations.size());
  Eigen::SparseMatrix<double> A(rows, n), I(n, n);
  A.setFromTriplets(entries.begin(), entries.end());
  I.setIdentity();
  Vec b(rows), x = Vec::Zero(n), w(rows);
  for (Index i = 0; i < rows; ++i) b[i] = -equations[i].constant;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors;  // of one pattern in all sweeps
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    const Vec off = A * x - b;
    for (Index i = 0; i < rows; ++i) w[i] = weight[i] / (sweep == 0 ? 1 : 0.1 + std::fabs(off[i]));
    const Eigen::SparseMatrix<double> weighted = w.asDiagonal() * A;
    const Eigen::SparseMatrix<double> product = A.transpose() * weighted;
    const Eigen::SparseMatrix<double> N = product + slight * I;
    if (sweep == 0) factors.analyzePattern(N);
    factors.factorize(N);
    const Vec next = factors.solve(Vec(A.transpose() * w.cwiseProduct(b)));
    if (!next.allFinite()) break;
    x = next;
  }
  return x;
}

}  // namespace

Magnitudes magnitudes(const std::vector<Expr>& rows, std::size_t equations, const std::vector<Expr>& unknowns,
                      const std::unordered_map<Expr, double>& known,
                      const std::vector<std::pair<Expr, double>>& anchors) {
  constexpr double anchored = 1e-10;  // decides only what the equations do not
  Magnitude m(unknowns, known);
  m.visit(rows, equations);
  std::vector<double> weight(m.equations.size(), 1);
  std::unordered_map<Expr, Index> column;
  for (std::size_t j = 0; j < unknowns.size(); ++j) column[unknowns[j]] = static_cast<Index>(j);
  for (const auto& [leaf, value] : anchors)
    if (const auto j = column.find(leaf); j != column.end() && value != 0 && std::isfinite(value)) {
      m.equations.push_back({{{j->second, 1}}, -std::log(std::fabs(value))});
      weight.push_back(anchored);
    }
  const auto n = static_cast<Index>(unknowns.size());
  Vec log_unit = least_absolute(m.equations, weight, n);
  constexpr double credible =
      80;  // in a long chain small contradictions add up to nothing that means anything
  if (n > 0 && log_unit.maxCoeff() - log_unit.minCoeff() > credible) {
    for (Index j = 0; j < n; ++j) {
      m.equations.push_back({{{j, 1}}, 0});
      weight.push_back(0.1);
    }
    log_unit = least_absolute(m.equations, weight, n);
  }
  constexpr double largest = 200;  // e²⁰⁰ is 1e87: products of units stay finite
  Magnitudes result{log_unit.cwiseMin(largest).cwiseMax(-largest).array().exp(), Vec(rows.size())};
  for (std::size_t i = 0; i < rows.size(); ++i) result.rows[static_cast<Index>(i)] = m.row_unit(i, log_unit);
  return result;
}

}  // namespace pendula::dae
