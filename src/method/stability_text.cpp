#include "method/stability.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"

namespace pendula::integrate {
namespace {

std::string power_of_z(std::size_t k) { return k == 1 ? "z" : "z" + superscript(static_cast<long>(k)); }

/// "z/3", "2z/3", "(1/2 - √3/6)z", "0.0012z": a term without its sign.
std::string term(const Surd& size, std::size_t k) {
  if (size.is_rational()) {
    const mpq_class& q = size.rational_part();
    if (q.get_den() > mpz_class("1000000000000000")) return rounded(size.value(), 6) + power_of_z(k);
    return text(q.get_num() == 1 ? "" : q.get_num().get_str(), power_of_z(k),
                q.get_den() == 1 ? "" : "/" + q.get_den().get_str());
  }
  return "(" + to_text(size.expr()) + ")" + power_of_z(k);
}

std::string polynomial_text(const Polynomial& p) {
  std::string result;
  for (std::size_t k = 0; k < p.size(); ++k) {
    if (p[k].is_zero()) continue;
    const bool negative = p[k].sign() < 0;
    const Surd size = negative ? -p[k] : p[k];
    if (k > 0)
      result += result.empty() ? (negative ? "-" : "") : (negative ? " - " : " + ");
    else if (negative)
      result += "-";
    result += k == 0 ? to_text(size.expr()) : term(size, k);
  }
  return result;
}

}  // namespace

std::string Stability::formula() const {
  const std::string p = polynomial_text(P_);
  if (degree(Q_) == 0) return p;
  // (1 - γz)^s, the denominator of singly diagonally implicit methods.
  const Surd gamma = -Q_[1] / Surd(degree(Q_));
  Polynomial factor = {Surd(1), -gamma}, product = {Surd(1)};
  for (int i = 0; i < degree(Q_); ++i) product = times(product, factor);
  const bool single = degree(Q_) > 1 && exact_ && product == Q_;
  const std::string q = single ? "(" + polynomial_text(factor) + ")" + superscript(degree(Q_))
                               : "(" + polynomial_text(Q_) + ")";
  return (degree(P_) > 0 ? "(" + p + ")" : p) + "/" + q;
}

}  // namespace pendula::integrate
