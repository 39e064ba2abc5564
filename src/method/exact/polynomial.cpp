#include "method/exact/polynomial.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/interrupt.hpp"

namespace pendula::integrate {
namespace {

/// The Sturm chain of a square-free polynomial.
std::vector<Polynomial> sturm_chain(const Polynomial& p) {
  std::vector<Polynomial> chain = {p, derivative(p)};
  while (!chain.back().empty() && degree(chain.back()) > 0) {
    poll_interrupt();
    Polynomial rest = divide(chain[chain.size() - 2], chain.back()).remainder;
    for (Surd& c : rest) c = -c;
    if (rest.empty()) break;
    chain.push_back(std::move(rest));
  }
  return chain;
}

int variations(const std::vector<int>& signs) {
  int count = 0, last = 0;
  for (int sign : signs) {
    if (sign == 0) continue;
    if (last != 0 && sign != last) ++count;
    last = sign;
  }
  return count;
}

int variations_at(const std::vector<Polynomial>& chain, const mpq_class& x) {
  std::vector<int> signs;
  for (const Polynomial& p : chain) signs.push_back(sign_at(p, x));
  return variations(signs);
}

int variations_at_infinity(const std::vector<Polynomial>& chain) {
  std::vector<int> signs;
  for (const Polynomial& p : chain) signs.push_back(p.empty() ? 0 : p.back().sign());
  return variations(signs);
}

/// p without its factor x^k.
Polynomial without_zero_root(Polynomial p) {
  const auto first = std::find_if(p.begin(), p.end(), [](const Surd& c) { return !c.is_zero(); });
  p.erase(p.begin(), first);
  return p;
}

}  // namespace

void trim(Polynomial& p) {
  while (!p.empty() && p.back().is_zero()) p.pop_back();
}

Polynomial plus(const Polynomial& a, const Polynomial& b) {
  Polynomial sum(std::max(a.size(), b.size()));
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] += a[i];
  for (std::size_t i = 0; i < b.size(); ++i) sum[i] += b[i];
  trim(sum);
  return sum;
}

Polynomial minus(const Polynomial& a, const Polynomial& b) {
  Polynomial negative = b;
  for (Surd& c : negative) c = -c;
  return plus(a, negative);
}

Polynomial times(const Polynomial& a, const Polynomial& b) {
  if (a.empty() || b.empty()) return {};
  Polynomial product(a.size() + b.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  trim(product);
  return product;
}

Polynomial derivative(const Polynomial& p) {
  Polynomial result;
  for (std::size_t i = 1; i < p.size(); ++i) result.push_back(p[i] * Surd(static_cast<long>(i)));
  return result;
}

Division divide(Polynomial a, const Polynomial& b) {
  PENDULA_ASSERT(!b.empty(), "division by the zero polynomial");
  Division result;
  trim(a);
  if (a.size() >= b.size()) result.quotient.resize(a.size() - b.size() + 1);
  while (a.size() >= b.size()) {
    const std::size_t shift = a.size() - b.size();
    const Surd factor = a.back() / b.back();
    result.quotient[shift] = factor;
    for (std::size_t i = 0; i < b.size(); ++i) a[shift + i] -= factor * b[i];
    a.pop_back();
    trim(a);
  }
  result.remainder = std::move(a);
  return result;
}

Polynomial greatest_common_divisor(Polynomial a, Polynomial b) {
  trim(a);
  trim(b);
  while (!b.empty()) {
    poll_interrupt();
    Polynomial rest = divide(a, b).remainder;
    if (!rest.empty()) {
      const Surd lead = rest.back();
      for (Surd& c : rest) c = c / lead;
    }
    a = std::move(b);
    b = std::move(rest);
  }
  if (!a.empty()) {
    const Surd lead = a.back();
    for (Surd& c : a) c = c / lead;
  }
  return a;
}

Real evaluate(const Polynomial& p, const Real& x) {
  Real sum(0, x.get_prec());
  for (std::size_t i = p.size(); i-- > 0;) sum = sum * x + p[i].real(x.get_prec());
  return sum;
}

int sign_at(const Polynomial& p, const mpq_class& x) {
  Surd sum;
  for (std::size_t i = p.size(); i-- > 0;) sum = sum * Surd(x) + p[i];
  return sum.sign();
}

// Yun's algorithm: a₁ a₂² a₃³ … with square-free, coprime aᵢ.
Polynomial sign_changing_part(const Polynomial& p) {
  if (degree(p) < 1) return p;
  Polynomial odd = {p.back().sign() < 0 ? Surd(-1) : Surd(1)};
  const Polynomial slope = derivative(p), common = greatest_common_divisor(p, slope);
  Polynomial b = divide(p, common).quotient;
  Polynomial d = minus(divide(slope, common).quotient, derivative(b));
  for (int multiplicity = 1; degree(b) > 0; ++multiplicity) {
    const Polynomial a = greatest_common_divisor(b, d);
    if (multiplicity % 2) odd = times(odd, a);
    b = divide(b, a).quotient;
    d = minus(divide(d, a).quotient, derivative(b));
  }
  return odd;
}

std::optional<double> first_sign_change(const Polynomial& p) {
  const Polynomial f = without_zero_root(sign_changing_part(p));
  if (degree(f) < 1) return {};
  const std::vector<Polynomial> chain = sturm_chain(f);
  const int at_zero = variations_at(chain, 0);
  if (at_zero == variations_at_infinity(chain)) return {};
  mpq_class low = 0, high = 1;
  while (at_zero == variations_at(chain, high)) {
    low = high;
    high *= 2;
  }
  // The smallest zero lies in (low, high]: bisect until it is isolated, then by sign.
  while (variations_at(chain, low) - variations_at(chain, high) > 1) {
    const mpq_class middle = (low + high) / 2;
    (at_zero == variations_at(chain, middle) ? low : high) = middle;
  }
  constexpr mp_bitcnt_t bits = 256;
  Real a(low, bits), b(high, bits);
  const int beyond = sgn(evaluate(f, b));
  if (beyond == 0) return nearest_double(b);
  constexpr int halvings = 120;  // 53 bits of a double, and 67 if the interval is wide
  for (int i = 0; i < halvings; ++i) {
    const Real middle((a + b) / 2, bits);
    (sgn(evaluate(f, middle)) == beyond ? b : a) = middle;
  }
  return nearest_double(b);
}

bool nonnegative(const Polynomial& p) {
  if (p.empty()) return true;
  return p.back().sign() > 0 && !first_sign_change(p);
}

bool is_hurwitz(const Polynomial& p) {
  if (p.empty()) return false;
  Polynomial row, next;  // coefficients n, n-2, … and n-1, n-3, …
  for (int i = degree(p); i >= 0; i -= 2) row.push_back(p[i]);
  for (int i = degree(p) - 1; i >= 0; i -= 2) next.push_back(p[i]);
  const int sign = row[0].sign();
  while (!next.empty()) {
    if (next[0].sign() != sign) return false;
    Polynomial following;
    for (std::size_t i = 0; i + 1 < row.size(); ++i) {
      const Surd right = i + 1 < next.size() ? next[i + 1] : Surd();
      following.push_back(row[i + 1] - row[0] / next[0] * right);
    }
    row = std::move(next);
    next = std::move(following);
  }
  return true;
}

}  // namespace pendula::integrate
