// Minima of functions of one variable by golden section.
#pragma once

#include <algorithm>

namespace pendula {

/// The last interval of a search: its ends, and the two points in it that divide it by the golden ratio.
struct GoldenSection {
  double low, high, left, right;
  double at_low, at_high, at_left, at_right;  ///< f there
  double least() const { return std::min(at_left, at_right); }
  double best() const { return at_left < at_right ? left : right; }
  double middle() const { return (low + high) / 2; }
};

/// Golden section search: of two points inside [low, high] the better one remains, in the interval that ends
/// at the other: it is 0.618 times as long, and the point divides it by the golden ratio again.
///
/// requires  f with one local minimum in [low, high]; of several, one is found
/// sections  at most; `is_enough(section, k)` after k of them ends the search
/// returns   an interval that contains a local minimum, down to the rounding of f: a smooth minimum is found
///           to √ε of the scale on which f changes, a kink to ε
/// cost      four evaluations, then one per section
/// see       Kiefer, Proc. Amer. Math. Soc. 4(3), 1953
template <class F, class IsEnough>
GoldenSection golden_section(const F& f, double low, double high, int sections, const IsEnough& is_enough) {
  constexpr double part = 0.3819660112501051;  // (3 - √5)/2
  GoldenSection s{low, high, 0, 0, f(low), f(high), 0, 0};
  s.left = low + part * (high - low);
  s.right = high - part * (high - low);
  s.at_left = f(s.left);
  s.at_right = f(s.right);
  for (int k = 0; k < sections && !is_enough(s, k); ++k) {
    if (s.at_left < s.at_right) {
      s.high = s.right;
      s.at_high = s.at_right;
      s.right = s.left;
      s.at_right = s.at_left;
      s.left = s.low + part * (s.high - s.low);
      s.at_left = f(s.left);
    } else {
      s.low = s.left;
      s.at_low = s.at_left;
      s.left = s.right;
      s.at_left = s.at_right;
      s.right = s.high - part * (s.high - s.low);
      s.at_right = f(s.right);
    }
  }
  return s;
}
template <class F>
GoldenSection golden_section(const F& f, double low, double high, int sections) {
  return golden_section(f, low, high, sections, [](const GoldenSection&, int) { return false; });
}

}  // namespace pendula
