// The Lagrange polynomials of a method's nodes and its orthogonality integrals.
#include "base/error.hpp"
#include "method/collocation.hpp"

namespace pendula::integrate {
namespace {

template <class Number>
std::vector<Number> node_polynomial(const std::vector<Number>& nodes, const Number& zero) {
  std::vector<Number> all(1, zero);
  all[0] += 1;
  for (const Number& root : nodes) {
    all.push_back(zero);
    for (std::size_t k = all.size() - 1; k > 0; --k) all[k] = all[k - 1] - root * all[k];
    all[0] = zero - root * all[0];
  }
  return all;
}

template <class Number>
std::vector<Number> moments(const std::vector<Number>& nodes, const Number& zero, int count) {
  const std::vector<Number> M = node_polynomial(nodes, zero);
  std::vector<Number> result;
  for (int k = 0; k < count; ++k) {
    Number sum = zero;
    for (std::size_t i = 0; i < M.size(); ++i) {
      Number divisor = zero;
      divisor += static_cast<long>(i) + k + 1;
      sum += M[i] / divisor;
    }
    result.push_back(sum);
  }
  return result;
}

std::optional<std::vector<Surd>> exact_nodes(const Tableau& rk) {
  std::vector<Surd> nodes;
  for (Eigen::Index i = 0; i < rk.data().c->size(); ++i) {
    const auto node = exact_surd((*rk.data().c)[i]);
    if (!node) return {};
    nodes.push_back(*node);
  }
  if (!one_field(nodes)) return {};
  return nodes;
}

void require_distinct(const Tableau& rk) {
  for (int i = 0; i < rk.stages(); ++i)
    for (int j = 0; j < i; ++j)
      if (rk.c()[i] == rk.c()[j])
        throw Error(text("the nodes c[", j + 1, "] and c[", i + 1, "] of ", rk.name(),
                         " are equal: there is no Lagrange polynomial through them"));
}

}  // namespace

std::optional<LagrangeBasis> exact_lagrange(const Tableau& rk) {
  require_distinct(rk);
  const auto nodes = exact_nodes(rk);
  if (!nodes) return {};
  LagrangeBasis basis;
  for (std::size_t j = 0; j < nodes->size(); ++j) {
    Polynomial ell = {Surd(1)};
    for (std::size_t i = 0; i < nodes->size(); ++i) {
      if (i == j) continue;
      const Surd gap = (*nodes)[j] - (*nodes)[i];
      ell = times(ell, {-(*nodes)[i] / gap, Surd(1) / gap});
    }
    Polynomial integral = {Surd()};
    for (std::size_t k = 0; k < ell.size(); ++k) integral.push_back(ell[k] / Surd(static_cast<long>(k) + 1));
    basis.ell.push_back(std::move(ell));
    basis.integral.push_back(std::move(integral));
  }
  return basis;
}

Mat lagrange(const Tableau& rk) {
  require_distinct(rk);
  const Coefficients& c = rk.coefficients();
  const int s = rk.stages();
  Mat result(s, s);
  for (int j = 0; j < s; ++j) {
    RealVector ell(1, Real(1, c.bits));
    for (int i = 0; i < s; ++i) {
      if (i == j) continue;
      const Real gap(c.c[j] - c.c[i]);
      ell.push_back(Real(0, c.bits));
      for (std::size_t k = ell.size(); k-- > 0;)
        ell[k] = ((k > 0 ? ell[k - 1] : Real(0, c.bits)) - c.c[i] * ell[k]) / gap;
    }
    for (int k = 0; k < s; ++k) result(j, k) = nearest_double(ell[k]);
  }
  return result;
}

std::vector<Real> orthogonality_integrals(const Coefficients& rk, int count) {
  return moments(rk.c, Real(0, rk.bits), count);
}

std::optional<std::vector<Surd>> exact_orthogonality_integrals(const Tableau& rk, int count) {
  const auto nodes = exact_nodes(rk);
  if (!nodes) return {};
  return moments(*nodes, Surd(), count);
}

}  // namespace pendula::integrate
