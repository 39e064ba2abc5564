#include "plot/ticks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/text.hpp"

namespace pendula::plot {
namespace {

/// Of a quotient by the step, or of a logarithm: some ε each, so that an end of the range counts as inside.
constexpr double tick_rounding = 1e-9;

double power_of_ten(int n) { return std::pow(10.0, n); }

/// Smallest 1, 2 or 5 times a power of ten that is at least `raw`.
double nice_step(double raw) {
  const double unit = power_of_ten(static_cast<int>(std::floor(std::log10(raw))));
  for (double m : {1.0, 2.0, 5.0})
    if (m * unit >= raw * (1 - tick_rounding)) return m * unit;
  return 10 * unit;
}

int decimals_of(double step) {
  return std::max(0, static_cast<int>(-std::floor(std::log10(step) + tick_rounding)));
}

std::string fixed(double value, int decimals) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, value);
  std::string out = buffer;
  if (out.find_first_not_of("-0.") == std::string::npos) return out.substr(out[0] == '-');  // never "-0.0"
  return out;
}

std::string power_text(int n) { return "10" + superscript(n); }

/// Writes the ticks as common offset + factor · (short numbers).
void write_numbers(Ticks& t, Range range, double step) {
  const double size = std::max(std::abs(t.at.front()), std::abs(t.at.back()));
  double offset = 0;
  constexpr double shown_digits = 5, large = 1e5,
                   small = 1e-3;  // numbers that are read without a power of ten
  if (size > 0 &&
      std::log10(size / step) > shown_digits) {  // 9.8100001, 9.8100002 differ in the eighth digit only
    const double block = power_of_ten(static_cast<int>(std::ceil(std::log10(range.span()))));
    offset = std::floor(range.low / block) * block;
  }
  double largest = 0;
  for (double v : t.at) largest = std::max(largest, std::abs(v - offset));
  int exponent = 0;
  if (largest > 0 && (largest >= large || largest < small))
    exponent = static_cast<int>(std::floor(std::log10(largest) + tick_rounding));
  const double unit = power_of_ten(exponent);
  // decimals of step / unit from the exponents: the quotient itself may be 0.9999…
  const int decimals = decimals_of(step / unit * (1 + tick_rounding));
  for (double v : t.at) t.text.push_back(fixed((v - offset) / unit, decimals));
  if (exponent) t.suffix = "×" + power_text(exponent);
  if (offset != 0) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%c %.15g", offset < 0 ? '-' : '+', std::abs(offset));
    t.suffix += (t.suffix.empty() ? "" : " ") + std::string(buffer);
  }
}

std::string mantissa_text(int mantissa, int exponent, bool plain) {
  if (plain)
    return shortest(exponent < 0 ? mantissa / power_of_ten(-exponent) : mantissa * power_of_ten(exponent));
  return mantissa == 1 ? power_text(exponent) : std::to_string(mantissa) + "·" + power_text(exponent);
}

bool contains(Range r, double v) {
  constexpr double last_bits = 1e-12;  // of powers of ten: 4500 ε
  return v >= r.low * (1 - last_bits) && v <= r.high * (1 + last_bits);
}

}  // namespace

namespace {

Ticks multiples(Range range, double step) {
  Ticks t;
  const double first = std::ceil(range.low / step - tick_rounding),
               last = std::floor(range.high / step + tick_rounding);
  for (double k = first; k <= last; ++k) t.at.push_back(k * step == 0 ? 0 : k * step);
  if (t.at.empty()) t.at.push_back(range.low);
  write_numbers(t, range, step);
  return t;
}

}  // namespace

Ticks ticks_of_step(Range range, int count, double step) {
  const double fitting = range.span() / std::max(1, count);
  double stride = 1;
  while (stride * step < 0.75 * fitting) stride *= 2;  // up to a third more ticks than asked for
  if (stride * step > range.span()) return linear_ticks(range, count);  // a single number shows no scale
  return multiples(range, stride * step);
}

Ticks linear_ticks(Range range, int count, double step_min) {
  double step = nice_step(std::max(range.span() / std::max(1, count), step_min));
  const auto first = [&] { return std::ceil(range.low / step - tick_rounding); };
  const auto last = [&] { return std::floor(range.high / step + tick_rounding); };
  if (last() - first() < 1)
    step = std::max(nice_step(0.4 * step), step_min);  // a single number shows no scale
  return multiples(range, step);
}

Ticks log_ticks(Range range, int count) {
  const int lowest = static_cast<int>(std::ceil(std::log10(range.low) - tick_rounding));
  const int highest = static_cast<int>(std::floor(std::log10(range.high) + tick_rounding));
  const int decades = highest - lowest + 1;
  Ticks t;
  constexpr int most_minor = 12;  // decades: a hundred minor marks
  if (decades <= most_minor)
    for (int e = lowest - 1; e <= highest; ++e)
      for (int m = 2; m <= 9; ++m)
        if (contains(range, m * power_of_ten(e))) t.minor.push_back(m * power_of_ten(e));
  if (decades >= 3 || (decades == 2 && count < 6)) {
    const int stride = (decades + std::max(1, count) - 1) / std::max(1, count);
    const bool plain = std::abs(lowest) <= 3 && std::abs(highest) <= 3;
    for (int e = lowest; e <= highest; ++e)
      if (e % stride == 0) {
        t.at.push_back(power_of_ten(e));
        t.text.push_back(mantissa_text(1, e, plain));
      }
    return t;
  }
  const bool plain = std::abs(lowest - 1) <= 3 && std::abs(highest) <= 3;
  for (int e = lowest - 1; e <= highest; ++e)
    for (int m : {1, 2, 5})
      if (const double v = m * power_of_ten(e); contains(range, v)) {
        t.at.push_back(v);
        t.text.push_back(mantissa_text(m, e, plain));
      }
  if (t.at.size() >= 2) return t;
  // the range covers less than a factor of two or so, where a log axis is nearly linear
  return linear_ticks(range, count);
}

Ticks ticks(const Axis& axis, Range range, int count) {
  if (!axis.log && axis.step > 0) return ticks_of_step(range, count, axis.step);
  return axis.log ? log_ticks(range, count) : linear_ticks(range, count, axis.whole ? 1 : 0);
}

double fraction(const Axis& axis, Range range, double value) {
  const double f = axis.log ? (std::log10(value) - std::log10(range.low)) /
                                  (std::log10(range.high) - std::log10(range.low))
                            : (value - range.low) / range.span();
  return axis.reversed ? 1 - f : f;
}

std::string labelled(const std::string& label, const Ticks& ticks) {
  if (ticks.suffix.empty()) return label;
  return label.empty() ? ticks.suffix : label + "  " + ticks.suffix;
}

}  // namespace pendula::plot
