// Text of linear systems: the block table of a state space, fractions with a rule, factors.
#include <algorithm>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lti/system.hpp"

namespace pendula::lti {
namespace {

constexpr int widest = 24;  // states, inputs or outputs up to which a table is printed

/// A constant in exact form, or rounded if it is a decimal number or its exact form is longer than
/// the digits available.
std::string number_text(Expr e, bool decimals, int digits = 10) {
  std::string exact = pendula::to_text(e);
  const bool fits = display_width(exact) <= digits + 2;
  return e.is_constant() && (decimals || !fits) ? pendula::rounded(constant_value(e), digits) : exact;
}

std::string time_text(const System& g) {
  return g.continuous() ? "continuous time" : "sampling time " + number_text(g.Ts, true);
}

/// x′ of x, x″ of x′; x⁺ in discrete time.
std::string following(std::string name, bool continuous) {
  if (!continuous) return name + "⁺";
  const std::string prime = "′";
  if (!name.ends_with(prime)) return name + prime;
  name.resize(name.size() - prime.size());
  return name + "″";
}

std::string pad(const std::string& cell, int width) {
  return std::string(static_cast<std::size_t>(width - display_width(cell)), ' ') + cell;
}

std::string repeated(const char* mark, int times) {
  std::string out;
  for (int k = 0; k < times; ++k) out += mark;
  return out;
}

// ── state space ──

///        x₁  x₂ │ u
/// x₁′     0   1 │ 0
/// x₂′    -2  -3 │ 1
/// ──────────────┼──
/// y       1   0 │ 0
std::string block_table(const System& g) {
  const int n = g.ss.order(), m = g.inputs, p = g.outputs;
  const bool decimals = field(g) == Field::numeric;
  const int digits = n + m > 5 ? 5 : 10;  // limits the table to the width of a terminal
  std::vector<std::vector<std::string>> cells(static_cast<std::size_t>(n + p + 1));
  cells[0].push_back("");
  for (int j = 0; j < n; ++j) cells[0].push_back(state_name(g, j));
  for (int j = 0; j < m; ++j) cells[0].push_back(input_name(g, j));
  for (int i = 0; i < n + p; ++i) {
    auto& row = cells[i + 1];
    row.push_back(i < n ? following(state_name(g, i), g.continuous()) : output_name(g, i - n));
    for (int j = 0; j < n + m; ++j) {
      const MatX& block = i < n ? (j < n ? g.ss.A : g.ss.B) : (j < n ? g.ss.C : g.ss.D);
      row.push_back(number_text(block(i < n ? i : i - n, j < n ? j : j - n), decimals, digits));
    }
  }
  std::vector<int> width(cells[0].size());
  for (const auto& row : cells)
    for (std::size_t j = 0; j < row.size(); ++j) width[j] = std::max(width[j], display_width(row[j]));
  std::string out;
  const auto line = [&](const std::vector<std::string>& row) {
    out += "  " + row[0] + std::string(static_cast<std::size_t>(width[0] - display_width(row[0])), ' ');
    for (std::size_t j = 1; j < row.size(); ++j) {
      if (static_cast<int>(j) == n + 1) out += " │";
      out += (static_cast<int>(j) == n + 1 ? " " : "  ") + pad(row[j], width[j]);
    }
    out += "\n";
  };
  for (int i = 0; i <= n; ++i) line(cells[i]);
  int left = width[0], right = 0;
  for (int j = 1; j <= n; ++j) left += 2 + width[j];
  for (int j = n + 1; j <= n + m; ++j) right += (j > n + 1 ? 2 : 1) + width[j];
  if (p > 0) out += "  " + repeated("─", left + 1) + (m > 0 ? "┼" + repeated("─", right) : "") + "\n";
  for (int i = n + 1; i <= n + p; ++i) line(cells[i]);
  return out;
}

std::string state_space(const System& g) {
  const int n = g.ss.order();
  std::string out = text("state space: ", counted(n, "state"), ", ", counted(g.inputs, "input"), ", ",
                         counted(g.outputs, "output"), ", ", time_text(g), "\n");
  if (n > widest || g.inputs > widest || g.outputs > widest)
    return out + "  too large to be written out; G.A, G.B, G.C and G.D are its matrices\n";
  return out + block_table(g);
}

// ── fractions ──

/// (s + 2)(s² + 2 s + 5) from its zeros.
std::string factors_text(const std::vector<std::pair<Expr, Expr>>& zeros, const std::string& variable,
                         bool latex, bool alone) {
  std::vector<std::pair<std::string, int>> list;
  std::vector<std::pair<Expr, Expr>> alone_yet;  // complex zeros whose conjugate has not been found yet
  for (const auto& zero : zeros) {
    const Expr re = zero.first, im = zero.second;
    const auto conjugate = std::find_if(alone_yet.begin(), alone_yet.end(), [&](const auto& z) {
      return simplify(z.first - re).is_zero() && simplify(z.second + im).is_zero();
    });
    if (conjugate != alone_yet.end()) {
      alone_yet.erase(conjugate);
      continue;
    }
    if (!im.is_zero()) alone_yet.emplace_back(re, im);
    Polynomial p{-re, 1};
    if (!im.is_zero()) p = from_zeros({{re, im}, {re, -im}});
    std::string words = to_text(p, variable, latex);
    if (words != variable) words = (latex ? "\\left(" : "(") + words + (latex ? "\\right)" : ")");
    const auto same = std::find_if(list.begin(), list.end(), [&](const auto& f) { return f.first == words; });
    if (same != list.end())
      ++same->second;
    else
      list.emplace_back(words, 1);
  }
  std::stable_sort(list.begin(), list.end(), [&](const auto& a, const auto& b) {
    return (a.first == variable) > (b.first == variable);
  });
  if (alone && list.size() == 1 && list[0].second == 1 && list[0].first != variable) {
    const std::size_t open = latex ? 6 : 1, close = latex ? 7 : 1;  // "\\left(", "\\right)"
    return list[0].first.substr(open, list[0].first.size() - open - close);
  }
  std::string out;
  for (const auto& [words, times] : list)
    out += (out == variable || (!out.empty() && out.back() != ')') ? " " : "") + words +
           (times == 1 ? ""
            : latex    ? text("^{", times, "}")
                       : superscript(times));
  return out;
}

struct Parts {
  std::string above, below;
};

Parts parts(const System& g, int i, int j, bool latex) {
  const std::string v = g.variable();
  if (g.form == Form::tf) {
    const Fraction& f = g.fraction(i, j);
    return {to_text(f.num, v, latex), to_text(f.den, v, latex)};
  }
  const Factored& f = g.zpk[i * g.inputs + j];
  const std::string above = factors_text(f.zeros, v, latex, f.gain.is_one()),
                    below = factors_text(f.poles, v, latex, true);
  const std::string gain = latex ? to_latex(f.gain) : pendula::to_text(f.gain);
  const bool one = f.gain.is_one() && !above.empty();
  return {one                                    ? above
          : f.gain == Expr(-1) && !above.empty() ? "-" + above
                                                 : gain + (above.empty() ? "" : " ") + above,
          below.empty() ? "1" : below};
}

std::string fractions(const System& g) {
  std::string out;
  const char* what = g.form == Form::tf ? "transfer function" : "zeros, poles, gain";
  out = text(what, g.siso() ? "" : text(": ", counted(g.inputs, "input"), ", ", counted(g.outputs, "output")),
             ", ", time_text(g), "\n");
  for (int j = 0; j < g.inputs; ++j)
    for (int i = 0; i < g.outputs; ++i) {
      if (!g.siso()) out += "from " + input_name(g, j) + " to " + output_name(g, i) + ":\n";
      const Parts f = parts(g, i, j, false);
      for (const std::string& line : lines(f.above, f.below)) out += "  " + line + "\n";
    }
  return out;
}

}  // namespace

std::string describe(const System& g) {
  std::string out = g.form == Form::ss ? state_space(g) : fractions(g);
  for (const std::string& note : g.notes) out += "  " + note + "\n";
  out.pop_back();
  return out;
}

std::string latex(const System& g) {
  if (g.form == Form::ss) {
    PrintOptions options = default_print_options();
    options.latex = true;
    const auto m = [&](const MatX& a) { return matrix_to_text(a, options); };
    const std::string left = g.continuous() ? "\\dot x" : "x_{k+1}", x = g.continuous() ? "x" : "x_k",
                      u = g.continuous() ? "u" : "u_k", y = g.continuous() ? "y" : "y_k";
    return text("\\begin{aligned} ", left, " &= ", m(g.ss.A), " ", x, " + ", m(g.ss.B), " ", u, " \\\\ ", y,
                " &= ", m(g.ss.C), " ", x, " + ", m(g.ss.D), " ", u, " \\end{aligned}");
  }
  const auto entry = [&](int i, int j) {
    const Parts f = parts(g, i, j, true);
    return f.below == "1" ? f.above : "\\frac{" + f.above + "}{" + f.below + "}";
  };
  const std::string name = std::string("G(") + g.variable() + ") = ";
  if (g.siso()) return name + entry(0, 0);
  std::vector<std::string> rows;
  for (int i = 0; i < g.outputs; ++i) {
    std::vector<std::string> cells;
    for (int j = 0; j < g.inputs; ++j) cells.push_back(entry(i, j));
    rows.push_back(join(cells, " & "));
  }
  return name + "\\begin{bmatrix} " + join(rows, " \\\\ ") + " \\end{bmatrix}";
}

}  // namespace pendula::lti
