#include "method/collocation.hpp"

#include <cctype>
#include <cmath>
#include <functional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "method/tableau_text.hpp"

namespace pendula::integrate {
namespace {

constexpr long most_collocated = 100;  // a choice: more stages than doubles can use at any tolerance

/// aᵢⱼ = ∫₀^τᵢ ℓⱼ and bⱼ = ∫₀¹ ℓⱼ for Number = Surd (exact) or Real. The coefficients of ℓⱼ grow like 6^s and
/// cancel again, so that Real needs 3 s additional bits.
template <class Number, class Store>
void collocation_integrals(const std::vector<Number>& node, const Number& zero, const Store& store) {
  const int s = static_cast<int>(node.size());
  std::vector<Number> all(1, zero);  // ∏ (τ - τⱼ), coefficient of τ^k at k
  all[0] += 1;
  for (const Number& root : node) {
    all.push_back(zero);
    for (std::size_t k = all.size() - 1; k > 0; --k) all[k] = all[k - 1] - root * all[k];
    all[0] = zero - root * all[0];
  }
  for (int j = 0; j < s; ++j) {
    poll_interrupt();
    std::vector<Number> quotient(s, zero);  // ∏ over i ≠ j, by synthetic division
    quotient[s - 1] = all[s];
    for (int k = s - 1; k > 0; --k) quotient[k - 1] = all[k] + node[j] * quotient[k];
    Number scale = zero;
    for (int k = s - 1; k >= 0; --k) scale = scale * node[j] + quotient[k];
    const auto integral = [&](const Number& end) {  // ∫₀^end ℓⱼ
      Number sum = zero;
      for (int k = s - 1; k >= 0; --k) {
        Number divisor = zero;
        divisor += k + 1;
        sum = sum * end + quotient[k] / divisor;
      }
      sum = sum * end / scale;
      return sum;
    };
    for (int i = 0; i < s; ++i) store(i, j, integral(node[i]));
    Number one = zero;
    one += 1;
    store(s, j, integral(one));
  }
}

/// A and b of a method with nodes c.
template <class Number>
struct Scheme {
  std::vector<Number> A, b, c;
  Number& a(std::size_t i, std::size_t j) { return A[i * c.size() + j]; }
};

template <class Number>
Scheme<Number> collocated(const std::vector<Number>& nodes, const Number& zero) {
  const std::size_t s = nodes.size();
  Scheme<Number> scheme{std::vector<Number>(s * s, zero), std::vector<Number>(s, zero), nodes};
  collocation_integrals<Number>(nodes, zero, [&](int i, int j, const Number& value) {
    const auto row = static_cast<std::size_t>(i), column = static_cast<std::size_t>(j);
    (row < s ? scheme.a(row, column) : scheme.b[column]) = value;
  });
  return scheme;
}

/// aᵢⱼ ← bⱼ(1 - aⱼᵢ/bᵢ): with the old method bᵢaᵢⱼ + bⱼaⱼᵢ = bᵢbⱼ, and C(q) becomes D(q).
template <class Number>
Scheme<Number> transposed(Scheme<Number> old) {
  Scheme<Number> scheme = old;
  for (std::size_t i = 0; i < old.c.size(); ++i)
    for (std::size_t j = 0; j < old.c.size(); ++j) {
      Number value = old.b[j];
      value -= old.b[j] * old.a(j, i) / old.b[i];
      scheme.a(i, j) = value;
    }
  return scheme;
}

/// Rows of A with prescribed aᵢₖ that satisfy C(s-1): multiples of the divided difference are free since C(s)
/// is not required.
template <class Number>
Scheme<Number> with_column(Scheme<Number> scheme, std::size_t k, const Number& entry) {
  const std::size_t s = scheme.c.size();
  std::vector<Number> difference = scheme.c;  // nⱼ = 1/∏(cⱼ - cₗ): Σ nⱼcⱼ^q = 0 for q < s - 1
  for (std::size_t j = 0; j < s; ++j) {
    Number product = entry;
    product -= entry;
    product += 1;
    for (std::size_t l = 0; l < s; ++l) {
      Number gap = scheme.c[j];
      gap -= scheme.c[l];
      if (l != j) product *= gap;
    }
    difference[j] = product;
  }
  for (std::size_t i = 0; i < s; ++i) {
    Number missing = entry;
    missing -= scheme.a(i, k);
    for (std::size_t j = 0; j < s; ++j) scheme.a(i, j) += missing * difference[k] / difference[j];
  }
  return scheme;
}

template <class Number>
Scheme<Number> mean(Scheme<Number> scheme, Scheme<Number> other) {
  for (std::size_t i = 0; i < scheme.A.size(); ++i) {
    Number half = scheme.A[i];
    half += other.A[i];
    Number two = half;
    two -= half;
    two += 2;
    scheme.A[i] = half / two;
  }
  return scheme;
}

enum class Family { collocation, transposed, lobatto_c, lobatto_c_star, lobatto_d, lobatto_e };

template <class Number>
Scheme<Number> derived(const Scheme<Number>& base, Family family, const Number& zero) {
  switch (family) {
    case Family::transposed:
      return transposed(base);
    case Family::lobatto_c:
      return with_column(base, 0, base.b[0]);
    case Family::lobatto_c_star:
      return with_column(base, base.c.size() - 1, zero);
    case Family::lobatto_d:
      return mean(with_column(base, 0, base.b[0]), with_column(base, base.c.size() - 1, zero));
    case Family::lobatto_e:
      return mean(base, transposed(base));
    default:
      return base;
  }
}

/// If C(1) fails (IIIB and IIIE with two stages, Radau IA with one), the nodes are the row sums, so that
/// problems with and without t are solved alike.
template <class Number, class Small>
void nodes_from_rows(Scheme<Number>& scheme, const Number& zero, const Small& negligible) {
  for (std::size_t i = 0; i < scheme.c.size(); ++i) {
    Number sum = zero;
    for (std::size_t j = 0; j < scheme.c.size(); ++j) sum += scheme.a(i, j);
    Number gap = sum;
    gap -= scheme.c[i];
    if (!negligible(gap)) scheme.c[i] = sum;
  }
}

Tableau exact_tableau(TableauData data, const std::vector<Surd>& nodes, Family family) {
  Scheme<Surd> scheme = derived(collocated(nodes, Surd()), family, Surd());
  nodes_from_rows(scheme, Surd(), [](const Surd& gap) { return gap.is_zero(); });
  const auto s = static_cast<Eigen::Index>(nodes.size());
  data.A = MatX(s, s);
  data.b = VecX(s);
  data.c = VecX(s);
  for (Eigen::Index i = 0; i < s; ++i) {
    for (Eigen::Index j = 0; j < s; ++j)
      data.A(i, j) = scheme.a(static_cast<std::size_t>(i), static_cast<std::size_t>(j)).expr();
    data.b[i] = scheme.b[i].expr();
    (*data.c)[i] = scheme.c[i].expr();
  }
  return Tableau(std::move(data));
}

Tableau precise_tableau(TableauData data, const RealVector& nodes, Family family, mp_bitcnt_t bits,
                        double unit) {
  const int s = static_cast<int>(nodes.size());
  const Real zero(0, bits);
  Scheme<Real> scheme = derived(collocated(nodes, zero), family, zero);
  Coefficients rk;
  rk.bits = bits;
  rk.unit = unit;
  rk.A = RealMatrix(s, bits);
  rk.b = scheme.b;
  rk.c = nodes;
  data.A = MatX(s, s);
  data.b = VecX(s);
  data.c = VecX(s);
  for (int i = 0; i < s; ++i) {
    for (int j = 0; j < s; ++j) {
      rk.A(i, j) = scheme.a(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
      if (abs(rk.A(i, j)) < unit)
        rk.A(i, j) = 0;  // a zero of the family: first row of IIIA, last column of IIIB
      data.A(i, j) = Expr(rounded_coefficient(rk.A(i, j)));
    }
    data.b[i] = Expr(rounded_coefficient(rk.b[i]));
    (*data.c)[i] = Expr(rounded_coefficient(nodes[i]));
  }
  return Tableau(std::move(data), std::move(rk));
}

/// 3 bits per stage cancel in the coefficients of Lagrange's polynomials (see above); 16 are a choice that
/// allows for conditions on powers of the nodes. 256 remain.
mp_bitcnt_t digits_for(std::size_t stages) { return 256 + 16 * stages; }

/// The zeros of the Jacobi polynomial P_n^(α,β), (α, β) = (0, 0), (1, 0) or (1, 1), in (-1, 1) to double
/// precision: eigenvalues of the symmetric matrix of its recurrence (Golub & Welsch, Math. Comp. 23, 1969).
Vec jacobi_zeros(int n, int alpha, int beta) {
  if (n == 0) return Vec();
  Vec diagonal(n), off(n - 1);
  const double a = alpha, b = beta;
  for (int k = 0; k < n; ++k) {
    const double d = 2 * k + a + b;
    diagonal[k] = alpha == beta ? 0 : (b * b - a * a) / (d * (d + 2));
  }
  for (int k = 1; k < n; ++k) {
    const double d = 2 * k + a + b;
    off[k - 1] = std::sqrt(4.0 * k * (k + a) * (k + b) * (k + a + b) / (d * d * (d + 1) * (d - 1)));
  }
  Eigen::SelfAdjointEigenSolver<Mat> solver;
  solver.computeFromTridiagonal(diagonal, off, Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
}

/// P_n, P_{n-1} and their derivatives at x by the three-term recurrence k
/// P_k = (2k-1) x P_{k-1} - (k-1) P_{k-2}.
struct Legendre {
  Real p, previous, slope, previous_slope;
  Legendre(int n, const Real& x)
      : p(1, x.get_prec()),
        previous(0, x.get_prec()),
        slope(0, x.get_prec()),
        previous_slope(0, x.get_prec()) {
    for (int k = 1; k <= n; ++k) {
      const Real next(((2 * k - 1) * x * p - (k - 1) * previous) / k);
      const Real next_slope(slope * x + k * p);  // P_k′ = x P_{k-1}′ + k P_{k-1}
      previous = p;
      p = next;
      previous_slope = slope;
      slope = next_slope;
    }
  }
};

/// A zero on [0, 1]: Newton's method on f/f′, given as a function of the Legendre polynomials at x, from a
/// zero in double precision. The digits double in each step.
template <class Quotient>
Real refine(int s, double start, mp_bitcnt_t bits, const Quotient& quotient) {
  Real x(start, bits);
  constexpr int most = 30;  // a cap: from 50 bits the 1856 of a hundred stages take six steps
  for (int iteration = 0; iteration < most; ++iteration) {
    const Real step = quotient(Legendre(s, x), x);
    x -= step;
    if (abs(step) <= Real(Real(1, bits) >> (bits - 16))) break;
  }
  return Real((x + 1) / 2, bits);
}

void check_stages(const char* name, long stages) {
  if (stages >= 1 && stages <= most_collocated) return;
  throw Error(text(name, "(", stages, "): the number of stages must be between 1 and ", most_collocated));
}

TableauData named(const std::string& name, const char* note, const char* cite, int order) {
  TableauData data;
  data.name = name;
  data.text = note;
  data.cite = cite;
  data.order = order;
  return data;
}

Surd surd(const char* entry) { return *exact_surd(parse_entry(entry)); }

/// The method of the family with these nodes: exact ones if available, else `count` nodes to many digits.
Tableau family_tableau(TableauData data, std::vector<Surd> exact, int count, Family family,
                       const std::function<RealVector(mp_bitcnt_t)>& nodes) {
  if (!exact.empty()) return exact_tableau(std::move(data), exact, family);
  const mp_bitcnt_t bits = digits_for(static_cast<std::size_t>(count));
  return precise_tableau(std::move(data), nodes(bits), family, bits,
                         std::ldexp(1.0, -static_cast<int>(bits) / 2));
}

/// Zeros of P_s - P_{s-1} = (x - 1) P_{s-1}^(1,0) up to a factor, the node 1 included.
RealVector radau_nodes(int s, mp_bitcnt_t bits) {
  RealVector nodes;
  for (double start : jacobi_zeros(s - 1, 1, 0))
    nodes.push_back(refine(s, start, bits, [](const Legendre& at, const Real&) {
      return Real((at.p - at.previous) / (at.slope - at.previous_slope));
    }));
  nodes.push_back(Real(1, bits));
  return nodes;
}

std::vector<Surd> exact_radau_nodes(int s) {
  if (s == 1) return {1};
  if (s == 2) return {surd("1/3"), 1};
  if (s == 3) return {surd("(4-sqrt(6))/10"), surd("(4+sqrt(6))/10"), 1};
  return {};
}

/// 0, the zeros of P_{s-1}′ and 1.
RealVector lobatto_nodes(int s, mp_bitcnt_t bits) {
  const int n = s - 1;
  RealVector nodes = {Real(0, bits)};
  for (double start : jacobi_zeros(s - 2, 1, 1))
    nodes.push_back(refine(n, start, bits, [n](const Legendre& at, const Real& x) {
      const Real second((2 * x * at.slope - n * (n + 1) * at.p) / (1 - x * x));  // Legendre's equation
      return Real(at.slope / second);
    }));
  nodes.push_back(Real(1, bits));
  return nodes;
}

std::vector<Surd> exact_lobatto_nodes(int s) {
  if (s == 2) return {0, 1};
  if (s == 3) return {0, surd("1/2"), 1};
  if (s == 4) return {0, surd("(5-sqrt(5))/10"), surd("(5+sqrt(5))/10"), 1};
  if (s == 5) return {0, surd("(7-sqrt(21))/14"), surd("1/2"), surd("(7+sqrt(21))/14"), 1};
  return {};
}

}  // namespace

Tableau collocation(std::span<const Expr> nodes) {
  if (nodes.empty()) throw Error("needs at least one node: rk.collocation{ \"1/3\", 1 }");
  if (nodes.size() > most_collocated)
    throw Error(text(nodes.size(), " nodes; the limit is ", most_collocated));
  const mp_bitcnt_t bits = digits_for(nodes.size());
  double error = 0;
  RealVector values;
  std::vector<Surd> exact;
  for (Expr node : nodes) {
    values.push_back(precise_value(node, bits, error));
    if (const auto value = exact_surd(node)) exact.push_back(*value);
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (nearest_double(values[i]) == nearest_double(values[j]))
        throw Error(text("nodes ", j + 1, " and ", i + 1, " are equal; the nodes must be distinct"));
  TableauData data;
  data.name = "collocation";
  data.cite = "Hairer, Nørsett & Wanner, Solving ODEs I, 2nd ed., §II.7";
  constexpr std::size_t most_exact = 20;  // a choice: fractions of longer tableaus are unreadable and slow
  if (exact.size() == values.size() && one_field(exact) && exact.size() <= most_exact)
    return exact_tableau(std::move(data), exact, Family::collocation);
  // however the nodes were rounded, the method is the collocation at these nodes to all digits
  return precise_tableau(std::move(data), values, Family::collocation, bits, std::ldexp(1.0, -128));
}

Tableau gauss(long stages) {
  check_stages("gauss", stages);
  const int s = static_cast<int>(stages);
  TableauData data =
      named(text("gauss(", s, ")"),
            "Gauss-Legendre collocation, order 2s: symplectic, symmetric, A-stable, R(∞) = (-1)^s.",
            "Kuntzmann 1961; Butcher, Math. Comp. 18, 1964; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5",
            2 * s);
  std::vector<Surd> exact;
  if (s == 1) exact = {surd("1/2")};
  if (s == 2) exact = {surd("1/2-sqrt(3)/6"), surd("1/2+sqrt(3)/6")};
  if (s == 3) exact = {surd("1/2-sqrt(15)/10"), surd("1/2"), surd("1/2+sqrt(15)/10")};
  return family_tableau(std::move(data), std::move(exact), s, Family::collocation, [s](mp_bitcnt_t bits) {
    RealVector nodes;
    for (double start : jacobi_zeros(s, 0, 0))
      nodes.push_back(
          refine(s, start, bits, [](const Legendre& at, const Real&) { return Real(at.p / at.slope); }));
    return nodes;
  });
}

Tableau radau(long stages) {
  check_stages("radau", stages);
  const int s = static_cast<int>(stages);
  TableauData data =
      named(text("radau(", s, ")"), "Radau IIA collocation, order 2s - 1: stiffly accurate, L-stable.",
            "Ehle 1969; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5", 2 * s - 1);
  return family_tableau(std::move(data), exact_radau_nodes(s), s, Family::collocation,
                        [s](mp_bitcnt_t bits) { return radau_nodes(s, bits); });
}

Tableau radau_ia(long stages) {
  check_stages("radau_ia", stages);
  const int s = static_cast<int>(stages);
  TableauData data =
      named(text("radau_ia(", s, ")"), "Radau IA, order 2s - 1: L-stable, the first node is 0.",
            "Ehle 1969; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5", 2 * s - 1);
  std::vector<Surd> exact;
  for (const Surd& node : exact_radau_nodes(s)) exact.insert(exact.begin(), Surd(1) - node);
  return family_tableau(std::move(data), std::move(exact), s, Family::transposed, [s](mp_bitcnt_t bits) {
    RealVector nodes;
    for (const Real& node : radau_nodes(s, bits)) nodes.insert(nodes.begin(), Real(1 - node));
    return nodes;
  });
}

Tableau lobatto(const std::string& kind, long stages) {
  struct Kind {
    const char* name;
    Family family;
    const char* note;
  };
  static const Kind kinds[] = {
      {"IIIA", Family::collocation,
       "Lobatto IIIA collocation, order 2s - 2: A-stable, symmetric, stiffly accurate."},
      {"IIIB", Family::transposed,
       "Lobatto IIIB, order 2s - 2: A-stable and symmetric; with IIIA a symplectic pair."},
      {"IIIC", Family::lobatto_c,
       "Lobatto IIIC, order 2s - 2: L-stable, algebraically stable, stiffly accurate."},
      {"IIIC*", Family::lobatto_c_star,
       "Lobatto IIIC*, order 2s - 2: the last stage is explicit; pairs with IIIC."},
      {"IIID", Family::lobatto_d,
       "Lobatto IIID, order 2s - 2: symplectic and symmetric, the mean of IIIC and IIIC*."},
      {"IIIE", Family::lobatto_e,
       "Lobatto IIIE, order 2s - 2: symplectic and symmetric, the mean of IIIA and IIIB."},
  };
  std::string wanted;
  for (char c : kind) wanted += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::vector<std::string> names;
  for (const Kind& candidate : kinds) {
    const std::string name = candidate.name;
    names.push_back(name);
    if (wanted != name && wanted != name.substr(3) && "LOBATTO" + name != wanted) continue;
    if (stages < 2 || stages > most_collocated)
      throw Error(text("lobatto(\"", name, "\", ", stages, "): the number of stages must be between 2 and ",
                       most_collocated, ": 0 and 1 are always nodes"));
    const int s = static_cast<int>(stages);
    TableauData data =
        named(text("lobatto(", name, ", ", s, ")"), candidate.note,
              "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.5; Jay, Lobatto methods, 2015", 2 * s - 2);
    return family_tableau(std::move(data), exact_lobatto_nodes(s), s, candidate.family,
                          [s](mp_bitcnt_t bits) { return lobatto_nodes(s, bits); });
  }
  throw Error(
      text("unknown kind '", kind, "'.", did_you_mean(wanted, names), " Known are: ", join(names, ", ")));
}

}  // namespace pendula::integrate
