// The text of a model in the usual format of identification toolboxes.
#include <cmath>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/model.hpp"

namespace pendula::sysid {
namespace {

void append_term(std::string& out, double c, const std::string& what, int digits) {
  if (c == 0) return;
  const std::string size = rounded(std::abs(c), digits);
  out += out.empty() ? (c < 0 ? "-" : "") : (c < 0 ? " - " : " + ");
  if (what.empty()) {
    out += size;
  } else {
    out += (size == "1" ? "" : size + " ") + what;
  }
}

std::string lag(const std::string& signal, Index k) {
  return k == 0 ? signal + "(t)" : text(signal, "(t-", k, ")");
}

std::string number_or(double value, int digits, const std::string& otherwise) {
  return std::isfinite(value) ? rounded(value, digits) : otherwise;
}

std::string head(const PolyModel& m) {
  if (!m.estimated) return m.kind + " model\n";
  const std::string how = m.search.iterations > 0 ? m.search.method
                          : !m.weighting.empty()  ? m.weighting
                          : !m.noise.empty()      ? "maximum likelihood"
                                                  : "linear least squares";
  std::string out =
      text(m.kind, " model, estimated from ", m.quality.rows, " of ", m.samples, " samples by ", how, "\n");
  const Index first = m.samples - m.quality.rows - m.left_out;
  if (m.start == InitialCondition::drop && first > 0)
    out += text("  ic = \"drop\": the first ", first == 1 ? "sample starts" : text(first, " samples start"),
                " the regressor\n");
  if (m.start == InitialCondition::zero) out += "  ic = \"zero\": samples before the first are zero\n";
  if (m.start == InitialCondition::estimate) {
    out += "  ic = \"estimate\": the samples before the first are estimated";
    for (Index i = 0; i < m.initial_past.size(); ++i)
      out += text(i == 0 ? ": " : ", ", m.y_name, "(", -i, ") = ", rounded(m.initial_past[i], 6));
    out += "\n";
  }
  if (!m.noise.empty()) out += text("  ", m.noise, ", ln L = ", rounded(m.log_likelihood, 7), "\n");
  if (m.left_out > 0) out += text("  ", counted(m.left_out, "row"), " left out, where samples are missing\n");
  return out;
}

std::string form(const PolyModel& m) {
  const Polynomials& p = m.p;
  std::string in;
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    const std::string k = p.B.size() > 1 ? subscript(static_cast<long>(i + 1)) : "";
    in += text(in.empty() ? "" : " + ", "B", k, "(q)", p.F[i].size() > 1 ? text("/F", k, "(q)") : "", " ",
               m.u_names[i], "(t)");
  }
  std::string noise = p.C.size() > 1 ? "C(q) e(t)" : "e(t)";
  if (p.D.size() > 1) noise = p.C.size() > 1 ? "C(q)/D(q) e(t)" : "1/D(q) e(t)";
  std::string out =
      text("  ", p.A.size() > 1 ? "A(q) " : "", m.y_name, "(t) = ", in, in.empty() ? "" : " + ", noise, "\n");
  const auto line = [&](const std::string& name, const Vec& v) {
    out += text("    ", name, "(q) = ", polynomial_text(v), "\n");
  };
  if (p.A.size() > 1) line("A", p.A);
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    const std::string k = p.B.size() > 1 ? subscript(static_cast<long>(i + 1)) : "";
    line("B" + k, p.B[i]);
    if (p.F[i].size() > 1) line("F" + k, p.F[i]);
  }
  if (p.C.size() > 1) line("C", p.C);
  if (p.D.size() > 1) line("D", p.D);
  return out;
}

std::string difference_equation(const PolyModel& m) {
  const Polynomials& p = m.p;
  std::string sum;
  const auto from = [&](std::string& out, const Vec& v, Index first, double sign, const std::string& signal) {
    for (Index k = first; k < v.size(); ++k) append_term(out, sign * v[k], lag(signal, k), 7);
  };
  from(sum, p.A, 1, -1, m.y_name);
  std::string more;
  for (std::size_t i = 0; i < p.B.size(); ++i) {
    if (p.F[i].size() == 1) {
      from(sum, p.B[i], 0, 1, m.u_names[i]);
      continue;
    }
    const std::string w = p.B.size() > 1 ? "w" + subscript(static_cast<long>(i + 1)) : "w";
    append_term(sum, 1, w + "(t)", 7);
    std::string line;
    from(line, p.F[i], 1, -1, w);
    from(line, p.B[i], 0, 1, m.u_names[i]);
    more += text("    ", w, "(t) = ", line, "\n");
  }
  if (p.D.size() > 1) {
    append_term(sum, 1, "v(t)", 7);
    std::string line;
    from(line, p.D, 1, -1, "v");
    append_term(line, 1, "e(t)", 7);
    from(line, p.C, 1, 1, "e");
    more += "    v(t) = " + line + "\n";
  } else {
    append_term(sum, 1, "e(t)", 7);
    from(sum, p.C, 1, 1, "e");
  }
  return text("  difference equation\n    ", m.y_name, "(t) = ", sum, "\n", more);
}

std::string parameters(const PolyModel& m) {
  Table table({false, true, false});
  for (std::size_t i = 0; i < m.names.size(); ++i) {
    const auto k = static_cast<Index>(i);
    std::string deviation;
    if (k < m.std.size())
      deviation = !std::isfinite(m.std[k]) ? "not identifiable" : m.exact ? "" : "± " + rounded(m.std[k], 4);
    table.row({m.names[i], rounded(m.theta[k], 9), deviation});
  }
  return text("  parameters",
              m.exact            ? " (exact to rounding)"
              : m.std.size() > 0 ? " ± standard deviation"
                                 : "",
              "\n", table.str(4));
}

std::string numbers(const PolyModel& m) {
  std::string out;
  if (m.exact) {
    out += text("  the data are reproduced exactly (to rounding) on ", m.quality.rows,
                " rows; loss, FPE and AIC are rounding errors then\n");
  } else {
    const Criteria& q = m.quality;
    out += text("  loss V = ", rounded(q.loss, 8), ", FPE = ", number_or(q.fpe, 8, "–"),
                ", AIC = ", number_or(q.aic, 7, "–"), ", BIC = ", number_or(q.bic, 7, "–"), "\n");
    if (q.rows > q.parameters) out += text("  noise variance SSE/(rows - d) = ", rounded(q.sigma2, 8), "\n");
    out += text("  fit on the estimation data: ", number_or(q.fit, 6, "–"), " % (1-step prediction)");
    if (std::isfinite(m.simulation.percent))
      out += text(", ", rounded(m.simulation.percent, 6), " % (simulation, ", m.simulation.start, ")");
    else if (!std::isnan(m.simulation.percent))
      out += text(", diverges (simulation, ", m.simulation.start, ": the model is unstable)");
    out += "\n";
  }
  if (!m.search.verdict.empty()) out += "  search: " + m.search.verdict + "\n";
  for (const std::string& line : m.search.warnings) out += text("  warning: ", line, "\n");
  if (!m.identifiability.directions.empty()) {
    out += text("  rank ", m.identifiability.rank, " of ", m.names.size(),
                m.search.iterations > 0 ? ": other parameters explain the data equally well\n"
                                        : ": the estimate shown is the one of minimum norm\n");
    for (const std::string& line : m.identifiability.directions) out += "    " + line + "\n";
    for (const std::string& line : m.identifiability.advice) out += "    why: " + line + "\n";
  }
  return out;
}

}  // namespace

std::string polynomial_text(const Vec& p, int digits) {
  std::string out;
  for (Index k = 0; k < p.size(); ++k)
    append_term(out, p[k], k == 0 ? "" : "q" + superscript(-static_cast<long>(k)), digits);
  return out.empty() ? "0" : out;
}

std::string describe(const PolyModel& m) {
  std::string out = head(m) + form(m) + difference_equation(m);
  if (m.estimated) out += parameters(m) + numbers(m);
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid
