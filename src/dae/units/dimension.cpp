#include "dae/units/dimension.hpp"

#include <cctype>
#include <cmath>
#include <cstdlib>
#include <unordered_map>

#include "base/text.hpp"

namespace pendula::dae {
namespace {

struct NamedUnit {
  const char* name;
  Dimension dimension;
};

//                                      m   kg  s   A   K  mol cd
constexpr NamedUnit units[] = {
    {"1", {0, 0, 0, 0, 0, 0, 0}},      {"m", {1, 0, 0, 0, 0, 0, 0}},     {"kg", {0, 1, 0, 0, 0, 0, 0}},
    {"s", {0, 0, 1, 0, 0, 0, 0}},      {"A", {0, 0, 0, 1, 0, 0, 0}},     {"K", {0, 0, 0, 0, 1, 0, 0}},
    {"mol", {0, 0, 0, 0, 0, 1, 0}},    {"cd", {0, 0, 0, 0, 0, 0, 1}},    {"N", {1, 1, -2, 0, 0, 0, 0}},
    {"Pa", {-1, 1, -2, 0, 0, 0, 0}},   {"W", {2, 1, -3, 0, 0, 0, 0}},    {"V", {2, 1, -3, -1, 0, 0, 0}},
    {"Ohm", {2, 1, -3, -2, 0, 0, 0}},  {"S", {-2, -1, 3, 2, 0, 0, 0}},   {"F", {-2, -1, 4, 2, 0, 0, 0}},
    {"H", {2, 1, -2, -2, 0, 0, 0}},    {"C", {0, 0, 1, 1, 0, 0, 0}},     {"Wb", {2, 1, -2, -1, 0, 0, 0}},
    {"T", {0, 1, -2, -1, 0, 0, 0}},    {"J", {2, 1, -2, 0, 0, 0, 0}},    {"m/s", {1, 0, -1, 0, 0, 0, 0}},
    {"1/s", {0, 0, -1, 0, 0, 0, 0}},   {"Hz", {0, 0, -1, 0, 0, 0, 0}},   {"rad", {0, 0, 0, 0, 0, 0, 0}},
    {"V/s", {2, 1, -4, -1, 0, 0, 0}},  {"A/s", {0, 0, -1, 1, 0, 0, 0}},  {"m/s^2", {1, 0, -2, 0, 0, 0, 0}},
    {"m^3/s", {3, 0, -1, 0, 0, 0, 0}}, {"m^2", {2, 0, 0, 0, 0, 0, 0}},   {"m^3", {3, 0, 0, 0, 0, 0, 0}},
    {"kg*m^2", {2, 1, 0, 0, 0, 0, 0}}, {"g", {0, 1, 0, 0, 0, 0, 0}},     {"min", {0, 0, 1, 0, 0, 0, 0}},
    {"h", {0, 0, 1, 0, 0, 0, 0}},      {"bar", {-1, 1, -2, 0, 0, 0, 0}}, {"l", {3, 0, 0, 0, 0, 0, 0}},
    {"deg", {0, 0, 0, 0, 0, 0, 0}},    {"%", {0, 0, 0, 0, 0, 0, 0}}};

void add(Dimension& d, const Dimension& e, double factor) {
  for (std::size_t k = 0; k < d.size(); ++k) d[k] += factor * e[k];
}

bool same(const Dimension& a, const Dimension& b) {
  constexpr double rounding =
      1e-9;  // sums of fractions err by some ε and differ by 10⁻⁴ (denominators below 100)
  for (std::size_t k = 0; k < a.size(); ++k)
    if (std::fabs(a[k] - b[k]) > rounding) return false;
  return true;
}

/// product := factor { ("*" | "/") factor };  factor := (name | "(" product ")") [ "^" number ]
class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}
  std::optional<Dimension> parse() {
    const auto d = product();
    return d && at_ == text_.size() ? d : std::nullopt;
  }

 private:
  bool take(char c) {
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  std::optional<Dimension> product() {
    auto d = factor();
    while (d) {
      const bool times = take('*'), over = !times && take('/');
      if (!times && !over) break;
      const auto next = factor();
      if (!next) return {};
      add(*d, *next, times ? 1 : -1);
    }
    return d;
  }
  std::optional<Dimension> factor() {
    std::optional<Dimension> d;
    if (take('(')) {
      d = product();
      if (!d || !take(')')) return {};
    } else {
      d = name();
    }
    if (!d || !take('^')) return d;
    const auto power = number();
    if (!power) return {};
    Dimension raised{};
    add(raised, *d, *power);
    return raised;
  }
  std::optional<Dimension> name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && std::string_view("*/^()").find(text_[at_]) == std::string_view::npos) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    for (const NamedUnit& u : units)
      if (word == u.name) return u.dimension;
    return {};
  }
  std::optional<double> number() {
    const bool inside = take('(');
    char* end = nullptr;
    const std::string rest(text_.substr(at_));
    double value = std::strtod(rest.c_str(), &end);
    if (end == rest.c_str()) return {};
    at_ += static_cast<std::size_t>(end - rest.c_str());
    if (inside && take('/')) {
      const auto below = number();
      if (!below || *below == 0) return {};
      value /= *below;
    }
    return inside && !take(')') ? std::nullopt : std::optional(value);
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

/// The known dimension of an expression.
struct Known {
  enum { anything, number, dimensioned } what = anything;
  Dimension dimension{};
};

class Checker {
 public:
  std::optional<DimensionClash> check(Expr left, Expr right) {
    const Expr sides[] = {left, right};
    for (Expr node : topological(sides)) {
      known_[node] = of(node);
      if (clash_) return clash_;
    }
    meet(left, right);
    return clash_;
  }

 private:
  static Known of_symbol(Expr leaf) {
    const Symbol& s = symbol_of(leaf);
    if (s.kind == Kind::constant) return {Known::number, {}};
    if (s.kind == Kind::time) return {};
    const Symbol& base = symbol_of(s.base);
    if (base.unit.empty()) return {};
    const auto unit = parse_unit(base.unit);
    if (!unit) return {};
    Dimension d = *unit;
    d[2] -= s.order;
    return {Known::dimensioned, d};
  }

  /// Requires equal dimensions of two operands; returns their common dimension.
  Known meet(Expr a, Expr b) {
    const Known x = known_[a], y = known_[b];
    if (x.what == Known::dimensioned && y.what == Known::dimensioned && !same(x.dimension, y.dimension) &&
        !clash_)
      clash_ = {a, b, x.dimension, y.dimension};
    if (x.what == Known::dimensioned) return x;
    return y.what == Known::dimensioned ? y : x.what == Known::anything ? x : y;
  }

  Known product(Expr a, Expr b, double sign) {
    const Known x = known_[a], y = known_[b];
    if (x.what == Known::anything || y.what == Known::anything) return {};
    Known result{
        x.what == Known::dimensioned || y.what == Known::dimensioned ? Known::dimensioned : Known::number,
        x.dimension};
    add(result.dimension, y.dimension, sign);
    return result;
  }

  Known power(Expr a, Expr exponent) {
    const Known x = known_[a];
    if (x.what != Known::dimensioned) return x;
    if (!exponent.is_constant()) return {};
    Known result{Known::dimensioned, {}};
    add(result.dimension, x.dimension, constant_value(exponent));
    return result;
  }

  /// Requires dimensionless arguments.
  Known number_of(Expr e) {
    for (Expr x : e.operands()) {
      const Known k = known_[x];
      if (k.what == Known::dimensioned && !same(k.dimension, {}) && !clash_) clash_ = {e, x, {}, k.dimension};
    }
    return {Known::number, {}};
  }

  Known of(Expr e) {
    switch (e.op()) {
      case Op::constant:
        return {Known::number, {}};
      case Op::symbol:
        return of_symbol(e);
      case Op::call:
      case Op::solve:
        return {};
      case Op::neg:
      case Op::abs:
        return known_[e.operand(0)];
      case Op::sign:
        return {Known::number, {}};
      case Op::add:
      case Op::sub:
      case Op::min:
      case Op::max:
        return meet(e.operand(0), e.operand(1));
      case Op::lt:
      case Op::le:
      case Op::atan2:
        meet(e.operand(0), e.operand(1));
        return {Known::number, {}};
      case Op::both:
      case Op::either:
        return {Known::number, {}};
      case Op::ifelse:
        return meet(e.operand(1), e.operand(2));
      case Op::mul:
        return product(e.operand(0), e.operand(1), 1);
      case Op::div:
        return product(e.operand(0), e.operand(1), -1);
      case Op::pow:
        return power(e.operand(0), e.operand(1));
      case Op::sqrt: {
        Known half = known_[e.operand(0)];
        for (double& k : half.dimension) k /= 2;
        return half;
      }
      default:
        return number_of(e);
    }
  }

  std::unordered_map<Expr, Known> known_;
  std::optional<DimensionClash> clash_;
};

}  // namespace

std::optional<Dimension> parse_unit(std::string_view text) { return UnitParser(text).parse(); }

std::string unit_text(const Dimension& d) {
  for (const NamedUnit& u : units)
    if (same(d, u.dimension)) return u.name;
  std::string above, below;
  for (std::size_t k = 0; k < d.size(); ++k) {
    if (d[k] == 0) continue;
    std::string& part = d[k] > 0 ? above : below;
    part += (part.empty() ? "" : "*") + std::string(units[k + 1].name);
    if (std::fabs(d[k]) != 1) part += "^" + rounded(std::fabs(d[k]), 4);
  }
  if (above.empty()) above = "1";
  if (below.empty()) return above;
  return above + "/" + (below.find('*') == below.npos ? below : "(" + below + ")");
}

std::optional<DimensionClash> dimension_clash(Expr left, Expr right) { return Checker().check(left, right); }

}  // namespace pendula::dae
