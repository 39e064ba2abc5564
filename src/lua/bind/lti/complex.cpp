// Complex numbers, and lists of poles and zeros.
#include <cmath>

#include "base/counted.hpp"
#include "base/text.hpp"
#include "expr/print/print.hpp"
#include "expr/rewrite/rewrite.hpp"
#include "lua/bind/expr/matrix_algebra.hpp"
#include "lua/bind/lti/lti.hpp"
#include "lua/core/objects.hpp"

namespace pendula::lua {

ComplexNumber read_complex(lua_State* L, int index, const std::string& what) {
  if (const auto* held = object_at(L, index, TypeName<ComplexNumber>::value); held && *held)
    return *static_cast<const ComplexNumber*>(held->get());
  if (lua_istable(L, index)) {
    const VecX parts = to_column(L, index, what);
    if (parts.size() != 2)
      throw Error(text(what, ": a complex number is complex(re, im) or { re, im }, got ",
                       counted(parts.size(), "entry")));
    return {parts[0], parts[1]};
  }
  return {to_expr(L, index, what), 0};
}

int push_complex(lua_State* L, const ComplexNumber& z) {
  if (z.im.is_zero()) return push_expr(L, z.re);
  push_object(L, std::make_shared<const ComplexNumber>(z), TypeName<ComplexNumber>::value);
  return 1;
}

namespace {

bool is_sum(const std::string& words) {
  return words.find(" + ") != std::string::npos || words.find(" - ", 1) != std::string::npos;
}

/// "2 i", "i", "√3 i", without sign. Exact numbers that are too long are shown as decimals: √2/2, but
/// 2.214723459 for 3 √218/20.
std::string part_text(Expr e, bool decimals) {
  const auto value = number_value(e);
  if (decimals && value) return rounded(*value);
  std::string words = to_text(e);
  if (!value || display_width(words) <= (words.find("√") == std::string::npos ? 7 : 5)) return words;
  return rounded(*value);
}

std::string imaginary_text(Expr size, bool decimals) {
  std::string words = part_text(size, decimals);
  if (words == "1") return "i";
  return (is_sum(words) ? "(" + words + ")" : words) + " i";
}

bool is_negative(Expr e) {
  if (const auto v = number_value(e)) return *v < 0;
  return to_text(e)[0] == '-';
}

}  // namespace

std::string complex_text(const ComplexNumber& z) {
  if (z.im.is_zero()) return to_text(z.re);
  const bool minus = is_negative(z.im);
  const bool decimals = lti::field(std::vector<Expr>{z.re, z.im}) == lti::Field::numeric;
  const std::string im = imaginary_text(minus ? simplify(-z.im) : z.im, decimals);
  if (z.re.is_zero()) return (minus ? "-" : "") + im;
  return part_text(z.re, decimals) + (minus ? " - " : " + ") + im;
}

int push_roots(Call& call, Roots roots) { return call.push(std::make_shared<const Roots>(std::move(roots))); }

namespace {

// ── complex ──

Expr tidy(Expr e) { return e.is_constant() ? e : simplify(e); }
int push_result(Call& call, Expr re, Expr im) { return push_complex(call.L, {tidy(re), tidy(im)}); }

struct Pair {
  ComplexNumber a, b;
};
Pair operands(Call& call) {
  return {read_complex(call.L, 1, "the left operand"), read_complex(call.L, 2, "the right operand")};
}

int make(Call& call) {
  auto z = std::make_shared<ComplexNumber>();
  z->re = to_expr(call.L, 1, "re");
  if (call.has(2)) z->im = to_expr(call.L, 2, "im");
  return call.push(std::shared_ptr<const ComplexNumber>(std::move(z)));
}

const ComplexNumber& complex_of(Call& call) { return call.object<ComplexNumber>(1, "z"); }
int re(Call& call) { return push_expr(call.L, complex_of(call).re); }
int im(Call& call) { return push_expr(call.L, complex_of(call).im); }
int conj(Call& call) { return push_result(call, complex_of(call).re, -complex_of(call).im); }
int magnitude(Call& call) {
  const auto& z = complex_of(call);
  return push_expr(call.L, tidy(sqrt(tidy(z.re * z.re + z.im * z.im))));
}
int argument(Call& call) { return push_expr(call.L, tidy(atan2(complex_of(call).im, complex_of(call).re))); }

int add(Call& call) {
  const auto [a, b] = operands(call);
  return push_result(call, a.re + b.re, a.im + b.im);
}
int subtract(Call& call) {
  const auto [a, b] = operands(call);
  return push_result(call, a.re - b.re, a.im - b.im);
}
ComplexNumber product(const ComplexNumber& a, const ComplexNumber& b) {
  return {tidy(a.re * b.re - a.im * b.im), tidy(a.re * b.im + a.im * b.re)};
}
ComplexNumber quotient(const ComplexNumber& a, const ComplexNumber& b) {
  const Expr d = tidy(b.re * b.re + b.im * b.im);
  if (d.is_zero()) throw Error("division by zero");
  return {tidy((a.re * b.re + a.im * b.im) / d), tidy((a.im * b.re - a.re * b.im) / d)};
}
int multiply(Call& call) {
  const auto [a, b] = operands(call);
  return push_complex(call.L, product(a, b));
}
int divide(Call& call) {
  const auto [a, b] = operands(call);
  return push_complex(call.L, quotient(a, b));
}
int power(Call& call) {
  const long n = call.integer(2, "exponent");
  if (std::labs(n) > 10000)
    throw Error("the exponent of a complex number must be an integer of at most 10000");
  ComplexNumber result{1, 0};
  for (long k = 0; k < std::labs(n); ++k) result = product(result, complex_of(call));
  return push_complex(call.L, n < 0 ? quotient({1, 0}, result) : result);
}
int negative(Call& call) { return push_result(call, -complex_of(call).re, -complex_of(call).im); }
int equal(Call& call) {
  const auto [a, b] = operands(call);
  return call.push(a.re == b.re && a.im == b.im);
}
int shown(Call& call) { return call.push(complex_text(complex_of(call))); }

// ── roots ──

const Roots& roots(Call& call) { return call.object<Roots>(1, "roots"); }

Expr part(const dae::Mode& m, bool imaginary) {
  if (m.exact) return imaginary ? m.exact->second : m.exact->first;
  return Expr(imaginary ? m.value.imag() : m.value.real());
}

/// The roots, repeated by multiplicity.
std::vector<ComplexNumber> all(const Roots& r) {
  std::vector<ComplexNumber> list;
  for (Expr e : r.symbolic) list.push_back({e, 0});
  for (const dae::Mode& m : r.list)
    for (int k = 0; k < m.multiplicity; ++k) list.push_back({part(m, false), part(m, true)});
  return list;
}

int push_parts(Call& call, bool imaginary) {
  const auto list = all(roots(call));
  MatX m(static_cast<Eigen::Index>(list.size()), 1);
  for (std::size_t k = 0; k < list.size(); ++k)
    m(static_cast<Eigen::Index>(k), 0) = imaginary ? list[k].im : list[k].re;
  return push_entries(call.L, m);
}
int real_parts(Call& call) { return push_parts(call, false); }
int imaginary_parts(Call& call) { return push_parts(call, true); }
int values(Call& call) {
  for (const ComplexNumber& z : all(roots(call)))
    if (!z.im.is_zero())
      throw Error(text("some ", roots(call).what, " are complex: read .re and .im, or [i]"));
  return push_parts(call, false);
}
int length(Call& call) { return call.push(static_cast<long>(all(roots(call)).size())); }
std::string singular(std::string what) {
  if (what.ends_with("s")) what.pop_back();
  return what == "zeroe" ? "zero" : what;
}

int item(Call& call) {
  const auto list = all(roots(call));
  const long i = call.integer(2, "index");
  if (i == static_cast<long>(list.size()) + 1) {  // end of an iteration by ipairs
    return call.push_nil();
  }
  if (i < 1 || i > static_cast<long>(list.size()))
    throw Error(
        text("there is no ", singular(roots(call).what), " number ", i, ": the system has ", list.size()));
  return push_complex(call.L, list[i - 1]);
}

int eigenvalue(Call& call) {
  const auto& e = call.object<Eigenvalues>(1, "eigenvalues");
  const long i = call.integer(2, "index"), n = static_cast<long>(e.numeric.re.size());
  if (i < 1 || i > n) throw Error(text("there is no eigenvalue number ", i, ": the matrix has ", n));
  if (e.exact) return push_complex(call.L, {(*e.exact)[i - 1].re, (*e.exact)[i - 1].im});
  return push_complex(call.L, {Expr(e.numeric.re[i - 1]), Expr(e.numeric.im[i - 1])});
}

std::string times(int multiplicity) {
  return multiplicity == 1 ? "" : multiplicity == 2 ? " (twice)" : text(" (", multiplicity, " times)");
}

int roots_text(Call& call) {
  const Roots& r = roots(call);
  std::vector<std::string> list;
  for (Expr e : r.symbolic) list.push_back(to_text(e));
  for (const dae::Mode& m : r.list) {
    if (m.value.imag() == 0) {
      list.push_back(part_text(part(m, false), !m.exact) + times(m.multiplicity));
    } else if (m.value.imag() > 0) {
      const std::string im = imaginary_text(part(m, true), !m.exact);
      list.push_back((m.value.real() == 0 ? "±" : part_text(part(m, false), !m.exact) + " ± ") + im +
                     times(m.multiplicity));
    }
  }
  return call.push(list.empty() ? "no " + r.what : r.what + ": " + join(list, ", "));
}

}  // namespace

extern const Module complex_module = {
    "complex numbers",
    "Complex numbers, poles and zeros",
    {
        {"complex", make, "complex(re, im) -> complex",
         "A complex number; its parts may be exact. With + - * / ^ ==, .re .im .abs .arg .conj.",
         "complex(1, 2) * complex(1, -2) + complex(0, 1)", "5 + i"},
        {"complex#re", re, "z.re", "The real part."},
        {"complex#im", im, "z.im", "The imaginary part."},
        {"complex#abs", magnitude, "z.abs", "√(re² + im²).", "return complex(3, 4).abs", "5"},
        {"complex#arg", argument, "z.arg", "The angle in radians, between -π and π."},
        {"complex#conj", conj, "z.conj", "The conjugate."},
        {"complex:__add", add, "a + b", "Sum.", "complex(1, 2) + complex(3, 4)", "4 + 6 i"},
        {"complex:__sub", subtract, "a - b", "Difference.", "complex(1, 2) - 3", "-2 + 2 i"},
        {"complex:__mul", multiply, "a * b", "Product.", "complex(1, 2)*complex(3, 4)", "-5 + 10 i"},
        {"complex:__div", divide, "a / b", "Quotient.", "complex(1, 2)/complex(0, 1)", "2 - i"},
        {"complex:__pow", power, "z ^ n", "Power with a whole exponent.", "complex(0, 1)^2", "-1"},
        {"complex:__unm", negative, "-z", "Negative.", "-complex(1, 2)", "-1 - 2 i"},
        {"complex:__eq", equal, "a == b", "Equal parts.", "complex(1, 2) == complex(1, 2)", "true"},
        {"complex:__tostring", shown, "print(z)", "a + b i."},
        {"roots#re", real_parts, "G:poles().re -> column", "The real parts, by size."},
        {"roots#im", imaginary_parts, "G:poles().im -> column", "The imaginary parts."},
        {"roots#values", values, "G:poles().values -> column", "The values, if all are real."},
        {"roots:__len", length, "#G:poles()", "How many there are, with multiplicity."},
        {"roots:__index", item, "G:poles()[i]", "A number, or complex with .re and .im.",
         R"(
             p = tf({1}, {1, 2, 5}):poles()
             p[1].re, p[1].im)",
         "-1 -2"},
        {"eigenvalues:__index", eigenvalue, "eig(A)[i]", "A number, or complex with .re and .im.", R"(
             e = eig{{0, 1}, {-4, 0}}
             e[1], e[2].im)",
         "-2 i 2"},
        {"roots:__tostring", roots_text, "print(G:poles())", "The list; a ± b i are two."},
    }};

}  // namespace pendula::lua
