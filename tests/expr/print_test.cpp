// What people read, letter by letter: textbook order, numbers, vectors by their
// names, LaTeX, what is too large.
#include <doctest/doctest.h>

#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::print_test {

namespace {

Expr var(const std::string& name) { return symbol(Kind::variable, name); }
Expr param(const std::string& name) { return symbol(Kind::parameter, name); }
Expr dot(Expr x, int k = 1) { return derivative_leaf(x, k); }
std::string show(Expr e) { return to_text(e, PrintOptions{}); }
std::string latex(Expr e) { return to_text(e, PrintOptions{true, {}}); }

struct Mechanics {  // declared in the order of the book; CTest runs this file alone, so nothing declares them
                    // first
  Expr M = param("M"), m = param("m"), L = param("L"), l = param("l"), g = param("g"), R = param("R");
  Expr x = var("x"), y = var("y"), theta = var("theta");
};

/// The exam's two masses: q ∈ ℝ⁶, p1 and p2 its halves.
struct TwoMasses {
  std::vector<Expr> q = symbol_vector(Kind::variable, "q", 6);
  std::vector<Expr> z = symbol_vector(Kind::variable, "z", 2);
  Expr m = param("m"), g = param("g"), R = param("R"), L = param("L");
  PrintOptions names{false, {{"p1", {q[0], q[1], q[2]}}, {"p2", {q[3], q[4], q[5]}}}};
  Expr T = 0, C1, C2;
  TwoMasses() {
    for (Expr qi : q) T += dot(qi) * dot(qi);
    T = m / 2 * T;
    for (std::size_t i = 0; i < 3; ++i) C1 += q[i] * q[i], C2 += pow(q[i + 3] - q[i], 2);
    C1 = (C1 - R * R) / 2;
    C2 = (C2 - L * L) / 2;
  }
  std::string show(Expr e) const { return to_text(e, names); }
};

}  // namespace

TEST_CASE("print: the pendulum and the cart-pendulum as in a book") {
  const Mechanics k;
  CHECK(show(k.m * pow(k.l, 2) * dot(k.theta, 2) + k.m * k.g * k.l * sin(k.theta)) ==
        "m l² θ″ + m l g sin(θ)");
  const Expr T = (k.M + k.m) * pow(dot(k.x), 2) / 2 + k.m * pow(k.L, 2) * pow(dot(k.theta), 2) / 2 -
                 k.m * k.L * dot(k.x) * dot(k.theta) * sin(k.theta);
  CHECK(show(T) == "(M + m) x′²/2 - m L x′ θ′ sin(θ) + m L² θ′²/2");
  CHECK(show(total_derivative(partial(T, dot(k.x))) - partial(T, k.x)) ==
        "(M + m) x″ - m L θ″ sin(θ) - m L θ′² cos(θ)");
  CHECK(show(total_derivative(partial(T, dot(k.theta))) - partial(T, k.theta)) == "m L² θ″ - m L x″ sin(θ)");
}

TEST_CASE("print: signs, fractions and numbers") {
  const Mechanics k;
  const std::pair<Expr, std::string> cases[] = {
      {0, "0"},
      {Expr(-3), "-3"},
      {Expr(0.5), "1/2"},
      {k.x / 2, "x/2"},
      {Expr(0.75) * k.x * k.y, "3 x y/4"},
      {Expr(9.81) * k.m, "9.81 m"},
      {Expr(0.05) * k.x, "x/20"},
      {Expr(0.001) * k.x, "0.001 x"},
      {Expr(1) / 3 * k.x, "x/3"},
      {k.x / 37, "x/37"},
      {Expr(std::sqrt(2.0)) * k.x, "1.414213562 x"},
      {Expr(2) * pi() * k.x, "2 π x"},
      {-k.x, "-x"},
      {-k.x - k.y, "-x - y"},
      {k.y - k.x, "y - x"},
      {Expr(1) - pow(k.x, 2), "1 - x²"},
      {k.m * k.g * (k.L - k.x), "m g (L - x)"},
      {-(k.m * (k.x + k.y)), "-m (x + y)"},
      {k.g / (Expr(2) * k.l) * sin(k.theta), "g sin(θ)/(2 l)"},
      {Expr(1) / (k.x + k.y), "1/(x + y)"},
      {(k.x + k.y) / 2, "(x + y)/2"},
      {Expr(3) * pow(Expr(2), k.x), "3·2^x"},
      {pow(k.x, Expr(1.5)), "x^(3/2)"},
      {pow(k.x, k.y + 1), "x^(y + 1)"},
      {Expr(1) / sqrt(k.x), "1/√x"},
      {sqrt(k.x + 1), "√(x + 1)"},
      {abs(k.x) * k.y, "y |x|"},
      {exp(-k.x), "exp(-x)"},
      {atan2(k.y, k.x), "atan2(y, x)"},
  };
  for (const auto& [e, text] : cases) CHECK(show(e) == text);
}

TEST_CASE("print: like terms are collected, doubled signs and -1 factors do not appear") {
  const Mechanics k;
  CHECK(show(k.x + k.y + k.x) == "2 x + y");
  CHECK(show(k.x * k.y - k.y * k.x + k.m) == "m");
  CHECK(show(k.x - (k.y - k.x)) == "2 x - y");
  CHECK(show(Expr(-1) * k.x * Expr(-1) * k.y) == "x y");
  CHECK(show((Expr(2) * k.x + Expr(2) * k.y) / 2) == "x + y");
  CHECK(show(k.x * k.y / k.x) == "y");
}

TEST_CASE("print: order of terms and factors") {
  const Mechanics k;
  CHECK(show(k.m + k.x + dot(k.x) + dot(k.x, 2) + 1) == "x″ + x′ + x + m + 1");
  CHECK(show(pow(k.x, 2) + k.x + pow(k.x, 3)) == "x³ + x² + x");
  CHECK(show(k.y * k.y + k.x * k.y + k.x * k.x) == "x² + x y + y²");
  CHECK(show(sin(k.x) * dot(k.x) * k.m * (k.x + k.y) * 3) == "3 m x′ (x + y) sin(x)");
  CHECK(show(dot(k.x, 4) * dot(k.x, 3)) == "x‴ x⁽⁴⁾");
  CHECK(show(pow(dot(k.x, 4), 2)) == "(x⁽⁴⁾)²");
}

TEST_CASE("print: the order does not depend on the ids of operations") {
  const auto build = [](const std::string& tag, bool backwards) {
    const Expr x = var("x" + tag), y = var("y" + tag), c = param("c" + tag);
    std::vector<Expr> parts(4);
    for (int k = 0; k < 4; ++k) {
      const int i = backwards ? 3 - k : k;
      const Expr made[] = {x * sin(y), y * cos(x * c), (x + y) * c, exp(x) * (c - y)};
      parts[i] = i == 0 ? x * sin(y) : made[i];
    }
    Expr sum = 0;
    for (int k = 0; k < 4; ++k) sum += parts[backwards ? 3 - k : k];
    std::string text = to_text(sum * min(y * x, x + 1), PrintOptions{});
    std::string::size_type at;
    while ((at = text.find(tag)) != std::string::npos) text.erase(at, tag.size());
    return text;
  };
  CHECK(build("_first", false) == build("_second", true));
}

TEST_CASE("print: names") {
  CHECK(show(var("theta1")) == "θ₁");
  CHECK(show(var("theta_2")) == "θ₂");
  CHECK(show(dot(var("omega"), 2)) == "ω″");
  CHECK(show(param("K_eq")) == "K_eq");
  CHECK(show(param("Delta_x")) == "Δ_x");
  CHECK(show(var("x12")) == "x₁₂");
  CHECK(show(var("alphabet")) == "alphabet");
  CHECK(latex(var("theta1")) == "\\theta_1");
  CHECK(latex(param("K_eq")) == "K_{\\mathrm{eq}}");
  CHECK(latex(param("mass")) == "\\mathrm{mass}");
}

TEST_CASE("print: conditions and pieces") {
  const Mechanics k;
  const Expr c = both(lt(k.x, 0), either(le(k.y, k.x), lt(k.y, 0)));
  CHECK(show(ifelse(lt(k.x, 0), -k.x, k.x)) == "{-x if x < 0, else x}");
  CHECK(show(k.y * ifelse(c, k.x, 0)) == "y {x if x < 0 and (y ≤ x or y < 0), else 0}");
  CHECK(latex(ifelse(lt(k.x, 0), -k.x, k.x)) ==
        "\\begin{cases} -x & \\text{if } x < 0 \\\\ x & \\text{else} \\end{cases}");
}

TEST_CASE("print: scalar products and columns by their names") {
  const TwoMasses k;
  CHECK(k.show(k.T) == "m q′ᵀq′/2");
  CHECK(k.show(k.C1) == "(p1ᵀp1 - R²)/2");
  CHECK(k.show(k.C2) == "((p2 - p1)ᵀ(p2 - p1) - L²)/2");
  CHECK(k.show(total_derivative(k.C1)) == "p1ᵀp1′");
  CHECK(k.show(total_derivative(k.C2)) == "(p2 - p1)ᵀ(p2′ - p1′)");
  CHECK(k.show(total_derivative(k.C1, 2)) == "p1ᵀp1″ + p1′ᵀp1′");
  CHECK(k.show(k.m * k.g * (k.q[2] + k.q[5])) == "m g (q₃ + q₆)");
  CHECK(k.show(sqrt(Expr(2) * k.C1 + k.R * k.R)) == "‖p1‖");
  CHECK(k.show(k.q[0] * k.q[1] + k.q[1] * k.q[2]) == "q₁ q₂ + q₂ q₃");
  CHECK(show(k.C1) == "(q₁² + q₂² + q₃² - R²)/2");  // without the alias
  VecX equation(6);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const Expr qi = k.q[i];
    equation[i] = k.m * dot(qi, 2) + k.z[0] * partial(k.C1, qi) + k.z[1] * partial(k.C2, qi);
    if (i % 3 == 2) equation[i] += k.m * k.g;
  }
  CHECK(vector_to_text(equation, k.names) ==
        "(m p1″ + m g e₃ + z₁ p1 + z₂ (p1 - p2), m p2″ + m g e₃ + z₂ (p2 - p1))");
  CHECK(to_text(k.C2, PrintOptions{true, k.names.aliases}) ==
        "\\frac{\\left(\\mathbf{p}_2 - \\mathbf{p}_1\\right)^\\top \\left(\\mathbf{p}_2 - "
        "\\mathbf{p}_1\\right) - "
        "L^2}{2}");
}

TEST_CASE("print: almost a scalar product is not one") {
  const TwoMasses k;
  Expr e = 0;
  for (std::size_t i = 0; i < 3; ++i) e += Expr(i == 1 ? 2 : 1) * k.q[i] * k.q[i + 3];
  CHECK(k.show(e) == "q₁ q₄ + 2 q₂ q₅ + q₃ q₆");
  CHECK(k.show(e - k.q[1] * k.q[4]) == "p1ᵀp2");
  CHECK(k.show(e - k.q[1] * k.q[4] + k.q[0] * k.q[3]) == "2 q₁ q₄ + q₂ q₅ + q₃ q₆");
}

TEST_CASE("print: columns and matrices") {
  const auto p = symbol_vector(Kind::variable, "p", 3);
  const Expr m = param("m"), g = param("g"), z = var("z"), x = var("x");
  VecX v(3);
  for (Eigen::Index i = 0; i < 3; ++i) v[i] = -z * p[i];
  v[2] -= m * g;
  CHECK(vector_to_text(v, {}) == "-m g e₃ - z p");
  v[0] += x;
  CHECK(vector_to_text(v, {}) == "(x, 0, -m g) - z p");
  CHECK(vector_to_text(column(std::vector<Expr>{0, x, 1}), {}) == "(0, x, 1)");
  MatX a(2, 2);
  a << 1, Expr(-12), Expr(9.81), 0;
  CHECK(matrix_to_text(a, {}) == "⎡   1  -12⎤\n⎣9.81    0⎦");
  CHECK(matrix_to_text(a, {true, {}}) == "\\begin{bmatrix} 1 & -12 \\\\ 9.81 & 0 \\end{bmatrix}");
  CHECK(matrix_to_text(MatX(a.row(0)), {}) == "[1  -12]");
  MatX b(3, 1);
  b << x, m * g, 0;
  CHECK(matrix_to_text(b, {}) == "⎡ x ⎤\n⎢m g⎥\n⎣ 0 ⎦");
}

TEST_CASE("print: unspecified functions") {
  const auto p = symbol_vector(Kind::variable, "p", 3);
  const Expr x = var("x");
  FunctionCall f{"g", {3, 1}, {0, 0, 0, 0}, {p[0], p[1], p[2], x}};
  CHECK(show(call(f)) == "g(p, x)");
  CHECK(show(partial(call(f), x)) == "∂g/∂x");
  CHECK(show(partial(partial(call(f), x), x)) == "∂²g/∂x²");
  CHECK(show(partial(partial(call(f), x), p[1])) == "∂²g/(∂p₂ ∂x)");
  CHECK(latex(partial(call(f), x)) == "\\frac{\\partial g}{\\partial x}");
  f.arguments[3] = x * x;
  CHECK(show(partial(call(f), x)) == "2 x ∂₄g(p, x²)");
}

TEST_CASE("print: LaTeX") {
  const Mechanics k;
  CHECK(latex(k.m * pow(k.L, 2) * pow(dot(k.theta), 2) / 2) == "\\frac{m L^2 \\dot{\\theta}^2}{2}");
  CHECK(latex(sqrt(k.x) * sin(k.x / 2)) == "\\sqrt{x} \\sin\\left(\\frac{x}{2}\\right)");
  CHECK(latex(dot(k.x, 4)) == "x^{(4)}");
  CHECK(latex((k.x + 1) * k.m) == "m \\left(x + 1\\right)");
}

TEST_CASE("print: long sums are written, deep and exponential expressions are elided with their size") {
  const Expr x = var("x");
  Expr sum = x;
  for (int i = 0; i < 30'000; ++i) sum = sum + var("w" + std::to_string(i));
  const std::string text = show(sum);
  CHECK(text.starts_with("x + w₀ + w₁ + w₂"));
  CHECK(text.find("w₂₉₉₉₉") != std::string::npos);

  Expr deep = x;
  for (int i = 0; i < 100'000; ++i) deep = sin(deep) + 1;
  CHECK(show(deep).find("operations⟩") != std::string::npos);
  Expr wide = x;
  for (int i = 0; i < 300; ++i) wide = sin(wide) * wide + wide;  // a tree of 3^300 nodes
  const std::string elided = show(wide);
  CHECK(elided.find("operations⟩") != std::string::npos);
  CHECK(elided.size() < 20'000);
  Expr cancelled = x;
  for (int i = 1; i < 60'000; ++i) cancelled = cancelled + Expr(i % 2 ? 1 : -1) * x;
  CHECK(show(cancelled) == "2 x");
}

}  // namespace pendula::print_test
