// print(sys:pencil())
#include <algorithm>
#include <cmath>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "dae/pencil/pencil.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"

namespace pendula::dae {
namespace {

std::string number(double v) { return rounded(v, 10); }

std::string times(const Mode& m) { return m.multiplicity == 1 ? "" : text("  (", m.multiplicity, " times)"); }

/// "-1/2", "-1 ± 2 i", "-0.3221853546"; the conjugate of a pair is not listed again.
std::string mode_text(const Mode& m) {
  const double im = std::fabs(m.value.imag());
  if (m.exact) {
    const auto& [re, exact_im] = *m.exact;
    if (exact_im.is_zero()) return "s = " + to_text(re) + times(m);
    const Expr size = m.value.imag() < 0 ? simplify(-exact_im) : exact_im;
    const std::string unit = size.is_one() ? "i" : to_text(size) + " i";
    return "s = " + (re.is_zero() ? "" : to_text(re) + " ") + "± " + unit + times(m);
  }
  if (im == 0) return "s ≈ " + number(m.value.real()) + times(m);
  return "s ≈ " + number(m.value.real()) + " ± " + number(im) + " i" + times(m);
}

std::string values_text(const LinearForm& f) {
  std::vector<std::string> words;
  for (Expr p : f.used) {
    const auto it = f.values.find(p);
    words.push_back(to_text(p) + " = " + (it == f.values.end() ? "?" : to_text(it->second)));
  }
  return join(words, ", ");
}

void list(std::string& out, const char* title, const std::vector<std::string>& lines) {
  Table table;
  for (std::size_t i = 0; i < lines.size(); ++i) table.row({i == 0 ? title : "", lines[i]});
  out += table.str(2);
}

std::vector<std::string> conditions(const std::vector<Constraint>& constraints) {
  std::vector<std::string> lines;
  for (const Constraint& c : constraints) lines.push_back("0 = " + to_text(c.residual));
  return lines;
}

/// y(d/dt) applied to the equations: the combination, and the remaining forcing.
std::string row_text(const LinearForm& f, const PolynomialVector& y) {
  const VecX g = f.forcing();
  std::string combined;
  Expr rest = 0;
  mpq_class sign = 0;  // makes the first printed term positive
  for (int k = y.coefficient.cols(); k-- > 0;)
    for (int i = f.rows(); i-- > 0;) {
      if (y.coefficient(i, k) == 0) continue;
      if (sign == 0) sign = sgn(y.coefficient(i, k));
      const mpq_class c = sign * y.coefficient(i, k);
      combined += combined.empty() ? "" : c < 0 ? " - " : " + ";
      if (abs(c) != 1) combined += to_text(Expr(mpq_class(abs(c)))) + " ";
      const std::string& label = f.label[i];
      combined += (label.empty() ? "(derivatives of states)" : label) + primes(k);
      rest += Expr(c) * (k == 0 ? g[i] : total_derivative(g[i], k));
    }
  rest = simplify(rest);
  const char* verdict = rest.is_zero()       ? "one equation too many, no contradiction"
                        : rest.is_constant() ? "the equations contradict each other"
                                             : "a condition on the inputs, or a contradiction";
  return combined + " reads 0 = " + to_text(rest) + ": " + verdict;
}

/// The unknowns along x(s): (x, y) + (φ′, -φ) solves the same equations.
std::string column_text(const LinearForm& f, const PolynomialVector& x) {
  const Expr phi = symbol(Kind::variable, "phi");
  std::vector<std::string> names, parts;
  for (int j = 0; j < f.size(); ++j) {
    Expr part = 0;
    for (int k = 0; k < x.coefficient.cols(); ++k)
      part += Expr(x.coefficient(j, k)) * derivative_leaf(phi, k);
    if (part.is_zero()) continue;
    names.push_back(to_text(f.x[j]));
    parts.push_back(to_text(part));
  }
  const std::string phi_text = to_text(phi);
  if (names.size() == 1) return names[0] + " is not determined: any function can be added to it";
  return text(join(names, ", "), " are not determined: with any function ", phi_text, " one may add (",
              join(parts, ", "), ") to (", join(names, ", "), ")");
}

std::string unit_column(const RationalMatrix& column) {
  std::vector<std::string> words;
  for (int i = 0; i < column.rows(); ++i) words.push_back(to_text(Expr(column(i, 0))));
  return "(" + join(words, ", ") + ")";
}

std::vector<std::string> consistent_space(const Pencil& p) {
  if (p.dof == 0) return {"only one x(0): no value is free"};
  std::vector<std::string> words;
  for (int j = 0; j < p.dof; ++j)
    words.push_back((p.dof == 1 ? "α " : "α" + subscript(j + 1) + " ") + unit_column(p.T.columns(j, 1)));
  const VecX g = p.form.forcing();
  const bool forced = std::any_of(g.data(), g.data() + g.size(), [](Expr e) { return !e.is_zero(); });
  return {"x(0) = " + join(words, " + ") +
          (forced && p.dof < p.form.size() ? ", shifted by the inputs" : "")};
}

std::vector<std::string> indented(const std::string& grid) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < grid.size();) {
    const std::size_t end = std::min(grid.find('\n', at), grid.size());
    lines.push_back(grid.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

}  // namespace

std::string describe_singular(const Pencil& p) {
  const LinearForm& f = p.form;
  std::string out;
  for (const auto& y : p.rows) out += "  " + row_text(f, y) + "\n";
  for (const auto& x : p.columns) out += "  " + column_text(f, x) + "\n";
  return out.empty() ? out : out.substr(0, out.size() - 1);
}

std::string describe(const Pencil& p) {
  const LinearForm& f = p.form;
  std::string out = p.regular ? "regular pencil, " : "singular pencil, ";
  out += counted(f.rows(), "equation") + " for " + join({counted(f.size(), "unknown")}, "");
  if (p.regular) out += text(", index ", p.index, ", ", counted(p.dof, "free initial value"));
  out += "\n";
  if (!f.used.empty()) out += "  with the values " + values_text(f) + "\n";
  if (!p.regular) {
    out += text(f.rows() == f.size() ? "  det(sE - A) = 0 for every s: " : "  ", "sE - A has rank ", p.rank,
                "\n");
    return out + describe_singular(p);
  }
  const Expr s = symbol(Kind::parameter, "s");
  list(out, "det(sE - A)", {to_text(expression(p.det, s))});
  std::vector<std::string> lines;
  for (const Mode& m : p.modes)
    if (m.value.imag() <= 0) lines.push_back(mode_text(m));
  if (lines.empty()) lines.push_back("none");
  list(out, "finite modes", lines);
  list(out, "constraints",
       p.constraints.empty() ? std::vector<std::string>{"none"} : conditions(p.constraints));
  if (!p.algebraic.empty()) list(out, "algebraic", conditions(p.algebraic));
  if (f.size() <= 12) list(out, "consistent", consistent_space(p));
  if (f.size() > 8) return out.substr(0, out.size() - 1);
  out += "  S E T = diag(I, N), S A T = diag(J, I) with\n";
  for (const auto& [name, m] :
       {std::pair{"S =", &p.S}, std::pair{"T =", &p.T}, std::pair{"J =", &p.J}, std::pair{"N =", &p.N}})
    if (m->rows() > 0) list(out, name, indented(matrix_to_text(expressions(*m))));
  return out.substr(0, out.size() - 1);
}

}  // namespace pendula::dae
