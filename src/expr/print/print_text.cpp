// Unicode text: x″, θ₁, p1ᵀp1, √x, {p if x < 0, else q}.
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <unordered_set>

#include "base/text.hpp"
#include "expr/graph/declaration.hpp"
#include "expr/print/primes.hpp"
#include "expr/print/print_notation.hpp"

namespace pendula {
namespace {

thread_local NumberStyle number_style = NumberStyle::mixed;

// Choices, in digits: longer exact numbers are printed as decimal numbers of ten digits.
constexpr std::size_t longest_fraction = 24, longest_integer = 40;
constexpr int longest_decimal = 12;
constexpr int most_places = 6;  // 0.000001; smaller numbers are read more easily with an exponent

bool all_digits(const std::string& s) {
  return !s.empty() && s.find_first_not_of("0123456789") == std::string::npos;
}

/// The powers of 2 and 5 in a denominator; q is a finite decimal if there is no other factor.
struct Tens {
  explicit Tens(mpz_class rest) {
    for (; rest % 2 == 0; rest /= 2) ++twos;
    for (; rest % 5 == 0; rest /= 5) ++fives;
    finite = rest == 1;
  }
  int twos = 0, fives = 0;
  bool finite;
};

/// q as a decimal if it has a finite one that is not too long.
std::string decimal(const mpq_class& q) {
  const Tens tens(q.get_den());
  const int places = std::max(tens.twos, tens.fives);
  if (!tens.finite || places > longest_decimal) return "";
  mpz_class scale;
  mpz_ui_pow_ui(scale.get_mpz_t(), 10, static_cast<unsigned long>(places));
  std::string digits = mpz_class(q.get_num() * scale / q.get_den()).get_str();
  if (digits.size() > longest_decimal) return "";
  if (static_cast<int>(digits.size()) <= places)
    digits.insert(0, static_cast<std::size_t>(places) + 1 - digits.size(), '0');
  return digits.insert(digits.size() - static_cast<std::size_t>(places), ".");
}

/// Ten digits of a number, which may exceed the range of double: 2e+400.
std::string ten_digits(const Number& n) {
  constexpr int digits = 10, bits = 128;
  if (!n.exact() || sgn(n.rational()) == 0 || std::isnormal(n.value())) return rounded(n.value(), digits);
  mp_exp_t exponent;
  std::string mantissa = mpf_class(abs(n.rational()), bits).get_str(exponent, 10, digits);
  if (mantissa.size() > 1) mantissa.insert(1, ".");
  return (n.sign() < 0 ? "-" : "") + mantissa + (exponent > 0 ? "e+" : "e-") +
         std::to_string(std::labs(exponent - 1));
}

/// A decimal number with more than six places, such as 3e-9, which is written with an exponent.
bool is_long_decimal(const mpq_class& q) {
  const Tens tens(q.get_den());
  return tens.finite && (tens.fives > most_places || (tens.fives > 0 && tens.twos > most_places));
}

std::string pretty_name(const std::string& name) {
  const SplitName s = split_name(name);
  const std::string letter = greek_letter(s.head), head = letter.empty() ? s.head : letter;
  if (s.below.empty()) return head;
  constexpr std::size_t most = 9;  // digits of a number that fits a long
  if (all_digits(s.below) && s.below.size() <= most) return head + subscript(std::stol(s.below));
  const std::string below = greek_letter(s.below);
  return head + "_" + (below.empty() ? s.below : below);
}

class Unicode final : public Notation {
 public:
  std::string parenthesised(const std::string& inside) const override { return "(" + inside + ")"; }

  Piece symbol(const Symbol& s) const override {
    if (const auto d = stands_for(s.base)) return symbol(symbol_of(derivative_leaf(*d, s.order)));
    std::string name = pretty_name(s.name);
    if (s.component > 0) name = column_name(s.vector) + subscript(s.component);
    return {name + primes(s.order), s.order < 4 ? Bind::atom : Bind::power};
  }

  Piece column(const std::string& name, int order) const override {
    return {column_name(name) + primes(order), order < 4 ? Bind::atom : Bind::power};
  }

  Piece unit_vector(int i) const override { return {"e" + subscript(i)}; }

  Piece power(const Piece& base, const mpq_class& exponent) const override {
    const std::string b = within(base, Bind::atom);
    if (exponent == 1) return base;
    if (exponent.get_den() == 1 && exponent.get_num().fits_slong_p())
      return {b + superscript(exponent.get_num().get_si()), Bind::power};
    return {b + "^(" + exponent.get_str() + ")", Bind::power};
  }

  Piece power(const Piece& base, const Piece& exponent) const override {
    return {within(base, Bind::atom) + "^" + within(exponent, Bind::atom), Bind::power};
  }

  Piece product(const Number& coefficient, std::vector<Piece> above,
                std::vector<Piece> below) const override {
    const NumberText c =
        above.empty() && below.empty() ? number_text(coefficient) : coefficient_text(coefficient);
    if (c.above != "1" || above.empty()) above.insert(above.begin(), {c.above});
    if (!c.below.empty()) below.insert(below.begin(), {c.below});
    if (above.size() == 1 && below.empty()) return above[0];
    const std::string text = juxtaposed(above, below.empty() ? Bind::quotient : Bind::dot);
    if (below.empty()) return {text, Bind::product};
    const std::string bottom = juxtaposed(below, Bind::power);
    return {text + "/" + (below.size() > 1 ? parenthesised(bottom) : bottom), Bind::product};
  }

  Piece dot(const Piece& a, const Piece& b) const override {
    return {within(a, Bind::atom) + "ᵀ" + within(b, Bind::atom), Bind::dot};
  }

  Piece root(const Piece& a) const override { return {"√" + within(a, Bind::atom), Bind::power}; }
  Piece absolute(const Piece& a) const override { return {"|" + a.text + "|"}; }
  Piece norm(const Piece& a) const override { return {"‖" + a.text + "‖"}; }

  Piece function(Op op, const std::vector<Piece>& args) const override {
    const auto operand = [&](std::size_t i) { return within(args[i], Bind::product); };
    switch (op) {
      case Op::lt:
        return {args[0].text + " < " + args[1].text, Bind::condition};
      case Op::le:
        return {args[0].text + " ≤ " + args[1].text, Bind::condition};
      case Op::both:
        return {condition(args[0]) + " and " + condition(args[1]), Bind::condition};
      case Op::either:
        return {condition(args[0]) + " or " + condition(args[1]), Bind::condition};
      case Op::ifelse:
        return {"{" + args[1].text + " if " + args[0].text + ", else " + args[2].text + "}"};
      case Op::neg:
        return {"-" + operand(0), Bind::sum};
      default:
        return {info(op).name + list(args).text};
    }
  }

  Piece call(const std::string& name, const std::vector<Piece>& args) const override {
    return {pretty_name(name) + list(args).text};
  }

  Piece partial(const std::string& name, const std::vector<Piece>& wrt) const override {
    const auto order = static_cast<long>(wrt.size());
    std::string below;
    for (std::size_t i = 0, n; i < wrt.size(); i += n) {
      for (n = 1; i + n < wrt.size() && wrt[i + n].text == wrt[i].text;) ++n;
      below += (i ? " ∂" : "∂") + wrt[i].text + (n > 1 ? superscript(static_cast<long>(n)) : "");
    }
    const bool several = below.find(' ') != std::string::npos;
    return {"∂" + (order > 1 ? superscript(order) : "") + pretty_name(name) + "/" +
                (several ? parenthesised(below) : below),
            Bind::quotient};
  }

  Piece partial_at(const std::string& name, const std::vector<int>& places,
                   const std::vector<Piece>& args) const override {
    std::string d;
    for (int place : places) d += "∂" + subscript(place);
    return {d + pretty_name(name) + list(args).text};
  }

  Piece list(const std::vector<Piece>& entries) const override {
    std::vector<std::string> texts;
    for (const Piece& p : entries) texts.push_back(p.text);
    return {parenthesised(join(texts, ", "))};
  }

  Piece elided(const std::string& what) const override { return {"⟨" + what + "⟩"}; }

 private:
  static std::string column_name(const std::string& name) {
    const std::string head = name.substr(0, name.find('_', 1)), letter = greek_letter(head);
    return letter.empty() ? name : letter + name.substr(head.size());
  }

  std::string condition(const Piece& p) const {
    const bool joined = p.text.find(" and ") != std::string::npos || p.text.find(" or ") != std::string::npos;
    return joined ? parenthesised(p.text) : p.text;
  }

  /// Factors side by side; a number that follows a factor is separated by a dot.
  std::string juxtaposed(const std::vector<Piece>& factors, Bind least) const {
    std::string text;
    for (const Piece& p : factors) {
      const std::string next = within(p, least);
      const bool digit = std::isdigit(static_cast<unsigned char>(next[0]));
      text += (text.empty() ? "" : digit ? "·" : " ") + next;
    }
    return text;
  }
};

}  // namespace

const Notation& unicode_notation() {
  static const Unicode notation;
  return notation;
}

SplitName split_name(const std::string& name) {
  const std::size_t bar = name.find('_', 1);
  if (bar != std::string::npos && bar + 1 < name.size()) return {name.substr(0, bar), name.substr(bar + 1)};
  const std::size_t last = name.find_last_not_of("0123456789");
  if (last == std::string::npos || last + 1 == name.size() || name[last] == '_') return {name, ""};
  return {name.substr(0, last + 1), name.substr(last + 1)};
}

NumberText number_text(const Number& magnitude) {
  if (!magnitude.exact()) return {ten_digits(magnitude), ""};
  const mpq_class& q = magnitude.rational();
  const std::string above = q.get_num().get_str();
  if (q.get_den() == 1) return {above.size() <= longest_integer ? above : ten_digits(magnitude), ""};
  const bool five = mpz_divisible_ui_p(q.get_den_mpz_t(), 5) != 0;
  if (is_long_decimal(q)) return {ten_digits(magnitude), ""};
  constexpr long readable = 1024;  // 1/256 is a power of 1/2 instead of a measured 0.00390625
  if (!five && q.get_den() <= readable && above.size() <= longest_integer &&
      number_style != NumberStyle::decimals)
    return {above, q.get_den().get_str()};
  if (q.get_den() > simple_denominator || number_style == NumberStyle::decimals ||
      (five && number_style == NumberStyle::mixed))
    if (const std::string d = decimal(q); !d.empty()) return {d, ""};
  const std::string below = q.get_den().get_str();
  if (above.size() + below.size() > longest_fraction) return {ten_digits(magnitude), ""};
  return {above, below};
}

NumberText coefficient_text(const Number& magnitude) {
  const bool divides = magnitude.exact() && magnitude.rational().get_num() == 1 &&
                       magnitude.rational().get_den() <= simple_denominator && !magnitude.is(1);
  return divides ? NumberText{"1", magnitude.rational().get_den().get_str()} : number_text(magnitude);
}

namespace {

/// Properties of all coefficients in the forms, including nested ones.
struct NumbersOfForms {
  bool all_finite = true, some_five = false, only_numbers = true;

  void visit(const NormalForms& forms, SumId sum, int depth = 0) {
    constexpr int deepest = 100;  // bounds the stack; the printer elides deeper parts
    if (depth > deepest || !seen_.insert(sum).second) return;
    for (const Term& t : forms.sum(sum)) {
      note(t.coefficient);
      all_finite = all_finite && !is_exact(forms, t);
      for (const Factor& f : t.factors) {
        only_numbers = false;
        for (SumId part : forms.atom(f.atom).args) visit(forms, part, depth + 1);
      }
    }
  }

 private:
  /// Is a coefficient exact? 2 π/5 is an angle, and 2 √5 x/5 contains an exact root; 0.314 π is
  /// a measured number.
  static bool is_exact(const NormalForms& forms, const Term& t) {
    constexpr long most_below = 60;  // π/60 = 3°: finer angles are seldom written as fractions of π
    const bool root = std::any_of(t.factors.begin(), t.factors.end(), [&](const Factor& f) {
      return f.exponent.get_den() != 1 && forms.atom(f.atom).traits.level < 0;
    });
    const bool angle =
        t.factors.size() == 1 && t.factors[0].exponent == 1 && forms.atom(t.factors[0].atom).node == pi();
    const Number& c = t.coefficient;
    return (root || angle) && c.exact() && c.rational().get_den() != 1 &&
           c.rational().get_den() <= most_below;
  }
  void note(const Number& n) {
    if (!n.exact() || n.rational().get_den() == 1) return;
    all_finite = all_finite && !decimal(abs(n.rational())).empty();
    some_five = some_five || mpz_divisible_ui_p(n.rational().get_den_mpz_t(), 5) != 0;
  }
  std::unordered_set<SumId> seen_;
};

}  // namespace

NumberStyleScope::NumberStyleScope(const NormalForms& forms, const std::vector<SumId>& sums)
    : before_(number_style) {
  NumbersOfForms numbers;
  for (SumId s : sums) numbers.visit(forms, s);
  number_style = !numbers.all_finite                         ? NumberStyle::fractions
                 : numbers.only_numbers && numbers.some_five ? NumberStyle::decimals
                                                             : NumberStyle::mixed;
}
NumberStyleScope::~NumberStyleScope() { number_style = before_; }

}  // namespace pendula
